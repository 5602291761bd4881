"""Silence, old data, reboots, wrong rates, pauses and exceptions, in invented time."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from esp32_streams import made
from hardware_faults import causes
from hardware_rig import BENT, FREE, LIMIT, PERIOD, Rig, armed, pose_change

from antennate.control.registry import make_controller
from antennate.hardware.esp32.clock import DeviceClock, SampleState
from antennate.hardware.esp32.wire import Hello, Reset
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.supervisor import Outputs
from antennate.params.control import ControlParams
from antennate.types import Maneuver, State


def test_L8_silence_at_a_thousand_random_phases() -> None:
    """HOLD is decided within 70 ms after the last valid sample, whatever the phases."""
    rng = np.random.default_rng(8)
    after = []
    for _ in range(1000):
        ticker = armed()
        phase, delay = rng.uniform(0, PERIOD), rng.uniform(0, 0.005)
        last = ticker.now + phase - delay
        outputs = ticker.step(age=ticker.now + PERIOD - last)
        while outputs.move:
            outputs = ticker.step(age=ticker.now + PERIOD - last, valid=0)
        assert outputs.state is State.HOLD
        assert causes(outputs) == {Cause.STALE}
        after.append(ticker.now - last)
    assert min(after) > LIMIT
    assert max(after) <= 0.070


def test_L8_a_maneuver_that_is_held_does_not_delay_hold() -> None:
    """The turn has 2 s to go when the samples end: the command stands still within 70 ms."""
    rig = Rig("paper")
    rig.start()
    rig.go(40, (BENT, FREE))
    assert rig.control.maneuver[0] == Maneuver.TURN_R
    last = rig.now
    moved = last
    for _ in range(100):
        rig.step([])
        if rig.pose_step() > 0:
            moved = rig.now
    assert moved - last <= 0.06
    assert rig.outputs[-1].state is State.HOLD
    assert rig.outputs[-1].torque


@pytest.mark.parametrize("silence", [0.2, 0.5, 1.0, 5.0, 60.0])
def test_L9_silence_then_return(silence: float) -> None:
    """Walks again within 1 s and after ten good samples; the first step is a normal one."""
    rig = Rig("open")
    rig.start()
    normal = 0.0
    for _ in range(100):
        rig.go(1)
        normal = max(normal, rig.pose_step())
    assert normal > 0
    for _ in range(round(silence / PERIOD)):
        rig.step([])
    assert rig.outputs[-1].state is State.HOLD
    held = rig.sent[-1]
    first = rig.now + PERIOD
    good = 0
    while rig.sent[-1] is held or rig.pose_step() == 0:
        rig.go(1)
        good += 1
        assert rig.now - first < 1.0
    assert good >= 10
    assert rig.pose_step() <= 1.01 * normal
    assert causes(rig.outputs[-1]) <= {Cause.RATE}
    rig.go(100)
    assert rig.outputs[-1].state is State.OK
    assert max(itertools.starmap(pose_change, itertools.pairwise(rig.sent))) <= 1.01 * normal


def boot(number: int = 1) -> Hello:
    return Hello(number, (1, 0, 0), Reset.POWER_ON, 0, "00", 30, 100)


@pytest.mark.parametrize("stall", [0.1, 0.6, 2.0, 5.0])
@pytest.mark.parametrize("behind", [0, 20])
def test_L10_a_burst_of_old_frames_is_not_acted_upon(stall: float, behind: int) -> None:
    """No command rests on a sample older than 50 ms; it holds in time and walks again after."""
    rig, clock = Rig("paper"), DeviceClock()
    clock.greet(boot(made(0).boot_id))
    rig.sent.append(rig.control.gait.step(np.array([int(Maneuver.HOLD)])))
    rng = np.random.default_rng(10)
    stop, end = 200, 200 + round(stall * 100)
    holds = moves = 0
    for n in range(end + 300):
        now = (rig.n + 1) * PERIOD
        if n < stop:
            arrived = [n]
        elif n < end:
            arrived = []
        elif n == end:
            arrived = list(range(stop, max(stop, end - behind)))
        else:
            arrived = [n] if n > end + 1 else list(range(max(stop, end - behind), n + 1))
        samples = []
        for number in arrived:
            if clock.take(made(number), now) is SampleState.USED and clock.newest is not None:
                counts = (FREE + np.rint(rng.normal(0, 2.5, 2))).tolist()
                samples.append((number * PERIOD, *counts))
        outputs = rig.step(samples, age=clock.age(now), arm=n == 100)
        holds += outputs.state is State.HOLD and n >= stop
        moves += outputs.move and n >= stop
        if stop + 7 <= n < end + 10:
            assert not outputs.move
    assert max(rig.used_ages) <= LIMIT + 1e-9
    assert holds >= round(stall * 100) - 7
    assert rig.outputs[-1].state is State.OK
    assert moves > 200


def reboots(reason: str, gap: float, every: float, count: int) -> list[Outputs]:
    """What follows when the board restarts again and again, silent for a time [s] after each."""
    ticker = armed()
    found = []
    for number in range(1, count + 1):
        for n in range(round(every / PERIOD)):
            silent = n < round(gap / PERIOD)
            changes = {"age": math.inf, "valid": 0} if silent else {}
            found.append(ticker.step(resets=number, reset_reason=reason, **changes))
    return found


@pytest.mark.parametrize("gap", [0.05, 0.3, 0.95, 1.0])
@pytest.mark.parametrize("reason", ["brown-out", "HARD"])
def test_E2_a_reboot_loop_is_a_fault_after_three(gap: float, reason: str) -> None:
    """One a second, 30 times: FAULT at the third, with the reason; never walks again by itself."""
    found = reboots(reason, gap, 1.0, 30)
    first = next(n for n, outputs in enumerate(found) if outputs.state is State.FAULT)
    assert first <= 2.0 / PERIOD
    assert all(o.state is State.FAULT and not o.move for o in found[first:])
    details = {a.cause: a.detail for a in found[-1].causes}
    assert details[Cause.REBOOT_LOOP] == reason
    assert ("brown-out" in details[Cause.REBOOT_LOOP]) == (reason == "brown-out")


def test_E2_reboots_far_apart_are_holds() -> None:
    found = reboots("HARD", 0.3, 6.0, 5)
    assert {o.state for o in found} == {State.OK, State.HOLD}


@pytest.mark.parametrize(
    ("rate", "wrong"),
    [(50, True), (78, True), (82, False), (100, False), (118, False), (200, True)],
)
def test_L16_a_wrong_rate_is_shown_and_degrades(rate: int, wrong: bool) -> None:
    """After 2 s it is known, and measured to 2 %."""
    ticker = armed()
    taken = 0
    outputs = None
    for n in range(400):
        come = (n + 1) * rate // 100 - taken
        taken += come
        outputs = ticker.step(valid=come)
    assert outputs is not None
    assert ticker.supervisor.meter.rate == pytest.approx(rate, rel=0.02)
    assert (Cause.RATE in causes(outputs)) == wrong
    assert outputs.state is (State.DEGRADED if wrong else State.OK)


@pytest.mark.parametrize("rate", [25, 50, 100, 200, 1000])
def test_L16_the_mean_covers_the_same_time_at_any_rate(rate: int) -> None:
    """Readings step from straight to half bent: b settles after 0.1 s, and one sample or tick."""
    rig = Rig("paper")
    rig.start()
    begin = rig.n + 1
    taken = 0
    settled = []
    for n in range(begin, begin + 40):
        come = (n - begin + 1) * rate // 100 - taken
        taken += come
        rig.step(
            [
                (n * PERIOD - k / rate, 1600.0 + 3 * (k % 2), FREE + 3 * (k % 2))
                for k in reversed(range(come))
            ]
        )
        settled.append(rig.control.level[0, 0])
    reached = next(n for n, b in enumerate(settled) if abs(b - settled[-1]) < 0.01)
    averaging = ControlParams().conditioning.averaging_time
    patience = max(1 / rate, 2 * PERIOD) * 3
    assert averaging - 2 * PERIOD <= (reached + 1) * PERIOD <= averaging + patience


def test_T5_after_a_pause_it_does_not_resume() -> None:
    """The loop stood still for 5 s, then a person pressed arm: not in the tick of the wake-up."""
    ticker = armed()
    ticker.n += 500
    outputs = ticker.step(arm=True)
    assert outputs.state is State.FAULT
    assert not outputs.arming
    assert Cause.PAUSE in causes(outputs)
    assert all(o.state is State.FAULT for o in ticker.run(100))
    assert ticker.step(arm=True).arming


class Moody:
    """A controller that raises in some ticks."""

    def __init__(self, bad: set[int]) -> None:
        self._inner = make_controller("open", ControlParams())
        self._bad = bad
        self._n = 0

    def step(self, frame):
        self._n += 1
        if self._n in self._bad:
            raise RuntimeError(f"tick {self._n}")
        return self._inner.step(frame)

    def __getattr__(self, name: str):
        return getattr(self._inner, name)


@pytest.mark.parametrize("seed", range(5))
def test_T6_an_exception_holds_in_the_same_tick_and_three_are_a_fault(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bad = sorted((100 + rng.choice(500, 3, replace=False)).tolist())
    rig = Rig(control=Moody(set(bad)))
    rig.start()
    while rig.n < 700:
        tick = rig.n + 2
        rig.go(1)
        outputs = rig.outputs[-1]
        if tick in bad:
            assert outputs.state is (State.FAULT if tick == bad[-1] else State.HOLD)
            assert not outputs.move
            assert not outputs.feed_watchdog
            assert Cause.FAILED in causes(outputs)
            assert rig.pose_step() == 0
        elif tick < bad[-1]:
            assert outputs.state is State.OK
        else:
            assert outputs.state is State.FAULT
            assert Cause.REPEATED_FAILURES in causes(outputs)
