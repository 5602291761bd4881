"""Streams of frames: every fault of the link that reaches the decoder."""

from __future__ import annotations

import math
import sys
import time
import tracemalloc
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from esp32_streams import (
    BOOT_TEXTS,
    encoded,
    framed,
    frames_of,
    hello,
    made,
    with_bit_errors,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import LONGEST, TEXT_KEPT, Counters, Frame, FrameDecoder, Sample


def closed(counters: Counters, held: int) -> bool:
    return counters.delimiters + counters.judged + held == counters.received


def noisy(rate: float, count: int) -> None:
    """All intact frames and no false one, in order."""
    samples = [made(i) for i in range(count)]
    sent = frames_of(samples)
    arrived = with_bit_errors(sent, rate, np.random.default_rng(7))
    intact = np.all(arrived == sent, axis=1)
    decoder = FrameDecoder()
    delivered = decoder.feed(arrived.tobytes())
    assert delivered == [samples[i] for i in np.flatnonzero(intact)]
    assert 0 < len(delivered) < len(samples)
    assert decoder.counters.good == len(delivered)
    assert decoder.counters.received == sent.size
    assert closed(decoder.counters, decoder.held)


@pytest.mark.parametrize("rate", [1e-5, 1e-4, 1e-3, 1e-2])
def test_L1_random_bit_errors(rate: float) -> None:
    noisy(rate, 10_000)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1e-5, 1e-4, 1e-3, 1e-2])
def test_L1_random_bit_errors_in_a_million_frames(rate: float) -> None:
    noisy(rate, 1_000_000)


@pytest.mark.parametrize("rate", [1e-3, 1e-2])
@pytest.mark.parametrize("kind", ["lost", "doubled", "inserted"])
def test_L2_lost_doubled_and_inserted_bytes(kind: str, rate: float) -> None:
    """Every untouched frame arrives, nothing false does, nothing twice."""
    rng = np.random.default_rng(8)
    samples = [made(i) for i in range(8_000)]
    sent = frames_of(samples)
    hit = rng.random(sent.size) < rate
    if kind == "inserted":
        places = np.flatnonzero(hit)
        arrived = np.insert(sent.reshape(-1), places, rng.integers(0, 256, places.size))
        hit[places[places > 0] - 1] = True  # what stands before a place is touched as well
    else:
        arrived = np.repeat(sent.reshape(-1), np.where(hit, 0 if kind == "lost" else 2, 1))
    untouched = ~hit.reshape(sent.shape).any(axis=1)
    decoder = FrameDecoder()
    delivered = decoder.feed(arrived.astype(np.uint8).tobytes())
    numbers = [found.seq for found in delivered if isinstance(found, Sample)]
    assert delivered == [samples[i] for i in numbers]
    assert set(np.flatnonzero(untouched).tolist()) <= set(numbers)
    assert sorted(set(numbers)) == numbers
    assert np.count_nonzero(~untouched) > 100
    assert closed(decoder.counters, decoder.held)


def mixed_stream() -> bytes:
    good = [encoded(made(i)) for i in range(8)]
    return b"".join(
        [
            *good[:2],
            BOOT_TEXTS[0],
            hello(),
            good[2],
            good[3][:11],
            good[4],
            b"\x05\x11\x00",
            bytes(range(1, 256)),
            good[5],
            BOOT_TEXTS[1],
            framed(b"\x09\x02 a newer protocol"),
            good[6],
            good[7][:20],
        ]
    )


def outcome(pieces: list[bytes]) -> tuple[list[Frame], Counters, str, int]:
    decoder = FrameDecoder()
    frames = [found for piece in pieces for found in decoder.feed(piece)]
    return frames, decoder.counters, decoder.take_text(), decoder.held


