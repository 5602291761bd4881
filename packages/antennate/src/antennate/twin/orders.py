"""Orders to a twin while it runs: plugs, shafts, and of a robot touches of its antennae and faults.

    plug NAME, unplug NAME     put a servo on the bus with power, or take it off
    only NAME, next            plug in this one alone, or the next one alone
    push NAME=ANGLE            turn a shaft without torque
    touch left:20mm            hold an antenna, or `touch left` for a second; 0mm lets go
    hang, floor                raise the robot by its middle link, or put it down
    fault servo:7=silent       let a fault begin; `fault servo:7=none` takes it back

NAME is a joint, the place of a servo in its list (from 1 on), or `all`. A turn of a shaft takes
half a second and ends at rest; a servo with torque holds its shaft. `--push yaw1=20deg@3s` turns
one at a given time.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from antennate.errors import BadInputError
from dynamixel_bus.servo import Servo

_CHUNK = 4096
_WORDS = (
    "plug NAME, unplug NAME, only NAME, next, push NAME=ANGLE, or of a robot touch SIDE[:SIZE], "
    "hang, floor or fault FAULT"
)
NONE = "none"
TURNING = 0.5
"""Time that a turn takes [s]."""
ALL = "all"
_TURN = re.compile(
    r"(?P<joint>[\w.-]+)=(?P<angle>[+-]?[0-9.]+)(?P<unit>deg|rad)(@(?P<t>[0-9.]+)s)?"
)


class Pushes:
    """Turns of shafts at given times, from the first packet on the bus on.

    Args:
        orders: Joint, angle and time of each.
        names: Names of the joints, in the order of the servos.
        ticks: Where the shaft of the servo at a place is at an angle [rad].
    """

    def __init__(
        self, orders: Sequence[str], names: Sequence[str], ticks: Callable[[int, float], float]
    ) -> None:
        self._names = list(names)
        self._ticks = ticks
        self._waiting = sorted(
            (self._read(text, "--push") for text in orders), key=lambda order: order[2]
        )
        self._turning: dict[int, tuple[float, float, float]] = {}
        self._begin = math.inf

    def now(self, text: str, t: float, servos: Sequence[Servo]) -> None:
        """Begin a turn at time t [s]."""
        places, angle, _ = self._read(text, "push")
        self._start(places, angle, t, servos)

    def places(self, name: str, what: str) -> list[int]:
        """Places of servos in their list, by the name of a joint, a number from 1 on or `all`."""
        if name == ALL:
            return list(range(len(self._names)))
        if name in self._names:
            return [self._names.index(name)]
        if name.isdigit() and 0 < int(name) <= len(self._names):
            return [int(name) - 1]
        known = ", ".join(self._names)
        raise BadInputError(f"{what}: expected {ALL} or one of {known}, found {name!r}")

    def apply(self, t: float, used: bool, servos: Sequence[Servo]) -> list[tuple[int, float]]:
        """Shafts that move at time t [s]: place in the list and position [ticks] of each.

        Args:
            t: The time [s].
            used: A packet has been on the bus.
            servos: All servos.
        """
        if used:
            self._begin = min(self._begin, t)
        while self._waiting and self._waiting[0][2] <= t - self._begin:
            places, angle, _ = self._waiting.pop(0)
            self._start(places, angle, t, servos)
        moved: list[tuple[int, float]] = []
        for place, (since, start, goal) in list(self._turning.items()):
            share = min((t - since) / TURNING, 1.0)
            if share == 1.0 or servos[place].torque:
                del self._turning[place]
            if not servos[place].torque:
                moved.append((place, start + (goal - start) * share * share * (3.0 - 2.0 * share)))
        return moved

    @property
    def busy(self) -> bool:
        """Something is being turned, or will be."""
        return bool(self._turning or self._waiting)

    def _start(self, places: list[int], angle: float, t: float, servos: Sequence[Servo]) -> None:
        for place in places:
            if not servos[place].torque:
                goal = self._ticks(place, angle)
                self._turning[place] = (t, servos[place].motion.shaft.position, goal)

    def _read(self, text: str, what: str) -> tuple[list[int], float, float]:
        match = _TURN.fullmatch(text)
        try:
            if match is None:
                raise ValueError
            angle, t = float(match["angle"]), float(match["t"] or 0.0)
        except ValueError:
            raise BadInputError(
                f"{what}: expected JOINT=ANGLE[@Ts], such as yaw1=20deg@3s, found {text!r}"
            ) from None
        angle = math.radians(angle) if match["unit"] == "deg" else angle
        return self.places(match["joint"], what), angle, t


class Plugging:
    """The plugs and the shafts of some servos.

    Args:
        servos: The servos.
        pushes: Turns their shafts.
    """

    def __init__(self, servos: Sequence[Servo], pushes: Pushes) -> None:
        self._servos = list(servos)
        self._pushes = pushes

    def begin(self, plugged: Sequence[str]) -> None:
        """Leave only some servos on the bus; all if none is named."""
        if not plugged:
            return
        chosen = {
            place
            for name in plugged
            if name != NONE
            for place in self._pushes.places(name, "--plugged")
        }
        for place, servo in enumerate(self._servos):
            if place not in chosen:
                servo.plug(0.0, into=False)

    def order(self, text: str, t: float) -> None:
        """Do what an order says at time t [s]."""
        word, _, rest = text.strip().partition(" ")
        rest = rest.strip()
        if word == "push":
            self._pushes.now(rest, t, self._servos)
        elif word in ("plug", "unplug"):
            for place in self._pushes.places(rest, word):
                self._plug(place, word == "plug", t)
        elif word == "only" or (word, rest) == ("next", ""):
            chosen = self._pushes.places(rest, word) if rest else [self._following()]
            for place in range(len(self._servos)):
                self._plug(place, place in chosen, t)
        else:
            raise BadInputError(f"expected {_WORDS}, found {text!r}")

    def _plug(self, place: int, into: bool, t: float) -> None:
        servo = self._servos[place]
        if servo.plugged != into:
            servo.plug(t, into)

    def _following(self) -> int:
        """Place behind the last servo that is plugged in; the first one behind the end."""
        plugged = [place for place, servo in enumerate(self._servos) if servo.plugged]
        return (plugged[-1] + 1) % len(self._servos) if plugged else 0


class Orders:
    """Lines from a named pipe, a file or standard input.

    Args:
        path: Where they come from; `-` is standard input.
        say: Told each order that was carried out, and why one was not.
    """

    def __init__(self, path: str, say: Callable[[str], None]) -> None:
        self._say = say
        self._rest = b""
        self._mine = path != "-"
        fifo = self._mine and Path(path).is_fifo()
        # A pipe that is open for writing here too has no end when a writer goes away.
        way = os.O_RDWR if fifo else os.O_RDONLY
        self._file: int | None = os.open(path, way | os.O_NONBLOCK) if self._mine else 0

    @property
    def files(self) -> list[int]:
        """What `select` waits for: nothing once all has been read."""
        return [] if self._file is None else [self._file]

    def take(self, order: Callable[[str], None]) -> None:
        """Carry out the orders that have come."""
        if self._file is None:
            return
        try:
            came = os.read(self._file, _CHUNK)
        except BlockingIOError:
            return
        except OSError:
            came = b""
        if not came:
            self.close()
        *lines, self._rest = (self._rest + came).split(b"\n")
        for line in lines:
            text = line.decode(errors="replace").strip()
            if not text:
                continue
            try:
                order(text)
            except BadInputError as error:
                text = f"not done: {error}"
            self._say(text)

    def close(self) -> None:
        """Read no more."""
        if self._file is not None and self._mine:
            with contextlib.suppress(OSError):
                os.close(self._file)
        self._file = None
