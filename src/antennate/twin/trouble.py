"""What may be wrong with the answers of a servo."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from antennate.hardware.dynamixel import packets
from antennate.hardware.dynamixel.packets import Status
from antennate.hardware.dynamixel.parser import Parser


class Fault(Enum):
    """What may be wrong with the answers of a servo."""

    SILENT = "takes nothing and replies nothing"
    BAD_CRC = "answers with a wrong CRC"
    TRUNCATED = "stops in the middle of an answer"
    LATE = "answers, and all after it, `delay` seconds late"
    DOUBLED = "answers twice"
    WRONG_ID = "answers with the id of its neighbour"
    OVERSIZED = "answers with four bytes too many"


@dataclass(slots=True)
class Trouble:
    """A fault of one servo.

    Attributes:
        fault: What.
        delay: For LATE, by how much [s].
        count: How many more answers it spoils, None for all; not used for SILENT.
    """

    fault: Fault
    delay: float = 0.0
    count: int | None = None


def spoil(data: bytes, fault: Fault) -> bytes:
    """An answer with a fault."""
    if fault is Fault.BAD_CRC:
        return data[:-1] + bytes([data[-1] ^ 0x55])
    if fault is Fault.TRUNCATED:
        return data[: len(data) // 2]
    if fault is Fault.DOUBLED:
        return data + data
    status = next(iter(Parser().feed(data)), None)
    answer = status and packets.as_status(status)
    if answer and fault is Fault.WRONG_ID:
        return packets.status(Status(answer.id + 1, answer.error, answer.alert, answer.data))
    if answer and fault is Fault.OVERSIZED:
        return packets.status(
            Status(answer.id, answer.error, answer.alert, answer.data + b"\0" * 4)
        )
    return data