def test_L3_any_split_of_the_stream_gives_the_same() -> None:
    """Every single cut, every piece size from 1 on, and 10 000 random splittings."""
    stream = mixed_stream()
    whole = outcome([stream])
    assert len(whole[0]) == 8
    size = len(stream)
    splits = [[stream[:i], stream[i:]] for i in range(size)]
    splits += [[stream[i : i + n] for i in range(0, size, n)] for n in range(1, size + 1)]
    rng = np.random.default_rng(3)
    for _ in range(10_000):
        cuts = [0, *np.sort(rng.integers(0, size, rng.integers(1, 12))).tolist(), size]
        splits.append([stream[a:b] for a, b in pairwise(cuts)])
    assert all(outcome(pieces) == whole for pieces in splits)


def endless(megabytes: int) -> None:
    """Memory stays below 1 KiB, and the frame after the first delimiter arrives."""
    piece = np.random.default_rng(4).integers(1, 256, 1_000_000, dtype=np.uint8).tobytes()
    decoder = FrameDecoder()
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    most = 0
    for _ in range(megabytes):
        assert decoder.feed(piece) == []
        most = max(most, tracemalloc.get_traced_memory()[0] - before)
    tracemalloc.stop()
    assert most <= 1024
    assert decoder.held < LONGEST
    assert len(decoder.take_text()) <= TEXT_KEPT
    assert decoder.feed(encoded(made(1)) + encoded(made(2))) == [made(1), made(2)]
    assert decoder.counters.oversize == 1
    assert decoder.counters.judged == 1_000_000 * megabytes + 2 * (len(encoded(made(1))) - 2)
    assert closed(decoder.counters, decoder.held)


def test_L4_endless_garbage_without_a_delimiter() -> None:
    endless(10)


@pytest.mark.slow
def test_L4_a_hundred_megabytes_of_garbage() -> None:
    endless(100)


def test_L5_boot_texts_and_panics_in_mid_stream() -> None:
    """10 000 splices: only the frame that was cut is lost, and the text can be read."""
    rng = np.random.default_rng(5)
    decoder = FrameDecoder()
    size = frame.SAMPLE_FRAME_SIZE
    marks = ("POWERON_RESET", "Brownout detector", "Guru Meditation", "in colour", "ENOMEM")
    for _ in range(10_000):
        samples = [made(i) for i in rng.integers(0, 2**32, 3).tolist()]
        which, at = int(rng.integers(len(BOOT_TEXTS))), int(rng.integers(3 * size + 1))
        stream = b"".join(map(encoded, samples))
        delivered = decoder.feed(stream[:at] + BOOT_TEXTS[which] + stream[at:] + b"\0")
        whole, cut = divmod(at, size)
        expected = samples[:whole] + samples[whole + (cut > 0) :]
        assert delivered == expected
        text = decoder.take_text()
        assert marks[which] in text
        assert len(text) <= TEXT_KEPT
        assert text.isascii()
        assert "\x1b" not in text
    assert closed(decoder.counters, decoder.held)


def test_L5_text_between_frames_is_counted_as_text() -> None:
    decoder = FrameDecoder()
    decoder.feed(encoded(made(1)) + BOOT_TEXTS[1] + encoded(made(2)))
    assert decoder.counters.text == 1
    assert decoder.counters.judged == len(BOOT_TEXTS[1]) + 2 * (len(encoded(made(1))) - 2)
    assert decoder.take_text() == BOOT_TEXTS[1].decode().replace("\r", "")
    assert decoder.take_text() == ""


def test_L5_a_flood_of_text_is_bounded() -> None:
    decoder = FrameDecoder()
    decoder.feed(b"a line of text\n" * 1000)
    text = decoder.take_text()
    assert text.startswith("a line of text\na line")
    assert len(text) == TEXT_KEPT
    assert decoder.take_text() == ""
    assert closed(decoder.counters, decoder.held)


