"""A joint that does not follow is named, and one that pushes with all it has is not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from test_session import DRY, at, walked
from twin_rig import rig

from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import require_servos
from antennate.hardware.driving.drive import drive
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.joints import Joints
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.following import Following
from antennate.params.safety import FollowingParams
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from antennate.twin.faults import Faults, read
from antennate.types import Floats, State

ROBOT = RobotSpec()
YAW, LEG = 1, 8
"""Places of yaw2 (servo 2) and leg_r1 (servo 9)."""
FULL = 885
SATURATED = FULL / (700 / 128)
"""Error of an XC430 from which on its drive is full [ticks]: manual, Position P Gain 700 / 128."""
EVENT = 1.0
CYCLE = 2.0
"""A gait cycle at half a hertz [s]."""


class Bench:
    """Nineteen joints that stand at their zeros with torque, and one of them that does not."""

    def __init__(self, at: int, well: bool = True) -> None:
        self.at, self.n = at, 0
        self.following = Following(Joints(ROBOT), FollowingParams(), lambda servo: well)
        self.zeros: Floats = np.array(ROBOT.zeros, float)
        self.following.arm(self.zeros, dict.fromkeys(ROBOT.ids, FULL))

    def tick(self, goal: float, place: float, pwm: int | None = None, stands: bool = False) -> None:
        """Goal and place of the joint from its zero [ticks]; its drive, if it is read.

        The goal moves a little from tick to tick, as in a wave, unless the robot stands.
        """
        goals, places = self.zeros.copy(), self.zeros.copy()
        goals[self.at] += goal + (0.0 if stands else 0.1 * (self.n % 2))
        places[self.at] += place
        self.n += 1
        self.following.step((0.01 * self.n, 0.01 * self.n + 0.002), goals, places)
        if pwm is not None and self.at in self.following.suspects:
            self.following.drive(0.01 * self.n, self.at, pwm, round(places[self.at]))

    def run(self, ticks: int, goal: float, place: float, pwm: int | None = None) -> None:
        for _ in range(ticks):
            self.tick(goal, place, pwm)

    @property
    def named(self) -> set[str]:
        found = self.following.faults
        kinds = {"behind": found.behind, "outside": found.outside, "leaps": found.leaps}
        assert all(set(words) <= {ROBOT.ids[self.at]} for words in kinds.values())
        return {kind for kind, words in kinds.items() if words}


def test_B20_a_joint_far_behind_at_full_drive_is_not_named_as_long_as_it_moves() -> None:
    bench = Bench(LEG)
    for n in range(3000):  # a turn behind for half a minute, and 1.2 degrees to and fro
        bench.tick(4096.0, 14.0 * (n // 100 % 2), FULL)
    assert bench.following.suspects == [LEG]
    assert not bench.named
    bench.run(199, 4096.0, 0.0, FULL)
    assert not bench.named
    bench.run(2, 4096.0, 0.0, FULL)
    assert bench.named == {"behind"}
    assert bench.following.faults.behind[9].endswith("has not moved for 2 s of moving goals")


@pytest.mark.parametrize("joint", [YAW, LEG])
def test_B20_a_joint_that_leans_while_the_robot_stands_is_healthy(joint: int) -> None:
    """A minute of HOLD, row L9: its servo pushes, and no wave frees it; then the wave does."""
    bench, lean = Bench(joint), 0.6 * SATURATED
    bench.run(150, lean, 0.0, round(0.6 * FULL))
    for _ in range(6000):
        bench.tick(lean, 0.0, round(0.6 * FULL), stands=True)
    assert bench.following.suspects == [joint]
    assert not bench.named
    bench.run(45, lean, 0.0, round(0.6 * FULL))
    assert not bench.named
    bench.run(10, lean, 0.0, round(0.6 * FULL))
    assert bench.named == {"behind"}


def test_B21_a_joint_pushed_beyond_its_limit_while_the_robot_stands_is_healthy() -> None:
    bench, limit = Bench(YAW), ROBOT.yaw_limit / (2 * math.pi) * 4096
    for way in np.linspace(0.0, limit + 1.1 * SATURATED, 60).tolist():
        bench.tick(min(way, limit), way, -FULL)
    for _ in range(6000):
        bench.tick(limit, limit + 1.1 * SATURATED, -FULL, stands=True)
    assert not bench.named


def test_B20_a_joint_that_does_not_drive_is_named_while_the_robot_stands() -> None:
    bench = Bench(YAW)
    for _ in range(14):
        bench.tick(SATURATED, 0.0, 0, stands=True)
    assert bench.named == {"behind"}


@pytest.mark.parametrize(("pwm", "named"), [(0, True), (650, True), (680, False), (FULL, False)])
def test_B20_a_drive_that_lacks_a_quarter_is_named_after_a_tenth_of_a_second(
    pwm: int, named: bool
) -> None:
    """Full drive is due from twice the error of saturation on: half the gain is granted."""
    bench = Bench(LEG)
    bench.run(10, -2.1 * SATURATED, 0.0, -pwm)
    assert not bench.named
    bench.run(4, -2.1 * SATURATED, 0.0, -pwm)
    assert bench.named == ({"behind"} if named else set())
    words = bench.following.faults.behind.get(9, "leg_r1")
    assert words.startswith("leg_r1")


def test_B20_a_drive_the_wrong_way_a_lost_answer_and_a_single_bad_reading() -> None:
    bench = Bench(YAW)
    bench.run(14, SATURATED, 0.0, -FULL)
    assert bench.named == {"behind"}
    bench = Bench(YAW)
    for n in range(100):  # never three in a row
        bench.tick(SATURATED, 3.0 * (n % 7), 0 if n % 3 else FULL)
        bench.tick(SATURATED, math.nan, 0 if n % 3 else FULL)
    assert not bench.named


def test_B20_a_servo_without_torque_or_watchdog_has_another_cause() -> None:
    bench = Bench(LEG, well=False)
    bench.run(500, 4096.0, 0.0, 0)
    assert not bench.named


def test_B20_a_small_error_asks_for_no_drive() -> None:
    """Below half the error of saturation less than a quarter of the drive is due."""
    bench = Bench(YAW)
    bench.run(500, 0.49 * SATURATED, 0.0, 0)
    assert bench.following.suspects == []
    assert not bench.named


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("beyond", "ticks", "pwm", "named"),
    [
        (0.97, 1000, FULL, False),
        (1.03, 190, FULL, False),
        (1.03, 205, FULL, True),
        (1.03, 14, 0, True),
    ],
)
def test_B21_a_joint_is_pushed_beyond_its_limit_for_a_moment_and_at_full_drive(
    beyond: float, ticks: int, pwm: int, named: bool, side: int
) -> None:
    """Farther than the error of full drive: less than a gait cycle."""
    bench = Bench(YAW)
    limit = ROBOT.yaw_limit / (2 * math.pi) * 4096
    for way in np.linspace(0.0, limit, 60).tolist():
        bench.tick(side * way, side * way)
    for n in range(ticks):  # it moves to and fro, so that it is not stuck
        away = beyond * SATURATED + 14.0 * (n // 50 % 2)
        bench.tick(side * limit, side * (limit + away), -side * pwm)
    assert ("outside" in bench.named) is named
    assert ("behind" in bench.named) is (pwm == 0)


def test_B21_legs_without_end_have_no_limit() -> None:
    bench = Bench(LEG)
    for n in range(1000):
        bench.tick(30.0 * n, 30.0 * n)
    assert not bench.named


@pytest.mark.parametrize("way", [-4096.0, 1024.0, 4096.0])
def test_B22_a_leap_is_named_at_once_and_the_speed_without_load_is_not(way: float) -> None:
    bench = Bench(LEG)
    a_tick = 65 / 60 * 4096 * 0.01  # 65 rev/min (data sheet)
    for n in range(300):
        bench.tick(n * a_tick, n * a_tick)
    assert not bench.named
    bench.tick(300 * a_tick, 300 * a_tick + way)
    assert bench.named == {"leaps"}


def test_arming_forgets_what_was_wrong_and_takes_a_joint_where_it_stands() -> None:
    bench = Bench(YAW)
    bench.run(14, SATURATED, 0.0, 0)
    bench.run(14, 0.0, 1500.0, 0)
    assert bench.named == {"behind", "outside", "leaps"}
    nearest = replace(bench.following.margins)
    stood = bench.zeros.copy()
    stood[YAW] += 1500.0
    bench.following.arm(stood, dict.fromkeys(ROBOT.ids, FULL))
    bench.run(20, 1500.0, 1500.0)
    assert not bench.named
    assert bench.following.margins == nearest


CASES = [
    ("servo:9=goal_pwm:0", Cause.NOT_FOLLOWING, 1.0),
    ("servo:2=operating_mode:1", Cause.WRONG_MODE, 1.0),
    ("servo:9=jump:4096", Cause.IMPOSSIBLE_SPEED, 0.1),
    ("servo:2=goal_pwm:0", Cause.NOT_FOLLOWING, CYCLE),
    ("servo:9=frozen", Cause.NOT_FOLLOWING, 1.0),
    ("servo:2=frozen", Cause.NOT_FOLLOWING, CYCLE),
    ("servo:2=jump:-4096", Cause.OUT_OF_LIMITS, 1.0),
    ("servo:9=operating_mode:16", Cause.WRONG_MODE, 1.0),
    ("servo:9=torque_enable:0", Cause.DISARMED, 1.0),
]
FAST = 3


def cases() -> Iterator[object]:
    for number, case in enumerate(CASES):
        yield pytest.param(*case, id=case[0], marks=() if number < FAST else pytest.mark.slow)


@pytest.mark.parametrize(("what", "cause", "within"), list(cases()))
def test_B20_B21_B22_B23_what_a_joint_does_wrong_is_a_fault_in_time_that_names_it(
    what: str, cause: Cause, within: float
) -> None:
    log = walked(at(EVENT, what), DriveConfig(dry_run=DRY, duration=3.0, fault_time=0.3))
    assert log.first(cause) - EVENT <= within
    assert log.state[-1] is State.FAULT
    if cause in (Cause.DISARMED, Cause.WRONG_MODE):
        assert Cause.NOT_FOLLOWING not in set().union(*log.causes)
    servo = what[6]
    assert f"{cause.name}: {cause.text} (servo {servo}" in log.report.why
    assert log.report.safe


@pytest.mark.slow
def test_B20_a_yaw_joint_that_is_cut_at_any_phase_is_named_within_a_cycle() -> None:
    for phase in np.linspace(0.0, CYCLE, 8, endpoint=False).tolist():
        config = DriveConfig(dry_run=DRY, duration=5.0, fault_time=0.1)
        log = walked(at(EVENT + phase, "servo:2=goal_pwm:0"), config)
        assert log.first(Cause.NOT_FOLLOWING) - EVENT - phase <= CYCLE


def test_B23_a_mode_that_was_changed_in_the_dry_run_gets_no_torque() -> None:
    log = walked(at(DRY / 2, "servo:2=operating_mode:1"))
    assert "expected operating modes {2: 3} by id, found {2: 1}" in log.report.why
    assert not any(servo.torque for servo in log.rig.robot.servos)


@pytest.mark.parametrize(("when", "what"), [(0.0, "overload"), (0.2, "overheat")])
def test_B24_a_hardware_error_is_refused_at_once(when: float, what: str) -> None:
    """Before the drive by the look at all servos; in the dry run as soon as it is there."""
    made = rig(TwinConfig())
    faults = Faults([read(f"servo:7={what}@{when}s")], ROBOT.ids)
    if not when:
        faults.apply(made.robot, 0.0)
        with pytest.raises(BringUpError, match=r"found overload in servo 7; .* reboot"):
            require_servos(made.session.actuators.bus, ROBOT)  # type: ignore[attr-defined]
        return
    config = DriveConfig(dry_run=5.0, touch_check=False, duration=1.0)
    report = drive(made.session, config, arm=True, on_tick=lambda s, t: faults.apply(made.robot, t))
    assert "SERVO_ERROR: servos report a hardware error (servo 7: overheating)" in report.refusal
    assert made.clock.now() < 1.0
    assert report.on is None


@pytest.mark.parametrize("text", ["servo:7=jump", "servo:7=jump:0", "servo:7=jump:1e7"])
def test_a_jump_has_a_size(text: str) -> None:
    with pytest.raises(BadInputError, match="expected a jump of 1 to 1048575 ticks"):
        read(text)
