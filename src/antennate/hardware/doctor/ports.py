"""Ports for an examination: who else has them open, and how late their adapters deliver."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from antennate.hardware.doctor.check import Finding, Opener, Row
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.ports.errors import OpenError
from antennate.hardware.ports.finder import finder
from antennate.hardware.ports.holder import holders
from antennate.params.hardware import DoctorParams, NetworkParams

_TIMERS = Path("/sys/bus/usb-serial/devices")
_TERMINALS = Path("/dev/pts")
"""Where the twin's ports are."""
_USUAL_NAME = "ttyUSB0"


def opener_of(
    path: str, flag: str, key: bytes | None = None, network: NetworkParams | None = None
) -> Opener:
    """Opens a port at any speed; `key` and `network` are those of a board behind udp://.

    Raises:
        ConfigError: pyserial is not installed.
    """
    return lambda baud: contextlib.closing(finder(path, baud, flag, key, network)())


def port_row(part: str, path: str, opener: Opener, baud: int = BOARD_BAUD) -> Row:
    """Whether a port is there, may be opened, and is used by no other program."""
    try:
        with opener(baud):
            others = ", ".join(holders(path))
        cure = "end that program: two readers take each other's bytes"
        finding = Finding(f"{path}, in use by {others}", "warn", cure) if others else Finding(path)
    except OpenError as error:
        finding = Finding(f"{path}: {error.found}", "bad", error.cure)
    return finding.row(part, "port", "opens, used by no other program")


def latency_row(path: str, slow: bool, params: DoctorParams, timers: Path = _TIMERS) -> Row:
    """The latency timer of the bus's adapter; `slow` if all answers were measured to come late."""
    most, name = params.latency_timer, Path(os.path.realpath(path)).name
    file = timers / name / "latency_timer"
    value = None
    with contextlib.suppress(OSError, ValueError):
        value = int(file.read_text())
    if value is None and not name.startswith("tty"):
        file = timers / _USUAL_NAME / "latency_timer"
    set_it = (
        f"run `echo {most} | sudo tee {file}`, or `setserial {path} low_latency`; again after "
        "every plug-in"
    )
    if Path(os.path.realpath(path)).parent == _TERMINALS:
        cure = "if a twin is there, the computer is too busy: end other programs"
    elif value is None:
        cure = f"if it is an FTDI adapter (U2D2), {set_it}; else use one"
    elif value > most:
        cure = set_it
    else:
        cure = "not the timer: plug the adapter into the computer itself, end busy programs"
    shown = "none is shown" if value is None else f"{value} ms"
    late = ", and answers come late" if slow else ""
    high = value is not None and value > most
    finding = Finding(shown + late, "bad" if high or slow else "ok", cure)
    return finding.row("bus", "latency timer", f"at most {most} ms")


def same(one: str, other: str) -> bool:
    """Whether two paths are one device."""
    return os.path.realpath(one) == os.path.realpath(other)
