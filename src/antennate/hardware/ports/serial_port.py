"""A serial line as a Port, through pyserial; nobody else may open it meanwhile.

Opening must not reset the antenna board. On the usual board for the ESP32 two crossed transistors
turn the modem lines into a reset (EN) and a boot button (IO0); so say Espressif's schematics
(https://docs.espressif.com/projects/esp-dev-kits, "Auto program"):

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

import termios
from contextlib import AbstractContextManager

import serial

from antennate.hardware.ports.errors import explain
from antennate.port import Port, PortError, port_errors

_FAILURES = (OSError, TypeError, ValueError, termios.error)
"""What pyserial raises; it lets some through as they are."""


class SerialPort(Port):
    """A serial line, by its device file and bits per second; `flag` named it, for errors.

    Raises:
        PortError: If it cannot be opened, or another program holds it; with the cure.
    """

    def __init__(self, path: str, baud: int, flag: str = "") -> None:
        self._path = path
        try:
            line = serial.Serial(baudrate=baud, timeout=0, write_timeout=0.1, exclusive=True)
            line.dtr = line.rts = True
            line.port = path
            line.open()
            self._line = line
        except _FAILURES as error:
            raise explain(flag, path, baud, error) from error

    def write(self, data: bytes) -> None:
        """Send all of it."""
        with self._mapped("write to"):
            sent = self._line.write(data)
        if sent != len(data):
            raise PortError(f"{self._path}: expected to send {len(data)} bytes, sent {sent}")

    def read(self, most: int, timeout: float) -> bytes:
        """What has come, empty if nothing comes within `timeout` [s]."""
        with self._mapped("read from"):
            self._line.timeout = max(timeout, 0.0)
            first = self._line.read(1)
            if not first or most == 1:
                return first
            self._line.timeout = 0
            return first + self._line.read(most - 1)

    def close(self) -> None:
        """Let it go."""
        with self._mapped("close"):
            self._line.close()

    def _mapped(self, what: str) -> AbstractContextManager[None]:
        return port_errors(f"{what} {self._path}", *_FAILURES)
