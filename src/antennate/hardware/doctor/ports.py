"""Serial ports for an examination, and who else has them open."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from antennate.hardware.doctor.rows import Opener, Row, row
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.ports.errors import OpenError
from antennate.hardware.ports.finder import finder
from antennate.hardware.ports.holder import holders
from antennate.hardware.ports.port import Port
from antennate.params import NetworkParams


def opener_of(
    path: str, flag: str, key: bytes | None = None, network: NetworkParams | None = None
) -> Opener:
    """Opens a port at any speed; `key` and `network` are those of a board behind udp://.

    Raises:
        ConfigError: pyserial is not installed.
    """

    @contextlib.contextmanager
    def opened(baud: int) -> Iterator[Port]:
        line = finder(path, baud, flag, key, network)()
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
