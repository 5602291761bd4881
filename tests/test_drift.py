"""S7: a resting reading that drifts is followed, shown, and degrades beyond its band."""

from __future__ import annotations

import numpy as np
import pytest
from hardware_rig import BAND, PERIOD, Ticker, armed

from antennate.antenna.sensor import reading_noise
from antennate.control.conditioning import bending_level, contact_of
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import Finding
from antennate.hardware.safety.signal_quality import Drift, SignalQuality
from antennate.params.control import ConditioningParams, RuleParams
from antennate.params.safety import DriftParams
from antennate.robots.antenna import SensorParams
from antennate.types import Contact, Floats, State

SPAN = BAND.high - BAND.low
MEAN = 10
"""Readings in the controller's running mean, 0.1 s at 100 Hz."""


def readings(bend: Floats, seed: int) -> Floats:
    """Counts of a straight film whose reading has drifted by `bend` spans, with its noise."""
    noise = reading_noise(SensorParams(), np.random.default_rng(seed), (len(bend),))
    return np.rint(BAND.high - SPAN * bend + noise)


def contacts(counts: Floats) -> Floats:
    """Whether the controller sees contact, tick after tick."""
    total = np.cumsum(np.concatenate([np.zeros(1), counts]))
    mean = (total[MEAN:] - total[:-MEAN]) / MEAN
    level = bending_level(ConditioningParams(), mean)
    enters = level >= RuleParams().threshold
    if not enters.any():
        return enters
    seen, before = np.zeros(len(level), bool), np.full((1, 1), int(Contact.FREE))
    for n, b in enumerate(level):
        before = contact_of(RuleParams(), np.array([[b]]), before)
        seen[n] = before[0, 0] == Contact.CONTACT
    return seen


def follow(drift: Drift, counts: Floats, free: bool = True, start: float = 0.0) -> list[float]:
    """The drift after each reading."""
    shares: list[float] = []
    for n, count in enumerate(counts.tolist()):
        drift.step(start + PERIOD * (n + 1), count, free)
        shares.append(drift.share)
    return shares


@pytest.mark.parametrize("way", [1, -1])
def test_S7_a_ramp_of_ten_minutes_is_followed_within_2_percent(way: int) -> None:
    drift = Drift(DriftParams(), BAND)
    true = way * np.linspace(0.0, 0.3, 60_000)
    shares, beyond = np.empty(len(true)), np.empty(len(true), bool)
    for n, count in enumerate(readings(true, 1).tolist()):
        drift.step(PERIOD * (n + 1), count, True)
        shares[n], beyond[n] = drift.share, drift.beyond
    assert abs(shares - true).max() <= 0.02
    first = true[np.argmax(beyond)]
    assert abs(first) == pytest.approx(0.15, abs=0.02)
    assert beyond[np.argmax(beyond) :].all()


def test_S7_no_false_contact_up_to_10_percent_in_a_ramp_of_ten_minutes() -> None:
    counts = readings(np.linspace(0.0, 0.1, 60_000), 2)
    assert not contacts(counts).any()


@pytest.mark.slow
@pytest.mark.parametrize("end", [0.1, 0.3])
def test_S7_no_false_contact_in_a_ramp_of_24_hours(end: float) -> None:
    """In pieces of an hour; the drift is followed to within 2 % of the span."""
    drift, worst = Drift(DriftParams(), BAND), 0.0
    hours, n = 24, 360_000
    for hour in range(hours):
        true = np.linspace(end * hour / hours, end * (hour + 1) / hours, n)
        counts = readings(true, hour)
        assert not contacts(counts).any()
        shares = np.array(follow(drift, counts, start=hour * n * PERIOD))
        worst = max(worst, float(abs(shares - true).max()))
    assert worst <= 0.02


def test_S7_the_contact_that_is_looked_for_would_be_found() -> None:
    assert contacts(readings(np.full(100, 0.8), 3)).all()


def test_S7_touches_and_spikes_move_the_resting_reading_little() -> None:
    """Seven tenths of the time a light touch of 0.3 spans, 2.8 s each; 1 % of spikes."""
    rng = np.random.default_rng(4)
    n = 30_000
    bend = np.where(np.arange(n) % 400 < 280, 0.3, 0.0)
    counts = readings(bend, 5)
    counts[rng.random(n) < 0.01] = 4000.0
    shares = follow(Drift(DriftParams(), BAND), counts)
    assert max(map(abs, shares)) <= 0.05


def test_S7_only_what_is_free_and_fit_counts() -> None:
    """Not while an antenna touches, and not on a channel three of whose ten readings are spikes."""
    quality = SignalQuality(ConditioningParams())
    drifted = BAND.high - 0.2 * SPAN
    for n in range(5000):
        spiky = 4000.0 if n % 10 in (0, 3, 5) else drifted
        seen = (Contact.CONTACT, Contact.FREE)
        quality.step(PERIOD * n, (drifted + n % 5 - 2, spiky + n % 5 - 2), seen)
    assert quality.findings == (Finding.OK, Finding.SPIKY)
    assert [abs(drift.share) < 0.02 for drift in quality.drifts] == [True, True]
    for n in range(5000, 15000):
        free = (Contact.FREE, Contact.FREE)
        quality.step(PERIOD * n, (drifted + n % 5 - 2, BAND.high + n % 5 - 2), free)
    assert quality.drifted.startswith("left by +2")
    assert "drift=+20,+0%" in quality.status or "drift=+20,-0%" in quality.status


def test_S7_drift_degrades_and_the_robot_walks_on() -> None:
    ticker: Ticker = armed()
    out = ticker.step(drift="left by +12 % of the span")
    assert out.state is State.DEGRADED
    assert out.move
    assert [(a.cause, a.detail) for a in out.causes] == [(Cause.DRIFT, "left by +12 % of the span")]
    assert ticker.step().state is State.OK
