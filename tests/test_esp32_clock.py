"""The board's clock: wraps, outages, resets and lies, in invented time."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from esp32_streams import BOOT, BOOT_TEXTS, encoded, hello, made

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.clock import DeviceClock, SampleState, Sequence
from antennate.hardware.esp32.wire import FrameDecoder, Hello, Reset, Sample

PERIOD = 10_000
STALE = 0.05
"""Age beyond which no decision may rest on a sample [s]."""


def greeting(boot: int = BOOT, tick_bits: int = 30, reset: int = 1) -> Hello:
    (found,) = FrameDecoder().feed(hello(boot, tick_bits=tick_bits, reset=reset))
    assert isinstance(found, Hello)
    return found


def ready(tick_bits: int = 30) -> DeviceClock:
    clock = DeviceClock()
    assert clock.greet(greeting(tick_bits=tick_bits))
    return clock


def sample(seq: int, ticks: int, tick_bits: int = 30, boot: int = BOOT) -> Sample:
    """Sample of unwrapped number and time [us]."""
    return dataclasses.replace(made(seq, boot=boot), ticks=ticks % (1 << tick_bits))


def steady(clock: DeviceClock, first: int, count: int, late: float = 0.001) -> None:
    """Samples on time: number n is taken at n periods and arrives this much later [s]."""
    for n in range(first, first + count):
        assert clock.take(sample(n, n * PERIOD), n * 0.01 + late) is SampleState.USED


@pytest.mark.parametrize("loss", [0.0, 0.4])
@pytest.mark.parametrize("bits", [30, 32])
def test_E4_ticks_wrap(bits: int, loss: float) -> None:
    """From 1 s before a wrap: the unwrapped time is exact, and no sample is refused or old."""
    rng = np.random.default_rng(1)
    clock = ready(bits)
    start = (1 << bits) - 1_000_000
    first = None
    for n in range(300):
        if n and rng.random() < loss:
            continue
        ticks = start + n * PERIOD + int(rng.integers(0, 500))
        first = ticks if first is None else first
        now = (ticks - start) * 1e-6 + rng.uniform(0, 0.004)
        assert clock.take(sample(n, ticks, bits), now) is SampleState.USED
        assert clock.newest is not None
        assert clock.newest.elapsed_us == ticks - first
        assert n < 50 or clock.age(now) < STALE
    assert clock.epoch == 1


def test_E4_sequence_numbers_wrap() -> None:
    clock = ready()
    first = 2**32 - 100
    steady(clock, first, 300)
    assert clock.newest is not None
    assert clock.newest.seq == first + 299
    assert clock.sequence.lost == 0


@pytest.mark.parametrize(("bits", "wraps"), [(30, 80), (32, 20)])
@pytest.mark.slow
def test_E4_a_day_with_99_of_100_samples_lost(bits: int, wraps: int) -> None:
    """24 h cross 80 wraps of 2**30 us and 20 of 2**32 us without an error."""
    clock = ready(bits)
    before = -1
    for n in range(0, 8_640_000, 100):
        state = clock.take(sample(n, n * PERIOD, bits), n * 0.01)
        assert state is SampleState.USED
        assert clock.newest is not None
        assert clock.newest.elapsed_us == n * PERIOD > before
        before = clock.newest.elapsed_us
    assert before >> bits == wraps
    assert clock.epoch == 1


@pytest.mark.parametrize("minutes", [18.0, 2**30 / 60e6, 2 * 2**30 / 60e6 + 0.02, 60.0, 600.0])
def test_E5_a_wrap_hidden_by_an_outage(minutes: float) -> None:
    """The time base begins anew, and ages are believed again within 1 s."""
    clock = ready()
    steady(clock, 0, 100)
    later = 100 + round(minutes * 6000)
    assert clock.take(sample(later, later * PERIOD), later * 0.01 + 0.001) is SampleState.USED
    assert clock.epoch == 2
    assert clock.newest is not None
    assert clock.newest.elapsed_us == 0
    assert clock.age(later * 0.01 + 0.001) == math.inf
    steady(clock, later + 1, 20)
    assert clock.age((later + 20) * 0.01 + 0.001) == pytest.approx(0, abs=1e-9)
    assert clock.newest.elapsed_us == 20 * PERIOD


def test_E5_a_shorter_outage_keeps_the_time() -> None:
    clock = ready()
    steady(clock, 0, 100)
    later = 8 * 6000
    steady(clock, later, 100)
    assert clock.epoch == 1
    assert clock.newest is not None
    assert clock.newest.elapsed_us == (later + 99) * PERIOD


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("drift", [-200e-6, 0.0, 200e-6])
def test_E6_ages_are_right_under_drift_and_jitter(drift: float, seed: int) -> None:
    """Within 2 ms after 60 s, with delays of 0 to 20 ms; the shortest delay cannot be seen."""
    rng = np.random.default_rng(seed)
    clock = ready()
    worst = 0.0
    arrival = 0.0
    for n in range(12_000):
        taken = n * 0.01
        arrival = max(arrival, taken + rng.uniform(0, 0.02))
        state = clock.take(sample(n, round(n * PERIOD * (1 + drift))), arrival)
        assert state is SampleState.USED
        if n >= 6000:
            worst = max(worst, abs(clock.age(arrival) - (arrival - taken)))
    assert worst < 0.002


@pytest.mark.parametrize(
    ("lie", "state"),
    [
        (lambda n: 100 * PERIOD, SampleState.FROZEN),
        (lambda n: n * PERIOD - 1_000_000, SampleState.BACK),
        (lambda n: n * PERIOD - 93_000, SampleState.BACK),
        (lambda n: n * PERIOD - 400_000_000, SampleState.BACK),
        (lambda n: n * PERIOD + 3_600_000_000, SampleState.AHEAD),
        (lambda n: n * PERIOD + 200_000, SampleState.AHEAD),
    ],
)
def test_E7_lies_of_the_boards_clock(lie, state: SampleState) -> None:
    """Refused at once; a steady lie becomes a new time base after ten samples, a stop never."""
    clock = ready()
    steady(clock, 0, 101)
    seen = []
    for n in range(101, 131):
        now = n * 0.01 + 0.001
        seen.append(clock.take(sample(n, lie(n)), now))
        if n == 106:
            assert clock.age(now) > STALE
    assert seen[:9] == [state] * 9
    assert clock.states[state] >= 9
    if state is SampleState.FROZEN:
        assert set(seen) == {state}
        assert clock.epoch == 1
    else:
        assert seen[9:] == [SampleState.USED] * 21
        assert clock.epoch == 2
        assert clock.age(130 * 0.01 + 0.001) < STALE


def test_E7_single_lies_do_no_harm() -> None:
    """Twenty of them begin no new time base, and later delays are no lies."""
    clock = ready()
    for n in range(0, 1000, 50):
        steady(clock, n, 49)
        assert clock.take(sample(n + 49, n * PERIOD), n * 0.01 + 0.491) is SampleState.BACK
    steady(clock, 1000, 50)
    assert clock.take(sample(1050, 1050 * PERIOD), 10.54) is SampleState.USED
    assert clock.newest is not None
    assert clock.newest.elapsed_us == 1050 * PERIOD
    assert clock.epoch == 1
    assert clock.age(10.54) == pytest.approx(0.039, abs=1e-3)


def test_E7_ticks_beyond_the_declared_modulus_are_refused() -> None:
    clock = ready()
    assert clock.take(dataclasses.replace(made(1), ticks=2**30), 0.0) is SampleState.OVERRANGE
    assert clock.newest is None


@pytest.mark.parametrize("stall", [0.1, 0.6, 2.0, 5.0])
def test_L10_old_samples_of_a_burst_are_known_to_be_old(stall: float) -> None:
    """After a stall all frames come at once; their ages are right to 5 ms."""
    clock = ready()
    steady(clock, 0, 200)
    end = 2.0 + stall
    for n in range(200, 200 + round(stall * 100)):
        clock.take(sample(n, n * PERIOD), end)
        assert clock.age(end) == pytest.approx(end - n * 0.01 - 0.001, abs=0.005)


@pytest.mark.parametrize("spread", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("rate", [100, 1000])
def test_L10_a_burst_at_the_start_is_not_believed_to_be_fresh(rate: int, spread: float) -> None:
    """A backlog of 2 s that drains at once or in a while: ages are right or not known."""
    clock = ready()
    told = 0
    for n in range(4 * rate):
        taken = n / rate
        now = max(taken, 2.0 + spread * taken / (2.0 + spread)) + 0.001
        clock.take(sample(n, round(taken * 1e6)), now)
        age = clock.age(now)
        assert age == math.inf or age == pytest.approx(now - taken - 0.001, abs=0.01)
        told += age < math.inf
    assert told > rate


def test_L9_ages_are_believed_after_ten_samples_and_50_ms() -> None:
    clock = ready()
    steady(clock, 0, 9)
    assert clock.age(0.081) == math.inf
    steady(clock, 9, 1)
    assert clock.age(0.091) == pytest.approx(0, abs=1e-9)
    clock = ready()
    for n in range(50):
        clock.take(sample(n, n * 1000), n * 0.001)
        assert clock.age(n * 0.001) == math.inf
    clock.take(sample(50, 50_000), 0.05)
    assert clock.age(0.05) == pytest.approx(0, abs=1e-9)


def test_a_silent_board_ages() -> None:
    clock = ready()
    assert clock.age(0.0) == math.inf
    steady(clock, 0, 100)
    assert clock.age(0.991 + 0.1) == pytest.approx(0.1, abs=1e-6)


@pytest.mark.slow
def test_L7_lost_doubled_and_swapped_datagrams() -> None:
    """10 % lost, 5 % swapped, 5 % doubled: each used once at most, never older after newer."""
    rng = np.random.default_rng(7)
    count = 100_000
    kept = np.flatnonzero(rng.random(count) >= 0.1)
    swapped = np.flatnonzero(rng.random(kept.size - 1) < 0.05)
    for i in swapped.tolist():
        kept[[i, i + 1]] = kept[[i + 1, i]]
    order = np.repeat(kept, 1 + (rng.random(kept.size) < 0.05))
    decoder, clock = FrameDecoder(), ready()
    used = []
    for n in order.tolist():
        (found,) = decoder.feed(encoded(sample(n, n * PERIOD)))
        assert isinstance(found, Sample)
        if clock.take(found, n * 0.01 + 0.03) is SampleState.USED:
            used.append(found.seq)
    assert used == sorted(set(used))
    assert len(used) > 0.9 * kept.size
    spread = kept.max() - kept[0] + 1
    assert clock.sequence.lost / spread == pytest.approx(1 - kept.size / count, abs=0.001)
    assert clock.states[SampleState.DUPLICATE] == pytest.approx(order.size - kept.size, abs=1)
    assert clock.states[SampleState.USED] + clock.states[SampleState.LATE] == pytest.approx(
        kept.size, abs=1
    )


def test_L7_the_window_tells_late_from_doubled() -> None:
    numbers = Sequence()
    assert numbers.place(100) is SampleState.USED
    assert numbers.place(100) is SampleState.DUPLICATE
    assert numbers.place(103) is SampleState.USED
    assert numbers.lost == 2
    assert numbers.place(101) is SampleState.LATE
    assert numbers.lost == 1
    assert numbers.place(101) is SampleState.DUPLICATE
    assert numbers.place(200) is SampleState.USED
    assert numbers.place(102) is SampleState.LATE
    assert numbers.place(137) is SampleState.LATE
    assert numbers.place(200) is SampleState.DUPLICATE
    assert numbers.received == 5


def test_E1_reset_in_mid_frame() -> None:
    """Cut at every byte, boot text, a new boot: used again at once, nothing old, reset counted."""
    whole = b"".join(encoded(made(n)) for n in range(50))
    size = frame.SAMPLE_FRAME_SIZE
    for cut in range(size + 1):
        decoder, clock = FrameDecoder(), ready()
        now = 0.0
        for found in decoder.feed(whole[: -size + cut] if cut < size else whole):
            assert isinstance(found, Sample)
            clock.take(found, found.ticks * 1e-6)
        now = 1.0
        old = made(49)
        again = [sample(n, n * PERIOD, boot=77) for n in range(20)]
        stream = BOOT_TEXTS[0] + encoded(again[0]) + hello(77, reset=3)
        for found in decoder.feed(stream):
            if isinstance(found, Hello):
                assert clock.greet(found)
                assert clock.newest is None
                assert clock.age(now) == math.inf
            elif isinstance(found, Sample):
                assert clock.take(found, now) is SampleState.OTHER_BOOT
        assert clock.resets == 1
        assert clock.last_reset is Reset.WATCHDOG
        for n, later in enumerate(again[1:], 1):
            assert clock.take(later, now + n * 0.01) is SampleState.USED
        assert clock.take(old, now + 0.2) is SampleState.OTHER_BOOT
        assert clock.epoch == 2
        assert clock.newest is not None
        assert clock.newest.sample == again[-1]
        assert clock.age(now + 0.2) < STALE


def test_E1_a_greeting_that_comes_late_does_not_bring_the_old_boot_back() -> None:
    clock = ready()
    assert not clock.greet(greeting())
    assert clock.greet(greeting(boot=5))
    assert not clock.greet(greeting())
    assert clock.take(made(1), 0.0) is SampleState.OTHER_BOOT
    assert clock.resets == 1


def test_E8_before_a_greeting_no_sample_is_used() -> None:
    clock = DeviceClock()
    for n in range(100):
        assert clock.take(made(n), n * 0.01) is SampleState.OTHER_BOOT
    assert clock.newest is None
    assert clock.age(1.0) == math.inf
