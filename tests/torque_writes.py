"""What masters write on twin wires to torque, watchdog and goals, and which module asked for it."""

from __future__ import annotations

import sys
from types import FrameType
from typing import NamedTuple

import pytest

from dynamixel_bus.simulated_wire import SimulatedWire

WATCHED = {64, 98, *range(100, 120)}
"""Torque enable, bus watchdog, and all goals and profiles (e-manual of the XC430-W240)."""
TORQUE, GOAL = 64, 116
_WRITE, _REG_WRITE, _SYNC_WRITE, _BULK_WRITE = 0x03, 0x04, 0x83, 0x93
_BELOW = {"torque_writes", "lockstep", "dynamixel_bus.bus"}
"""Modules below the one that decides what is written."""


class Written(NamedTuple):
    """One write to a watched register.

    Attributes:
        t: Time [s].
        address: First of the registers.
        data: What follows the address in the packet: lengths, ids and values.
        caller: Name of the module that asked the bus for it.
    """

    t: float
    address: int
    data: bytes
    caller: str

    @property
    def torque_on(self) -> bool:
        """Whether it gives a servo torque: a length of one byte, an id, a one."""
        return self.address == TORQUE and self.data[2:] != b"" and 1 in self.data[3::2]


def watch(patch: pytest.MonkeyPatch) -> list[Written]:
    """All that is written from now on, by any wire of this process."""
    seen: list[Written] = []
    write = SimulatedWire.write

    def listen(self: SimulatedWire, data: bytes) -> None:
        for address, length, params in writes(data):
            if WATCHED & set(range(address, address + length)):
                seen.append(Written(self.now(), address, params, _caller(sys._getframe(1))))
        write(self, data)

    patch.setattr(SimulatedWire, "write", listen)
    return seen


def writes(packet: bytes) -> list[tuple[int, int, bytes]]:
    """Address, length and what follows the address, of a packet of protocol 2.0 that writes."""
    assert packet[:4] == b"\xff\xff\xfd\x00"
    instruction, params = packet[7], packet[8:-2]
    assert instruction != _BULK_WRITE, "nobody uses it, so nobody reads it here"
    address = int.from_bytes(params[:2], "little")
    if instruction in (_WRITE, _REG_WRITE):
        return [(address, len(params) - 2, params[2:])]
    if instruction == _SYNC_WRITE:
        return [(address, int.from_bytes(params[2:4], "little"), params[2:])]
    return []


def _caller(frame: FrameType | None) -> str:
    while frame is not None and (name := frame.f_globals["__name__"]) in _BELOW:
        frame = frame.f_back
    return "" if frame is None else name
