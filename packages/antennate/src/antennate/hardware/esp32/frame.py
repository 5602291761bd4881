"""Frames between the antenna board and the host: one file for both ends.

It runs under CPython and, copied to the board as `antenna_frame.py`, under MicroPython.

On the wire a frame is `00 COBS(body + CRC-32) 00`, little-endian, the CRC that of zlib. A delimiter
on both sides costs a byte and saves the frame after a damaged delimiter. The first two bytes of a
body, protocol version and kind, keep their place in every version. Bytes that arrive are compared
with what is known here and never executed.

| body | fields |
|---|---|
| HELLO | version, kind, boot id, firmware, reset, config hash, device id, tick bits, rate [Hz] |
| SAMPLE | version, kind, boot id, sequence number, ticks [us], left, right [counts], flags, drops |
| MOTION | as SAMPLE; angular velocity x, y, z, specific force x, y, z [counts], misses |

A board with an inertial sensor sends MOTION in place of SAMPLE. Its axes are those of the head: x
forward, y to the left, z up.
"""

import struct
from binascii import crc32

PROTOCOL = 1
FIRMWARE = (0, 1, 0)
TICK_BITS = 30
"""`time.ticks_us` of a 32-bit MicroPython counts modulo 2**30."""
TICK_MASK = (1 << TICK_BITS) - 1

FULL_SCALE = 4095
"""Largest reading of the 12-bit converter [counts]."""

HELLO = 1
SAMPLE = 2
REQUEST = 3
MOTION = 5
"""A sample with the readings of an inertial sensor; 4 is the first byte of an ASK."""

HELLO_LAYOUT = "<BBIBBBBI8sBH"
SAMPLE_LAYOUT = "<BBIIIHHBH"
IMU_LAYOUT = "<6hH"
"""What follows in MOTION."""
IMU_NONE = -32768
"""Six of these stand for no answer of the inertial sensor; no reading is lower than -32767."""
HELLO_SIZE = struct.calcsize(HELLO_LAYOUT)
SAMPLE_SIZE = struct.calcsize(SAMPLE_LAYOUT)
MOTION_SIZE = SAMPLE_SIZE + struct.calcsize(IMU_LAYOUT)
CRC_SIZE = 4
WRAPPING = CRC_SIZE + 3
"""Bytes around a body of less than 250 bytes: CRC, one COBS code, two delimiters."""
HELLO_FRAME_SIZE = HELLO_SIZE + WRAPPING
SAMPLE_FRAME_SIZE = SAMPLE_SIZE + WRAPPING
MOTION_FRAME_SIZE = MOTION_SIZE + WRAPPING

RESET_UNKNOWN = 0
RESET_POWER_ON = 1
RESET_HARD = 2
RESET_WATCHDOG = 3
RESET_DEEP_SLEEP = 4
RESET_SOFT = 5

FLAG_LEFT_RAIL = 1
"""The left reading is 0 or full scale: a broken or a shorted wire."""
FLAG_RIGHT_RAIL = 2
"""The right reading is 0 or full scale."""
FLAG_LATE = 4
"""The sample was taken more than 1.5 periods after the one before."""


def stuff_into(target: bytearray, at: int, source: bytearray) -> int:
    """Write the COBS code of a source to a target from an index on; return the index after it."""
    code_at = at
    code = 1
    at += 1
    left = len(source)
    for byte in source:
        left -= 1
        if byte:
            target[at] = byte
            at += 1
            code += 1
        if not byte or (code == 255 and left):
            target[code_at] = code
            code_at = at
            code = 1
            at += 1
    target[code_at] = code
    return at


def unstuff(chunk: bytes) -> bytearray | None:
    """Undo COBS of the bytes between two delimiters; None if they are not COBS."""
    body = bytearray()
    at = 0
    end = len(chunk)
    if not end or 0 in chunk:
        return None
    while at < end:
        code = chunk[at]
        if at + code > end:
            return None
        body += chunk[at + 1 : at + code]
        at += code
        if code < 255 and at < end:
            body.append(0)
    return body


