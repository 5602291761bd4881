"""The flags of a live view, and the view that they ask for."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pydantic.dataclasses import dataclass

from antennate.cli import view_server
from antennate.cli.options import option
from antennate.cli.status import write
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import BY_HAND
from antennate.telemetry.view import FOXGLOVE_PORT, PAGE_PORT

if TYPE_CHECKING:  # both import much, for a page that few runs want
    from antennate.telemetry.view.process import ViewProcess
    from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class FoxgloveOptions:
    """Whether other tools may read along."""

    foxglove: bool = option(
        False, "topics live for Foxglove and Lichtblick, without access control"
    )
    foxglove_port: int = option(
        FOXGLOVE_PORT,
        "port for these, 0 takes any",
        "PORT",
        needs=["--foxglove"],
        ge=0,
        le=65535,
    )


@dataclass(frozen=True)
class PageOptions(FoxgloveOptions):
    """Where the page is."""

    view: bool = option(False, "show it on a page of this computer while it runs")
    view_port: int = option(
        PAGE_PORT, "port of that page, 0 takes any", "PORT", needs=["--view"], ge=0, le=65535
    )


@dataclass(frozen=True)
class ViewOptions(PageOptions):
    """The same where time is simulated."""

    view_paused: bool = option(False, "start paused, so that nothing is missed", needs=["--view"])
    view_speed: float = option(
        1.0,
        "times real time at which --view begins, 0 as fast as it goes",
        "FLOAT",
        needs=["--view", "--foxglove"],
        ge=0,
        le=100,
    )


def foxglove_of(options: FoxgloveOptions) -> int | None:
    """The port for Foxglove, None without it."""
    return options.foxglove_port if options.foxglove else None


def page_of(options: PageOptions, idle: bool = False) -> ViewProcess | None:
    """The process of the page that is wanted, None of none; it is to be closed.

    Args:
        options: What is wanted.
        idle: Whether it gives way to everything else, as beside a loop in real time.

    Raises:
        AntennateError: It cannot be served.
    """
    foxglove = foxglove_of(options)
    if not options.view and foxglove is None:
        return None
    from antennate.telemetry.view.process import ViewProcess

    port = options.view_port if options.view else None
    return ViewProcess(port, view_server.__name__, foxglove, on_lost=_say, idle=idle)


def _say(line: str) -> None:
    write(f"{line}\n")


@contextlib.contextmanager
def view_of(options: ViewOptions) -> Iterator[SimulationView | None]:
    """The view of a simulation, None if none is wanted.

    Raises:
        AntennateError: As `page_of`.
    """
    process = page_of(options)
    if process is None:
        yield None
        return
    from antennate.telemetry.view.simulation import SimulationView

    with process:
        speed, paused = options.view_speed, options.view_paused
        yield SimulationView(process.channel, speed, paused=paused)


def say_by_hand(lines: Sequence[str], run: RunDirectory) -> None:
    """Keep what a person changed in the run, and say so."""
    if not lines:
        return
    head = "Changed by hand while it ran: this run does not follow from its configuration."
    run.write(BY_HAND, "\n".join([head, *lines]) + "\n")
    sys.stderr.write(f"changed by hand, so not reproducible: {run.path / BY_HAND}\n")