@settings(max_examples=300)
@given(st.lists(st.binary(max_size=300), max_size=8))
def test_L6_hostile_bytes_raise_nothing(pieces: list[bytes]) -> None:
    decoder = FrameDecoder()
    for piece in pieces:
        assert decoder.feed(piece) == []
    assert closed(decoder.counters, decoder.held)


def test_L6_mutated_frames_raise_nothing() -> None:
    """2 MB of frames with bytes replaced, and intact frames with hostile bodies."""
    rng = np.random.default_rng(6)
    samples = [made(i) for i in range(70_000)]
    sent = frames_of(samples).reshape(-1).copy()
    hit = rng.random(sent.size) < 0.2
    sent[hit] = rng.integers(0, 256, int(hit.sum()))
    decoder = FrameDecoder()
    delivered = decoder.feed(sent.tobytes())
    assert set(delivered) <= set(samples)
    assert closed(decoder.counters, decoder.held)


SAMPLES = [made(i) for i in range(30_000)]


def hostile(megabytes: int) -> Iterator[bytes]:
    """Noise, damaged frames and storms of delimiters by turns, a megabyte each."""
    rng = np.random.default_rng(9)
    whole = frames_of(SAMPLES).reshape(-1)
    for number in range(megabytes):
        if number % 3 == 0:
            yield rng.bytes(1_000_000)
        elif number % 3 == 1:
            hit = rng.random(whole.size) < rng.uniform(0.001, 0.2)
            piece = np.where(hit, rng.integers(0, 256, whole.size), whole).astype(np.uint8)
            yield piece.tobytes()[:1_000_000].ljust(1_000_000, b"\1")
        else:
            yield rng.choice(np.array([0, 0, 1, 2, 12, 255], np.uint8), 1_000_000).tobytes()


def flood(megabytes: int) -> float:
    """Speed of the slowest megabyte [MB/s]."""
    known, decoder, slowest = set(SAMPLES), FrameDecoder(), math.inf
    for piece in hostile(megabytes):
        begin = time.process_time()
        delivered = decoder.feed(piece)
        slowest = min(slowest, 1.0 / max(time.process_time() - begin, 1e-9))
        assert known.issuperset(delivered)
        assert decoder.held < LONGEST
        assert len(decoder.take_text()) <= TEXT_KEPT
    assert decoder.counters.received == 1_000_000 * megabytes
    assert decoder.counters.good > 1000
    assert closed(decoder.counters, decoder.held)
    return slowest


def test_L6_a_flood_of_hostile_bytes_delivers_nothing_false() -> None:
    flood(3)


@pytest.mark.slow
def test_L6_a_hundred_million_hostile_bytes() -> None:
    slowest = flood(100)
    sys.stdout.write(f"slowest {slowest:.2f} MB/s\n")
    assert slowest >= 0.2


@pytest.mark.parametrize("megabytes", [3, pytest.param(30, marks=pytest.mark.slow)])
def test_L6_decoding_allocates_at_most_64_KiB(megabytes: int) -> None:
    """In pieces as a port is read, a quarter of them; what is delivered is included."""
    decoder, worst = FrameDecoder(), 0
    tracemalloc.start()
    try:
        for whole in hostile(megabytes):
            for at in range(0, len(whole), 4 * 4096):
                piece = whole[at : at + 4096]
                tracemalloc.reset_peak()
                before, _ = tracemalloc.get_traced_memory()
                decoder.feed(piece)
                worst = max(worst, tracemalloc.get_traced_memory()[1] - before)
            decoder.take_text()
    finally:
        tracemalloc.stop()
    sys.stdout.write(f"at most {worst} bytes\n")
    assert 4096 < worst <= 65_536


@given(st.binary(min_size=2, max_size=100))
def test_L6_an_intact_frame_with_any_body_is_judged_not_trusted(body: bytes) -> None:
    found = FrameDecoder().feed(framed(body))
    assert len(found) == 1
    if isinstance(found[0], Sample):
        assert max(found[0].left, found[0].right) <= 4095
