"""S8: swapped channels and reversed films are found before the robot is armed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hardware_rig import BAND, BENT, FREE, Ticker

from antennate.errors import ConfigError
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import Band
from antennate.hardware.safety.signal_quality import Ask, SignalQuality, TouchCheck
from antennate.params.control import ConditioningParams
from antennate.params.safety import TouchCheckParams
from antennate.types import Contact

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
