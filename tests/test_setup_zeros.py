"""`zero` in invented time: a robot that is held by hand, its horns and directions anyhow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from setup_rig import ROBOT, Box, Script

from antennate.errors import BadInputError
from antennate.hardware.setup.person import Quit, SetupError
from antennate.hardware.setup.servos import ServoSetup, joints_of
from antennate.hardware.setup.zeros import Positions, Zeroing, by_group
from antennate.params.hardware import SetupParams
from antennate.robots.spec import RobotSpec
from dynamixel_bus.bus import Bus

NAMES = ROBOT.joint_names
ZEROS = [2048 + 3 * (-1) ** i * i for i in range(19)]
SIGNS = [(-1) ** (i // 2) for i in range(19)]
TICK = 2 * math.pi / 4096


class Held:
    """A robot whose servos are set up, without torque, in somebody's hands."""

    def __init__(self, zeros: list[int] = ZEROS, robot: RobotSpec = ROBOT) -> None:
        self.box = Box(robot)
        for joint in joints_of(robot):
            self.box.plug(joint.name)
            ServoSetup(self.box.opener, robot, 0.02, self.box.wire.now).set_up(joint, ())
        self.box.plug_all()
        self.box.bus.master_baud = robot.baud
        self.straight(zeros)
        bus = Bus(self.box.wire, clock=self.box.wire.now)
        positions = Positions(bus, robot, self.box.wire.sleep)
        self.zeroing = Zeroing(robot, SetupParams(), positions)

    def straight(self, zeros: list[int]) -> None:
        for servo, zero in zip(self.box.servos.values(), zeros, strict=True):
            servo.place(zero)

    def turn(self, name: str, angle: float) -> None:
        """By hand, in the joint's own sense [rad]."""
        servo = self.box.servos[name]
        servo.place(servo.position + SIGNS[NAMES.index(name)] * angle / TICK)


def moves(held: Held, angle: float = 0.3) -> list:
    return [(rf": {name}: ", lambda n=name: held.turn(n, angle), None) for name in NAMES]


def test_zeros_and_directions_are_those_of_the_robot() -> None:
    held = Held()
    person = Script([("hold the robot straight", None, "")])
    assert held.zeroing.zeros(person) == ZEROS
    person = Script(moves(held))
    assert held.zeroing.directions(person) == SIGNS
    assert held.box.servos["yaw1"].get("torque_enable") == 0


def test_a_leg_counts_its_turns_from_where_it_stands() -> None:
    turned = list(ZEROS)
    turned[5], turned[6] = ZEROS[5] + 3 * 4096, ZEROS[6] - 4096
    assert Held(turned).zeroing.zeros(Script([("hold", None, "")])) == ZEROS


def test_a_robot_that_moves_is_asked_for_once_more() -> None:
    held, shaking = Held(), [True]
    advance = held.box.bus.advance

    def shake(t: float) -> None:
        advance(t)
        if shaking:
            held.box.servos["yaw3"].place(ZEROS[2] + 13 * math.sin(20 * t))

    held.box.bus.advance = shake  # type: ignore[method-assign]
    person = Script(
        [("hold", None, ""), ("at rest, found yaw3", shaking.clear, None), ("hold", None, "")]
    )
    assert np.allclose(held.zeroing.zeros(person), ZEROS, atol=14)
    assert person.script == []


def test_a_joint_without_room_is_refused_until_its_horn_is_put_on_anew() -> None:
    held = Held()
    held.box.servos["yaw2"].place(900)
    person = Script(
        [
            ("hold", None, ""),
            ("expected yaw2 at 1024 to 3072", lambda: held.straight(ZEROS), None),
            ("hold", None, ""),
        ]
    )
    assert held.zeroing.zeros(person) == ZEROS
    assert person.script == []


@pytest.mark.parametrize(("off", "teeth"), [(85, 0), (86, 1), (-171, 1), (341, 2)])
def test_a_horn_that_sits_teeth_off_is_told(off: int, teeth: int) -> None:
    """24 teeth are 170.7 ticks each: half of one is 85.3 ticks."""
    zeros = list(ZEROS)
    zeros[1] = 2048 + off
    zeros[7] = 2048 + 700  # a leg that rolls may have any
    told = Held().zeroing.horns(zeros)
    assert [(one.joint, one.teeth) for one in told] == ([("yaw2", teeth)] if teeth else [])
    if teeth:
        assert f"yaw2: zero {2048 + off} is {off:+d} ticks ({off * 360 / 4096:+.1f} deg)" in str(
            told[0]
        )


def test_a_direction_may_be_kept_and_the_rest_too() -> None:
    held = Held()
    person = Script(
        [
            (": yaw1: ", None, "s"),
            (": yaw2: ", lambda: held.turn("yaw2", -0.3), None),
            (": yaw3: ", None, "r"),
        ]
    )
    found = held.zeroing.directions(person)
    assert found == [1, -SIGNS[1]] + [1] * 17


def test_only_enter_says_that_the_robot_is_held_straight() -> None:
    held = Held()
    person = Script(
        [
            ("hold the robot straight", None, "s"),
            ("expected Enter or q, found 's'", None, "wait"),
            ("expected Enter or q, found 'wait'", None, ""),
        ]
    )
    assert held.zeroing.zeros(person) == ZEROS
    assert person.script == []


def test_other_words_keep_no_direction() -> None:
    """Neither Enter nor a word that begins with r; what was kept is known."""
    held = Held()
    person = Script(
        [
            (": yaw1: ", None, "right"),
            ("expected s, r or q, found 'right'", None, ""),
            ("expected s, r or q, found Enter", lambda: held.turn("yaw1", 0.3), None),
            (": yaw2: ", None, "s"),
            (": yaw3: ", None, "r"),
        ]
    )
    assert held.zeroing.directions(person) == [SIGNS[0]] + [1] * 18
    assert person.script == []
    assert held.zeroing.measured == {"yaw1"}


def test_exchanged_servos_are_noticed() -> None:
    held = Held()
    person = Script(
        [
            (": yaw1: ", lambda: held.turn("yaw4", 0.5), None),
            (r"expected yaw1 \(id 1\) to move, found yaw4 \(id 4\)", None, "q"),
        ]
    )
    with pytest.raises(Quit):
        held.zeroing.directions(person)


def test_it_tells_of_a_servo_that_does_not_answer_any_more() -> None:
    held = Held()
    held.box.plug(*NAMES[:-1])
    with pytest.raises(SetupError, match=r"found none of \[19\] for a second"):
        held.zeroing.zeros(Script([]))


def test_live_numbers_are_shown() -> None:
    held = Held()
    person = Script([("hold", None, "")])
    held.zeroing.zeros(person)
    yaw = " ".join(map(str, ZEROS[:5]))
    assert person.shown[0].startswith(f"yaw {yaw}  legs {ZEROS[5]} ")
    person = Script([(": yaw1: ", lambda: held.turn("yaw1", 0.1), None)])
    held.turn("yaw1", 0.0)
    with pytest.raises(BadInputError):
        held.zeroing.directions(Impatient(person.script))
    assert by_group(ROBOT, "zeros", ZEROS)[("robot", "antennae", "zeros")] == ZEROS[17:]


class Impatient(Script):
    """Gives up after some readings."""

    def show(self, text: str) -> None:
        super().show(text)
        if len(self.shown) > 3:
            raise BadInputError(self.shown[-1])
