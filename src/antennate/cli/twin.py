"""`antennate twin`: the simulated robot behind two pseudo-terminals, or on the network."""

from __future__ import annotations

import json
import re
import secrets
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import FromFile, parse
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.progress import end_at_first
from antennate.errors import ConfigError
from antennate.hardware.driving.priority import LEVEL, urgent
from antennate.hardware.ports.keys import read_key
from antennate.twin.config import TwinConfig, watched
from antennate.twin.endpoints import Endpoint
from antennate.twin.faults import Faults, read
from antennate.twin.serve import TwinServer
from antennate.twin.tcp import TcpEndpoint
from antennate.twin.udp import UdpEndpoint

_LAST_PORT = 65_534

DESCRIPTION = """\
Serve the simulated robot in a scene as real bytes on two pseudo-terminals: the frames of the
antenna board, and a DYNAMIXEL bus with all its servos. Prints one JSON line with the paths when
ready. Physics begins when the first servo gets torque. --fault and --touch may be repeated.

--touch left@2s right@5s bends the antennae of the standing robot, as the check by touch of
`antennate drive` wants it.

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
    pace: Literal["real", "lockstep"] = option(
        "real", "real time, or a control period with each sync write of all goals"
    )


def command(argv: Sequence[str]) -> int:
    """Serve until the duration is over, Ctrl-C or SIGTERM.

    Raises:
        AntennateError: Something given cannot be used.
    """
    with end_at_first():
        return _serve(argv)


def _serve(argv: Sequence[str]) -> int:
    config, places = parse("twin", DESCRIPTION, TwinConfig, argv, Places)
    faults = Faults([read(text) for text in config.fault], config.robot.ids)
    real = places.pace == "real"
    robot, passage = watched(config, boot_id=secrets.randbits(32) if real else None)
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
    """Host and port; this computer alone is the default, others are named on purpose."""
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > _LAST_PORT:
        raise ConfigError(
            f"{flag}: expected [HOST:]PORT with a port of 0 to {_LAST_PORT}, found {text!r}"
        )
    return host or "127.0.0.1", int(port)
