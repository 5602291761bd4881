"""Signed datagrams: the tag is HMAC-SHA-256, and nothing forged, old or too much comes through."""

from __future__ import annotations

import hashlib
import hmac
from itertools import pairwise

import numpy as np
import pytest
from esp32_streams import encoded, hello, made

from antennate.hardware.esp32 import datagram, frame
from antennate.hardware.ports.network import Bucket, Verifier
from antennate.params.hardware import NetworkParams

KEY = bytes(range(32))
NONCE = bytes(range(16, 32))

# RFC 4231, test cases 1 to 4, 6 and 7: key, data, HMAC-SHA-256
RFC_4231 = [
    (b"\x0b" * 20, b"Hi There", "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7"),
    (
        b"Jefe",
        b"what do ya want for nothing?",
        "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843",
    ),
    (
        b"\xaa" * 20,
        b"\xdd" * 50,
        "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe",
    ),
    (
        bytes(range(1, 26)),
        b"\xcd" * 50,
        "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b",
    ),
    (
        b"\xaa" * 131,
        b"Test Using Larger Than Block-Size Key - Hash Key First",
        "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54",
    ),
    (
        b"\xaa" * 131,
        b"This is a test using a larger than block-size key and a larger than block-size data. "
        b"The key needs to be hashed before being used by the HMAC algorithm.",
        "9b09ffa71b942fcb27635fbcd5b0e944bfdc63644f0713938a7f51535c3a35e2",
    ),
]


class Air:
    """A board and a host that hear each other, without a network."""

    def __init__(self, key: bytes = KEY, boot: int = 5, **params: float) -> None:
        self.host = Verifier(KEY, NONCE, NetworkParams(**params))  # pyright: ignore[reportArgumentType]
        self.board = datagram.Speaker(
            datagram.Signer(key), boot, hello(boot), frame.SAMPLE_FRAME_SIZE
        )
        self.boot = boot
        self.said: list[bytes] = []

    def greet(self) -> None:
        """Ask twice: who is there, then with what it said."""
        for _ in range(2):
            answer = self.board.answer(self.host.ask(), "host", 0)
            assert answer is not None
            self.said.append(answer)
            self.host.take(answer, 0.0)

    def frame(self, seq: int) -> bytes:
        """A datagram."""
        signed = self.board.sign(encoded(made(seq, boot=self.boot)), 0)
        assert signed is not None
        self.said.append(bytes(signed))
        return bytes(signed)


@pytest.mark.parametrize(("key", "data", "expected"), RFC_4231)
def test_the_tag_is_that_of_the_standard(key: bytes, data: bytes, expected: str) -> None:
    assert datagram.Signer(key).digest(data).hex() == expected


def test_the_tag_is_that_of_python_for_every_length_of_key_and_text() -> None:
    rng = np.random.default_rng(1)
    for size in range(200):
        key, data = rng.bytes(size), rng.bytes(3 * size)
        expected = hmac.new(key, data, hashlib.sha256).digest()
        signer = datagram.Signer(key)
        assert signer.digest(data[:size], data[size:]) == expected
        assert signer.tag(data) == expected[:16]


