"""Servos that are set otherwise than the robot needs are refused, and their speed is limited."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from twin_rig import rig

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import require_servos
from antennate.hardware.driving.drive import drive
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.safety.session import Session
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from antennate.types import State
from dynamixel_bus.driven import DrivenServo
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import StatusError
from dynamixel_bus.servo import Servo

COUNTS = math.ceil(1.25 * 4.5 / (0.229 * 2 * math.pi / 60))
"""A quarter more than the 4.5 rad/s of goals, in units of 0.229 rev/min: 235."""
LEGS = math.ceil(1.25 * 5.26 / (0.229 * 2 * math.pi / 60))
"""A quarter more than the 5.26 rad/s of goals of legs: 275."""


def set_all(*changes: tuple[int, str, int]) -> Callable[[list[DrivenServo]], None]:
    def change(servos: list[DrivenServo]) -> None:
        for servo, name, value in changes:
            servos[servo - 1].set(name, value)

    return change


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (set_all((9, "operating_mode", 3)), r"operating mode 3 \(expected 4\) in servos \[9\]"),
        (set_all((1, "operating_mode", 4)), r"operating mode 4 \(expected 3\) in servos \[1\]"),
        (
            set_all((8, "drive_mode", 9), (7, "drive_mode", 9)),
            r"drive mode 9 \(expected 0\) in servos \[7, 8\]",
        ),
        (set_all((19, "drive_mode", 1)), r"drive mode 1 \(expected 0\) in servos \[19\]"),
        (set_all((3, "homing_offset", -5)), r"homing offset -5 \(expected 0\) in servos \[3\]"),
        (
            set_all((4, "min_position_limit", 1717)),  # 0.5087 rad are 331.7 ticks
            r"min position limit 1717 \(expected at most 1716\) in servos \[4\]",
        ),
        (
            set_all((18, "max_position_limit", 3071)),
            r"max position limit 3071 \(expected at least 3072\) in servos \[18\]",
        ),
        (
            set_all((10, "velocity_limit", LEGS - 1)),
            rf"velocity limit {LEGS - 1} \(expected at least {LEGS}\) in servos \[10\]",
        ),
    ],
)
def test_B15_servos_that_are_set_otherwise_are_refused_with_the_cure(
    spoil: Callable[[list[DrivenServo]], None], said: str
) -> None:
    made = rig(TwinConfig())
    spoil(made.robot.servos)
    with pytest.raises(BringUpError, match=rf"{said}; `(uv run )?antennate doctor --fix`"):
        require_servos(made.session.actuators.bus, RobotSpec())
    assert not any(servo.torque for servo in made.robot.servos)


def test_settings_that_leave_room_enough_are_taken() -> None:
    """Half a radian about 2048 ends at 1722 and 2374; position limits do not act on legs."""
    made = rig(TwinConfig())
    low, high = "min_position_limit", "max_position_limit"
    set_all((1, low, 1722), (1, high, 2374), (6, low, 2000), (6, high, 2001))(made.robot.servos)
    narrow = RobotSpec.model_validate({"yaw": {"limit": 0.5}})
    require_servos(made.session.actuators.bus, narrow)
    set_all((1, low, 1723))(made.robot.servos)
    with pytest.raises(BringUpError, match="at most 1722"):
        require_servos(made.session.actuators.bus, narrow)


def test_all_that_is_wrong_is_said_at_once() -> None:
    made = rig(TwinConfig())
    set_all((8, "drive_mode", 9), (3, "homing_offset", 500))(made.robot.servos)
    with pytest.raises(BringUpError, match=r"drive mode .*\[8\]; homing offset .*\[3\]"):
        require_servos(made.session.actuators.bus, RobotSpec())


def test_B10_profiles_that_another_program_left_are_set_before_torque() -> None:
    made = rig(TwinConfig())
    servos = made.robot.servos
    for servo in servos:
        servo.set("profile_velocity", 5)
        servo.set("profile_acceleration", 700)
    torque: list[bool] = []
    write = servos[0].write

    def note(address: int, data: bytes) -> StatusError:
        if address in (108, 112):
            torque.append(any(servo.torque for servo in servos))
        return write(address, data)

    servos[0].write = note  # type: ignore[method-assign]
    states: list[State] = []

    def look(session: Session, t: float) -> None:
        assert session.outputs is not None
        states.append(session.outputs.state)

    drive(made.session, DriveConfig(dry_run=0.3, duration=0.5), arm=True, on_tick=look)
    assert {servo.get("profile_velocity") for servo in servos} == {COUNTS, LEGS}
    assert {servo.get("profile_acceleration") for servo in servos} == {0}
    assert torque == [False, False]
    assert states[-1] <= State.DEGRADED


def test_profiles_follow_the_fastest_of_their_group_and_stay_below_the_velocity_limit() -> None:
    """10 rad/s of an antenna base are 417 counts, 522 with a quarter more; its limit is 445."""
    made = rig(TwinConfig())
    robot = RobotSpec.model_validate({"yaw": {"fastest": 1.0}, "antennae": {"fastest": 10.0}})
    profiles = type(made.session.actuators.joints)(robot).profiles
    assert [profiles[i] for i in (1, 5, 6, 17, 18, 19)] == [53, 53, LEGS, LEGS, 445, 445]
    require_servos(made.session.actuators.bus, robot)


def test_the_twin_gets_torque_by_a_goal_if_its_drive_mode_says_so() -> None:
    """Bit 3 of Drive Mode, as in the manual."""
    for mode, torque in ((0, False), (8, True)):
        servo = Servo(XC430_W240, 1)
        servo.set("drive_mode", mode)
        assert servo.write(116, (2100).to_bytes(4, "little")) == StatusError.NONE
        assert servo.torque is torque


def test_the_twin_turns_the_other_way_if_its_drive_mode_says_so() -> None:
    """Bit 0 of Drive Mode, as in the manual."""
    servo = DrivenServo(XC430_W240, 1)
    servo.set("drive_mode", 1)
    servo.shaft(2100.0)
    assert servo.position == 4096 - 2100
    assert servo.goal() == 2100.0
    servo.set("torque_enable", 1)
    servo.set("goal_position", 1000)
    assert servo.goal() == 3096.0


def test_a_low_goal_pwm_that_another_program_left_is_raised_before_torque() -> None:
    """As by a `jog` that was killed. 885 is all of it, by the manuals; 700 a limit in EEPROM."""
    made = rig(TwinConfig())
    servos = made.robot.servos
    servos[4].set("pwm_limit", 700)
    for servo in servos:
        servo.set("goal_pwm", 265)
    pwm: list[int] = []
    write = servos[0].write

    def note(address: int, data: bytes) -> StatusError:
        if address == 64 and data == b"\1":
            pwm.extend(servo.get("goal_pwm") for servo in servos)
        return write(address, data)

    servos[0].write = note  # type: ignore[method-assign]
    drive(made.session, DriveConfig(dry_run=0.3, duration=0.5), arm=True)
    assert pwm == [700 if at == 4 else 885 for at in range(len(servos))]
