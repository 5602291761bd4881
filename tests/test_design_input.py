# ruff: noqa: E501
"""Files of searches that cannot be run: one line says what, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from design_plans import refusal

pytestmark = pytest.mark.usefixtures("there")


BAD = """
 :: evaluate: expected experiments that evaluate a design, found none
WALL :: search: expected parameters, found none: the space is empty
[search]; wall.overlap = []; WALL :: the space is empty
[search]; antenna.frction = { low = 0.1, high = 0.5 }; WALL :: did you mean antenna.friction?
[search]; seed = [1, 2]; WALL :: expected a parameter of a design, found seed
[search]; antenna.friction = { low = 0.1, high = 5.0 }; WALL :: search.antenna.friction: wall: antenna.friction: expected a number of at most 2, found 5.0
[search]; antenna.friction = { low = 0.5, high = 0.1 }; WALL :: search.antenna.friction.range: expected low < high, found low 0.5 and high 0.1
[search]; antenna.friction = { low = 0.1, high = 0.5, rising = true }; WALL :: search.antenna.friction.range: expected entries beside rising
[search]; GOOD; [reference]; paper = { 'antenna.friction' = 3.0 }; WALL :: reference.paper: wall: antenna.friction
[search]; GOOD; [evaluate.wall]; SETTINGS; minimize = ["force_men_n"] :: did you mean force_mean_n?
[search]; GOOD; [evaluate.wall]; SETTINGS; minimize = ["profile"] :: found profile
[search]; GOOD; WALL; maximize = ["force_mean_n"] :: evaluate.wall.force_mean_n: expected an objective once, found it twice
[search]; GOOD; [evaluate.wall] :: evaluate.wall: expected measures to maximize or minimize, found none
[search]; GOOD; [evaluate.wall]; minimize = ["force_mean_n"] :: expected one profile, found stiff, descending
[search]; GOOD; [evaluate.wal]; SETTINGS; minimize = ["force_mean_n"] :: expected an experiment (did you mean
[search]; GOOD; [evaluate.'own.py:f']; minimize = ['a'] :: expected a label of letters
[search]; GOOD; [evaluate.own]; experiment = 'own.py:f'; minimize = ['a'] :: add --trust-code
WALL; [search]; wall.gravity = ['down', 'sideways'] :: found 'sideways'
[search]; "coil_mm" = [3.0, 4.0]; [evaluate.springs]; trials = 2; minimize = ["spring_index"] :: evaluate.springs.trials: expected none, as springs has no seed, found 2
[search]; GOOD; wall.gravity = ['down']; gravity = ['down']; WALL :: search.gravity: expected each parameter of wall once, found wall.gravity as search.wall.gravity too
[search]; GOOD; WALL; settings.antenna.friction = 0.4 :: evaluate.wall.settings.antenna.friction: expected none, as search.antenna.friction
[search]; GOOD; WALL; settings.trials = 4; trials = 3 :: evaluate.wall.settings.trials: expected none beside evaluate.wall.trials
"""
"""Lines of a file, and what is said of it."""
SHORT = {
    "GOOD": "antenna.friction = { low = 0.1, high = 0.5 }",
    "WALL": '[evaluate.wall]\nSETTINGS\nminimize = ["force_mean_n"]',
    "SETTINGS": 'settings.profiles = ["descending"]',
}


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
    Path("bad.toml").write_text(quoted)
    assert expected in refusal(capsys, "study", "design", "bad.toml")
    assert not Path("runs").exists()
