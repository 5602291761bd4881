"""Driving a twin in its own time: it goes on when the client waits, and at no other moment.

No line here reads the host's clock: what a port waits for costs the twin's time, and an answer is
there before the time at which it came is told. The same drive therefore gives the same bytes on any
machine, however busy. If the twin is gone, each call raises PortError at once.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from antennate.errors import BadInputError, ConfigError
from antennate.hardware.ports import clock_words as words
from antennate.hardware.ports.clock_words import At, Wire
from antennate.hardware.ports.finder import finder, is_udp
from antennate.hardware.ports.port import PortError
from antennate.hardware.ports.reconnecting import Line
from antennate.params.clock import ClockParams

_ROUNDING = 1e-9
_MAJORS = range(136, 144)
"""Device numbers of Linux' pseudo-terminals (Documentation/admin-guide/devices.txt)."""


class TwinPort:
    """The board or the bus of a twin as a Port.

    Args:
        clock: The twin's clock.
        name: Which wire it is.
        line: The wire.
    """

    def __init__(self, clock: TwinClock, name: Wire, line: Line) -> None:
        self._clock, self._name, self._line = clock, name, line
        self._came = b""
        self._fetched = 0
        self._doubt = False

    def write(self, data: bytes) -> None:
        """Send; takes no time, the twin's wire does."""
        self._clock.check()
        for at in range(0, len(data), words.MOST):
            piece = data[at : at + words.MOST]
            self._line.write(piece)
            self._clock.say(f"sent {self._name} {len(piece)}")
        self._doubt = True

    def read(self, most: int, timeout: float) -> bytes:
        """What has come by now; a board's within `timeout` [s], a bus's as soon as it speaks."""
        self._settle()
        if not self._came and timeout > 0:
            end = self._clock.now() + timeout
            while not self._came and self._clock.now() < end:
                self._clock.go_on(end, self._name == "bus")
        came, self._came = self._came[:most], self._came[most:]
        return came

    @property
    def came(self) -> bool:
        """Whether something has come that nobody has read."""
        return bool(self._came)

    def drain(self) -> int:
        """Throw away what has come; how many bytes that was."""
        self._settle()
        count, self._came = len(self._came), b""
        return count

    def fetch(self, count: int, patience: float) -> None:
        """Read until it is so many bytes in all; the twin has sent them.

        Raises:
            PortError: They do not come within `patience` [s] of real time.
        """
        while self._fetched < count:
            part = self._line.read(count - self._fetched, patience)
            if not part:
                raise PortError(
                    f"expected {count} bytes from the twin on --{self._name}, found "
                    f"{self._fetched}; are --esp32, --bus and --clock those of one twin?"
                )
            self._came += part
            self._fetched += len(part)
        self._doubt = False

    def _settle(self) -> None:
        """Have what a write may have caused at once."""
        self._clock.check()
        if self._doubt:
            self._clock.go_on(self._clock.now(), listens=False)


