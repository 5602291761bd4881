"""The flags of a live view, and the view that they ask for."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli import view_server
from antennate.cli.options import option
from antennate.errors import ConfigError
from antennate.studies.run_directory import BY_HAND, RunDirectory
from antennate.telemetry.view.process import PORT, ViewProcess
from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class PageOptions:
    """Where the page is."""

    view: bool = option(False, "show it on a page of this computer while it runs")
    view_port: int = option(PORT, "port of that page, 0 takes any", "PORT", ge=0, le=65535)


@dataclass(frozen=True)
class ViewOptions(PageOptions):
    """The same where time is simulated."""

    view_speed: float = option(
        1.0, "times real time at which --view begins, 0 as fast as it goes", "FLOAT", ge=0, le=100
    )


def page_of(options: PageOptions) -> ViewProcess | None:
    """The process of the page that is wanted, None of none; it is to be closed.

    Raises:
        ConfigError: Something is said of a page that is not wanted.
        AntennateError: It cannot be served.
    """
    if options.view:
        return ViewProcess(options.view_port, view_server.__name__)
    for name, usual in (("view_port", PORT), ("view_speed", 1.0)):
        if getattr(options, name, usual) != usual:
            flag = f"--{name.replace('_', '-')}"
            raise ConfigError(f"{flag}: expected --view beside it, found none")
    return None


@contextlib.contextmanager
def view_of(options: Any) -> Iterator[SimulationView | None]:
    """The view of a simulation, None if none is wanted.

    Raises:
        AntennateError: As `page_of`.
    """
    process = page_of(options) if isinstance(options, ViewOptions) else None
    if process is None or not isinstance(options, ViewOptions):
        yield None
        return
    with process:
        yield SimulationView(process.channel, options.view_speed)


def require_one_worker(options: Any) -> None:
    """Check that no processes are asked for beside a view.

    Raises:
        ConfigError: Some are.
    """
    workers = getattr(options, "workers", None)
    if getattr(options, "view", False) and workers not in (None, 1):
        raise ConfigError(
            f"--workers: expected 1 beside --view, which shows one trial at a time, found {workers}"
        )


def tell_by_hand(view: SimulationView | None, run: RunDirectory) -> None:
    """Keep what a person changed in the run, and say so."""
    if view is None or not view.by_hand:
        return
    lines = [
        "Changed by hand while it ran: this run does not follow from its configuration.",
        *view.by_hand,
    ]
    run.write(BY_HAND, "\n".join(lines) + "\n")
    sys.stderr.write(f"changed by hand, so not reproducible: {run.path / BY_HAND}\n")
