"""`antennate drive`: the controller on the real robot, or on its twin."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from antennate.cli import BAD_INPUT, OK
from antennate.cli.arguments import FromFile, parse_with
from antennate.cli.progress import terminate_as_interrupt
from antennate.errors import ConfigError
from antennate.hardware.causes import State
from antennate.hardware.drive import DriveConfig, Report, connect, drive
from antennate.hardware.keys import read_key
from antennate.hardware.ports import is_udp
from antennate.hardware.session import Session
from antennate.records import Maneuver

DESCRIPTION = """\
Let a controller walk the robot whose antenna board and servo bus hang on two serial ports, or its
twin. An address is the path of a serial port, tcp://HOST:PORT, or, for a board on the network,
udp://HOST:PORT with the key it was given. First a dry run: everything is read and nothing written.
Then, with --arm only, torque comes on with every servo where it stands. Ctrl-C or SIGTERM ends it:
pose held, torque off, verified. A lost board or servo makes it hold; the watchdogs of the servos
stop it if this program dies."""
_LINES_A_SECOND = 5


@dataclass(frozen=True)
class Orders(FromFile):
    """What to talk to, and whether to move.

    Attributes:
        config: robot.toml with the parameters below as keys and tables; flags override it
        esp32: serial port of the antenna board, tcp://HOST:PORT or udp://HOST:PORT
        bus: serial port of the servo bus, or tcp://HOST:PORT
        arm: torque on after the dry run
        key: file with the key of a board behind udp://, mode 0600; else ANTENNATE_KEY is read
        insecure_udp: the board has no key; anybody on the network can feign it
    """

    esp32: Annotated[str, tyro.conf.arg(metavar="PORT")] = ""
    bus: Annotated[str, tyro.conf.arg(metavar="PORT")] = ""
    arm: bool = False
    key: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    insecure_udp: bool = False


def command(argv: Sequence[str]) -> int:
    """Drive until the duration is over or it is stopped.

    Raises:
        AntennateError: A port, a servo or the board is not what is needed; nothing moved then.
    """
    config, orders = parse_with("drive", DESCRIPTION, DriveConfig, argv, Orders())
    for name in ("esp32", "bus"):
        if not getattr(orders, name):
            raise ConfigError(f"--{name}: expected a serial port, found none")
    key = _key(orders)
    with connect(config, orders.esp32, orders.bus, key) as session, terminate_as_interrupt():
        report = drive(session, config, orders.arm, _status())
    _tell(report, orders.arm)
    return OK if report.safe and report.worst < State.FAULT else BAD_INPUT


def _key(orders: Orders) -> bytes | None:
    """The key for a board behind udp://, None if there is no such board."""
    if is_udp(orders.bus):
        raise ConfigError("--bus: expected a serial port or tcp://, found udp://; it loses packets")
    if not is_udp(orders.esp32):
        return None
    if not orders.insecure_udp:
        return read_key(orders.key)
    if orders.key is not None:
        raise ConfigError("--insecure-udp: expected no --key beside it, found both")
    warning = "UDP without a key: anybody on this network can feign the antenna board"
    red = "\x1b[1;31m{}\x1b[0m" if sys.stderr.isatty() else "{}"
    sys.stderr.write(red.format(warning) + "\n")
    return b""


def _status() -> Callable[[Session, float], None]:
    """A function that shows one line now and then, over the last one on a terminal."""
    due = -math.inf
    end = "\r" if sys.stderr.isatty() else "\n"
    every = 1.0 / _LINES_A_SECOND if sys.stderr.isatty() else 1.0

    def show(session: Session, t: float) -> None:
        nonlocal due
        if t < due:
            return
        due = t + every
        sys.stderr.write(_line(session, t) + end)
        sys.stderr.flush()

    return show


def _line(session: Session, t: float) -> str:
    out, clock, bus = session.outputs, session.board.clock, session.bus.tally
    missed = 0 if session.timing is None else session.timing.report().missed_cycles
    bytes_ = session.board.decoder.counters
    state = "-" if out is None else out.state.name
    why = "" if out is None or not out.causes else f" {out.causes[0].text}"
    maneuver = Maneuver(int(session.decider.maneuver[0])).name
    read = " ".join(f"{channel.reading.counts:.0f}" for channel in session.channels)
    return (
        f"{t:7.1f} s {state} {maneuver} counts={read} age={1e3 * clock.age(t):.0f}ms "
        f"missed={missed} frames={bytes_.good} crc={bytes_.crc_errors} "
        f"lost={clock.sequence.lost} misses={bus.misses} stale={bus.stale} "
        f"sent={session.tally.sent}{why}"
    )


def _tell(report: Report, armed: bool) -> None:
    if not armed:
        sys.stderr.write("\ndry run over, nothing was written to the servos; --arm lets it walk\n")
    if (timing := report.timing) is not None:
        stages = ", ".join(f"{n} {1e3 * s.worst:.1f}" for n, s in timing.stages.items())
        missed = f"{timing.missed_cycles} missed ({100 * timing.missed_share:.2f} %)"
        late = f"worst {1e3 * timing.worst_lateness:.1f} ms late"
        sys.stderr.write(f"\n{timing.ticks} ticks, {missed}, {late}; worst stages [ms]: {stages}")
    off = "off, verified" if report.safe else f"NOT confirmed off: servos {report.on}"
    worst = f"{report.worst.name} ({report.why})" if report.why else report.worst.name
    sys.stderr.write(f"\nworst state {worst}; torque {off}\n")
