"""What a client says on the clock of a twin in lock-step, and what the twin answers: ASCII lines.

| the client | the twin |
|---|---|
| `hello antennate-clock 2` | `at` its time and its wires; it counts its bytes from here on |
| `sent esp32 N`, `sent bus N` | nothing; it takes N bytes from that wire, now, in one piece |
| `until T` | goes on until T [s], then `at` |
| `listen T` | goes on until T, or until its bus has said something, then `at` |

`at T N M`: it is T [s], and N bytes of the board and M of the bus have left since the greeting. A
client that waits for so many has all that the twin said by T, whatever the wires' delays. After the
greeting two words more, `at T N M BOARD BUS`, name its other wires: `tcp:PORT`, or the path of a
pseudo-terminal. A client that was given others talks to something else, perhaps a robot. Anything
else is answered with `error` and why, and the client has to greet anew. T is written so that every
bit of it comes back.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass
from typing import Literal

from antennate.errors import BadInputError

Wire = Literal["esp32", "bus"]
WIRES: tuple[Wire, Wire] = ("esp32", "bus")
HELLO = "hello antennate-clock 2"
LONGEST = 200
"""Most bytes of a line."""
MOST = 1 << 16
"""Most bytes that a client may send in one piece."""

_TIME = r"([0-9]{1,9}(?:\.[0-9]{1,20})?(?:e-[0-9]{1,3})?)"
_REQUEST = re.compile(rf"(until|listen) {_TIME}|sent (esp32|bus) ([0-9]{{1,6}})")
_AT = re.compile(
    rf"at {_TIME} ([0-9]{{1,15}}) ([0-9]{{1,15}})(?: ([!-~]{{1,60}}) ([!-~]{{1,60}}))?"
)
_ERROR = re.compile(r"error ([ -~]+)")


@dataclass(frozen=True, slots=True)
class Hello:
    """A client is there."""


@dataclass(frozen=True, slots=True)
class Sent:
    """The client has sent bytes.

    Attributes:
        wire: On which wire.
        count: How many.
    """

    wire: Wire
    count: int


@dataclass(frozen=True, slots=True)
class GoOn:
    """Time is to pass.

    Attributes:
        t: Until when [s].
        listens: Or until the bus has said something.
    """

    t: float
    listens: bool


@dataclass(frozen=True, slots=True)
class At:
    """Where the twin is.

    Attributes:
        t: Its time [s].
        counts: Bytes that have left on each wire since the greeting, in the order of WIRES.
        places: Where those wires are, as `place` says it; after the greeting only.
    """

    t: float
    counts: tuple[int, int]
    places: tuple[str, ...] = ()


def request(line: bytes) -> Hello | Sent | GoOn:
    """What a client says.

    Raises:
        BadInputError: It is none of the words above.
    """
    text = line.decode("ascii", "replace")
    if text == HELLO:
        return Hello()
    found = _REQUEST.fullmatch(text)
    if found is None:
        raise BadInputError(
            f"expected `{HELLO}`, `sent esp32|bus BYTES`, `until T` or `listen T`, "
            f"found {text[:40]!a}"
        )
    verb, t, wire, count = found.groups()
    if verb is not None:
        return GoOn(float(t), verb == "listen")
    if not 0 < int(count) <= MOST:
        raise BadInputError(f"expected 1 to {MOST} bytes in one piece, found {count}")
    return Sent("bus" if wire == "bus" else "esp32", int(count))


def answer(line: bytes) -> At:
    """What a twin answers.

    Raises:
        BadInputError: It refuses, or it is no twin's clock.
    """
    text = line.decode("ascii", "replace")
    if found := _AT.fullmatch(text):
        t, board, bus, *places = found.groups()
        return At(float(t), (int(board), int(bus)), tuple(filter(None, places)))
    if found := _ERROR.fullmatch(text):
        raise BadInputError(f"the twin refuses: {found[1]}")
    raise BadInputError(f"expected the clock of a twin, found one that says {text[:40]!a}")


def place(address: str) -> str:
    """What tells one wire of this host from another: the port of an address, or the device."""
    scheme, separator, rest = address.partition("://")
    return f"{scheme}:{rest.rpartition(':')[2]}" if separator else os.path.realpath(address)


def go_on(t: float, listens: bool) -> str:
    """The line that lets time pass."""
    if not (math.isfinite(t) and t >= 0):
        raise BadInputError(f"expected a time of at least 0 s, found {t}")
    return f"{'listen' if listens else 'until'} {t!r}"
