"""A robot on another bus of actuators: session, supervisor and `drive` are the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from twin_rig import rig

from antennate.hardware.actuators import ActuatorError, ActuatorState, JointFaults, Tally
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.joints import CommandError
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.params.control import ConditioningParams
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from antennate.types import JointCommand, State

CONFIG = DriveConfig(dry_run=0.5, duration=1.0, stand=0.1, fault_time=0.2, bus_return=0.0)


class Motors:
    """Motors that are where they are told to be, on no bus at all."""

    robot = RobotSpec()

    def __init__(self) -> None:
        self.tally = Tally()
        self.state = ActuatorState(
            missed={1: 0},
            errors={},
            watchdogs=(),
            disarmed=(),
            modes={},
            joints=JointFaults(),
            supply=12.0,
            bus_error="",
        )
        self.enabled, self.resting, self.broken = False, False, False
        self.left_on: list[int] = []
        self.text = ""
        self.seen: list[JointCommand | None] = []

    def check(self, command: JointCommand) -> JointCommand:
        if not np.isfinite(command.leg).all():
            raise CommandError("expected finite angles")
        return command

    def enable(self, command: JointCommand) -> None:
        self.enabled = True

    def disable(self, again: bool = False) -> list[int]:
        self.enabled = False
        return []

    def command(self, command: JointCommand | None, time: float = math.inf) -> int:
        if self.broken:
            raise ActuatorError(self.text)
        self.seen.append(command)
        return 0

    def away(self, command: JointCommand, time: float) -> int:
        return 0

    def maintain(self, may_begin: bool) -> None: ...
    def look(self) -> None: ...


def session(motors: Motors) -> Session:
    made = rig(TwinConfig()).session
    quality = SignalQuality(ConditioningParams())
    control = made.control.controller
    return Session(made.board, motors, made.clock, control, made.period, quality)


def test_another_bus_walks_stands_and_lets_go() -> None:
    motors = Motors()
    report = drive(session(motors), CONFIG, arm=True)
    assert report.worst is State.OK
    assert report.on == []
    assert not motors.enabled
    walked = [command for command in motors.seen if command is not None]
    assert len(walked) == pytest.approx(90, abs=15)
    assert np.ptp([command.leg for command in walked], axis=0).max() > 0.5
    assert motors.seen[-10:] == [None] * 10  # it stands before the torque goes


@pytest.mark.parametrize(
    ("text", "said"), [("motor 1 does not obey",) * 2, ("", "(ActuatorError)")]
)
def test_a_motor_that_does_not_obey_is_a_fault_and_gets_nothing_more(text: str, said: str) -> None:
    """Also one that does not say why."""
    motors = Motors()
    motors.text = text

    def break_it(session: Session, t: float) -> None:
        motors.broken = t > 1.0

    report = drive(session(motors), CONFIG, arm=True, on_tick=break_it)
    assert report.worst is State.FAULT
    assert said in report.why
    assert motors.seen[-1] is not None  # not even to stand
    assert not motors.enabled
