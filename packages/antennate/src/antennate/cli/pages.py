"""The page of a live view, and the process that serves it.

Run as a module it is that process, which tells the address of the page and nothing else.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from antennate.cli.options import LiveOptions, PageOptions, ViewOptions
from antennate.cli.terminal import write
from antennate.errors import FAILURES, ConfigError
from antennate.host import STOPS, give_way
from antennate.messages import one_line, shown
from antennate.studies.run_files import BY_HAND
from antennate.telemetry import LAST_DOMAIN
from antennate.telemetry.view.channel import END, FAILED, IDLE, READY, Channel
from antennate.telemetry.view.pace import RATE

if TYPE_CHECKING:  # these import much, for a page that few runs want
    from antennate.studies.run_directory import RunDirectory
    from antennate.telemetry.view.foxglove import FoxgloveSink
    from antennate.telemetry.view.process import Place, ViewProcess
    from antennate.telemetry.view.ros import RosSink
    from antennate.telemetry.view.show import Page
    from antennate.telemetry.view.simulation import SimulationView

MODULE = "antennate.cli.pages"
"""What Python runs as the process of a page."""
_NONE = "-"
_DOMAIN = "ROS_DOMAIN_ID"
"""Variable of the environment in which ROS 2 finds the number of its domain."""


def place_of(options: LiveOptions, accept: bool = False) -> Place | None:
    """Where topics of ROS 2 are wanted, None if they are not.

    Args:
        options: What is wanted.
        accept: Whether goals of joints are taken.
    """
    if not options.ros:
        return None
    from antennate.telemetry.view.process import Place

    domain = options.ros_domain
    if domain is None:
        text = os.environ.get(_DOMAIN) or "0"
        domain = int(text) if text.isascii() and text.isdigit() else LAST_DOMAIN + 1
        if domain > LAST_DOMAIN:
            raise ConfigError(
                f"{_DOMAIN}: expected a number from 0 to {LAST_DOMAIN}, found {shown(text)}"
            )
    return Place(domain, options.ros_network, accept)


def page_of(options: PageOptions, idle: bool = False, accept: bool = False) -> ViewProcess | None:
    """The process of the page that is wanted, None of none; it is to be closed.

    Args:
        options: What is wanted.
        idle: Whether it gives way to everything else, as beside a loop in real time.
        accept: Whether goals of joints are taken from ROS 2.
    """
    if not options.is_shown:
        return None
    from antennate.telemetry.view.process import ViewProcess

    port = options.view_port if options.view else None
    return ViewProcess(
        port,
        MODULE,
        options.port_for_foxglove,
        on_lost=lambda line: write(f"{line}\n"),
        idle=idle,
        ros=place_of(options, accept),
    )


@contextlib.contextmanager
def view_of(options: ViewOptions) -> Iterator[SimulationView | None]:
    """The view of a simulation, None if none is wanted."""
    process = page_of(options)
    if process is None:
        yield None
        return
    from antennate.telemetry.view.simulation import SimulationView

    with process:
        speed, paused = options.view_speed, options.view_paused
        yield SimulationView(process.channel, speed, paused=paused, every=options.ros)


def say_by_hand(lines: Sequence[str], run: RunDirectory) -> None:
    """Keep what a person changed in the run, and say so."""
    if not lines:
        return
    head = "Changed by hand while it ran: this run does not follow from its configuration."
    run.write(BY_HAND, "\n".join([head, *lines]) + "\n")
    sys.stderr.write(f"changed by hand, so not reproducible: {run.path / BY_HAND}\n")


def main() -> int:
    """Serve until the program that is shown has ended; words as for `ViewProcess`."""
    for number in STOPS:  # that program decides when it is over
        signal.signal(number, signal.SIG_IGN)
    channel_file, page_file, foxglove, *more = sys.argv[1:]
    channel = Channel(socket.socket(fileno=int(channel_file)))
    try:
        _serve(
            channel,
            None if page_file == _NONE else socket.socket(fileno=int(page_file)),
            None if foxglove == _NONE else int(foxglove),
            more,
        )
    except FAILURES as error:
        channel.send(FAILED, one_line(str(error)).encode())
        return 1
    return 0


def _serve(
    channel: Channel, listener: socket.socket | None, foxglove: int | None, more: Sequence[str]
) -> None:
    from antennate.telemetry.view.process import Place

    displays: list[Page | FoxgloveSink | RosSink] = []
    ros = Place.of(more)
    with contextlib.ExitStack() as stack:
        if foxglove is not None:
            displays.append(_sink(foxglove))
        if ros is not None:
            displays.append(_topics(ros, channel))
        if listener is not None:
            displays.append(_page(channel, listener, stack))
        if IDLE in more:
            give_way()
        channel.send(READY)
        _show(channel, displays, prompt=ros is not None)


def _show(
    channel: Channel, displays: Sequence[Page | FoxgloveSink | RosSink], prompt: bool
) -> None:
    """Show what comes until the program has ended, and that it has.

    With `prompt` each message as it comes. That costs the program time, so else it is at pictures.
    """
    ended = False
    while not (ended or channel.closed):
        wait = min(each.draw(time.monotonic()) for each in displays)
        if prompt:
            select.select((channel,), (), (), wait)
        else:
            time.sleep(min(wait, 1.0 / RATE))
        for kind, content in channel.receive():
            if ended := kind == END:
                break
            for each in displays:
                each.take(kind, content)
    for each in displays:
        each.end()


def _sink(port: int) -> FoxgloveSink:
    from antennate.telemetry.view.foxglove import FoxgloveSink, layout

    sink = FoxgloveSink(port)
    write(f"foxglove: {sink.address}, layout {layout()}; it does not check who reads it\n")
    return sink


def _topics(place: Place, channel: Channel) -> RosSink:
    from antennate.telemetry.view.ros import GOAL_TOPIC, RosSink

    sink = RosSink(place, channel, lambda line: write(f"{line}\n"))
    where = f"domain {place.domain} {'of the network' if place.network else 'on this computer'}"
    goals = f"; goals of joints are taken from {GOAL_TOPIC}" if place.accept else ""
    write(f"ros: topics in {where}, which does not check who reads them{goals}\n")
    return sink


def _page(channel: Channel, listener: socket.socket, stack: contextlib.ExitStack) -> Page:
    from antennate.telemetry.view.server import Gate, load_page, serve
    from antennate.telemetry.view.show import Page

    port = listener.getsockname()[1]
    gate = Gate(port, *load_page(port), lambda: write(f"view: for another browser: {gate.link}\n"))
    server = serve(listener, gate)
    stack.callback(server.stop)
    display = Page(server, channel)
    write(f"view: {gate.link}\n")
    return display


if __name__ == "__main__":
    sys.exit(main())
