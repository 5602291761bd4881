"""Registers of the walking twin's servos where the whole robot hangs on them."""

from __future__ import annotations

import math

import pytest

from antennate.twin.config import TwinConfig, watched
from antennate.twin.robot import TwinRobot
from dynamixel_bus.driven import DrivenServo

PWM, CURRENT_POSITION = 16, 5
BIAS = 70
"""More than a joint of a trial stands off its zero [ticks]: 2 degrees, three times."""
XL330 = {"robot": {"yaw": {"servo": "xl330_m288"}}}


LEFT_BASE = 17


def turned(servo: DrivenServo) -> float:
    """Angle off the middle [rad]."""
    return (servo.position - 2048) * 2 * math.pi / 4096


def standing(robot: TwinRobot, mode: int, place: int = 0) -> DrivenServo:
    """A servo in a mode, with torque; the first one of the yaw joints without a place."""
    servo = robot.servos[place]
    for name, value in (("operating_mode", mode), ("torque_enable", 1)):
        register = servo.model[name]
        assert servo.write(register.address, register.encode(value)) == 0
    return servo


def put(servo: DrivenServo, name: str, value: int) -> None:
    register = servo.model[name]
    assert servo.write(register.address, register.encode(value)) == 0


@pytest.mark.parametrize("drive", [265, -885])
def test_an_antenna_that_is_driven_without_end_meets_a_stop(drive: int) -> None:
    robot = watched(TwinConfig())[0]
    servo = standing(robot, PWM, LEFT_BASE)
    put(servo, "goal_pwm", drive)
    robot.advance(4.0)
    assert robot.failure is None
    assert abs(turned(servo)) == pytest.approx(math.pi, abs=0.1)
    assert servo.get("present_pwm") == drive, "it stalls there"


@pytest.mark.parametrize("drive", [265, -885])
def test_a_yaw_joint_that_is_driven_without_end_meets_the_legs_of_the_next_link(drive: int) -> None:
    """Legs may touch from the clear bend on; with their axles 184 mm apart, where axles meet."""
    robot = watched(TwinConfig())[0]
    servo = standing(robot, PWM)
    put(servo, "goal_pwm", drive)
    robot.advance(4.0)
    assert robot.failure is None
    clear, axles = (2 * math.atan(way) for way in ((60 - 33 - 1) / 100, 60 / 92))
    assert clear < abs(turned(servo)) < axles
    assert servo.get("present_pwm") == drive, "it stalls there"


def test_a_position_needs_a_gain_and_a_current() -> None:
    """The same for the joint of a robot as for a servo alone: without either it stays."""
    robot = watched(TwinConfig.model_validate(XL330))[0]
    servo = standing(robot, CURRENT_POSITION)
    start = servo.position
    put(servo, "goal_current", 0)
    put(servo, "goal_position", round(start) + 250)
    robot.advance(0.5)
    assert servo.position == pytest.approx(start, abs=BIAS)
    put(servo, "goal_current", 1000)
    put(servo, "position_p_gain", 0)
    robot.advance(1.0)
    assert servo.position == pytest.approx(start, abs=BIAS)
    put(servo, "position_p_gain", 400)
    robot.advance(2.0)
    assert servo.position == pytest.approx(start + 250, abs=BIAS)
