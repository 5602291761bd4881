"""`servo` on the log of `drive`: the same error as on the same numbers in JSON."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from servo_recordings import of_twin

import antennate
from antennate.cli import main
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter

JOINT = "antenna_r_base"
ROBOT = RobotSpec()
PLACE = ROBOT.joint_names.index(JOINT)
NOWHERE = (math.nan,) * len(ROBOT.joint_names)
STANDING = 100
"""Ticks before torque is on."""


def put(angle: float) -> tuple[float, ...]:
    """The angles of all joints, of which one is known."""
    return (*NOWHERE[:PLACE], angle, *NOWHERE[PLACE + 1 :])


def tick(number: int, now: float, goal: float, position: float, on: bool) -> Tick:
    """A tick of a drive."""
    return Tick(
        number=number,
        t=now,
        now=now,
        counts=(2000.0, 2000.0),
        reading=(2000.0, 2000.0),
        level=(0.0, 0.0),
        contact=(0, 0),
        maneuver=0,
        phase=0.0,
        angles=put(goal),
        positions=put(position),
        state="OK" if on else "OFF",
        sent=number if on else 0,
    )


def as_log(recording: Path, path: Path) -> Path:
    """A recording as the log of a drive that stood without torque at first, far from its goal."""
    entries = json.loads(recording.read_text())["entries"]
    pairs = [(e["timestamp"], e["goal_position"], e["position"]) for e in entries]
    standing = [(0.01 * (i - STANDING), 1.0, pairs[0][2]) for i in range(STANDING)]
    with LogWriter(path, Header(controller="open", params=ControlParams(), robot=ROBOT)) as log:
        for i, (t, goal, position) in enumerate([*standing, *pairs], 1):
            log.write(tick(i, 5.0 + t, goal, position, i > STANDING))
    return path


def test_a_log_says_what_the_same_numbers_say_as_json(tmp_path: Path) -> None:
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8)
    log = as_log(file, tmp_path / "drive.mcap")
    whole = antennate.run("servo", recording=[str(file)]).summary
    told = antennate.run("servo", recording=[str(log)], joint=JOINT).summary
    assert [m["error_deg"] for m in told["models"]] == pytest.approx(
        [m["error_deg"] for m in whole["models"]], rel=1e-3
    )
    (row,) = told["recordings"]
    assert row["p_gain"] == 400.0
    assert row["torque_share"] == pytest.approx(1500 / 1600)
    assert row["supply_v"] is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "a log needs --joint, one of yaw1"),
        (["--joint", "antenna_r"], "(did you mean antenna_r_base?)"),
        (["--joint", "leg_l0"], "a log needs --joint, one of yaw1"),
        (["--joint", "yaw1"], "expected --servo xc430_w240, the servo of yaw1, found xl330_m288"),
        (["--joint", "antenna_l_base"], "at least 50 ticks with a measured position"),
    ],
)
def test_a_log_that_cannot_serve_is_refused_in_one_line(
    words: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = as_log(of_twin(tmp_path / "a.json", 1200, 400, 0.8, 1.0), tmp_path / "drive.mcap")
    assert main(["servo", "--recording", str(log), *words]) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.count("\n") == 1


def test_a_joint_without_a_log_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8, 1.0)
    assert main(["servo", "--recording", str(file), "--joint", JOINT]) == 2
    assert "--joint: expected a log among the recordings" in capsys.readouterr().err


def test_a_joint_that_never_follows_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "drive.mcap"
    with LogWriter(path, Header(controller="open", params=ControlParams(), robot=ROBOT)) as log:
        for i in range(1, 101):
            held = tick(i, 0.01 * i, 0.5, 0.0015 * (i % 2), True)
            log.write(held if i > 50 else replace(held, state="FAULT"))
    assert main(["servo", "--recording", str(path), "--joint", JOINT]) == 2
    assert "expected a joint that follows its goals" in capsys.readouterr().err
