"""Every example runs as a user would run it, and shows what it says."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def ran(name: str, folder: Path) -> str:
    """What an example prints; warnings are errors, and nothing may be left behind."""
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES / f"{name}.py")],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert list(folder.iterdir()) == []
    return done.stdout


@pytest.mark.ci
def test_a_cart_stops_at_a_wall_that_its_antennae_feel(tmp_path: Path) -> None:
    out = ran("antenna_on_my_robot", tmp_path)
    gap, *flex, force = map(float, re.findall(r"-?\d+\.\d+", out))
    assert 0.02 < gap < 0.12  # within the length of the antennae and clear of the wall
    assert min(flex) > 0.1
    assert force > 0.001


@pytest.mark.slow
def test_trials_become_a_data_frame(tmp_path: Path) -> None:
    out = ran("data_frame", tmp_path)
    assert re.search(r"open +\d+\.\d+ +\d\.\d+", out)
    assert re.search(r"closed +\d+\.\d+ +\d\.\d+", out)
    assert "level_left" in out


LONGER = {"imitate": 380, "train_ppo": 300, "touch_network": 75}
"""A whole algorithm in one file, to be read and changed."""


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_examples_are_short_and_say_what_they_are(path: Path) -> None:
    text = path.read_text()
    assert len(text.splitlines()) <= LONGER.get(path.stem, 60)
    assert text.startswith('"""')


@pytest.mark.ci
def test_virtual_servos_are_moved_over_tcp(tmp_path: Path) -> None:
    out = ran("servo_bus", tmp_path).splitlines()
    assert out[0].endswith("[1, 2, 3]")
    assert out[1].endswith("{1: 2048, 2: 2048, 3: 2048}")
    assert out[3].endswith("{1: 2148, 2: None, 3: 2348}")


@pytest.mark.ci
def test_a_swimmer_goes_as_far_as_published(tmp_path: Path) -> None:
    out = ran("swimmer", tmp_path)
    by_curvature, _ = map(float, re.findall(r"by curvature: (\S+), exact: (\S+)", out)[0])
    assert by_curvature == pytest.approx(math.pi * 0.5**2 * 5 / 243, abs=1e-4)
    exact, estimate = map(
        float, re.findall(r"farthest: (\S+), in minimum perturbation (\S+)", out)[0]
    )
    assert exact == pytest.approx(0.1035, abs=1e-4)
    assert estimate == pytest.approx(0.1035, rel=0.01)
