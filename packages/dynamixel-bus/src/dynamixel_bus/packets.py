"""DYNAMIXEL Protocol 2.0 as bytes: what is sent and what it means. No input or output.

A packet is FF FF FD 00, id, length (2 bytes, low first), instruction, parameters, CRC (2 bytes, low
first). The length counts everything after itself. FF FF FD between the instruction and the CRC
is followed by one more FD on the wire; length and CRC are of the stuffed packet.
Source: https://emanual.robotis.com/docs/en/dxl/protocol2/ and https://emanual.robotis.com/docs/en/dxl/crc/.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from dynamixel_bus.errors import BadInputError

HEADER = b"\xff\xff\xfd\x00"
BROADCAST = 0xFE
"""The id that means every servo."""
LAST_ID = 252
ALERT = 0x80
"""Bit of the error byte: the servo's hardware error status is not zero."""
OVERHEAD = 11
"""Bytes of a status packet around its data."""
LONGEST = 1024
"""Longest packet [bytes] that is made or believed."""

BEFORE_BODY = 7
"""Bytes of a packet before its instruction: header, id, length."""

_PATTERN, _STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"
_POLYNOMIAL = 0x8005
_CLEAR_TURNS = bytes([0x01, 0x44, 0x58, 0x4C, 0x22])


class PacketError(BadInputError):
    """A packet cannot be made as asked: an id, an address, a length."""


class Instruction(IntEnum):
    """What a packet asks for; STATUS is the answer."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93
    FAST_BULK_READ = 0x9A


class StatusError(IntEnum):
    """Why a servo did not do what it was asked; the low seven bits of the error byte."""

    NONE = 0
    RESULT_FAIL = 1
    INSTRUCTION = 2
    CRC = 3
    DATA_RANGE = 4
    DATA_LENGTH = 5
    DATA_LIMIT = 6
    ACCESS = 7
    UNKNOWN = 127


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet without its framing.

    Attributes:
        id: Servo it is for or from; 254 is all.
        instruction: An `Instruction`, or another number.
        params: Parameters without stuffing; of a status, the error byte and the data.
    """

    id: int
    instruction: int
    params: bytes


@dataclass(frozen=True, slots=True)
class Status:
    """What one servo answered; `alert` if it has a hardware error."""

    id: int
    error: StatusError
    alert: bool
    data: bytes

    @property
    def error_byte(self) -> int:
        """The error and the alert as they are sent."""
        return self.error | (ALERT if self.alert else 0)


def _crc_table() -> tuple[int, ...]:
    table: list[int] = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (_POLYNOMIAL if crc & 0x8000 else 0)
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC = _crc_table()


def crc16(data: bytes, crc: int = 0) -> int:
    """CRC-16 with polynomial 0x8005, not reflected, going on from `crc`."""
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _CRC[(crc >> 8) ^ byte]
    return crc


def stuff(body: bytes) -> bytes:
    """The body as it is sent: no header can appear in it."""
    return body.replace(_PATTERN, _STUFFED)


def unstuff(body: bytes) -> bytes:
    """The body as it was meant."""
    return body.replace(_STUFFED, _PATTERN)


