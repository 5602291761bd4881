"""Protocols of recordings: what they may hold, what they command, and their steps in a log."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_ticks import HEADER, tick

from antennate.control.protocol import Protocol, Step, lead, sweep, targets
from antennate.errors import ConfigError, LogError
from antennate.params.control import ControlParams
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.telemetry.steps import steps
from antennate.telemetry.writer import LogWriter

ROBOT, CONTROL = RobotSpec(), ControlParams()
PERIOD = 0.01


def made(*given: dict[str, Any], robot: RobotSpec = ROBOT) -> Protocol:
    return Protocol(steps=tuple(Step(**each) for each in given)).made_for(robot, CONTROL)


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "hexapod"])
def test_shipped_protocol_moves_every_joint_within_its_limits(name: str) -> None:
    robot = RobotSpec.named(name)
    protocol = Protocol.named("identify").made_for(robot, CONTROL)
    swept = [step.joint for step in protocol.steps if step.joint]
    assert swept == list(robot.joint_names)
    walked = {(s.maneuver, s.frequency) for s in protocol.steps if s.maneuver != "HOLD"}
    maneuvers = ("FORWARD", "TURN_L", "TURN_R", "REVERSE")
    assert walked == {(m, f) for m in maneuvers for f in (0.3, 0.5, 0.7)}
    for step in protocol.steps:
        angles = targets(step, robot, CONTROL)
        assert angles.shape == (round(step.seconds / PERIOD), len(robot.joint_names))
        assert (abs(angles) <= np.array(robot.limits)).all()
        speeds = abs(np.diff(angles, axis=0)) / PERIOD
        assert (speeds <= np.array(robot.fastest)).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_short_protocol_moves_each_joint_alone_in_the_air_in_little_more_than_a_minute(
    name: str,
) -> None:
    robot = RobotSpec.named(name)
    protocol = Protocol.named("check").made_for(robot, CONTROL)
    assert [step.joint for step in protocol.steps] == list(robot.joint_names)
    assert {step.place for step in protocol.steps} == {"hanging"}
    assert sum(step.seconds + protocol.settle for step in protocol.steps) <= 70.0


def test_sweep_crosses_zero_as_often_as_its_frequencies_say() -> None:
    # f = 0.1 * 100 ** (t / 6) has the integral 0.1 * 6 * 99 / ln 100 over 6 s
    periods = 0.1 * 6.0 * 99.0 / math.log(100.0)
    t = np.arange(0.0, 6.0, 1e-4)
    angles = sweep(Step(place="hanging", joint="yaw1", seconds=6.0), 4.5, t)
    crossings = np.count_nonzero(np.diff(np.sign(angles[1:])))
    assert crossings == pytest.approx(2.0 * periods, abs=1.0)


def test_sweep_keeps_its_amplitude_while_slow_and_its_speed_while_fast() -> None:
    step = Step(place="hanging", joint="yaw1", seconds=20.0, amplitude=0.4)
    t = np.arange(0.0, 20.0, 1e-4)
    angles = sweep(step, 4.5, t)
    speeds = abs(np.diff(angles)) / 1e-4
    assert abs(angles[t < 10]).max() == pytest.approx(0.4, rel=1e-3)  # up to 1 Hz
    fast = (t[1:] > 15) & (t[1:] < 19.5)  # from 3.2 Hz on
    assert speeds[fast].max() == pytest.approx(0.9 * 4.5, rel=1e-2)
    assert angles[-1] == pytest.approx(0.0, abs=1e-4)


def test_other_joints_stay_where_they_are_while_one_is_swept() -> None:
    (step,) = made({"place": "hanging", "joint": "leg_r2"}).steps
    angles = targets(step, ROBOT, CONTROL)
    moved = np.flatnonzero(np.ptp(angles, axis=0))
    assert [ROBOT.joint_names[place] for place in moved] == ["leg_r2"]


def test_walk_has_the_frequency_of_its_step() -> None:
    (step,) = made({"maneuver": "FORWARD", "frequency": 0.25, "seconds": 8.0}).steps
    angles = targets(step, ROBOT, CONTROL)
    leg = ROBOT.joint_names.index("leg_l0")
    turns = (angles[-1, leg] - angles[0, leg]) / (2 * math.pi)
    assert turns == pytest.approx(0.25 * (8.0 - PERIOD))


def test_way_between_steps_is_short_and_slow() -> None:
    before, after = np.zeros(19), np.zeros(19)
    leg, yaw = ROBOT.joint_names.index("leg_l0"), 0
    before[leg], after[yaw] = 5.0 * math.pi, 0.4  # two and a half turns
    way = lead(before, after, ROBOT, PERIOD, 0.5)
    assert way[-1, yaw] == pytest.approx(0.4)
    assert abs(way[-1, leg] - before[leg]) == pytest.approx(math.pi)
    whole = np.vstack([before, way])
    assert abs(np.diff(whole, axis=0)).max() / PERIOD <= 0.5 * 5.26 * 1.001
    assert len(lead(before, before, ROBOT, PERIOD, 0.5)) == 50


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ({"place": "hanging", "joint": "yaw9"}, "expected a joint of the robot"),
        ({"place": "hanging", "joint": "yaw1", "amplitude": 1.0}, "amplitude of at most 0.50"),
        ({"place": "hanging", "joint": "yaw1", "highest": 11.0}, "highest of at most 10 Hz"),
        ({"maneuver": "FORWARD", "frequency": 0.9}, "frequency: expected at most 0.837 Hz"),
        (
            {"maneuver": "TURN_L", "frequency": 0.9},
            "step turn_l: frequency: expected at most 0.837",
        ),
        ({"place": "hand", "antenna": "left", "mark": 130.0}, "mark of at most 120 mm"),
    ],
)
def test_what_a_robot_cannot_do_is_refused(step: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        made(step)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ({"place": "hanging"}, "joint: expected one"),
        ({"place": "floor", "joint": "yaw1"}, "joint: expected none"),
        ({"place": "hand", "antenna": "left", "maneuver": "FORWARD"}, "place floor"),
        ({"place": "hanging", "joint": "yaw1", "lowest": 9.0, "highest": 3.0}, "below highest"),
    ],
)
def test_step_moves_one_thing(step: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Step(**step)


def test_protocol_has_steps_of_different_names() -> None:
    with pytest.raises(ConfigError, match="at least one"):
        Protocol()
    with pytest.raises(ConfigError, match="hold twice"):
        made({}, {})
    with pytest.raises(ConfigError, match="expected identify, check or a TOML file"):
        Protocol.named("identfy")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "steps: expected at least one, found none"),
        ("[[steps]]\nspeed = 3", "speed"),
        ('[[steps]]\nplace = "hanging"\njoint = "yaw9"', "yaw9: expected a joint of the robot"),
        (
            '[[steps]]\nmaneuver = "FORWARD"\nfrequency = 0.9',
            "frequency: expected at most 0.837 Hz",
        ),
        ("[[steps]]\nseconds = -1", "seconds"),
        ("[[steps", "short.toml"),
    ],
)
def test_bad_file_is_refused_in_one_line(
    text: str,
    words: str,
    tmp_path: Path,
    refused: Callable[..., str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(text)
    assert words in refused("drive", "--protocol", "short.toml")


def test_a_vice_is_refused_where_a_twin_hangs_by_its_hook(
    tmp_path: Path, refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    step = '[[steps]]\nplace = "hanging"\njoint = "yaw1"\n'
    (tmp_path / "short.toml").write_text(f"{step}[hook]\nfirm = true\n")
    line = refused("drive", "--protocol", "short.toml", "--tell", "orders")
    assert "hook: expected the hook of the twin beside --tell" in line
    assert [path.name for path in tmp_path.iterdir()] == ["short.toml"]


def test_log_tells_its_steps_by_tick_numbers(tmp_path: Path) -> None:
    protocol = made({"place": "hanging", "joint": "yaw1"}, {"name": "stand"})
    header = HEADER.model_copy(update={"protocol": protocol.model_dump(mode="json")})
    events = {
        3: ("begin yaw1",),
        7: ("break yaw1",),
        9: ("begin yaw1",),
        12: ("end yaw1", "begin stand"),
    }
    with LogWriter(tmp_path / "a.mcap", header, 0.0) as log:
        for number in range(1, 16):
            log.write(replace(tick(number), events=events.get(number, ())))
    found = steps(tmp_path / "a.mcap")
    assert [(s.name, s.place, s.begin, s.end, s.whole) for s in found] == [
        ("yaw1", "hanging", 3, 7, False),
        ("yaw1", "hanging", 9, 12, True),
        ("stand", "floor", 12, 16, False),
    ]
    assert found[0].step == protocol.steps[0]


def test_log_of_another_drive_has_no_steps(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "a.mcap", HEADER, 0.0) as log:
        log.write(tick(1))
    with pytest.raises(LogError, match="found one of another drive"):
        steps(tmp_path / "a.mcap")
