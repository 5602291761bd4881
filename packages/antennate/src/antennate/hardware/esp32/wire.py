"""From bytes of the antenna board to records: frames are found, checked and parsed.

There is no input or output here. However a stream is cut into pieces, the frames, the text and the
counters are the same.
"""

from __future__ import annotations

import re
import struct
from binascii import crc32
from dataclasses import dataclass
from enum import IntEnum

from antennate.errors import CalibrationError
from antennate.hardware.esp32 import frame

_SERIAL = re.compile("[0-9a-f]{16}")
"""A sensor id of this form is the serial number of a board."""


class Reset(IntEnum):
    """Why a board started. MicroPython cannot tell a brown-out from the other two it may report."""

    UNKNOWN = frame.RESET_UNKNOWN
    POWER_ON = frame.RESET_POWER_ON
    HARD = frame.RESET_HARD
    WATCHDOG = frame.RESET_WATCHDOG
    DEEP_SLEEP = frame.RESET_DEEP_SLEEP
    SOFT = frame.RESET_SOFT


@dataclass(frozen=True, slots=True)
class Hello:
    """A board's greeting.

    Attributes:
        boot_id: Random number of this boot.
        firmware: Version: major, minor, patch.
        config_hash: `frame.config_hash` of its settings.
        device_id: The chip's serial number in hexadecimal.
        tick_bits: Ticks count modulo 2**tick_bits.
        rate: Samples per second [Hz].
    """

    boot_id: int
    firmware: tuple[int, int, int]
    reset: Reset
    config_hash: int
    device_id: str
    tick_bits: int
    rate: int


@dataclass(frozen=True, slots=True)
class Sample:
    """One reading of both antennae.

    Attributes:
        boot_id: Boot it belongs to.
        seq: Number since boot, modulo 2**32.
        ticks: The board's time [us], modulo what HELLO declared.
        left: Left reading [counts]; so `right`.
        flags: Sum of `frame.FLAG_` values.
        drops: Samples the board could not send since boot, modulo 2**16.
        imu: Readings of its inertial sensor [counts], gyroscopes first, each `frame.IMU_NONE` where
            it did not answer; empty of a board without one.
        misses: Readings that it has not given since boot, modulo 2**16.
    """

    boot_id: int
    seq: int
    ticks: int
    left: int
    right: int
    flags: int
    drops: int
    imu: tuple[int, ...] = ()
    misses: int = 0


@dataclass(frozen=True, slots=True)
class Refused:
    """A frame that arrived intact and cannot be used."""

    reason: str


Frame = Hello | Sample | Refused
_SIZES = {
    frame.HELLO: frame.HELLO_SIZE,
    frame.SAMPLE: frame.SAMPLE_SIZE,
    frame.MOTION: frame.MOTION_SIZE,
}


def parse(body: bytes | bytearray) -> Frame:
    """Record of an intact body of at least two bytes, without its CRC; Refused says why not."""
    version, kind = body[0], body[1]
    if version != frame.PROTOCOL:
        return Refused(
            f"the board speaks protocol version {version}, this host version {frame.PROTOCOL}: "
            "deploy the firmware of this release"
        )
    if kind not in _SIZES:
        *others, last = map(str, _SIZES)
        return Refused(f"frame kind {kind} is unknown, valid are {', '.join(others)} and {last}")
    if len(body) != _SIZES[kind]:
        return Refused(f"frame kind {kind} has {_SIZES[kind]} bytes, found {len(body)}")
    return _hello(body) if kind == frame.HELLO else _sample(body)


def _hello(body: bytes | bytearray) -> Hello | Refused:
    _, _, boot_id, major, minor, patch, reset, config, device_id, bits, rate = struct.unpack(
        frame.HELLO_LAYOUT, body
    )
    if not 16 <= bits <= 32:
        return Refused(f"ticks have 16 to 32 bits, found {bits}")
    if rate == 0:
        return Refused("the rate is at least 1 Hz, found 0")
    known = reset in set(Reset)
    return Hello(
        boot_id=boot_id,
        firmware=(major, minor, patch),
        reset=Reset(reset) if known else Reset.UNKNOWN,
        config_hash=config,
        device_id=device_id.hex(),
        tick_bits=bits,
        rate=rate,
    )


def _sample(body: bytes | bytearray) -> Sample | Refused:
    _, kind, boot_id, seq, ticks, left, right, flags, drops = struct.unpack_from(
        frame.SAMPLE_LAYOUT, body
    )
    if max(left, right) > frame.FULL_SCALE:
        return Refused(f"counts are at most {frame.FULL_SCALE}, found {left} and {right}")
    imu, misses = (), 0
    if kind == frame.MOTION:
        *imu, misses = struct.unpack_from(frame.IMU_LAYOUT, body, frame.SAMPLE_SIZE)
    return Sample(boot_id, seq, ticks, left, right, flags, drops, tuple(imu), misses)


