"""Readings that are none, absurd, or chatter: what conditioning and controller make of them."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from hardware_rig import BENT, FREE, PERIOD
from hypothesis import given, settings
from hypothesis import strategies as st

from antennate.control.conditioning import bending_level
from antennate.control.registry import make_controller
from antennate.params.control import ConditioningParams, ControlParams, RuleParams
from antennate.robots.antenna import SensorParams
from antennate.types import AntennaFrame, Contact, Maneuver


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(*[st.sampled_from([FREE, BENT, math.nan, math.inf, -math.inf, None])] * 2),
        min_size=1,
        max_size=40,
    ),
    st.sampled_from(["open", "paper", "closed"]),
)
def test_S5_what_is_no_number_holds_and_never_reaches_a_pose(readings: list, name) -> None:
    """NaN, infinities and None in counts: HOLD in the same tick, as long as the mean holds them."""
    params = ControlParams()
    control = make_controller(name, params)
    length = round(params.conditioning.averaging_time / params.period)
    since = length
    for n, pair in enumerate(readings):
        counts = np.array([pair], dtype=float)
        command = control.step(AntennaFrame(t=np.array([n * PERIOD]), counts=counts))
        since = since + 1 if np.isfinite(counts).all() else 0
        assert np.isfinite(command.yaw).all()
        assert np.isfinite(command.leg).all()
        assert np.isfinite(command.antenna).all()
        assert (control.maneuver[0] == Maneuver.HOLD) == (since < length)
        if since < length:
            assert Contact.UNKNOWN in control.contact


def test_S10_the_sigmoid_never_overflows() -> None:
    """z from -1e308 to 1e308: in [0, 1], monotonic, without a warning."""
    for polarity in (-1, 1):
        params = ConditioningParams(counts_low=0.0, counts_high=1.0, midpoint=0.0, slope=1.0)
        params = params.model_copy(update={"polarity": polarity})
        size = np.concatenate([[0.0], np.logspace(-300, 308, 2000)])
        z = np.concatenate([-size[::-1], size])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            b = bending_level(params, z)
        assert ((b >= 0) & (b <= 1)).all()
        assert (polarity * np.diff(b) >= 0).all()
        assert sorted({float(b[0]), float(b[-1])}) == pytest.approx([0, 1], abs=1e-300)


@pytest.mark.parametrize("frequency", [1.0, 2.0, 3.3, 5.0, 10.0, 20.0, 33.0, 50.0])
def test_S12_chatter_turns_the_robot_once_per_hold_at_most(frequency: float) -> None:
    """A square wave of contact for 20 s. FORWARD is not held: it may stand between two turns."""
    params = ControlParams()
    control = make_controller("paper", params)
    duration = 20.0
    seen = []
    for n in range(round(duration * params.rate)):
        t = n * PERIOD
        left = BENT if math.floor(2 * frequency * t + 1e-9) % 2 else FREE
        control.step(AntennaFrame(t=np.array([t]), counts=np.array([[left, FREE]])))
        seen.append(int(control.maneuver[0]))
    changes = [b for a, b in itertools.pairwise(seen) if a != b]
    bound = duration / params.rule.hold_time + 1
    assert sum(m != Maneuver.FORWARD for m in changes) <= bound
    assert len(changes) <= 2 * bound


@pytest.mark.parametrize(
    "right", ["free", pytest.param("like left", marks=pytest.mark.slow), "against left"]
)
@pytest.mark.parametrize(("name", "most"), [("closed", 11), ("open", 0), ("paper", 19)])
def test_S12_chatter_changes_the_action_as_often_as_the_page_says(
    name: str, most: int, right: str
) -> None:
    """1 to 50 Hz in 20 s, where duration / T_hold + 1 is 11; all changes, FORWARD among them."""
    params = ControlParams()
    frequency = np.repeat(np.arange(1.0, 50.1, 0.3), 2)
    start = np.tile([0.0, 0.21], len(frequency) // 2)
    control = make_controller(name, params, batch=len(frequency))
    changes, before = np.zeros(len(frequency), int), control.maneuver
    for n in range(2000):
        touch = np.floor(2 * (frequency * n * PERIOD + start) + 1e-9) % 2 == 1
        left = np.where(touch, BENT, FREE)
        other = {"free": np.full_like(left, FREE), "like left": left}
        counts = np.stack([left, other.get(right, np.where(touch, FREE, BENT))], axis=1)
        control.step(AntennaFrame(t=np.full(len(frequency), n * PERIOD), counts=counts))
        changes += control.maneuver != before
        before = control.maneuver
    assert changes.max() <= most
    assert changes[frequency > 10].max() <= 11


def test_S12_hysteresis_is_wider_than_the_noise() -> None:
    """Twice the noise of the mean of ten readings, where the sigmoid is steepest."""
    conditioning, rule = ConditioningParams(), RuleParams()
    steepest = conditioning.slope / 4 / (conditioning.counts_high - conditioning.counts_low)
    assert rule.hysteresis > 2 * steepest * SensorParams().noise_counts / math.sqrt(10)
