"""Simulated touches of the antennae of the standing twin.

Only the readings change; the simulated antenna itself is not bent. Orders:

- `left@2s` bends the left antenna for a second, 2 s after a client has begun;
- `left:20mm@2s` holds it from then on as a ruler beside it is read: its tip pushed 20 mm aside;
- `left:60deg@2s` likewise by the sum of its hinge angles; 0mm or 0deg lets go;
- while the twin runs, `left`, `left:20mm` and so on, at once.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Sequence

import numpy as np

from antennate.antenna.sensor import counts
from antennate.antenna.statics import Chain, equilibrium, shape
from antennate.errors import BadInputError
from antennate.robots.antenna import AntennaSpec
from antennate.types import Floats

FLEX = 1.0
"""Flex of a touch [rad]: more than twice what the check by touch asks for."""
LENGTH = 1.0
"""Time for which a touch bends an antenna [s]."""
_SIDES = ("left", "right")
_FORM = re.compile(r"(left|right)(?::([0-9]+(?:\.[0-9]+)?)(mm|deg))?(?:@([0-9]+(?:\.[0-9]+)?)s)?")
_LOADS = np.linspace(0.0, 0.15, 61)
"""Loads on the tip, normal to it [N]; the default antenna moves its tip farthest at 0.12 N."""


class TouchStimulus:
    """Touches of antennae, at given times or as they are ordered.

    Args:
        orders: As above.
        antenna: The antenna, for its springs and its flex sensor.

    Raises:
        BadInputError: An order has another form.
    """

    def __init__(self, orders: Sequence[str], antenna: AntennaSpec) -> None:
        self._antenna = antenna
        self._timed = sorted(
            (_read(text, antenna, timed=True) for text in orders),
            key=lambda order: order[3],
        )
        self._fresh: deque[tuple[int, float, float]] = deque()
        self._typed = [(0.0, -math.inf), (0.0, -math.inf)]
        self._begun = math.inf

    def order(self, text: str) -> None:
        """Take an order, to be carried out at once.

        Raises:
            BadInputError: It has another form.
        """
        side, flex, length, _ = _read(text, self._antenna, timed=False)
        self._fresh.append((side, flex, length))

    def change(self, t: float, begun: float) -> Floats:
        """Change of both readings [counts] at time t [s], shape (2,).

        Args:
            t: The twin's time.
            begun: When the present client began, inf if none has.
        """
        if begun != self._begun:  # touches of the last client end
            self._begun, self._typed = begun, [(0.0, -math.inf), (0.0, -math.inf)]
        while self._fresh:
            side, held, length = self._fresh.popleft()
            self._typed[side] = (held, t + length)
        flex = np.zeros(2)
        for side, held, length, start in self._timed:
            if start <= t - begun:
                flex[side] = held if t - begun < start + length else 0.0
        for side, (held, end) in enumerate(self._typed):
            flex[side] = held if t < end else flex[side]
        sensor = self._antenna.sensor
        return counts(sensor, flex) - counts(sensor, np.zeros(2))


def _read(text: str, antenna: AntennaSpec, timed: bool) -> tuple[int, float, float, float]:
    """Side, flex [rad], for how long [s] and when [s] of an order."""
    match = _FORM.fullmatch(text.strip())
    if match is None or (match[4] is None) is timed:
        when = "@Ts, with T in seconds" if timed else "nothing more"
        raise BadInputError(
            f"--touch: expected left or right, with or without :20mm or :60deg, then {when}, "
            f"found {text!r}"
        )
    if match[2] is None:
        flex, length = FLEX, LENGTH
    else:
        size, length = float(match[2]), math.inf
        flex = math.radians(size) if match[3] == "deg" else _flex_of(1e-3 * size, antenna)
    return _SIDES.index(match[1]), flex, length, float(match[4] or 0.0)


def _flex_of(way: float, antenna: AntennaSpec) -> float:
    """Flex [rad] of an antenna whose tip is pushed aside by so much [m], by the statics."""
    chain = Chain.of(antenna)
    force = np.stack([np.zeros_like(_LOADS), _LOADS], axis=1)
    bent = equilibrium(chain, np.full(len(_LOADS), chain.length), force, follower=True).angles
    ways, flexes = shape(chain, bent)[:, -1, 1], bent[:, : antenna.sensed_hinges].sum(axis=1)
    most = int(np.argmax(ways))
    if way > ways[most]:
        raise BadInputError(
            f"--touch: expected at most {1e3 * ways[most]:.0f}mm for this antenna, found "
            f"{1e3 * way:g}mm"
        )
    return float(np.interp(way, ways[: most + 1], flexes[: most + 1]))