def encode(servo: int, instruction: int, params: bytes = b"") -> bytes:
    """One packet with header, length, stuffing and CRC."""
    if not 0 <= servo <= LAST_ID and servo != BROADCAST:
        raise PacketError(f"expected a servo id from 0 to {LAST_ID} or {BROADCAST}, found {servo}")
    body = stuff(bytes([instruction]) + params)
    if len(body) + BEFORE_BODY + 2 > LONGEST:
        raise PacketError(f"expected a packet of at most {LONGEST} bytes, found {len(body) + 9}")
    packet = HEADER + bytes([servo]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16(packet).to_bytes(2, "little")


def ping(servo: int = BROADCAST) -> bytes:
    """Ask for model number and firmware version."""
    return encode(servo, Instruction.PING)


def read(servo: int, address: int, length: int) -> bytes:
    """Ask one servo for `length` bytes of its table."""
    return encode(servo, Instruction.READ, _words(address, length))


def write(servo: int, address: int, data: bytes) -> bytes:
    """Write into the table of one servo."""
    return encode(servo, Instruction.WRITE, _words(address) + data)


def reboot(servo: int) -> bytes:
    """Restart one servo."""
    return encode(servo, Instruction.REBOOT)


def clear(servo: int) -> bytes:
    """Forget whole turns of the position of one servo, which must stand still."""
    return encode(servo, Instruction.CLEAR, _CLEAR_TURNS)


def sync_read(ids: Sequence[int], address: int, length: int) -> bytes:
    """Ask several servos for the same bytes; each answers with a packet, in the order asked."""
    return _group(Instruction.SYNC_READ, ids, address, length)


def fast_sync_read(ids: Sequence[int], address: int, length: int) -> bytes:
    """Ask several servos for the same bytes; together they answer with one long packet."""
    return _group(Instruction.FAST_SYNC_READ, ids, address, length)


def sync_write(address: int, data: Mapping[int, bytes]) -> bytes:
    """Write equally many bytes to the same address of several servos; none answers."""
    require_ids(data)
    lengths = {len(item) for item in data.values()}
    if len(lengths) != 1:
        raise PacketError(f"expected as many bytes for each servo, found {sorted(lengths)}")
    parts = b"".join(bytes([servo]) + item for servo, item in data.items())
    return encode(BROADCAST, Instruction.SYNC_WRITE, _words(address, lengths.pop()) + parts)


def status(answer: Status) -> bytes:
    """The packet in which a servo answers."""
    return encode(answer.id, Instruction.STATUS, bytes([answer.error_byte]) + answer.data)


def as_status(packet: Packet) -> Status | None:
    """What a packet says if it is the status of one servo."""
    if packet.instruction != Instruction.STATUS or packet.id > LAST_ID or not packet.params:
        return None
    return _status(packet.id, packet.params[0], packet.params[1:])


def fast_reply_size(count: int, length: int) -> int:
    """Size [bytes] of the reply of `count` servos to a fast sync read of `length` bytes."""
    return 8 + count * (length + 4)


def split_fast_reply(received: bytes, ids: Sequence[int], length: int) -> list[Status]:
    """Answers in what came after a fast sync read, each proven by its CRC.

    The chain of answers stops at a servo that is silent. A part that is lost or damaged on the way
    costs itself and at most the next one: the CRC at the end of a part is also where the CRC of the
    next one starts, so each is checked from the CRC before it.
    """
    start = received.find(_fast_header(len(ids), length))
    if start < 0:
        return []
    answers: list[Status] = []
    left = list(ids)
    first = start + 8
    crc = crc16(received[start:first])
    for begin in range(first, len(received) - length - 3, length + 4):
        end = begin + 2 + length
        sent, crc = received[end : end + 2], crc16(received[begin:end], crc)
        servo = received[begin + 1]
        if sent == crc.to_bytes(2, "little") and servo in left:
            answers.append(_status(servo, received[begin], received[begin + 2 : end]))
            left = left[left.index(servo) + 1 :]
        crc = crc16(sent, int.from_bytes(sent, "little"))
    return answers


def broken_fast_reply(received: bytes, count: int, length: int, good: int) -> int:
    """How many parts came whole, but broken: all but the `good` ones; 1 if the header is.

    One damaged CRC breaks two parts.
    """
    start = received.find(_fast_header(count, length))
    if start < 0:
        return int(bool(received))
    whole = (len(received) - start - fast_reply_size(0, length)) // (length + 4)
    return max(min(whole, count) - good, 0)


def _status(servo: int, error_byte: int, data: bytes) -> Status:
    number = error_byte & ~ALERT
    error = StatusError(number) if number <= StatusError.ACCESS else StatusError.UNKNOWN
    return Status(servo, error, bool(error_byte & ALERT), data)


def _fast_header(count: int, length: int) -> bytes:
    size = fast_reply_size(count, length) - BEFORE_BODY
    return HEADER + bytes([BROADCAST]) + size.to_bytes(2, "little") + bytes([Instruction.STATUS])


def _group(instruction: Instruction, ids: Sequence[int], address: int, length: int) -> bytes:
    require_ids(ids)
    return encode(BROADCAST, instruction, _words(address, length) + bytes(ids))


def require_ids(ids: Iterable[int]) -> None:
    """Ids that a packet for several servos may name.

    Raises:
        PacketError: One cannot be, or stands twice.
    """
    listed = list(ids)
    if not listed or len(set(listed)) < len(listed) or not all(0 <= i <= LAST_ID for i in listed):
        raise PacketError(f"expected different servo ids from 0 to {LAST_ID}, found {listed}")


def _words(*numbers: int) -> bytes:
    if not all(0 <= number <= 0xFFFF for number in numbers):
        raise PacketError(f"expected address and length from 0 to 65535, found {list(numbers)}")
    return b"".join(number.to_bytes(2, "little") for number in numbers)
