"""One joint by small steps, before twin servos in invented time."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from setup_rig import ROBOT, Box

from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.setup.jog import Jog
from antennate.hardware.setup.person import SetupError
from antennate.hardware.setup.servos import ServoSetup, joints_of
from antennate.params.setup import JogParams

YAW1, LEG = joints_of(ROBOT)[0], joints_of(ROBOT)[5]
TICK = 2 * math.pi / 4096


class Ready:
    """A servo that is set up, alone on the bus."""

    def __init__(self, joint=YAW1) -> None:
        self.box = Box()
        self.box.plug(joint.name)
        ServoSetup(self.box.opener, ROBOT, 0.02, self.box.wire.now).set_up(joint, ())
        self.box.bus.master_baud = ROBOT.baud
        self.servo = self.box.servos[joint.name]
        self.servo.place(2048.0)
        self.bus = Bus(self.box.wire, clock=self.box.wire.now)
        self.joint = joint

    def jog(self, **params: float) -> Jog:
        return Jog(self.bus, ROBOT, self.joint, JogParams(**params))

    def wait(self, jog: Jog, time: float) -> list[float]:
        """Let time pass, looking every 40 ms; speeds [rad/s]."""
        places = [self.servo.position]
        for _ in range(round(time / 0.04)):
            self.box.wire.sleep(0.04)
            jog.look()
            places.append(self.servo.position)
        return [(b - a) * TICK / 0.04 for a, b in pairwise(places)]


def test_it_turns_by_its_step_slowly_and_lets_go() -> None:
    ready = Ready()
    jog = ready.jog()
    assert ready.servo.torque
    assert ready.servo.get("goal_pwm") == pytest.approx(0.3 * 885, abs=1)
    assert ready.servo.get("bus_watchdog") == 10
    jog.step(1)
    jog.step(1)
    speeds = ready.wait(jog, 1.5)
    assert jog.look().angle == pytest.approx(0.10, abs=0.02)
    assert max(speeds) < 0.5 * 1.3
    assert jog.end() == []
    assert not ready.servo.torque
    assert ready.servo.get("goal_pwm") == 885
    assert ready.servo.get("profile_velocity") == 0
    assert ready.servo.get("bus_watchdog") == 0


def test_it_stops_at_the_limit_of_the_joint() -> None:
    jog = Ready().jog(step=0.5)
    for _ in range(9):
        jog.step(1)
    assert jog.look().goal == pytest.approx(math.pi / 2)


def test_a_leg_goes_on_without_end_from_where_it_stands() -> None:
    ready = Ready(LEG)
    ready.servo.place(2048.0 + 3 * 4096)
    jog = ready.jog(step=0.5)
    assert jog.look().angle == pytest.approx(0.0, abs=2 * TICK)
    for _ in range(9):
        jog.step(-1)
    assert jog.look().goal == pytest.approx(-4.5)
    jog.end()


def test_a_program_that_dies_leaves_a_joint_that_stands() -> None:
    ready = Ready()
    jog = ready.jog(step=0.5)
    jog.step(1)
    ready.wait(jog, 0.2)
    ready.box.wire.sleep(0.3)
    stopped = ready.servo.position
    ready.box.wire.sleep(2.0)
    assert ready.servo.position == pytest.approx(stopped, abs=1)
    assert ready.servo.get("bus_watchdog") == -1


def test_an_error_of_the_servo_is_named_and_torque_is_off_afterwards() -> None:
    ready = Ready()
    jog = ready.jog()
    ready.servo.fail(32)  # overload
    with pytest.raises(SetupError, match="found: overload; take the load off"):
        jog.look()
    assert jog.end() == []
    assert not ready.servo.torque


def test_a_servo_that_falls_silent_is_told() -> None:
    ready = Ready()
    jog = ready.jog()
    ready.box.plug()
    with pytest.raises(SetupError, match=r"expected an answer of yaw1 .*, found none"):
        ready.wait(jog, 2.0)


def test_a_joint_that_a_killed_jog_left_weak_has_the_force_of_the_next_one() -> None:
    ready = Ready()
    ready.servo.set("goal_pwm", 20)
    jog = ready.jog()
    assert ready.servo.get("goal_pwm") == pytest.approx(0.3 * 885, abs=1)
    assert jog.end() == []
    assert ready.servo.get("goal_pwm") == 885
