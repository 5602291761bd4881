"""Simulated touch of the antennae of the standing twin: `left@2s` bends the left one for a second.

Only the readings of the antenna change; the simulated antenna itself is not bent. Times count from
the first packet on the servo bus, when a client has begun.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from antennate.errors import BadInputError
from antennate.params import ConditioningParams
from antennate.types import Floats

DEPTH = 0.6
"""Change of a reading by a touch, in spans: twice what the check by touch asks for."""
LENGTH = 1.0
"""Time for which a touch bends an antenna [s]."""
_FORM = re.compile(r"(left|right)@([0-9]+(?:\.[0-9]+)?)s")


class TouchStimulus:
    """Touches of antennae at given times.

    Args:
        orders: Side and time of each; they may overlap.
        conditioning: The range of the readings, straight to bent.

    Raises:
        BadInputError: An order has another form.
    """

    def __init__(self, orders: Sequence[str], conditioning: ConditioningParams) -> None:
        self._orders = [_read(text) for text in orders]
        span = conditioning.counts_high - conditioning.counts_low
        self._change = conditioning.polarity * DEPTH * span
        self._begin = math.inf

    def change(self, t: float, bus_used: bool) -> Floats:
        """Change of both readings [counts] at time t [s], shape (2,)."""
        if bus_used:
            self._begin = min(self._begin, t)
        bent = np.zeros(2)
        for side, start in self._orders:
            if start <= t - self._begin < start + LENGTH:
                bent[side] = self._change
        return bent


def _read(text: str) -> tuple[int, float]:
    match = _FORM.fullmatch(text)
    if match is None:
        raise BadInputError(
            f"--touch: expected left@Ts or right@Ts, with T in seconds, found {text!r}"
        )
    return ("left", "right").index(match[1]), float(match[2])
