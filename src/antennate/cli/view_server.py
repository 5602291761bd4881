"""The process that serves the page of a live view. It tells its address, and nothing else."""

from __future__ import annotations

import signal
import socket
import sys

from antennate.errors import AntennateError
from antennate.messages import one_line
from antennate.telemetry.view.channel import FAILED, READY, Channel

_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    """Serve until the program that is shown has ended; its files are the two words given."""
    for number in _STOPS:  # that program decides when it is over
        signal.signal(number, signal.SIG_IGN)
    channel = Channel(socket.socket(fileno=int(sys.argv[1])))
    try:
        _serve(channel, socket.socket(fileno=int(sys.argv[2])))
    except AntennateError as error:
        channel.send(FAILED, one_line(str(error)).encode())
        return 1
    return 0


def _serve(channel: Channel, listener: socket.socket) -> None:
    from antennate.telemetry.view import page
    from antennate.telemetry.view.gate import Gate
    from antennate.telemetry.view.server import serve
    from antennate.telemetry.view.show import Page

    port = listener.getsockname()[1]
    gate = Gate(port, *page.load(port), lambda: _say(f"view: for another browser: {gate.link}"))
    server = serve(listener, gate)
    shown = Page(server, channel)
    channel.send(READY)
    _say(f"view: {gate.link}")
    shown.run()
    server.flush()
    server.stop()


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
