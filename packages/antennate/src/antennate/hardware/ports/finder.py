"""From an address to a Port that comes back after it was unplugged, and the key of a board.

A port is a serial line, a board on the network, or a TCP connection. What was unplugged is looked
for, and the loop never waits for it. A key is read here, and never shown.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TypeVar
from urllib.parse import urlsplit

from antennate.errors import BadInputError, reason
from antennate.files import open_regular
from antennate.params.hardware import NetworkParams
from dynamixel_bus.port import Line, Port, PortError

KEY_SIZE = 32
"""As many bytes as SHA-256 gives; more would add nothing."""
ENVIRONMENT = "ANTENNATE_KEY"
_MAKE = (
    'make one with: (umask 077; python3 -c "import secrets; print(secrets.token_hex(32))" > FILE)'
)


def read_key(path: Path | None, way_out: str = "") -> bytes:
    """The key in a file, or in the environment variable ANTENNATE_KEY if there is no file.

    Args:
        path: The file.
        way_out: What else can be done without a key, for the error.
    """
    if path is None:
        text = os.environ.get(ENVIRONMENT)
        if text is None:
            cures = f"{_MAKE}; {way_out}" if way_out else _MAKE
            raise BadInputError(f"--key: expected a file, or {ENVIRONMENT} set; {cures}")
        return _parse(text, ENVIRONMENT)
    return _parse(_private(path), f"--key {path}")


def _private(path: Path) -> str:
    """Content of a file that nobody else can read; looked at after opening, so it cannot change."""
    try:
        with open_regular(path) as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(1024)
    except OSError as error:
        raise BadInputError(f"--key: expected a file, found {path}: {reason(error)}") from None
    if mode & 0o077:
        raise BadInputError(
            f"--key: expected a file that only you can read (mode 0600), found {path} with mode "
            f"{stat.S_IMODE(mode):04o}; others may know this key: chmod 600 it, or better {_MAKE}"
        )
    return content.decode("ascii", "replace")


def _parse(text: str, where: str) -> bytes:
    if re.fullmatch(rf"\s*[0-9a-fA-F]{{{2 * KEY_SIZE}}}\s*", text) is None:
        raise BadInputError(f"{where}: expected {2 * KEY_SIZE} hexadecimal digits; {_MAKE}")
    return bytes.fromhex(text)


def finder(
    address: str,
    baud: int,
    flag: str = "",
    key: bytes | None = None,
    network: NetworkParams | None = None,
) -> Callable[[], Line]:
    """What opens the port that an address names, and opens the same one again when called again.

    Args:
        address: Path of a serial line, tcp://HOST:PORT or udp://HOST:PORT.
        baud: Bits per second of a serial line.
        flag: What named it, for errors.
        key: Of the board behind udp://; empty for one without a key.
        network: Pace and limits of udp://.
    """
    scheme, separator, _ = address.partition("://")
    if not separator:
        return _serial(address, baud, flag)
    host, port = _place(address, flag)
    if scheme == "tcp":
        from dynamixel_bus.ports import TcpPort

        return lambda: TcpPort(host, port)
    if scheme != "udp":
        raise BadInputError(
            f"{flag}: expected a path, tcp:// or udp://, found {address!r}; a serial line on the "
            "network is tcp://HOST:PORT, of ser2net in raw mode, or a pseudo-terminal of socat"
        )
    if key is None:
        raise BadInputError(
            f"{address}: expected the key of the board; give --key FILE, or --insecure-udp for a "
            "board without one (anybody on the network can then send frames in its place)"
        )
    from antennate.hardware.ports.network import UdpPort

    return lambda: UdpPort(host, port, key, network)


def is_udp(address: str) -> bool:
    """Whether an address needs a key."""
    return address.startswith("udp://")


def _place(address: str, flag: str) -> tuple[str, int]:
    scheme = address.partition("://")[0]
    wanted = f"{flag}: expected {scheme}://HOST:PORT such as {scheme}://192.168.4.2:4210"
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise BadInputError(f"{wanted}, found {address!r}: {error}") from None
    if "@" in parts.netloc:
        raise BadInputError(f"{wanted}, found one with a name before @; a key never goes there")
    if not host or not port or parts.path or parts.query or parts.fragment:
        raise BadInputError(f"{wanted}, found {address!r}")
    return host, port


def _serial(path: str, baud: int, flag: str) -> Callable[[], Line]:
    from antennate.hardware.ports.serial_line import SerialFinder

    return SerialFinder(path, baud, flag)


RETRY = 0.2
"""Time between two looks for a port that is gone [s]; short beside the handling of a plug
(assumed)."""
_FAREWELL = 1.0
"""Longest that closing waits for a look that is under way [s]; one takes a tenth (assumed)."""


_Result = TypeVar("_Result")


def in_background(work: Callable[[], None]) -> threading.Thread:
    """Do it in a thread that does not keep the program alive."""
    thread = threading.Thread(target=work, name="port", daemon=True)
    thread.start()
    return thread


class Reconnecting(Port):
    """A port that is opened again after it was lost; for one thread.

    While it is gone each call raises PortError at once, and so does the constructor if it cannot be
    opened the first time. Opening and closing may take long, so they happen in the background.

    Args:
        find: Finds and opens it.
        clock: Monotonic time [s].
        start: Does work in the background.
    """

    def __init__(
        self,
        find: Callable[[], Line],
        clock: Callable[[], float] = time.monotonic,
        start: Callable[[Callable[[], None]], threading.Thread | None] = in_background,
    ) -> None:
        self._find, self._clock, self._start = find, clock, start
        self._line: Line | None = find()
        self._old: Line | None = None
        self._results: SimpleQueue[Line | PortError] = SimpleQueue()
        self._looking = self._closed = False
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._due = 0.0
        self._why = ""

    def write(self, data: bytes) -> None:
        """Send all of it."""
        self._use(lambda line: line.write(data))

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, empty if nothing comes within `timeout` [s]."""
        return self._use(lambda line: line.read(most, timeout))

    def drain(self) -> int:
        """Throw away what has come; how many bytes that was."""
        return self._use(lambda line: line.drain())

    def _use(self, action: Callable[[Line], _Result]) -> _Result:
        line = self._there()
        try:
            return action(line)
        except PortError as error:
            self._old, self._line = line, None
            self._due = self._clock() + RETRY
            self._why = reason(error)
            raise

    def close(self) -> None:
        """Let it go for good; a look that lasts longer lets go of what it finds by itself."""
        with self._lock:
            self._closed = True
        if self._thread is not None:
            self._thread.join(_FAREWELL)
        self._collect()
        for line in (self._line, self._old):
            _close(line)
        self._line = self._old = None
        self._due = float("inf")

    def _there(self) -> Line:
        """The port, if it is there; looks for it now and then if not."""
        if self._looking:
            self._collect()
        if self._line is not None:
            return self._line
        if not self._looking and self._clock() >= self._due:
            self._looking = True
            self._thread = self._start(self._look)
            self._collect()
        if self._line is None:
            raise PortError(self._why)
        return self._line

    def _look(self) -> None:
        """In the background: let go of the old one, find the new one."""
        old, self._old = self._old, None
        try:
            _close(old)
            result: Line | PortError = self._find()
        except PortError as error:
            result = error
        except Exception as error:  # noqa: BLE001 a thread that ends would never look again
            result = PortError(f"could not look for the port: {type(error).__name__}: {error}")
        with self._lock:
            if not self._closed:
                self._results.put(result)
                return
        if not isinstance(result, PortError):
            _close(result)

    def _collect(self) -> None:
        with contextlib.suppress(Empty):
            result = self._results.get_nowait()
            self._looking = False
            if isinstance(result, PortError):
                self._due = self._clock() + RETRY
                self._why = str(result)
            else:
                self._line = result


def _close(line: Line | None) -> None:
    if line is not None:
        with contextlib.suppress(PortError):
            line.close()
