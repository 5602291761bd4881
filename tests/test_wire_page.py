"""A reader built from docs/wire.md alone reads what our boards and datagrams hold."""

from __future__ import annotations

import hashlib
import hmac
import re
import struct
import zlib
from pathlib import Path
from typing import Any

from antennate.hardware.esp32 import datagram, frame

PAGE = (Path(__file__).parents[1] / "docs" / "wire.md").read_text()
BOOT = 0x5EED0001
TYPES = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i16": "h"}


def fields_of(title: str) -> dict[str, str]:
    """Field and type of each row of the table under a title."""
    section = re.search(rf"^###? {title}\n(.*?)(?=^##|\Z)", PAGE, re.M | re.S)
    assert section, title
    return dict(re.findall(r"^\| `(\w+)` \| ([a-z]+\d* ?\d*) \|", section[1], re.M))


def read(title: str, body: bytes) -> dict[str, Any]:
    """What a body says; its size must be that of the table."""
    table = fields_of(title)
    codes = [TYPES.get(kind) or f"{kind.removeprefix('bytes ')}s" for kind in table.values()]
    return dict(zip(table, struct.unpack("<" + "".join(codes), body), strict=True))


def bodies(stream: bytes) -> list[bytes]:
    """What intact frames hold, without their CRC."""
    found = []
    for coded in filter(None, stream.split(b"\0")):
        plain, at = b"", 0
        while at < len(coded):
            code = coded[at]
            plain += coded[at + 1 : at + code] + (b"\0" if code < 255 else b"")
            at += code
        plain = plain[:-1] if coded and code < 255 else plain
        if zlib.crc32(plain[:-4]) == int.from_bytes(plain[-4:], "little"):
            found.append(plain[:-4])
    return found


def example(name: str) -> bytes:
    block = re.search(rf"```{name}\n(.*?)\n```", PAGE, re.S)
    assert block, name
    return bytes.fromhex(block[1])


def hello() -> bytes:
    settings = zlib.crc32(struct.pack("<HHBB", 100, 15, 34, 35))
    return frame.encode_hello(BOOT, 1, settings, bytes.fromhex("a1b2c3d4e5f60000"), 100)


def sample() -> bytes:
    buffer = bytearray(frame.SAMPLE_FRAME_SIZE)
    frame.SampleEncoder(BOOT).encode_sample_into(buffer, 7, 1_070_312, 1650, 4095, 2, 0)
    return bytes(buffer)


FELT = (0, -2, 29, 120, 0, 4098)


def motion() -> bytes:
    encoder = frame.SampleEncoder(BOOT, motion=True)
    buffer = bytearray(encoder.size)
    encoder.encode_sample_into(buffer, 7, 1_070_312, 1650, 4095, 2, 0, FELT, 3)
    return bytes(buffer)


def test_the_examples_are_what_the_board_sends() -> None:
    assert example("hello") == hello()
    assert example("sample") == sample()
    assert example("request") == frame.encode_request()
    assert example("motion") == motion()


def test_a_reader_made_from_the_tables_reads_an_inertial_sensor() -> None:
    reading = read("MOTION", *bodies(motion()))
    names = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
    assert tuple(reading[name] for name in names) == FELT
    assert reading["misses"] == 3
    plain = read("SAMPLE", *bodies(sample()))
    assert all(reading[name] == plain[name] for name in plain if name != "kind")


def test_a_reader_made_from_the_tables_reads_a_stream_with_boot_text_and_damage() -> None:
    damaged = bytearray(sample())
    damaged[9] ^= 1
    stream = b"rst:0x1 (POWERON_RESET)\r\n" + hello() + bytes(damaged) + sample()
    first, second = bodies(stream)
    greeting, reading = read("HELLO", first), read("SAMPLE", second)
    assert greeting["boot_id"] == BOOT
    assert greeting["reset"] == 1
    assert greeting["rate"] == 100
    assert greeting["tick_bits"] == 30
    assert greeting["config_hash"] == frame.config_hash(100, 15, 34, 35)
    assert reading == {
        "version": 1,
        "kind": 2,
        "boot_id": BOOT,
        "seq": 7,
        "ticks": 1_070_312,
        "left": 1650,
        "right": 4095,
        "flags": frame.FLAG_RIGHT_RAIL,
        "drops": 0,
    }
    assert read("REQUEST", *bodies(example("request"))) == {"version": 1, "kind": 3}


def test_a_host_made_from_the_page_is_granted_frames_over_udp() -> None:
    key, nonce = bytes(range(32)), bytes(range(16))
    board = datagram.Speaker(datagram.Signer(key), BOOT, hello(), frame.SAMPLE_FRAME_SIZE)

    def tag(*parts: bytes) -> bytes:
        return hmac.new(key, b"".join(parts), hashlib.sha256).digest()[:16]

    def ask(number: int, boot_id: int, count: int) -> bytes:
        sizes = {"u8": 1, "u32": 4}
        given = {"version": 1, "kind": 4, "number": number, "boot_id": boot_id, "count": count}
        content = b""
        for name, kind in fields_of("ASK").items():
            size = sizes.get(kind) or int(kind.removeprefix("bytes "))
            content += nonce if name == "nonce" else given.get(name, 0).to_bytes(size, "little")
        return content + tag(b"A", content)

    answer = board.answer(ask(1, 0, 0), "host", 0)
    assert answer is not None
    content, seal = answer[:-16], answer[-16:]
    assert seal == tag(b"G", nonce, content)
    number, count = struct.unpack("<II", content[-8:])
    assert number == 1
    assert board.sign(sample(), 0) is None

    board.answer(ask(2, read("HELLO", *bodies(content[:-8]))["boot_id"], count), "host", 0)
    signed = board.sign(sample(), 1999)
    assert signed is not None
    assert bytes(signed) == sample() + tag(b"F", nonce, sample())
