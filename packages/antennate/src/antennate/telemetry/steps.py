"""Steps of a protocol in the log of its drive."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from antennate.control.protocol import Protocol, Step
from antennate.errors import LogError
from antennate.params.base import from_values
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import EVENTS, PROTOCOL


class LoggedStep(NamedTuple):
    """A step as it was recorded.

    Attributes:
        name: Name of the step.
        place: Place of the step, `hanging`, `floor` or `hand`.
        begin: Number of its first tick.
        end: Number of the first tick that is no more of it.
        whole: Whether it went on to its end; one that was broken off may come again.
        step: What moves, and how.
    """

    name: str
    place: str
    begin: int
    end: int
    whole: bool
    step: Step


def protocol_of(log: LogReader) -> Protocol:
    """The protocol of a log, as it was for its robot.

    Raises:
        LogError: The log is of no protocol.
    """
    if not log.header.protocol:
        raise LogError(f"{log.path}: expected the log of a protocol, found one of another drive")
    return from_values(Protocol, log.header.protocol)


def steps(path: Path) -> tuple[LoggedStep, ...]:
    """Steps that a log holds, all its files, in their order; those broken off are among them.

    Args:
        path: The log, its first file.

    Raises:
        LogError: It cannot be read, or is of no protocol.
    """
    found: list[LoggedStep] = []
    begun: tuple[str, int] | None = None
    with LogReader(path) as log:
        known = {step.called: step for step in protocol_of(log).steps}

        def close(end: int, whole: bool) -> None:
            if begun is not None and begun[0] in known:
                step = known[begun[0]]
                found.append(LoggedStep(begun[0], step.place, begun[1], end, whole, step))

        for records, _ in log.groups():
            for record in records:
                if record.topic is not EVENTS:
                    continue
                event = EVENTS.decode(record.data)
                if event["name"] != PROTOCOL:
                    continue
                word, _, name = str(event["msg"]).partition(" ")
                close(record.number, word == "end" and begun is not None and begun[0] == name)
                begun = (name, record.number) if word == "begin" else None
        close(log.last + 1, False)
    return tuple(found)
