"""The person before the robot, as the steps of setting it up see one."""

from __future__ import annotations

from typing import Protocol

from antennate.errors import AntennateError


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
        """Ask and wait: the answer in lower case, empty for Enter alone.

        Raises:
            BadInputError: No answer can come.
        """
        ...

    def answer(self) -> str | None:
        """An answer that has come since `ask` or `say`, without waiting; None so far."""
        ...


def agrees(person: Person, text: str) -> bool:
    """Ask for y or n.

    Raises:
        Quit: The answer was q.
        BadInputError: No answer can come.
    """
    while True:
        answer = person.ask(f"{text} [y, n; q ends]")
        if answer in ("q", "quit"):
            raise Quit
        if answer in ("y", "yes", "n", "no"):
            return answer.startswith("y")
        person.say(f"expected y, n or q, found {repr(answer[:20]) if answer else 'Enter'}")


def confirm(person: Person, text: str) -> bool:
    """Ask for Enter: True for it, False if the step is to be left out (s).

    Raises:
        Quit: The answer was q.
        BadInputError: No answer can come.
    """
    while True:
        answer = person.ask(f"{text} [Enter; s leaves it out, q ends]")
        if answer in ("q", "quit"):
            raise Quit
        if answer in ("", "s", "skip"):
            return not answer
        person.say(f"expected Enter, s or q, found {answer[:20]!r}")