class Packer:
    """Memory for bodies of one size; puts CRC, COBS and delimiters around them."""

    def __init__(self, size: int) -> None:
        self.body = bytearray(size + CRC_SIZE)
        self._checked = memoryview(self.body)[:size]
        self._size = size

    def pack_into(self, buffer: bytearray) -> int:
        """Write the frame of `body` to a buffer of at least its size; return the frame's length."""
        struct.pack_into("<I", self.body, self._size, crc32(self._checked) & 0xFFFFFFFF)
        buffer[0] = 0
        end = stuff_into(buffer, 1, self.body)
        buffer[end] = 0
        return end + 1


class SampleEncoder:
    """Encodes samples of one boot without new buffers, with an inertial sensor or without one.

    `size` is the length of each frame: SAMPLE_FRAME_SIZE or MOTION_FRAME_SIZE.
    """

    def __init__(self, boot_id: int, motion: bool = False) -> None:
        self._boot_id = boot_id
        self._kind = MOTION if motion else SAMPLE
        self._packer = Packer(MOTION_SIZE if motion else SAMPLE_SIZE)
        self.size = MOTION_FRAME_SIZE if motion else SAMPLE_FRAME_SIZE

    def encode_sample_into(
        self,
        buffer: bytearray,
        seq: int,
        ticks: int,
        left: int,
        right: int,
        flags: int,
        drops: int,
        imu: tuple[int, ...] = (),
        misses: int = 0,
    ) -> int:
        """Write one sample as a frame.

        Args:
            buffer: At least `size` bytes.
            seq: Number of the sample since boot, modulo 2**32.
            ticks: When it was taken [us], modulo 2**TICK_BITS.
            left: Reading of the left antenna [counts].
            right: Reading of the right antenna [counts].
            flags: Sum of FLAG_ values.
            drops: Samples taken and not sent since boot, modulo 2**16.
            imu: Readings of the inertial sensor [counts], gyroscopes first; none without one.
            misses: Readings that it has not given since boot, modulo 2**16.

        Returns:
            The frame's length, always `size`.
        """
        struct.pack_into(
            SAMPLE_LAYOUT,
            self._packer.body,
            0,
            PROTOCOL,
            self._kind,
            self._boot_id,
            seq & 0xFFFFFFFF,
            ticks,
            left,
            right,
            flags,
            drops & 0xFFFF,
        )
        if self._kind == MOTION:
            struct.pack_into(IMU_LAYOUT, self._packer.body, SAMPLE_SIZE, *imu, misses & 0xFFFF)
        return self._packer.pack_into(buffer)


def encode_hello(
    boot_id: int, reset: int, config: int, device_id: bytes, rate: int, tick_bits: int = TICK_BITS
) -> bytes:
    """Frame of a greeting: who speaks, since when, with which settings."""
    packer = Packer(HELLO_SIZE)
    major, minor, patch = FIRMWARE
    struct.pack_into(
        HELLO_LAYOUT,
        packer.body,
        0,
        PROTOCOL,
        HELLO,
        boot_id,
        major,
        minor,
        patch,
        reset,
        config,
        device_id[:8],
        tick_bits,
        rate,
    )
    buffer = bytearray(HELLO_FRAME_SIZE)
    packer.pack_into(buffer)
    return bytes(buffer)


def encode_request() -> bytes:
    """Frame by which the host asks for a HELLO: the only bytes to which a board answers."""
    packer = Packer(2)
    packer.body[0] = PROTOCOL
    packer.body[1] = REQUEST
    buffer = bytearray(2 + WRAPPING)
    packer.pack_into(buffer)
    return bytes(buffer)


def config_hash(
    rate: int, burst: int, pin_left: int, pin_right: int, imu: tuple[int, ...] = ()
) -> int:
    """CRC-32 of a board's settings, by which host and board compare them.

    Those of an inertial sensor count where there is one: its pins SDA and SCL, its address, and
    which of its axes point forward, left and up.
    """
    settings = struct.pack("<HHBB", rate, burst, pin_left, pin_right)
    if imu:
        settings += struct.pack("<BBBbbb", *imu)
    return crc32(settings) & 0xFFFFFFFF
