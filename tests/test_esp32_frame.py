"""One frame at a time: published codes, its layout, and what an intact frame may not say."""

from __future__ import annotations

import dataclasses
import struct
import zlib

import pytest
from esp32_streams import BOOT, encoded, framed, hello
from hypothesis import given
from hypothesis import strategies as st

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import (
    FrameDecoder,
    Hello,
    Refused,
    Reset,
    Sample,
    objections,
    parse,
)


def span(first: int, last: int) -> bytes:
    return bytes(range(first, last + 1))


COBS = [
    (b"\x00", b"\x01\x01"),
    (b"\x00\x00", b"\x01\x01\x01"),
    (b"\x00\x11\x00", b"\x01\x02\x11\x01"),
    (b"\x11\x22\x00\x33", b"\x03\x11\x22\x02\x33"),
    (b"\x11\x22\x33\x44", b"\x05\x11\x22\x33\x44"),
    (b"\x11\x00\x00\x00", b"\x02\x11\x01\x01\x01"),
    (span(0x01, 0xFE), b"\xff" + span(0x01, 0xFE)),
    (b"\x00" + span(0x01, 0xFE), b"\x01\xff" + span(0x01, 0xFE)),
    (span(0x01, 0xFF), b"\xff" + span(0x01, 0xFE) + b"\x02\xff"),
    (span(0x02, 0xFF) + b"\x00", b"\xff" + span(0x02, 0xFF) + b"\x01\x01"),
    (span(0x03, 0xFF) + b"\x00\x01", b"\xfe" + span(0x03, 0xFF) + b"\x02\x01"),
]
"""Examples published with the algorithm (Cheshire and Baker)."""


@pytest.mark.parametrize(("plain", "code"), COBS)
def test_cobs_gives_the_published_examples(plain: bytes, code: bytes) -> None:
    target = bytearray(len(code))
    assert frame.stuff_into(target, 0, bytearray(plain)) == len(code)
    assert bytes(target) == code
    assert frame.unstuff(code) == plain


@pytest.mark.parametrize("code", [b"", b"\x02", b"\x05\x11\x22", b"\x03\x11\x00"])
def test_what_is_not_cobs_is_told(code: bytes) -> None:
    assert frame.unstuff(code) is None


@given(st.binary(max_size=600))
def test_cobs_comes_back_without_a_zero_and_with_at_most_a_byte_in_254_more(plain: bytes) -> None:
    target = bytearray(len(plain) + len(plain) // 254 + 1)
    length = frame.stuff_into(target, 0, bytearray(plain))
    code = bytes(target[:length])
    assert 0 not in code
    assert frame.unstuff(code) == plain


def test_the_crc_is_that_of_the_check_value() -> None:
    """0xCBF43926 of "123456789" is how CRC-32 is told from its relatives."""
    assert frame.crc32(b"123456789") == 0xCBF43926


def test_a_sample_is_laid_out_as_written() -> None:
    sample = Sample(BOOT, 0x01020304, 0x3FFFFFFF, 4095, 0, 5, 258)
    wire = encoded(sample)
    assert wire[0] == wire[-1] == 0
    assert len(wire) == frame.SAMPLE_FRAME_SIZE == 28
    content = frame.unstuff(wire[1:-1])
    assert content is not None
    body = b"\x01\x02\xcd\xab\x34\x12\x04\x03\x02\x01\xff\xff\xff\x3f\xff\x0f\x00\x00\x05\x02\x01"
    assert content == body + zlib.crc32(body).to_bytes(4, "little")
    assert FrameDecoder().feed(wire) == [sample]


def test_a_hello_says_who_speaks() -> None:
    assert FrameDecoder().feed(hello(reset=3)) == [
        Hello(
            boot_id=BOOT,
            firmware=frame.FIRMWARE,
            reset=Reset.WATCHDOG,
            config_hash=zlib.crc32(bytes([100, 0, 15, 0, 34, 35])),
            device_id="240ac40102030000",
            tick_bits=30,
            rate=100,
        )
    ]


def refusal(body: bytes) -> str:
    decoder = FrameDecoder()
    (found,) = decoder.feed(framed(body))
    assert isinstance(found, Refused)
    assert decoder.counters.refused == 1
    assert decoder.counters.good == decoder.held == 0
    return found.reason


def test_E8_another_protocol_version_is_refused_and_both_are_named() -> None:
    for body in (bytes([2, frame.SAMPLE]) + bytes(19), bytes([2, 77]), bytes([2, 1]) + b"x" * 90):
        assert "version 2, this host version 1" in refusal(body)


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (b"\x01\x01", "has 25 bytes, found 2"),
        (b"\x01\x63", "kind 99 is unknown, valid are 1, 2 and 5"),
        (b"\x01\x02" + bytes(18), "has 21 bytes, found 20"),
        (struct.pack("<BBIIIHHBH", 1, 2, 0, 0, 0, 4096, 3, 0, 0), "at most 4095, found 4096 and 3"),
        (struct.pack("<BBI4BI8sBH", 1, 1, 0, 0, 1, 0, 1, 0, b"", 30, 0), "at least 1 Hz, found 0"),
        (struct.pack("<BBI4BI8sBH", 1, 1, 0, 0, 1, 0, 1, 0, b"", 64, 9), "16 to 32 bits, found 64"),
    ],
)
def test_E8_what_cannot_be_used_says_why(body: bytes, says: str) -> None:
    assert says in refusal(body)


@pytest.mark.parametrize("body", [b"", b"\x01"])
def test_E8_a_body_without_version_and_kind_is_noise(body: bytes) -> None:
    decoder = FrameDecoder()
    assert decoder.feed(framed(body)) == []
    assert decoder.counters.judged == len(body) + 5


def test_E8_an_unknown_reset_reason_stays_unknown() -> None:
    found = parse(struct.pack("<BBI4BI8sBH", 1, 1, 0, 0, 1, 0, 200, 0, b"", 30, 100))
    assert isinstance(found, Hello)
    assert found.reset is Reset.UNKNOWN


def test_E8_old_firmware_and_other_settings_are_objected_to() -> None:
    (board,) = FrameDecoder().feed(hello())
    assert isinstance(board, Hello)
    assert objections(board) == ()
    assert objections(board, board.config_hash) == ()
    (settings_differ,) = objections(board, 0xDEADBEEF)
    assert "deadbeef" in settings_differ
    assert f"{board.config_hash:08x}" in settings_differ
    (old,) = objections(dataclasses.replace(board, firmware=(0, 0, 9)))
    assert "0.0.9" in old
    assert ".".join(map(str, frame.FIRMWARE)) in old
