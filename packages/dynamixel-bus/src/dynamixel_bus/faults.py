"""What may be wrong with the answers of a virtual servo, and with the bytes on a wire."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from dynamixel_bus import packets
from dynamixel_bus.packets import Status
from dynamixel_bus.parser import Parser


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


class Noise:
    """What a bad wire does to the bytes that cross it, in either direction.

    Args:
        seed: Of its chance.

    Attributes:
        ber: Share of bits that arrive wrong.
        loss: Share of bytes that do not arrive.
        wrong: Bits turned over so far.
        lost: Bytes lost so far.
    """

    def __init__(self, seed: int) -> None:
        self.ber = self.loss = 0.0
        self.wrong = self.lost = 0
        self._rng = np.random.default_rng(seed)

    def __call__(self, data: bytes) -> bytes:
        """What arrives of these bytes."""
        if not data or not (self.ber or self.loss):
            return data
        turned = self._rng.random(8 * len(data)) < self.ber
        arrived = self._rng.random(len(data)) >= self.loss
        self.wrong += int(turned.sum())
        self.lost += int((~arrived).sum())
        return (np.frombuffer(data, np.uint8) ^ np.packbits(turned))[arrived].tobytes()
