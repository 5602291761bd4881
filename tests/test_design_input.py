"""Files of searches that cannot be run: one line says what, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from design_plans import refusal

GOOD = "antenna.friction = { low = 0.1, high = 0.5 }"
WALL = '[evaluate.wall]\nsettings = { profiles = ["descending"] }\nminimize = ["force_mean_n"]\n'


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "evaluate: expected experiments that evaluate a design, found none"),
        (WALL, "search: expected parameters, found none: the space is empty"),
        (f"[search]\nwall.overlap = []\n{WALL}", "the space is empty"),
        (
            f"[search]\nantenna.frction = {{ low = 0.1, high = 0.5 }}\n{WALL}",
            "did you mean antenna.friction?",
        ),
        (f"[search]\nseed = [1, 2]\n{WALL}", "expected a parameter of a design, found seed"),
        (
            f"[search]\nantenna.friction = {{ low = 0.1, high = 5.0 }}\n{WALL}",
            "search.antenna.friction: wall: antenna.friction: expected a number of "
            "at most 2, found 5.0",
        ),
        (
            f"[search]\nantenna.friction = {{ low = 0.5, high = 0.1 }}\n{WALL}",
            "search.antenna.friction.range: expected low < high, found low 0.5 and high 0.1",
        ),
        (
            f"[search]\nantenna.friction = {{ low = 0.1, high = 0.5, rising = true }}\n{WALL}",
            "search.antenna.friction.range: expected entries beside rising",
        ),
        (
            f"[search]\n{GOOD}\n[reference]\npaper = {{ 'antenna.friction' = 3.0 }}\n{WALL}",
            "reference.paper: wall: antenna.friction",
        ),
        (
            f"[search]\n{GOOD}\n{WALL.replace('force_mean_n', 'force_men_n')}",
            "did you mean force_mean_n?",
        ),
        (f"[search]\n{GOOD}\n{WALL.replace('force_mean_n', 'profile')}", "found profile"),
        (
            f'[search]\n{GOOD}\n{WALL}maximize = ["force_mean_n"]\n',
            "evaluate.wall.force_mean_n: expected an objective once, found it twice",
        ),
        (
            f"[search]\n{GOOD}\n[evaluate.wall]\n",
            "evaluate.wall: expected measures to maximize or minimize, found none",
        ),
        (
            f'[search]\n{GOOD}\n[evaluate.wall]\nminimize = ["force_mean_n"]\n',
            "expected one profile, found stiff, descending",
        ),
        (
            f"[search]\n{GOOD}\n{WALL.replace('.wall]', '.wal]')}",
            "expected an experiment (did you mean",
        ),
        (
            f"[search]\n{GOOD}\n[evaluate.'own.py:f']\nminimize = ['a']\n",
            "expected a label of letters",
        ),
        (
            f"[search]\n{GOOD}\n[evaluate.own]\nexperiment = 'own.py:f'\nminimize = ['a']\n",
            "add --trust-code",
        ),
        (f"{WALL}[search]\nwall.gravity = ['down', 'sideways']\n", "found 'sideways'"),
        (
            '[search]\n"coil_mm" = [3.0, 4.0]\n[evaluate.springs]\ntrials = 2\n'
            'minimize = ["spring_index"]\n',
            "evaluate.springs.trials: expected none, as springs has no seed, found 2",
        ),
        (
            f"[search]\n{GOOD}\nwall.gravity = ['down']\ngravity = ['down']\n{WALL}",
            "search.gravity: expected each parameter of wall once, found wall.gravity as "
            "search.wall.gravity too",
        ),
        (
            f"[search]\n{GOOD}\n{WALL.replace('{ ', '{ antenna.friction = 0.4, ')}",
            "evaluate.wall.settings.antenna.friction: expected none, as search.antenna.friction",
        ),
        (
            f"[search]\n{GOOD}\n{WALL.replace('{ ', '{ trials = 4, ')}trials = 3\n",
            "evaluate.wall.settings.trials: expected none beside evaluate.wall.trials",
        ),
    ],
)
def test_bad_searches_are_one_line(
    text: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Keys with dots are written with quotes; here they get them."""
    quoted = text
    for key in ("antenna.friction", "antenna.frction", "wall.overlap", "wall.gravity"):
        quoted = quoted.replace(f"\n{key} =", f'\n"{key}" =')
    Path("bad.toml").write_text(quoted)
    assert expected in refusal(capsys, "study", "design", "bad.toml")
    assert not Path("runs").exists()
