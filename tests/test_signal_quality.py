"""S8: swapped channels and reversed films are found, and only then a session is armed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hardware_rig import BAND, BENT, FREE, Ticker
from twin_rig import Rig, rig

from antennate.errors import BadInputError, ConfigError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import Band
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import Ask, SignalQuality, TouchCheck
from antennate.params.control import ConditioningParams
from antennate.params.safety import TouchCheckParams
from antennate.robots.antenna import AntennaSpec
from antennate.twin.board import TouchStimulus
from antennate.twin.config import TwinConfig
from antennate.types import Contact, Floats, State

TOUCHED = TwinConfig(touch=("left@0.5s", "right@2s"))
CONFIG = DriveConfig(dry_run=1.0, duration=1.0)
SHORT = TouchCheckParams(patience=4.0)


def driven(
    config: TwinConfig = TOUCHED,
    touch: TouchCheckParams | None = SHORT,
    arm: bool = True,
    spoil: Callable[[Rig], object] = lambda rig: None,
) -> tuple[Rig, Report, list[str]]:
    """A drive, how it went, and what was said on the way."""
    made = rig(config, touch=touch)
    spoil(made)
    for servo in made.robot.servos:
        servo.feed_watchdog(0.001)  # as bring-up does
    said: list[str] = []
    drive_config = CONFIG.model_copy(update={"touch": touch or SHORT})
    report = drive(made.session, drive_config, arm, lambda s, t: said.append(s.quality.status))
    return made, report, said


def swapped(made: Rig) -> None:
    """Let the board send each channel as the other."""
    board = made.session.board
    read = board.newest

    def exchange(now: float):
        timed = read(now)
        if timed is not None:
            from dataclasses import replace

            s = timed.sample
            timed = replace(timed, sample=replace(s, left=s.right, right=s.left))
        return timed

    board.newest = exchange  # type: ignore[method-assign]


class Inverted(TouchStimulus):
    def change(self, t: float, begun: float) -> Floats:
        return super().change(t, begun) * (-1, 1)


def inverted(made: Rig) -> None:
    """Let the left reading rise where it should fall."""
    made.robot.touch = Inverted(TOUCHED.touch, AntennaSpec())


def test_S8_a_robot_whose_antennae_were_bent_by_hand_is_armed() -> None:
    made, report, said = driven()
    assert report.refusal == ""
    assert report.safe
    assert made.session.tally.sent > 50
    asked = list(dict.fromkeys(line.split(" drift")[0] for line in said))
    assert asked == [
        "touch=(let go of both antennae)",
        "touch=(bend the left antenna towards the tail)",
        "touch=(let go of both antennae)",
        "touch=(bend the right antenna towards the tail)",
        "touch=passed",
    ] or asked == [
        "touch=(let go of both antennae)",
        "touch=(bend the left antenna towards the tail)",
        "touch=(bend the right antenna towards the tail)",
        "touch=passed",
    ]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (swapped, "the left antenna was asked for and the right channel answered"),
        (inverted, "the reading of the left antenna runs against its calibration"),
    ],
)
def test_S8_swapped_and_inverted_channels_are_refused_and_nothing_gets_torque(
    spoil: Callable[[Rig], object], said: str
) -> None:
    made, report, _ = driven(spoil=spoil)
    assert said in report.refusal
    assert made.clock.now() < 1.5  # at once
    assert made.session.tally.sent == 0
    assert not any(servo.torque for servo in made.robot.servos)


def test_S8_antennae_that_nobody_bends_are_refused_after_the_dry_run_was_extended() -> None:
    made, report, _ = driven(TwinConfig(touch=("left@0.5s",)))
    assert "no bend felt: bend the right antenna" in report.refusal
    assert made.clock.now() == pytest.approx(5.0, abs=0.1)
    assert made.session.tally.sent == 0


def test_S8_without_arm_the_dry_run_ends_on_time_and_refuses_nothing() -> None:
    made, report, _ = driven(TwinConfig(), arm=False)
    assert report.refusal == ""
    assert made.clock.now() == pytest.approx(1.0, abs=0.1)


def test_S8_a_check_that_is_skipped_is_shown() -> None:
    made, report, said = driven(TwinConfig(), touch=None)
    assert report.refusal == ""
    assert made.session.tally.sent > 50
    assert all(line.startswith("touch=skipped") for line in said)


def test_S8_an_arm_event_before_the_check_has_passed_is_not_accepted() -> None:
    made = rig(TwinConfig(), touch=SHORT)
    seen: list[tuple[Cause, ...]] = []

    def ask(session: Session, t: float) -> None:
        session.orders.arm = t > 0.5
        assert session.outputs is not None
        seen.append(session.outputs.refusal)

    drive(made.session, CONFIG, arm=False, on_tick=ask)
    assert (Cause.NOT_READY,) in seen
    assert made.session.outputs is not None
    assert made.session.outputs.state is State.OFF


@pytest.mark.parametrize("order", ["left", "left@2", "middle@2s", "left@-1s", "left@1es"])
def test_touches_that_do_not_exist_are_refused(order: str) -> None:
    with pytest.raises(BadInputError, match="--touch: expected left or right"):
        TouchStimulus([order], AntennaSpec())


RISING = Band(500.0, 2500.0, 1)


def follow(check: TouchCheck, swapped=False, reversed_side: int | None = None) -> TouchCheck:
    """A person does what is asked for, 1 s each; the wiring may be wrong."""
    rng = np.random.default_rng(1)
    for _ in range(6):
        bent = {Ask.LEFT: 0, Ask.RIGHT: 1}.get(check.ask)
        for _ in range(100):
            counts = FREE + rng.normal(0, 2.5, 2)
            if bent is not None:
                change = BENT - FREE
                counts[bent] += -change if bent == reversed_side else change
            left, right = (counts[::-1] if swapped else counts).tolist()
            check.step(left, right)
            if bent is not None and check.ask is Ask.REST:
                break
    return check


def fresh() -> TouchCheck:
    return TouchCheck(TouchCheckParams(), (BAND, BAND))


def test_S8_a_robot_wired_well_passes() -> None:
    check = follow(fresh())
    assert check.ask is Ask.NOTHING
    assert check.objection == ""


def test_S8_swapped_channels_are_refused() -> None:
    check = follow(fresh(), swapped=True)
    assert check.ask is Ask.NOTHING
    assert "the left antenna was asked for and the right channel answered" in check.objection


@pytest.mark.parametrize(("side", "name"), [(0, "left"), (1, "right")])
def test_S8_a_reversed_film_is_refused(side: int, name: str) -> None:
    check = follow(fresh(), reversed_side=side)
    assert check.ask is Ask.NOTHING
    assert f"the reading of the {name} antenna runs against its calibration" in check.objection


def test_S8_without_touch_or_with_both_bent_nothing_passes() -> None:
    check = fresh()
    for _ in range(100):
        assert check.step(BENT, BENT) is Ask.REST
    for _ in range(100):
        check.step(FREE, FREE)
    for left, right in [(BENT, BENT), (math.nan, FREE), (FREE, FREE), (1790.0, FREE)] * 50:
        assert check.step(left, right) is Ask.LEFT
    assert check.objection


def test_S8_a_short_touch_does_not_count() -> None:
    check = fresh()
    for _ in range(10):
        check.step(FREE, FREE)
    for n in range(200):
        assert check.step(BENT if n % 10 else FREE, FREE) is Ask.LEFT


def test_S8_films_that_rise_are_checked_alike() -> None:
    check = TouchCheck(TouchCheckParams(), (RISING, RISING))
    for left, right in [(500.0, 500.0), (1500.0, 500.0), (500.0, 500.0), (500.0, 1500.0)]:
        for _ in range(10):
            check.step(left, right)
    assert check.objection == ""


def test_S8_an_objection_keeps_the_robot_from_being_armed() -> None:
    check = fresh()
    ticker = Ticker()
    ticker.run(20, objections=(check.objection,))
    outputs = ticker.step(arm=True, objections=(check.objection,))
    assert outputs.refusal == (Cause.NOT_READY,)
    assert not outputs.torque
    details = {active.cause: active.detail for active in outputs.causes}
    assert details[Cause.NOT_READY] == check.objection
    assert not ticker.step().arming
    assert ticker.step(arm=True).arming


def test_limits_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ConfigError, match="still must be below level"):
        TouchCheckParams(still=0.3)


def test_S8_a_sample_that_is_read_again_counts_once() -> None:
    """A loop faster than the board reads each sample more than once."""
    params = TouchCheckParams(readings=10)
    quality = SignalQuality(ConditioningParams(), touch=params)
    free = (int(Contact.FREE), int(Contact.FREE))
    asks = []
    for sample in range(10):
        for _ in range(30):
            quality.step(0.01 * sample, (FREE + sample % 3, FREE - sample % 2), free)
        asks.append(quality.check.ask if quality.check else None)
    assert asks == [Ask.REST] * 9 + [Ask.LEFT]
