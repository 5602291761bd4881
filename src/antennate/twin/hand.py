"""A person's hand at the antennae of the standing twin: `left@2s` bends the left one for a second.

The counts of a bent film are shown, the film itself is not bent. Times count from the first packet
on the servo bus, when somebody has begun to look at the robot.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from antennate.errors import BadInputError
from antennate.params import ConditioningParams, TwinParams
from antennate.types import Floats

DEPTH = TwinParams().hand_depth
LENGTH = TwinParams().hand_time
_FORM = re.compile(r"(left|right)@([0-9]+(?:\.[0-9]+)?)s")


class Hand:
    """Bends antennae when told.

    Args:
        orders: Which, and when; may overlap.
        conditioning: The range of their readings, straight to bent.

    Raises:
        BadInputError: An order has another form.
    """

    def __init__(self, orders: Sequence[str], conditioning: ConditioningParams) -> None:
        self._orders = [_read(text) for text in orders]
        span = conditioning.counts_high - conditioning.counts_low
        self._change = conditioning.polarity * DEPTH * span
        self._begin = math.inf

    def change(self, t: float, heard: bool) -> Floats:
        """Change of both readings [counts] at time t [s], shape (2,); `heard`: the bus was used."""
        if heard:
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
