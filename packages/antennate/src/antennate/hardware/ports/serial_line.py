"""A serial line as a Port, found again by what it is, whatever it is called now.

Nobody else may open it meanwhile. Opening must not reset the antenna board. On the usual board for
the ESP32 two crossed transistors turn the modem lines into a reset (EN) and a boot button (IO0); so
say Espressif's schematics (https://docs.espressif.com/projects/esp-dev-kits, "Auto program"):

| DTR | RTS | the chip |
|---|---|---|
| off | off | runs |
| on | on | runs |
| off | on | EN low: held in reset |
| on | off | IO0 low: BOOT pressed, which ends our firmware's stream |

Linux switches both on in one step when a line is opened, and both off when it is closed. pyserial
then sets DTR first and RTS after it. Wanting both off would therefore pass through "RTS alone" and
reset the board; wanting both on changes nothing more. Both on it is, said before the line is open.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from antennate.errors import ConfigError
from antennate.hardware.ports.errors import explain
from antennate.messages import extra
from dynamixel_bus import ports
from dynamixel_bus.port import PortError

try:
    from serial.tools import list_ports
except ModuleNotFoundError as error:
    raise ConfigError(
        f"expected pyserial for real ports, found no module {error.name}; install it with "
        f"{extra('hardware')}"
    ) from None


class SerialPort(ports.SerialPort):
    """A serial line, by its device file and bits per second; `flag` named it, for errors.

    Raises:
        PortError: If it cannot be opened, or another program holds it; with the cure.
    """

    def __init__(self, path: str, baud: int, flag: str = "") -> None:
        try:
            super().__init__(path, baud)
        except PortError as error:
            cause = error.__cause__ or error
            raise explain(flag, path, baud, cause) from cause


@dataclass(frozen=True, slots=True)
class Identity:
    """What a USB adapter says of itself: vendor, product, serial number if it has one of its own.

    The location is the socket of its plug, with the interface of an adapter that has several.
    """

    vid: int
    pid: int
    serial_number: str
    location: str


class SerialFinder:
    """Opens a serial line, and opens the same one again each time it is called.

    The adapter behind it is remembered at the first opening: by its serial number, and by its
    socket where it has none or two share one. What is no USB adapter, such as a pseudo-terminal, is
    opened by its path, and a link is followed anew each time. `flag` named it, for errors.
    """

    def __init__(self, path: str, baud: int, flag: str = "") -> None:
        self._path, self._baud, self._flag = path, baud, flag
        self._known: Identity | None = None

    def __call__(self) -> SerialPort:
        """The line, opened."""
        if self._known is not None:
            return SerialPort(find(self._known, self._path), self._baud, self._flag)
        line = SerialPort(self._path, self._baud, self._flag)
        try:
            self._known = identity(self._path)
        except BaseException:
            line.close()
            raise
        return line


def identity(path: str) -> Identity | None:
    """The adapter behind a device file; None if it is none.

    A serial number that another adapter has too, such as the 0001 of many boards, is no number.
    """
    known = adapters()
    own = known.get(str(Path(path).resolve()))
    if own is None or sum(_alike(own, other) for other in known.values()) == 1:
        return own
    return replace(own, serial_number="")


def find(known: Identity, path: str) -> str:
    """Device file of a known adapter."""
    alike = {device: other for device, other in adapters().items() if _alike(known, other)}
    same = [device for device, other in alike.items() if other.location == known.location]
    if not same and known.serial_number:
        same = list(alike)
    if len(same) == 1:
        return same[0]
    what = f"USB adapter {known.vid:04x}:{known.pid:04x}"
    what += f" with serial number {known.serial_number}" if known.serial_number else ""
    count = f"{len(same)} of them" if same else "none"
    raise PortError(f"{path}: expected its {what} in socket {known.location}, found {count}")


def _alike(known: Identity, other: Identity) -> bool:
    number = known.serial_number in ("", other.serial_number)
    return number and (known.vid, known.pid) == (other.vid, other.pid)


def adapters() -> dict[str, Identity]:
    """All serial USB adapters by their device file."""
    try:
        ports: list[Any] = list(list_ports.comports())
    except Exception as error:  # pyserial reads files of sysfs that may vanish meanwhile
        what = f"{type(error).__name__}: {error}"
        raise PortError(f"could not list serial ports: {what}; try again") from error
    return {
        port.device: Identity(port.vid, port.pid, port.serial_number or "", port.location or "")
        for port in ports
        if port.vid is not None and port.pid is not None
    }
