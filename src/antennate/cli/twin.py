"""`antennate twin`: the simulated robot behind two pseudo-terminals, or on the network."""

from __future__ import annotations

import contextlib
import json
import os
import re
import secrets
import sys
import threading
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import FromFile, parse
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.progress import stop_signals
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.driving.priority import LEVEL, urgent
from antennate.hardware.ports.keys import read_key
from antennate.twin.config import TwinConfig, watched
from antennate.twin.endpoints import Endpoint
from antennate.twin.faults import Faults, read
from antennate.twin.passage import Passage
from antennate.twin.serve import TwinServer
from antennate.twin.tcp import TcpEndpoint
from antennate.twin.touch import TouchStimulus
from antennate.twin.udp import UdpEndpoint

_LAST_PORT = 65_534

DESCRIPTION = """\
Serve the simulated robot in a scene as real bytes on two pseudo-terminals: the frames of the
antenna board, and a DYNAMIXEL bus with all its servos. Prints one JSON line with the paths when
ready. Physics begins when the first servo gets torque. --fault and --touch may be repeated.

--touch left@2s right@5s bends the antennae of the standing robot, as the check by touch of
`antennate drive` wants it, from the beginning of each client on. left:20mm@2s holds the left one,
its tip 20 mm aside. --touch - takes left, left:20mm and so on as lines of standard input, to follow
the marks of `antennate record`. A robot that has walked is put back to the start when a new client
begins and no servo has torque.

Faults, each with @Ts for its time:
servo:ID=silent, bad_crc, truncated, late:SECONDS, doubled, wrong_id, oversized, voltage, overheat,
encoder, shock, overload, reboot or REGISTER:VALUE;
esp32=silent, reset, open_left, short_left (or right), left:COUNTS, right:COUNTS or ber:SHARE;
bus=silent, loss:SHARE, latency:SECONDS, discharge:VOLTS_A_SECOND or ber:SHARE;
link=ber:SHARE (bits wrong) or loss:SHARE (bytes lost), on both wires both ways."""


@dataclass(frozen=True)
class Places(FromFile):
    """Where to serve; two pseudo-terminals if no port is given."""

    tcp: str = option("", "TCP: the board on PORT, the bus on PORT+1; 0 takes any", "[HOST:]PORT")
    udp: str = option("", "the board on a UDP port instead, likewise", "[HOST:]PORT")
    key: Path | None = option(
        None, "file with the key for --udp, mode 0600; else ANTENNATE_KEY", "FILE"
    )
    passed: Path | None = option(
        None, "make this file when the head passes the exit, for `drive --until FILE`", "FILE"
    )
    pace: Literal["real", "lockstep"] = option(
        "real", "real time, or a control period with each sync write of all goals"
    )


@stop_signals(last=True)
def command(argv: Sequence[str]) -> int:
    """Serve until the duration is over, Ctrl-C or SIGTERM.

    Raises:
        AntennateError: Something given cannot be used.
    """
    config, places = parse("twin", DESCRIPTION, TwinConfig, argv, Places)
    faults = Faults([read(text) for text in config.fault], config.robot.ids)
    real = places.pace == "real"
    robot, passage = watched(config, boot_id=secrets.randbits(32) if real else None)
    passage.on_pass = lambda: _tell(passage, places.passed)
    if robot.touch is not None and robot.touch.typed:
        threading.Thread(target=_take_orders, args=(robot.touch,), daemon=True).start()
    end = float("inf") if config.duration is None else config.duration
    with TwinServer(robot, faults, *_endpoints(places)) as server:
        try:
            sys.stdout.write(json.dumps(server.paths) + "\n")
            sys.stdout.flush()
            with urgent(LEVEL + 1) if real else nullcontext():
                serve = server.run if real else server.run_lockstep
                serve(lambda t: t < end and robot.failure is None)
        finally:
            invalid = f"physics became invalid: {robot.failure}; " if robot.failure else ""
            late = f"its latest tick was {1e3 * server.late:.1f} ms late"
            sys.stderr.write(f"The twin has ended: {invalid}{passage.summary}; {late}.\n")
    return OK


def _tell(passage: Passage, file: Path | None) -> None:
    """The head has passed the exit."""
    sys.stderr.write(f"{passage.summary}\n")
    sys.stderr.flush()
    if file is not None:
        try:
            file.touch()
        except OSError as error:
            sys.stderr.write(f"--passed: expected to make {file}, found: {error.strerror}\n")


def _take_orders(touch: TouchStimulus) -> None:
    """Carry out touches that are typed; a line that is none is answered."""
    rest = b""
    with contextlib.suppress(OSError):  # nobody types any more
        while part := os.read(
            0, 4096
        ):  # without the lock of a buffer, which an exit would wait for
            *lines, rest = (rest + part).split(b"\n")
            for line in lines:
                try:
                    touch.order(line.decode("utf-8", "replace"))
                except BadInputError as error:
                    sys.stderr.write(f"{error}\n")


def _endpoints(places: Places) -> tuple[Endpoint | None, Endpoint | None]:
    """Endpoints of the board and the bus, None for a pseudo-terminal."""
    board = bus = None
    if places.udp:
        board = UdpEndpoint(*_place("--udp", places.udp), read_key(places.key))
    if places.tcp:
        host, port = _place("--tcp", places.tcp)
        board = board or TcpEndpoint(host, port)
        bus = TcpEndpoint(host, port and port + 1)
    return board, bus


def _place(flag: str, text: str) -> tuple[str, int]:
    """Host and port; without a host nobody beyond this computer can connect."""
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > _LAST_PORT:
        raise ConfigError(
            f"{flag}: expected [HOST:]PORT with a port of 0 to {_LAST_PORT}, found {text!r}"
        )
    return host or "127.0.0.1", int(port)
