"""The person before the robot: questions and answers, and which port is which.

A port is the one that goes when it is unplugged and comes back with it.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from antennate.errors import AntennateError
from dynamixel_bus.port import PortError


class SetupError(AntennateError):
    """A step did not succeed and may be tried again; says what was expected, found, and to do."""


class Quit(Exception):
    """The person wants to end; what is done stays done."""


class Person(Protocol):
    """The person who is asked, and who answers."""

    def say(self, text: str) -> None:
        """Tell something that stays to be read."""
        ...

    def show(self, text: str) -> None:
        """Show live numbers in place of those shown before."""
        ...

    def ask(self, text: str) -> str:
        """Ask and wait: the answer in lower case, empty for Enter alone."""
        ...

    def answer(self) -> str | None:
        """An answer that has come since `ask` or `say`, without waiting; None so far."""
        ...


def agrees(person: Person, text: str) -> bool:
    """Ask for y or n."""
    while True:
        answer = person.ask(f"{text} [y, n; q ends]")
        if answer in ("q", "quit"):
            raise Quit
        if answer in ("y", "yes", "n", "no"):
            return answer.startswith("y")
        person.say(f"expected y, n or q, found {repr(answer[:20]) if answer else 'Enter'}")


def confirm(person: Person, text: str) -> bool:
    """Ask for Enter: True for it, False if the step is to be left out (s)."""
    while True:
        answer = person.ask(f"{text} [Enter; s leaves it out, q ends]")
        if answer in ("q", "quit"):
            raise Quit
        if answer in ("", "s", "skip"):
            return not answer
        person.say(f"expected Enter, s or q, found {answer[:20]!r}")


Listing = Callable[[], frozenset[str]]
_NAMES = Path("/dev/serial/by-id")
_LOOK = 0.1
"""Time between two looks at the ports [s]."""


def all_ports() -> frozenset[str]:
    """The serial ports of this machine, by their lasting names where they have one."""
    from antennate.hardware.ports.serial_line import adapters

    lasting = {os.path.realpath(name): str(name) for name in sorted(_NAMES.glob("*"))}
    return frozenset(lasting.get(path, path) for path in adapters())


def ports_like(pattern: str) -> Listing:
    """Lists the files of a pattern such as `/dev/ttyACM*`."""
    path = Path(pattern)
    return lambda: frozenset(map(str, path.parent.glob(path.name)))


def find_port(
    person: Person,
    what: str,
    listing: Listing,
    wait: Callable[[float], None],
    patience: float,
) -> str:
    """Let a person unplug something and plug it in again: its port, empty if it is left out.

    Args:
        person: Who is asked.
        what: What is to be unplugged, in words.
        listing: All ports that are there now.
        wait: Lets a time pass [s].
        patience: Longest time for a port to go or to come [s].
    """
    before = listing()
    while True:
        if not confirm(person, f"unplug the {what}, and nothing else"):
            return ""
        try:
            without = _settled(listing, wait)
            _require_gone(before, without)
            if not confirm(person, "plug it in again"):
                return ""
            port = _appeared(listing, without, wait, patience)
            person.say(f"found the {what} at {port}")
            return port
        except (SetupError, PortError) as error:
            person.say(f"{error}; once more")
            before = listing()


def _require_gone(before: frozenset[str], after: frozenset[str]) -> None:
    """Require that a port has gone."""
    if before - after:
        return
    if new := sorted(after - before):
        raise SetupError(f"expected a port that is gone, found a new one, {new[0]}; now unplug it")
    paths = ", ".join(sorted(after)) or "none"
    raise SetupError(
        f"expected a port that is gone, found none gone (ports here: {paths}); if it was not "
        "plugged in before, plug it in now and press Enter"
    )


def _settled(listing: Listing, wait: Callable[[float], None]) -> frozenset[str]:
    """The ports once two looks at them agree; one that is going may still be listed."""
    before = listing()
    while True:
        wait(_LOOK)
        after = listing()
        if after == before:
            return after
        before = after


def _appeared(
    listing: Listing, without: frozenset[str], wait: Callable[[float], None], patience: float
) -> str:
    """The one port that is new."""
    waited = 0.0
    while True:
        new = sorted(listing() - without)
        if len(new) == 1:
            return new[0]
        if new:
            raise SetupError(f"expected one new port, found {len(new)}: {', '.join(new)}")
        if waited >= patience:
            known = ", ".join(sorted(without)) or "none"
            raise SetupError(
                f"expected a new port within {patience:g} s, found none (ports here: {known}); was "
                "it unplugged before the first Enter?"
            )
        wait(_LOOK)
        waited += _LOOK
