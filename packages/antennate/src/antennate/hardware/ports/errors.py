"""Why a serial port did not open: what was expected, who holds it, and the cure."""

from __future__ import annotations

import contextlib
import errno
import os
import re
from collections.abc import Iterator
from pathlib import Path

from dynamixel_bus.port import PortError

_PROC = Path("/proc")
_MASTER = "/dev/ptmx"


def holders(path: str) -> list[str]:
    """Other programs that have locked a port or have it open, as `pid 12 (name)`.

    The process that made a pseudo-terminal holds both its ends, and is left out.
    """
    names: dict[int, str] = {}
    for process in (*_lockers(path), *_openers(path)):
        with contextlib.suppress(OSError):
            name = re.sub(r"\s+", " ", (_PROC / str(process) / "comm").read_text().strip())
            names[process] = f"pid {process} ({name})"
    return [names[process] for process in sorted(names) if process != os.getpid()]


def _lockers(path: str) -> Iterator[int]:
    """Who holds a lock on it, by device and inode of the file."""
    try:
        there = Path(path).stat()
        locks = (_PROC / "locks").read_text().splitlines()
    except OSError:
        return
    device = f"{os.major(there.st_dev):02x}:{os.minor(there.st_dev):02x}:{there.st_ino}"
    for lock in locks:
        fields = lock.split()
        if device in fields and fields[fields.index(device) - 1].isdigit():
            yield int(fields[fields.index(device) - 1])


def _openers(path: str) -> Iterator[int]:
    """Who has it open."""
    device = os.path.realpath(path)
    for process in _PROC.glob("[0-9]*"):
        with contextlib.suppress(OSError):
            opened = {str(link.readlink()) for link in (process / "fd").iterdir()}
            if device in opened and _MASTER not in opened:
                yield int(process.name)


_BUSY = (errno.EBUSY, errno.EAGAIN)
_DENIED = (errno.EACCES, errno.EPERM)
_GONE = (errno.ENXIO, errno.ENODEV, errno.EIO)
_NAMES = Path("/dev/serial/by-id")


class OpenError(PortError):
    """A port did not open: what was found, and what to do."""

    def __init__(self, flag: str, path: str, found: str, cure: str) -> None:
        where = f"{flag}: " if flag else ""
        super().__init__(f"{where}expected a serial port that opens, found {path}: {found}; {cure}")
        self.found, self.cure = found, cure


def explain(flag: str, path: str, baud: int, error: BaseException) -> OpenError:
    """The error to raise when a port did not open at so many bits per second.

    `flag` is the one that named it, "--esp32" or "--bus", or empty; `error` is what the system or
    pyserial said.
    """
    return OpenError(flag, path, *_why(path, baud, error))


def _why(path: str, baud: int, error: BaseException) -> tuple[str, str]:
    number = getattr(error, "errno", None)
    if not Path(path).exists():
        if path.startswith("/dev/pts/"):
            return "no such file", "a port of a twin ends with it: start `antennate twin` again"
        return "no such file", f"plug it in and give one of: {known_ports()}"
    if number in _DENIED:
        return "no permission", permission_cure(path)
    if number in _BUSY:
        who = ", ".join(holders(path)) or "another program"
        return f"in use by {who}", "end that program, then try again"
    if number in _GONE:
        return "the device is gone", f"plug it in again; ports here are: {known_ports()}"
    text = str(error)
    if isinstance(error, ValueError) or "baud" in text:
        return f"it cannot do {baud} bit/s", "set robot.baud to a speed that the adapter can do"
    if number == errno.EISDIR or not Path(path).is_char_device() or "ioctl" in text:
        return "not a serial port", f"give one of: {known_ports()}"
    return text, f"ports here are: {known_ports()}"


def permission_cure(path: str) -> str:
    """The command that lets this user open a port."""
    try:
        group = Path(path).group()
    except (OSError, KeyError):
        group = "dialout"
    if group in ("root", "tty"):  # nobody is to join those; the rule of the adapter is missing
        return f"run `sudo chmod a+rw {path}`"
    return f"run `sudo usermod -aG {group} $USER`, log out and in again"


def known_ports() -> str:
    """The serial ports of this machine, by their lasting names where they have one."""
    from serial.tools import list_ports

    lasting = {os.path.realpath(name): str(name) for name in sorted(_NAMES.glob("*"))}
    paths = sorted(port.device for port in list_ports.comports())
    return ", ".join(lasting.get(path, path) for path in paths) or "none (no adapter is plugged in)"
