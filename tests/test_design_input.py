# ruff: noqa: E501
"""Files of searches that cannot be run: one line says what, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from design_plans import refusal

pytestmark = pytest.mark.usefixtures("there")


BAD = """
GOOD :: maximize: expected measures here or in minimize, found none
FORCE :: vary: expected values, found none: the optuna is empty
FORCE; [vary]; wall.overlap = [] :: the optuna is empty
FORCE; [vary]; antenna.frction = { low = 0.1, high = 0.5 } :: vary.antenna.frction: wall: antenna.frction: expected a known key of antenna (did you mean friction?)
FORCE; [vary]; antenna.friction = { low = 0.1, high = 5.0 } :: vary.antenna.friction: wall: antenna.friction: expected a number of at most 2, found 5.0
FORCE; [vary]; antenna.friction = { low = 0.5, high = 0.1 } :: vary.antenna.friction.range: expected low < high, found low 0.5 and high 0.1
FORCE; [vary]; antenna.friction = { low = 0.1, high = 0.5, rising = true } :: vary.antenna.friction.range: expected entries beside rising
FORCE; GOOD; [reference]; paper = { 'antenna.friction' = 3.0 } :: reference.paper: wall: antenna.friction
minimize = ["force_men_n"]; GOOD :: did you mean force_mean_n?
minimize = ["profile"]; GOOD :: found profile
FORCE; maximize = ["force_mean_n"]; GOOD :: force_mean_n: expected an objective once, found it twice
settings.antenna.friction = 0.4; FORCE; GOOD :: settings.antenna.friction: expected a parameter that does not vary
FORCE; response = "force_mean_n"; GOOD :: response: expected plan other than optuna beside it, found optuna
seeds = 1; FORCE; GOOD :: seeds
proposals = 8; FORCE; GOOD :: bad.toml: proposals: expected a known key (did you mean points?), found 'proposals'
FORCE; GOOD; [search]; wall.overlap = [0.1] :: search: expected a known key (did you mean vary?), found 'search'
GOOD; [evaluate.wall]; FORCE :: evaluate: expected a known key (did you mean experiment or trials or settings or maximize or minimize?)
FORCE; [vary]; wall.gravity = ['down', 'sideways'] :: found 'sideways'
"""
"""Lines of a file, and what is said of it."""
SHORT = {
    "GOOD": "[vary]\nantenna.friction = { low = 0.1, high = 0.5 }",
    "FORCE": 'minimize = ["force_mean_n"]',
}
HEAD = 'experiment = "wall"\nplan = "optuna"\nsettings.profiles = ["descending"]\n'


@pytest.mark.parametrize(
    ("text", "expected"), [line.split(" :: ") for line in BAD[1:-1].split("\n")]
)
def test_bad_searches_are_one_line(
    text: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Keys with dots are written with quotes; here they get them."""
    quoted = "\n" + text.strip().replace("; ", "\n")
    for name, lines in SHORT.items():
        quoted = quoted.replace(name, lines)
    for key in ("antenna.friction", "antenna.frction", "wall.overlap", "wall.gravity"):
        quoted = quoted.replace(f"\n{key} =", f'\n"{key}" =')
    Path("bad.toml").write_text(HEAD + quoted)
    assert expected in refusal(capsys, "study", "bad.toml")
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            'plan = "optuna"\nminimize = ["force_mean_n"]',
            "settings: expected one profile, found stiff",
        ),
        ('plan = "sobol"\nminimize = ["force_mean_n"]', "minimize: expected plan optuna beside it"),
    ],
)
def test_what_does_not_suit_the_plan_is_one_line(
    text: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    vary = '[vary]\n"antenna.friction" = { low = 0.1, high = 0.5 }\n'
    Path("bad.toml").write_text(f'experiment = "wall"\n{text}\n{vary}')
    assert expected in refusal(capsys, "study", "bad.toml")


def test_former_keys_of_a_search_are_hinted_at_in_its_file_and_words_alone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("trials.toml").write_text("[evaluate.wall]\ntrials = 3\n")
    said = refusal(capsys, "tunnel", "--config", "trials.toml")
    assert "evaluate: expected a known key, found 'evaluate'" in said
    Path("search.toml").write_text(f"{HEAD}{SHORT['FORCE']}\n{SHORT['GOOD']}\n")
    said = refusal(capsys, "study", "search.toml", "--proposals", "8")
    assert "(did you mean --points?), found '--proposals'" in said
    assert "(did you mean" not in refusal(capsys, "tracks", "--proposals", "8")


def test_lists_of_a_range_are_for_searches(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bad.toml").write_text(
        'experiment = "wall"\nplan = "sobol"\n'
        '[vary]\n"antenna.active_coils" = { low = 2, high = 9, entries = [2, 3] }\n'
    )
    said = refusal(capsys, "study", "bad.toml")
    assert "vary.antenna.active_coils: expected plan optuna beside entries, found sobol" in said