def objections(hello: Hello, config_hash: int | None = None) -> tuple[str, ...]:
    """Reasons not to arm with this board, each with what was expected and found; none is good.

    Its settings have to be those of `config_hash`, if that is given.
    """
    reasons: list[str] = []
    if hello.firmware < frame.FIRMWARE:
        has, needs = (".".join(map(str, v)) for v in (hello.firmware, frame.FIRMWARE))
        reasons.append(f"the board runs firmware {has}, this host needs {needs} or newer")
    if config_hash is not None and hello.config_hash != config_hash:
        reasons.append(
            f"the board's settings have hash {hello.config_hash:08x}, expected {config_hash:08x}: "
            "deploy firmware/config.py again"
        )
    return tuple(reasons)


def names_board(sensor_id: str) -> bool:
    """Whether the name of a flex sensor is the serial number of the board it is soldered to."""
    return _SERIAL.fullmatch(sensor_id) is not None


def require_sensor(hello: Hello | None, sensor_id: str | None) -> None:
    """Refuse a board to which the calibrated sensor is not soldered, where its id names a board."""
    if sensor_id is None or not names_board(sensor_id) or hello is None:
        return
    if hello.device_id != sensor_id:
        raise CalibrationError(
            f"--calibration: expected the board {sensor_id} of its sensor_id, found board "
            f"{hello.device_id}; calibrate the flex sensors of this board"
        )


LONGEST = 128
"""Bytes between delimiters that are held; from here on they cannot be a frame."""
SHORTEST = 2 + frame.CRC_SIZE + 1
"""Version, kind, CRC and one byte of COBS."""
TEXT_KEPT = 512
"""Bytes of text held until they are taken."""

_TEXT = re.compile(rb"[\t\n\r\x20-\x7e]{8,}")


@dataclass(slots=True)
class Counters:
    """What became of every byte: delimiters, judged and held ones add up to those received.

    The bytes between two delimiters are one piece.

    Attributes:
        received: Bytes fed.
        delimiters: Zero bytes.
        judged: Bytes of all pieces below.
        good: Frames delivered.
        refused: Intact frames of an unknown version, kind, length or range.
        crc_errors: Pieces of COBS with a wrong CRC.
        cobs_errors: Pieces that are not COBS.
        oversize: Pieces longer than any frame.
        noise: Pieces shorter than any frame.
        text: Pieces that are printable text only.
    """

    received: int = 0
    delimiters: int = 0
    judged: int = 0
    good: int = 0
    refused: int = 0
    crc_errors: int = 0
    cobs_errors: int = 0
    oversize: int = 0
    noise: int = 0
    text: int = 0


class FrameDecoder:
    """Finds frames in a stream; keeps less than 1 KiB whatever comes."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._held = bytearray()
        self._spilled = False
        self._text = bytearray()

    @property
    def held(self) -> int:
        """Bytes waiting for their delimiter."""
        return len(self._held)

    def feed(self, data: bytes) -> list[Frame]:
        """Frames completed by these bytes, in order of arrival; Refused ones say why."""
        frames: list[Frame] = []
        self.counters.received += len(data)
        at = 0
        while at < len(data):
            limit = at + LONGEST - len(self._held)
            end = data.find(0, at, limit)
            if end < 0:
                self._held += data[at:limit]
                at = limit
                if len(self._held) == LONGEST:
                    self._spill()
                continue
            self._held += data[at:end]
            at = end + 1
            self.counters.delimiters += 1
            if (whole := self._close()) is not None:
                frames.append(whole)
        return frames

    def take_text(self) -> str:
        """Printable text found between frames since the last call, at most TEXT_KEPT bytes.

        Asking at most 8 times a second keeps a log below 4 KiB/s.
        """
        text = self._text.replace(b"\r", b"").decode("ascii")
        self._text = bytearray()
        return text

    def _spill(self) -> None:
        """Give up bytes that cannot be a frame any more, except text."""
        self._keep_text(self._held)
        self.counters.judged += len(self._held)
        self._held = bytearray()
        self._spilled = True

    def _close(self) -> Frame | None:
        """Classify what lies between two delimiters."""
        chunk, counters = bytes(self._held), self.counters
        self._held = bytearray()
        counters.judged += len(chunk)
        if self._spilled:
            self._spilled = False
            counters.oversize += 1
            self._keep_text(chunk)
            return None
        content = frame.unstuff(chunk) if len(chunk) >= SHORTEST else None
        if content is not None and _intact(content):
            parsed = parse(content[: -frame.CRC_SIZE])
            counters.refused += isinstance(parsed, Refused)
            counters.good += not isinstance(parsed, Refused)
            return parsed
        if chunk:
            self._reject(chunk, cobs=content is not None)
        return None

    def _reject(self, chunk: bytes, cobs: bool) -> None:
        self._keep_text(chunk)
        if _TEXT.fullmatch(chunk):
            self.counters.text += 1
        elif len(chunk) < SHORTEST:
            self.counters.noise += 1
        elif cobs:
            self.counters.crc_errors += 1
        else:
            self.counters.cobs_errors += 1

    def _keep_text(self, chunk: bytes | bytearray) -> None:
        for run in _TEXT.findall(chunk):
            self._text += run[: TEXT_KEPT - len(self._text)]


def _intact(content: bytes | bytearray) -> bool:
    end = len(content) - frame.CRC_SIZE
    return crc32(content[:end]) == int.from_bytes(content[end:], "little")
