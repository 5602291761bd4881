"""Shafts of servos without torque, turned by somebody: `yaw1=20deg@3s`.

A turn takes half a second and ends with the shaft at rest. A servo with torque holds its shaft.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from antennate.errors import BadInputError
from antennate.twin.registers import Servo

TURNING = 0.5
"""Time that a turn takes [s]."""
ALL = "all"
_FORM = re.compile(
    r"(?P<joint>[\w.-]+)=(?P<angle>[+-]?[0-9.]+)(?P<unit>deg|rad)(@(?P<t>[0-9.]+)s)?"
)


class Pushes:
    """Turns of shafts at given times, from the first packet on the bus on.

    Args:
        orders: Joint, angle and time of each.
        names: Names of the joints, in the order of the servos.
        ticks: Where the shaft of the servo at a place is at an angle [rad].

    Raises:
        BadInputError: An order has another form, or names a joint that is not there.
    """

    def __init__(
        self, orders: Sequence[str], names: Sequence[str], ticks: Callable[[int, float], float]
    ) -> None:
        self._names = list(names)
        self._ticks = ticks
        self._waiting = sorted((self._read(text, "--push") for text in orders), key=_time)
        self._turning: dict[int, tuple[float, float, float]] = {}
        self._begin = math.inf

    def now(self, text: str, t: float, servos: Sequence[Servo]) -> None:
        """Begin a turn at time t [s].

        Raises:
            BadInputError: The order has another form or names no joint.
        """
        places, angle, _ = self._read(text, "push")
        self._start(places, angle, t, servos)

    def places(self, name: str, what: str) -> list[int]:
        """Places of servos in their list, by the name of a joint, a number from 1 on or `all`.

        Raises:
            BadInputError: There is none.
        """
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
        match = _FORM.fullmatch(text)
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


def _time(order: tuple[list[int], float, float]) -> float:
    return order[2]
