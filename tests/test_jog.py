"""One joint by small steps, before twin servos in invented time."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from setup_rig import ROBOT, Box

from antennate.hardware.setup.jog import Jog
from antennate.hardware.setup.person import SetupError
from antennate.hardware.setup.servos import ServoSetup, joints_of
from antennate.params.hardware import JogParams
from dynamixel_bus.bus import Bus

YAW1, LEG = joints_of(ROBOT)[0], joints_of(ROBOT)[5]
TICK = 2 * math.pi / 4096


class Ready:
    """A servo that is set up, alone on the bus."""

    def __init__(self, joint=YAW1, measured: bool = True) -> None:
        self.box = Box()
        self.box.plug(joint.name)
        ServoSetup(self.box.opener, ROBOT, 0.02, self.box.wire.now).set_up(joint, ())
        self.box.bus.master_baud = ROBOT.baud
        self.servo = self.box.servos[joint.name]
        self.servo.place(2048.0)
        self.bus = Bus(self.box.wire, clock=self.box.wire.now)
        self.joint, self.measured = joint, measured

    def jog(self, **params: float) -> Jog:
        jog = Jog(self.bus, ROBOT, self.joint, JogParams(**params), self.measured)
        jog.begin()
        return jog

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
    """Legs reach 33 of the 60 mm to the middle between two links and keep 1 mm, at 100 mm."""
    jog = Ready().jog(step=0.2)
    for _ in range(9):
        jog.step(1)
    assert jog.look().goal == pytest.approx(2 * math.atan((60 - 33 - 1) / 100))


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


@pytest.mark.parametrize(
    ("register", "value", "told"),
    [
        ("operating_mode", 0, "operating mode 3 of yaw1 .*, found 0"),  # current
        ("operating_mode", 1, "operating mode 3 of yaw1 .*, found 1"),  # velocity
        ("operating_mode", 4, "operating mode 3 of yaw1 .*, found 4"),  # extended position
        ("operating_mode", 5, "operating mode 3 of yaw1 .*, found 5"),  # position with current
        ("operating_mode", 16, "operating mode 3 of yaw1 .*, found 16"),  # PWM
        ("drive_mode", 1, "drive mode 0 of yaw1 .*, found 1"),  # reversed
        ("drive_mode", 4, "drive mode 0 of yaw1 .*, found 4"),  # profiles in milliseconds
        ("drive_mode", 8, "drive mode 0 of yaw1 .*, found 8"),  # a goal brings torque
        ("homing_offset", 300, "homing offset 0 of yaw1 .*, found 300"),
        ("min_position_limit", 2000, "min position limit at most 1716 of yaw1 .*, found 2000"),
        ("velocity_limit", 3, "velocity limit at least .* of yaw1 .*, found 3"),
    ],
)
def test_a_servo_that_is_set_otherwise_gets_no_torque(register: str, value: int, told: str) -> None:
    """Profile velocity is a speed and Goal PWM a limit in position modes alone (manuals)."""
    ready = Ready()
    ready.servo.set(register, value)
    jog = Jog(ready.bus, ROBOT, YAW1, JogParams(), True)
    with pytest.raises(SetupError, match=f"expected {told}; `antennate setup --only yaw1`") as info:
        jog.begin()
    assert "\n" not in str(info.value)
    assert not ready.servo.torque
    stood = ready.servo.position
    ready.box.wire.sleep(1.0)
    assert ready.servo.position == stood
    assert jog.end() == []


@pytest.mark.parametrize("side", [1, -1])
def test_outside_its_limit_a_joint_goes_inwards_by_single_steps_alone(side: int) -> None:
    ready = Ready()
    ready.servo.place(2048.0 + side * 1500)  # 132 degrees; the limit is 90
    jog = ready.jog(step=0.1)
    out = jog.look().angle
    assert abs(out) == pytest.approx(1500 * TICK, abs=2 * TICK)
    outwards = 1 if out > 0 else -1
    jog.step(outwards)
    assert jog.look().goal == pytest.approx(out)
    for count in range(1, 4):
        jog.step(-outwards)
        assert jog.look().goal == pytest.approx(out - outwards * 0.1 * count)
    jog.step(outwards)
    assert jog.look().goal == pytest.approx(out - outwards * 0.3)
    jog.end()


def test_what_a_stopped_program_left_is_told_in_words() -> None:
    """After 0.2 s without a packet the watchdog refuses goals, by the manual."""
    ready = Ready()
    jog = ready.jog()
    ready.box.wire.sleep(1.0)
    with pytest.raises(SetupError, match=r"found that its watchdog stopped it: .* start jog again"):
        jog.step(1)
    assert jog.end() == []


def test_a_servo_that_does_not_confirm_stays_slow_and_weak_and_is_named() -> None:
    ready = Ready()
    jog = ready.jog()
    ready.box.plug()
    assert jog.end() == [1]
    assert ready.servo.get("goal_pwm") == pytest.approx(0.3 * 885, abs=1)
    assert ready.servo.get("profile_velocity") > 0


def test_two_servos_with_the_id_of_the_joint_get_no_torque() -> None:
    ready = Ready()
    other = ready.box.servos["yaw2"]
    other.set("id", 1)
    other.set("baud_rate", ready.servo.get("baud_rate"))
    ready.box.plug("yaw1", "yaw2")
    with pytest.raises(SetupError, match="found: two servos answer with this id; leave one of"):
        ready.jog()
    assert not any(servo.torque for servo in (ready.servo, other))