class TwinClock:
    """The time of a twin in lock-step, and its two wires; for one thread.

    Args:
        line: The wire of its clock.
        esp32: The board's wire.
        bus: The servos' wire.
        params: Limits.
        addresses: Of `esp32` and `bus`, which have to be those that the twin names; not compared if
            not given.

    Attributes:
        esp32: The board as a Port.
        bus: The servos as a Port.

    Raises:
        PortError: It is no clock of a twin, or the wires are not those of that twin.
        ConfigError: The addresses are not those of that twin; nothing was sent to them.
    """

    def __init__(
        self,
        line: Line,
        esp32: Line,
        bus: Line,
        params: ClockParams | None = None,
        addresses: tuple[str, str] | None = None,
    ) -> None:
        self._line, self._params = line, params or ClockParams()
        self._t = 0.0
        self._heard = b""
        self._asked = False
        self._broken = ""
        self.esp32, self.bus = TwinPort(self, "esp32", esp32), TwinPort(self, "bus", bus)
        self._asked = True
        self.say(f"\n{words.HELLO}")
        at = self._hear()
        if addresses is not None:
            _require_own(at.places, addresses)
        self._fetch(at)

    def now(self) -> float:
        """The twin's time [s]."""
        return self._t

    def sleep_until(self, t: float) -> None:
        """Let the twin go on until t [s], if it has not come so far yet.

        Raises:
            PortError: The twin is gone.
        """
        self.check()
        while t > self._t:
            self.go_on(t, listens=False)

    def go_on(self, t: float, listens: bool) -> None:
        """Let it go on until t [s] or for one stride, or, if it listens, until the bus speaks.

        Raises:
            PortError: The twin is gone, or its time stands still.
        """
        until = min(t, self._t + self._params.stride)
        self._ask(words.go_on(until, listens))
        if self._t < until - _ROUNDING and not (listens and self.bus.came):
            with self._mapped():
                raise PortError(f"expected it to go on until {until!r} s, found {self._t!r} s")

    def say(self, line: str) -> None:
        """A word that is not answered.

        Raises:
            PortError: The twin is gone.
        """
        self.check()
        with self._mapped():
            self._line.write(line.encode() + b"\n")

    def check(self) -> None:
        """Raise what was raised before, if anything was: there is no way back."""
        if self._broken:
            raise PortError(self._broken)

    def _ask(self, line: str) -> None:
        self.check()
        if self._asked:  # a signal came before the answer to the last question
            self._fetch(self._hear())
        self._asked = True
        self.say(line)
        self._fetch(self._hear())

    def _hear(self) -> At:
        """Take the answer."""
        with self._mapped():
            while b"\n" not in self._heard:
                part = self._line.read(words.LONGEST, self._params.patience)
                if not part:
                    raise PortError(f"no answer within {self._params.patience:g} s")
                self._heard += part
                if len(self._heard) > words.LONGEST:
                    raise PortError("more than an answer; does another program use this clock?")
            line, _, rest = self._heard.partition(b"\n")
            at = words.answer(line)
            if at.t < self._t:
                raise PortError(f"expected a time from {self._t!r} s on, found {at.t!r}")
            self._heard, self._asked, self._t = rest, False, at.t
            return at

    def _fetch(self, at: At) -> None:
        """Take all that an answer says has been sent."""
        with self._mapped():
            for port, count in zip((self.esp32, self.bus), at.counts, strict=True):
                port.fetch(count, self._params.arrival)

    @contextlib.contextmanager
    def _mapped(self) -> Iterator[None]:
        try:
            yield
        except (PortError, BadInputError) as error:
            self._broken = f"--clock: lost the twin: {error}; start it anew"
            raise PortError(self._broken) from None


@contextlib.contextmanager
def twin_clock(esp32: str, bus: str, clock: str, baud: int) -> Iterator[TwinClock]:
    """Open the three wires of a twin in lock-step, and close them again.

    Args:
        esp32: Address of its board, a path or tcp://HOST:PORT.
        bus: Address of its bus.
        clock: Address of its clock.
        baud: Bits per second of the bus.

    Raises:
        ConfigError: One of them cannot be a twin's.
        PortError: One of them cannot be opened, or is no twin's.
    """
    addresses = {"--esp32": esp32, "--bus": bus, "--clock": clock}
    for flag, address in addresses.items():
        _require_twin(flag, address)
    with contextlib.ExitStack() as stack:
        lines: list[Line] = []
        for flag, address in addresses.items():
            lines.append(finder(address, baud, flag)())
            stack.callback(_close, lines[-1])
        board, servos, line = lines
        yield TwinClock(line, board, servos, addresses=(esp32, bus))


def _require_twin(flag: str, address: str) -> None:
    wanted = f"{flag}: expected the address of a twin in lock-step, because of --clock"
    if is_udp(address):
        raise ConfigError(f"{wanted}, found udp://, which may lose packets")
    if "://" in address or sys.platform != "linux":
        return
    with contextlib.suppress(OSError):  # to open it tells why not
        if os.major(Path(address).stat().st_rdev) not in _MAJORS:
            raise ConfigError(
                f"{wanted}, found {address}, no pseudo-terminal; real adapters have no such clock"
            )


def _require_own(places: tuple[str, ...], addresses: tuple[str, str]) -> None:
    """The wires are those that the twin names, so that no byte for a twin goes to a robot."""
    given = [words.place(address) for address in addresses]
    named = places or ("nothing",) * len(given)
    for wire, wanted, found in zip(words.WIRES, named, given, strict=True):
        if wanted != found:
            raise ConfigError(
                f"--{wire}: expected {wanted}, which the twin of --clock names as its own, found "
                f"{found}; --clock is for a twin alone, never for a robot"
            )


def _close(line: Line) -> None:
    with contextlib.suppress(PortError):
        line.close()
