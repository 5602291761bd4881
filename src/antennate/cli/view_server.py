"""The process that serves the page of a live view. It tells its address, and nothing else."""

from __future__ import annotations

import contextlib
import signal
import socket
import sys
from typing import TYPE_CHECKING

from antennate.cli.status import write
from antennate.errors import AntennateError
from antennate.hardware.host import give_way
from antennate.messages import one_line
from antennate.telemetry.view.channel import FAILED, IDLE, READY, Channel

if TYPE_CHECKING:
    from antennate.telemetry.view.show import Display

_NONE = "-"
_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    """Serve until the program that is shown has ended; words as for `ViewProcess`."""
    for number in _STOPS:  # that program decides when it is over
        signal.signal(number, signal.SIG_IGN)
    channel_file, page_file, foxglove, *more = sys.argv[1:]
    channel = Channel(socket.socket(fileno=int(channel_file)))
    try:
        _serve(
            channel,
            None if page_file == _NONE else socket.socket(fileno=int(page_file)),
            None if foxglove == _NONE else int(foxglove),
            IDLE in more,
        )
    except AntennateError as error:
        channel.send(FAILED, one_line(str(error)).encode())
        return 1
    return 0


def _serve(
    channel: Channel, listener: socket.socket | None, foxglove: int | None, idle: bool
) -> None:
    from antennate.telemetry.view.show import run

    displays: list[Display] = []
    with contextlib.ExitStack() as stack:
        if foxglove is not None:
            displays.append(_sink(foxglove))
        if listener is not None:
            displays.append(_page(channel, listener, stack))
        if idle:
            give_way()
        channel.send(READY)
        run(channel, displays)


def _sink(port: int) -> Display:
    from antennate.telemetry.view.foxglove import FoxgloveSink, layout

    sink = FoxgloveSink(port)
    write(f"foxglove: {sink.address}, layout {layout()}; it does not check who reads it\n")
    return sink


def _page(channel: Channel, listener: socket.socket, stack: contextlib.ExitStack) -> Display:
    from antennate.telemetry.view import page
    from antennate.telemetry.view.gate import Gate
    from antennate.telemetry.view.server import serve
    from antennate.telemetry.view.show import Page

    port = listener.getsockname()[1]
    gate = Gate(port, *page.load(port), lambda: write(f"view: for another browser: {gate.link}\n"))
    server = serve(listener, gate)
    stack.callback(server.stop)
    shown = Page(server, channel)
    write(f"view: {gate.link}\n")
    return shown


if __name__ == "__main__":
    sys.exit(main())
