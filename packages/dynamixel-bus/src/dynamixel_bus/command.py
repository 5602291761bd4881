"""`dynamixel-bus`: virtual DYNAMIXEL servos on a pseudo-terminal or a TCP port."""

from __future__ import annotations

import argparse
import errno
import json
import math
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import NoReturn, TextIO

from dynamixel_bus import __version__, demands, servo_list
from dynamixel_bus.demands import Demand
from dynamixel_bus.endpoints import Endpoint, TcpEndpoint
from dynamixel_bus.errors import BadInputError, BusError, ConfigError, reason
from dynamixel_bus.messages import one_line
from dynamixel_bus.models import MODELS
from dynamixel_bus.server import Server
from dynamixel_bus.servo_bus import ServoBus

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130
"""Exit codes."""
_LAST_PORT = 65_535
_DESCRIPTION = f"""\
Serve virtual DYNAMIXEL servos, which answer any program that speaks Protocol 2.0. Prints one JSON
line with the path that the program opens, when ready. Ctrl-C ends it.

models: {", ".join(MODELS)}, or a file that ends in .toml
faults, each with @Ts for its time:
  servo:ID=silent, bad_crc, truncated, late:SECONDS, doubled, wrong_id, oversized, voltage,
    overheat, encoder, shock, overload, reboot, frozen or jump:TICKS (Present Position), none,
    or REGISTER:VALUE
  bus=silent, echo, loss:SHARE, latency:SECONDS or ber:SHARE
"""


class _Parser(argparse.ArgumentParser):
    """Words of the command; what is wrong with them is one line."""

    def error(self, message: str) -> NoReturn:
        raise BadInputError(message)

    def _print_message(self, message: str, file: object = None) -> None:
        """Write a text of --help or --version; Python 3.11 to 3.13 lose or raise its errors."""
        _print(message)


class FaultyServer(Server):
    """A server whose servos fail on demand.

    Args:
        bus: The servos; only the server touches them.
        endpoint: The server's end of their wire, a pseudo-terminal by default.
        faults: What goes wrong, and when.
    """

    def __init__(
        self, bus: ServoBus, endpoint: Endpoint | None = None, faults: Sequence[Demand] = ()
    ) -> None:
        self._servos = {servo.get("id"): servo for servo in reversed(bus.servos)}
        for demand in faults:
            if demand.target == "servo" and demand.servo not in self._servos:
                known = ", ".join(map(str, sorted(self._servos)))
                raise BadInputError(f"--fault: expected a servo of {known}, found {demand.servo}")
        super().__init__(bus, endpoint)
        self._waiting = sorted(faults, key=lambda demand: demand.t)

    def _advance(self, now: float) -> None:
        while self._waiting and self._waiting[0].t <= now:
            demand = self._waiting.pop(0)
            if demand.target == "servo":
                demands.break_servo(self._servos[demand.servo], demand, now)
            else:
                demands.break_bus(self._wire, demand)
        super()._advance(now)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: Words after the program's name; those of this process by default.

    Returns:
        The exit code: 0, 2 after bad input, 130 if interrupted.
    """
    _take_closed()
    try:
        return _serve(_read(argv))
    except BusError as error:
        with suppress(OSError):  # nobody can be told
            _write(sys.stderr, f"dynamixel-bus: error: {one_line(str(error))}\n")
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def _take_closed() -> None:
    """Let what is written to closed standard streams fail, and no wire get their numbers."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:  # what is opened next gets this number; to write to it is an error
            os.open(os.devnull, os.O_RDONLY)
        if number and getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, "w", encoding="utf-8", closefd=False))


def _write(stream: TextIO, text: str) -> None:
    """Write at once."""
    try:
        stream.write(text)
        stream.flush()
    except OSError:
        with suppress(OSError):  # the buffer keeps the text, and Python flushes it at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        raise


def _print(text: str) -> None:
    """Write to standard output; a reader that has ended is no error."""
    try:
        _write(sys.stdout, text)
    except BrokenPipeError:
        pass
    except OSError as error:
        why = "it is closed" if error.errno == errno.EBADF else reason(error)
        raise BadInputError(f"cannot write to standard output: {why}") from None


def _read(argv: Sequence[str] | None) -> argparse.Namespace:
    """Words of the command; servos behind `--fault` are servos."""
    parser = _parser()
    given = parser.parse_args(argv)
    given.servos += filter(servo_list.is_listed, given.fault)
    given.fault = [word for word in given.fault if not servo_list.is_listed(word)]
    if not given.servos:
        parser.error(f"the following arguments are required: {servo_list.FORM}")
    return given


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dynamixel-bus",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "servos", nargs="*", metavar=servo_list.FORM, help="as 1:xl330-m288 2:xl430-w250@1000000"
    )
    parser.add_argument("--tcp", metavar="[HOST:]PORT", help="a TCP port, 0 for any that is free")
    parser.add_argument("--duration", metavar="SECONDS", help="end by itself")
    parser.add_argument(
        "--fault",
        metavar="FAULT",
        nargs="+",
        action="extend",
        default=[],
        help="what goes wrong; may be given several times",
    )
    parser.add_argument("--version", action="version", version=__version__)
    return parser


def _serve(given: argparse.Namespace) -> int:
    duration = _seconds(given.duration)
    faults = [demands.read(text) for text in given.fault]
    servos = [servo_list.make_servo(listed) for listed in servo_list.read_list(given.servos)]
    if not servos:
        raise ConfigError(f"expected servos, found none in {' '.join(given.servos)}")
    with (
        FaultyServer(ServoBus(servos), _endpoint(given.tcp), faults) as server,
        _stops() as stops,
    ):
        server.run(_until(duration, server.paths, stops))
    return INTERRUPTED if stops else OK


@contextmanager
def _stops() -> Iterator[list[int]]:
    """Signals that have asked for an end; the server ends between two packets."""
    asked: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: asked.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _seconds(text: str | None) -> float:
    """Seconds until the end, inf without one."""
    if text is None:
        return math.inf
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not seconds > 0.0:
        raise ConfigError(f"--duration: expected seconds above 0, found {text!r}")
    return seconds


def _endpoint(text: str | None) -> Endpoint | None:
    """The end of the wire, None for a pseudo-terminal."""
    if text is None:
        return None
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > _LAST_PORT:
        raise ConfigError(
            f"--tcp: expected [HOST:]PORT with a port of 0 to {_LAST_PORT}, found {text!r}"
        )
    return TcpEndpoint(host or "127.0.0.1", int(port))


def _until(duration: float, paths: dict[str, str], stops: Sequence[int]) -> Callable[[float], bool]:
    """Whether to go on at a time [s]; the first time it also prints the paths."""
    ready = False

    def go_on(t: float) -> bool:
        nonlocal ready
        if not ready:
            ready = True
            _print(json.dumps(paths) + "\n")
        return t < duration and not stops

    return go_on
