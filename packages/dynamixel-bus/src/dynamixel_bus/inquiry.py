"""Asking servos until they answer, with time to spare: for before and after the control loop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from dynamixel_bus.answers import Answer, Span, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import Register
from dynamixel_bus.models import XC430_W240

PINGS = 3
"""Pings until an id is taken for silent; at 1 % loss three in a row are one in 10^6 (assumed)."""
_READS = 6
"""Reads until a servo is taken for one that answers nothing but pings: answers that collide are by
chance whole once in 2^16 (assumed)."""
_TICKS = Span(XC430_W240["realtime_tick"].address, 16)
"""What differs between two servos of one id: the tick and the position, in all models."""
_SPARE = {"torque_enable": 1, "goal_position": 12, "present_position": 12}

State = Literal["ok", "broken", "collides", "mute"]


FOUND: Mapping[State, str] = {
    "ok": "",
    "broken": "no answer is whole: two servos with this id, or a bad cable or plug",
    "collides": "two servos answer with this id",
    "mute": "answers pings alone",
}
"""What each state means, in words."""


@dataclass(frozen=True, slots=True)
class Present:
    """One id that answers.

    Attributes:
        servo: The id.
        model: Model number, None if no ping came back whole; so `firmware`.
        state: "ok"; "broken", no answer is whole; "collides", pings are whole but other answers are
            not, as of two servos with one id; "mute", it answers pings and no reads.
    """

    servo: int
    model: int | None
    firmware: int | None
    state: State


def look(bus: Bus, servo: int, pings: int = PINGS) -> Present | None:
    """One id, None if it is silent.

    Two servos of one id and model answer a ping with the same bytes at the same time. Only what
    differs between them comes back broken.
    """
    data, broken = _tried(bus, lambda: bus.ping(servo), pings)
    if data is None:
        return Present(servo, None, None, "broken") if broken else None
    read, broken = _tried(bus, lambda: bus.read(servo, _TICKS), _READS)
    state: State = "ok" if read is not None else "collides" if broken else "mute"
    return Present(servo, int.from_bytes(data[:2], "little"), data[2], state)


def read_some(
    bus: Bus, ids: Iterable[int], register: Register, tries: int = 3, budget: float = 0.25
) -> dict[int, int]:
    """One register of those servos that answer, in their order, each try within a budget [s].

    In a quarter second all answer through an adapter of 16 ms, where answers come in lumps.
    """
    values: dict[int, int] = {}
    asked = left = list(ids)
    for _ in range(tries):
        if not left:
            break
        replies = bus.read_all(left, Span(register.address, register.size), budget)
        values |= {i: register.decode(r.data) for i, r in replies.items() if isinstance(r, Value)}
        left = [servo for servo in left if servo not in values]
        if left:
            bus.settle()
    return {servo: values[servo] for servo in asked if servo in values}


def read_once(bus: Bus, servo: int, register: Register, budget: float) -> int | None:
    """One register of one servo by one request, within a budget [s]; None without an answer.

    Torque, goal and present position have defined bytes after them, by which late answers are told
    apart.
    """
    span = Span(register.address, register.size, _SPARE.get(register.name, 0))
    reply = bus.read_all([servo], span, budget)[servo]
    return register.decode(reply.data) if isinstance(reply, Value) else None


def _tried(bus: Bus, ask: Callable[[], Answer], tries: int) -> tuple[bytes | None, bool]:
    """Data of the first answer, or None; and whether anything came that was not whole."""
    before = bus.tally.bad_crc + bus.tally.stale
    for _ in range(tries):
        reply = ask()
        if isinstance(reply, Value):
            return reply.data, False
        bus.settle()
    return None, bus.tally.bad_crc + bus.tally.stale > before
