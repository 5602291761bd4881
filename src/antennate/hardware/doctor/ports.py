"""Serial ports for an examination, and who else has them open."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from antennate.errors import ConfigError
from antennate.hardware.board import BOARD_BAUD
from antennate.hardware.doctor.rows import Opener, Row, row
from antennate.hardware.port import Port
from antennate.hardware.port_errors import OpenError
from antennate.hardware.port_holder import holders


def serial_opener(path: str, flag: str) -> Opener:
    """Opens a serial port at any speed.

    Raises:
        ConfigError: pyserial is not installed.
    """
    try:
        from antennate.hardware.serial_port import SerialPort
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"expected pyserial for real ports, found no module {error.name}; install "
            "antennate[hardware], or run `uv run --extra hardware antennate ...`"
        ) from None

    @contextlib.contextmanager
    def opened(baud: int) -> Iterator[Port]:
        line = SerialPort(path, baud, flag)
        try:
            yield line
        finally:
            line.close()

    return opened


def port_row(part: str, path: str, opener: Opener, baud: int = BOARD_BAUD) -> Row:
    """Whether a port is there, may be opened, and is nobody else's."""
    expected = "opens, in use by nobody else"
    try:
        with opener(baud):
            others = holders(path)
    except OpenError as error:
        return Row(part, "port", expected, f"{path}: {error.found}", "bad", error.cure)
    used = f", in use by {', '.join(others)}" if others else ""
    return row(
        part,
        "port",
        expected,
        f"{path}{used}",
        "warn" if used else None,
        "end that program: two readers take each other's bytes",
    )


def same(one: str, other: str) -> bool:
    """Whether two paths are one device."""
    return os.path.realpath(one) == os.path.realpath(other)
