"""Cuts a stream of bytes into Protocol 2.0 packets, with counters. No input or output."""

from __future__ import annotations

from dataclasses import dataclass

from dynamixel_bus.packets import (
    BEFORE_BODY,
    BROADCAST,
    HEADER,
    LONGEST,
    Instruction,
    Packet,
    crc16,
    unstuff,
)


@dataclass(slots=True)
class Counters:
    """What a parser has seen.

    Attributes:
        bad_crc: Packets with a wrong CRC.
        skipped_bytes: Bytes that belong to no right packet.
    """

    bad_crc: int = 0
    skipped_bytes: int = 0


class Parser:
    """Cuts a stream of bytes, however split, into packets. Keeps less than 2 `LONGEST` bytes."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._buffer = b""

    @property
    def pending(self) -> int:
        """Bytes of a packet that is not complete."""
        return len(self._buffer)

    def reset(self) -> None:
        """Give up the packet that is not complete."""
        self._skip(len(self._buffer))

    def feed(self, data: bytes) -> list[Packet]:
        """Packets completed by these bytes; wrong ones are counted and left out."""
        complete: list[Packet] = []
        for begin in range(0, len(data), LONGEST):
            self._buffer += data[begin : begin + LONGEST]
            while (packet := self._next()) is not None:
                complete.append(packet)
        return complete

    def _next(self) -> Packet | None:
        while True:
            self._find_header()
            if len(self._buffer) < BEFORE_BODY:
                return None
            size = BEFORE_BODY + int.from_bytes(self._buffer[5:7], "little")
            if not BEFORE_BODY + 3 <= size <= LONGEST:
                self._skip(1)
            elif len(self._buffer) < size:
                return None
            elif crc16(self._buffer[: size - 2]) != int.from_bytes(
                self._buffer[size - 2 : size], "little"
            ):
                self.counters.bad_crc += 1
                self._skip(1)
            else:
                return self._take(size)

    def _find_header(self) -> None:
        start = self._buffer.find(HEADER)
        if start < 0:
            tail = next(
                n for n in (3, 2, 1, 0) if HEADER.startswith(self._buffer[-n:] if n else b"")
            )
            start = max(len(self._buffer) - tail, 0)
        self._skip(start)

    def _skip(self, count: int) -> None:
        self.counters.skipped_bytes += count
        self._buffer = self._buffer[count:]

    def _take(self, size: int) -> Packet:
        whole, self._buffer = self._buffer[:size], self._buffer[size:]
        body = whole[BEFORE_BODY : size - 2]
        servo, instruction = whole[4], body[0]
        if servo == BROADCAST and instruction == Instruction.STATUS:
            return Packet(servo, instruction, body[1:])
        return Packet(servo, instruction, unstuff(body)[1:])
