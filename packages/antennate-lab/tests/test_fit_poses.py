"""Fits to logs beside motion capture: cycles of walks, gaps, and what is refused."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from protocol_logs import CONTROL, PERIOD, RATE, SMALL, SPEED, sweeps, walk, write

from antennate.control.protocol import Step, targets
from antennate.errors import BadInputError
from antennate.robots.spec import RobotSpec
from antennate.telemetry.mocap import poses_of
from antennate.types import Floats
from antennate_lab.fit import measures, recording, regression
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.run import run
from antennate_lab.fit.simulated import Course, simulated

TEXT = 'links = 2\nmass = 0.8\n\n[antennae]\nkind = "none"\n'


def read(log: Path, table: Path) -> recording.Recording:
    return recording.read(log, SMALL, (table.name, poses_of(log, table)))


def test_speed_and_turn_of_a_cycle_are_those_of_the_circle(tmp_path: Path) -> None:
    """A chord, and the angle on the circle; a walk begins at the end of a step of another name."""
    found = read(*walk(tmp_path))
    stand, forward, *_ = found.courses
    chord = 2.0 * SPEED / RATE * math.sin(RATE * PERIOD / 2.0)
    assert measures.strides(stand).shape == (0, 2)
    strides = measures.strides(forward)
    assert strides[:2] == pytest.approx(np.array([[chord, RATE * PERIOD]] * 2), rel=2e-3)
    assert len(strides) == 3
    assert measures.speed(forward, forward) == pytest.approx(chord, rel=5e-3)


def test_cycle_with_a_gap_is_left_out_and_counted(tmp_path: Path) -> None:
    """The second cycle of the first walk, 3 to 5 s of the log, is not seen for a quarter second."""
    found = read(*walk(tmp_path, (4.0, 4.25)))
    (warning,), (_, forward, *_) = found.warnings, found.courses
    assert np.isfinite(measures.strides(forward)[:, 0]).tolist() == [True, False, True]
    assert warning == "take.csv: 1 of 7 cycles of walks have a gap, and are left out"
    whole = replace(forward, poses=None)
    assert np.isfinite(regression.felt(forward)).all()
    assert (regression.felt(forward)[: len(regression.felt(whole))] == regression.felt(whole)).all()


def test_what_is_unusual_about_a_table_is_named(tmp_path: Path) -> None:
    """A clock that runs 1 % slow, as `log plot --poses` names it."""
    (warning,) = read(*walk(tmp_path, pace=0.99)).warnings
    assert warning.startswith("take.csv: its clock drifts by 1.0")


def course(speeds: list[float]) -> Course:
    """A walk whose cycles of 1 s have these lengths [m], and turn by a tenth of a radian each."""
    t = 0.01 * np.arange(100 * len(speeds) + 1)
    x = np.interp(t, np.arange(len(speeds) + 1), np.cumsum([0.0, *speeds]))
    goals = 0.3 * np.sin(2.0 * math.pi * t)[:, None]
    none = np.zeros((len(t), 0))
    poses: Floats = np.stack([x, 0.0 * t, 0.1 * t], axis=1)
    return Course("walk", None, 0.01, 1.0, goals, goals, none, none, poses)


def test_speed_counts_by_the_scatter_of_cycles_without_the_first() -> None:
    """Speeds of 0.2 and 0.3 m: their sd is 0.1 / √2 m, and turns that are alike have the least."""
    walks = [course([9.0, 0.2, 0.3])]
    unit = regression.scatter(walks)
    assert unit == pytest.approx([0.1 / math.sqrt(2.0), regression.LEAST[1]])
    assert regression.scatter([course([9.0, 0.2])]) == pytest.approx(regression.LEAST)
    values = regression.felt(walks[0], unit)
    own = len(regression.felt(replace(walks[0], poses=None)))
    speeds = values[own::2]
    assert speeds == pytest.approx(np.array([9.0, 0.2, 0.3]) / unit[0])
    assert len(values) == own + 6


def test_simulated_head_turns_as_its_gyroscope_says() -> None:
    """Poses of a simulation, against the sum of yaw rates; unknown where motion capture is."""
    robot = RobotSpec(imu={"kind": "head"})  # type: ignore[arg-type]
    goals = targets(Step(maneuver="TURN_L", frequency=1.0, seconds=2.0), robot, CONTROL)
    none = np.zeros((len(goals), 0))
    seen = np.zeros((len(goals), 3))
    seen[:3] = np.nan
    made = simulated(robot, Course("left", None, 0.01, 1.0, goals, goals, none, none, seen))
    assert made.poses is not None
    assert np.isnan(made.poses[:3]).all()
    turned = made.poses[-1, 2] - made.poses[3, 2]
    assert turned == pytest.approx(made.gyro[4:, 2].sum() * 0.01, abs=0.02)
    assert abs(turned) > 0.5
    assert simulated(robot, replace(made, poses=None)).poses is None


@pytest.mark.ci
def test_fit_with_poses_judges_the_speed(tmp_path: Path) -> None:
    """The chord of the circle in mm, beside what both robots walk; and the gap on the page."""
    log, table = walk(tmp_path, (4.0, 4.25))
    (file := tmp_path / "small.toml").write_text(TEXT)
    again = shutil.copy(log, tmp_path / "again.mcap")
    logs, poses = (str(log), str(again)), (str(table), "none")
    result = run(FitConfig(log=logs, robot=str(file), robots=20, poses=poses), 1).result()
    forward, unseen = (step for step in result.steps if step.step == "FORWARD")
    assert (unseen.log, unseen.speed_mm) == ("again", None)
    chord = 2e3 * SPEED / RATE * math.sin(RATE * PERIOD / 2.0)
    assert forward.speed_mm == pytest.approx(chord, rel=5e-3)
    assert forward.speed_before_mm is not None
    assert forward.speed_after_mm is not None
    assert "walk: take.csv: 1 of 7 cycles of walks have a gap, and are left out" in result.warnings


def test_table_that_belongs_to_nothing_is_refused(
    tmp_path: Path, refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line and exit code 2: not one for each log, a wrong unit, gaps alone, no walk."""
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(TEXT)
    log, table = walk(tmp_path)
    words = ("--robot", "small.toml", "--poses", table)
    assert "poses: expected a table or the word none for each log, 2, found 1" in refused(
        "fit", log, log, *words
    )
    assert "take.csv: expected metres" in refused("fit", log, *words, "--unit", "0.001")
    alone = refused("fit", log, "--robot", "small.toml", "--unit", "0.001")
    assert "unit: expected the default, as there are no poses, found another" in alone
    (tmp_path / "holed").mkdir()
    middles = (2.0, 4.0, 6.0, 8.0, 10.0, 11.7, 13.0)
    holed, gaps = walk(tmp_path / "holed", *((t, t + 0.2) for t in middles))
    words = ("--robot", "small.toml", "--poses", gaps)
    says = "take.csv: expected poses over a cycle of a walk on the floor of"
    line = refused("fit", holed, *words)
    assert says in line
    assert "found none in 7 cycles" in line
    air = write(tmp_path / "air.mcap", SMALL, sweeps(SMALL, "leg_l0"))
    with pytest.raises(BadInputError, match="found none, as the log has no walk"):
        recording.read(air, SMALL, (table.name, poses_of(log, table)))
