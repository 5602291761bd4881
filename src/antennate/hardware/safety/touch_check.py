"""A check before arming, by touch: bend the left antenna, let go, bend the right one, let go.

It finds channels that are swapped and flex sensors whose reading runs the wrong way.
"""

from __future__ import annotations

import math
from enum import Enum

from antennate.hardware.safety.diagnosis import Band
from antennate.params.safety import TouchCheckParams

_NAMES = ("left", "right")


class Ask(Enum):
    """What the person is asked to do next."""

    REST = "let go of both antennae"
    LEFT = "bend the left antenna towards the tail"
    RIGHT = "bend the right antenna towards the tail"
    NOTHING = "the check is over"


class TouchCheck:
    """Follows the check, one pair of readings after the other.

    Args:
        params: What counts as a touch and as rest.
        bands: Calibrated ranges of the left and the right channel.
    """

    def __init__(self, params: TouchCheckParams, bands: tuple[Band, Band]) -> None:
        self._params, self._bands = params, bands
        self.ask = Ask.REST
        self._against = ""
        self._side = 0
        self._run: tuple[str, int] = ("", 0)

    @property
    def objection(self) -> str:
        """Why not to arm, empty once the check has passed."""
        if self.ask is Ask.NOTHING:
            return self._against
        felt = "not seen at rest" if self.ask is Ask.REST else "no bend felt"
        return f"the antennae were not yet checked by touch, {felt}: {self.ask.value}"

    def step(self, left: float, right: float) -> Ask:
        """Take the newest readings [counts], NaN if unknown; returns what to do next."""
        if self.ask is Ask.NOTHING:
            return self.ask
        seen = self._see([b.level(c) for b, c in zip(self._bands, (left, right), strict=True)])
        count = self._run[1] + 1 if seen == self._run[0] else 1
        self._run = (seen, count)
        if seen and count >= self._params.readings:
            self._follow(seen)
        return self.ask

    def _see(self, levels: list[float]) -> str:
        """What the readings show: rest, right, swapped or reversed; empty if unclear."""
        if not all(map(math.isfinite, levels)):
            return ""
        still = [abs(level) < self._params.still for level in levels]
        if all(still):
            return "rest"
        bent = [abs(level) >= self._params.level for level in levels]
        if sum(bent) != 1 or sum(still) != 1:
            return ""
        if not bent[self._side]:
            return "swapped"
        return "right" if levels[self._side] > 0 else "reversed"

    def _follow(self, seen: str) -> None:
        if self.ask is Ask.REST:
            if seen == "rest":
                self.ask = (Ask.LEFT, Ask.RIGHT)[self._side]
        elif seen == "right" and self._side == 0:
            self.ask, self._side = Ask.REST, 1
        elif seen == "right":
            self.ask = Ask.NOTHING
        elif seen in ("swapped", "reversed"):
            self._against = self._why(seen)
            self.ask = Ask.NOTHING

    def _why(self, seen: str) -> str:
        name, other = _NAMES[self._side], _NAMES[1 - self._side]
        if seen == "swapped":
            return f"the {name} antenna was asked for and the {other} channel answered: swap them"
        return (
            f"the reading of the {name} antenna runs against its calibration: check the divider "
            "or calibrate this flex sensor"
        )