def test_tags_are_the_same_only_if_every_bit_is() -> None:
    tag = bytes(range(16))
    assert datagram.same(tag, bytes(tag))
    assert not datagram.same(tag, tag[:15])
    for bit in range(128):
        other = bytearray(tag)
        other[bit // 8] ^= 1 << bit % 8
        assert not datagram.same(tag, bytes(other))


def forge(count: int) -> None:
    """Noise of the right size, flipped bits, tags of other keys, cut and longer ones."""
    air, rng = Air(), np.random.default_rng(2)
    air.greet()
    good = air.frame(0)
    other = datagram.Signer(bytes(32))
    for n in range(count):
        kind = n % 4
        bad = bytearray(good)
        if kind == 0:
            bad[:] = rng.bytes(len(good) if n % 8 else 60)
        elif kind == 1:
            bit = n // 4 % (8 * len(good))
            bad[bit // 8] ^= 1 << bit % 8
        elif kind == 2:
            content = encoded(made(n, boot=air.boot))
            bad[:] = content + other.tag(datagram.FRAME, NONCE, content)
        else:
            bad = bad[: n % len(good)] if n % 8 == 3 else bad + b"\0"
        assert air.host.take(bytes(bad), 0.0) == (b"", False)
    tally = air.host.tally
    assert (tally.forged, tally.frames) == (count, 0)
    assert air.host.take(good, 0.0) == (good[:-16], False)


def test_X14_no_forged_datagram_is_accepted() -> None:
    forge(100_000)


@pytest.mark.slow
def test_X14_no_forged_datagram_of_a_million_is_accepted() -> None:
    forge(1_000_000)


def test_X14_a_greeting_cannot_be_forged_either() -> None:
    air = Air(key=bytes(32))
    assert air.board.answer(air.host.ask(), "host", 0) is None
    air = Air()
    answer = air.board.answer(air.host.ask(), "host", 0)
    assert answer is not None
    for bit in range(8 * len(answer)):
        bad = bytearray(answer)
        bad[bit // 8] ^= 1 << bit % 8
        assert air.host.take(bytes(bad), 0.0) == (b"", False)
    assert air.host.take(answer, 0.0) == (hello(5), True)


def test_X15_a_whole_session_played_again_is_not_accepted() -> None:
    """To a later connection, to the same one, and after the board has started anew."""
    air = Air(rate=1e5)
    air.greet()
    for seq in range(3000):
        frame_, _ = air.host.take(air.frame(seq), seq * 0.01)
        assert frame_ == encoded(made(seq, boot=5))
    session = list(air.said)
    later = Verifier(KEY, bytes(16), NetworkParams())
    later.ask()
    reborn = Air(boot=6)
    reborn.host = air.host
    reborn.greet()
    assert air.host.take(reborn.frame(0), 31.0)[0]
    for data in session:
        assert later.take(data, 32.0) == (b"", False)
        assert air.host.take(data, 32.0) == (b"", False)
    assert later.tally.forged == len(session)
    assert air.host.tally.old == len(session)
    assert air.host.take(reborn.frame(1), 33.0)[0]


def test_L7_X15_only_newer_frames_of_this_boot_are_handed_on() -> None:
    """10 % lost, 5 % swapped, 5 % doubled: each once, and in order."""
    air, rng = Air(rate=1e5), np.random.default_rng(7)
    air.greet()
    kept = np.flatnonzero(rng.random(20_000) >= 0.1)
    for i in np.flatnonzero(rng.random(kept.size - 1) < 0.05).tolist():
        kept[[i, i + 1]] = kept[[i + 1, i]]
    order = np.repeat(kept, 1 + (rng.random(kept.size) < 0.05)).tolist()
    used = [seq for n, seq in enumerate(order) if air.host.take(air.frame(seq), n * 0.01)[0]]
    assert all(a < b for a, b in pairwise(used))
    assert len(used) > 0.9 * kept.size
    assert air.host.tally.old == len(order) - len(used)


def test_sequence_numbers_wrap() -> None:
    air = Air()
    air.greet()
    for seq in (2**32 - 2, 2**32 - 1, 2**32, 2**32 + 1):
        assert air.host.take(air.frame(seq), 0.0)[0]
    assert not air.host.take(air.frame(2**32 - 1), 0.0)[0]


def test_a_grant_needs_the_boards_count_and_each_is_worth_one() -> None:
    air = Air()
    air.greet()
    ask = air.host.ask()
    assert air.board.answer(ask, "host", 1000) is not None
    assert air.board.answer(ask, "thief", 1001) is not None
    assert air.board.listener == "host"
    sample = encoded(made(0))
    assert air.board.sign(sample, 3000) is not None  # LEASE_MS after the last grant
    assert air.board.sign(sample, 3001) is None


def test_answers_that_come_late_still_count() -> None:
    """Latency of 1 s, four asks under way: as WiFi power saving has it."""
    air, due = Air(), []
    granted = 0.0
    for n in range(400):
        now = n * 0.01
        if (ask := air.host.due_ask(now)) is not None:
            answer = air.board.answer(ask, "host", round(1e3 * now))
            due.append((now + 1.0, answer))
        while due and due[0][0] <= now:
            air.host.take(due.pop(0)[1], now)
        if air.board.listener is not None and not granted:
            granted = now
    assert 0.0 < granted < 1.5
    assert air.host.tally.greetings >= 10


def test_X17_authentic_frames_are_limited_to_their_rate() -> None:
    air = Air()
    air.greet()
    for seq in range(20_000):  # 10 000 a second
        air.host.take(air.frame(seq), seq * 1e-4)
    assert air.host.tally.frames == pytest.approx(512 + 1000 * 2.0, abs=2)
    assert air.host.tally.limited == 20_000 - air.host.tally.frames


def test_a_bucket_is_never_fuller_than_its_depth_and_ignores_time_that_steps_back() -> None:
    bucket = Bucket(10.0, 3)
    assert [bucket.take(100.0) for _ in range(4)] == [True, True, True, False]
    assert [bucket.take(50.0), bucket.take(100.05), bucket.take(100.11)] == [False, False, True]
    assert [bucket.take(900.0) for _ in range(4)] == [True, True, True, False]
