"""The rule of the controller `map`: walk to a point ahead on the route, which it is told.

It shows how fast perfect knowledge is, so it needs what only a simulation knows. It turns when the
point is more than TURN_FROM off, until it is ahead; it backs off when it does not
get on, or when a turn has taken `escape.return_time`.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.control.knowledge import ALIGNED, Kind, Knowledge, aligned
from antennate.params.control import ControlParams, EscapeParams
from antennate.types import Bools, Contact, Floats, Ints, Maneuver

TURN_FROM = math.radians(45.0)
"""Angle to the point ahead from which on it turns [rad]; the head itself swings by 25 degrees."""


class MapRule:
    """Turns to a point ahead and walks there."""

    knows: tuple[Kind, ...] = ("jam", "map")
    needs: tuple[Kind, ...] = knows

    def __init__(self, control: ControlParams, batch: int) -> None:
        self._params: EscapeParams = control.escape
        self.turn_offset = control.escape.turn_offset
        self._maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))
        self._until: Floats = np.zeros(batch)
        self._jam: Bools = np.zeros(batch, dtype=bool)
        self._map: Floats = np.full(batch, math.nan)

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows begin anew, walking."""
        self._maneuver[rows] = Maneuver.FORWARD
        self._until[rows] = 0.0

    def know(self, knowledge: Knowledge) -> None:
        """Take what holds now."""
        if knowledge.jam is not None:
            self._jam = knowledge.jam
        if knowledge.map is not None:
            self._map = knowledge.map

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """As of a `Rule`; a row without a heading, or with a reading that is UNKNOWN, holds."""
        known = ~(contact == int(Contact.UNKNOWN)).any(axis=1) & ~np.isnan(self._map)
        walking = known & (self._maneuver == int(Maneuver.FORWARD))
        backing = known & (self._maneuver == int(Maneuver.REVERSE))
        turning = known & ~walking & ~backing
        over = t >= self._until
        off = np.abs(np.nan_to_num(self._map))
        ahead = aligned(self._maneuver, self._map)
        self._to(turning & ahead, int(Maneuver.FORWARD), t)
        back = (walking & self._jam) | (turning & over & ~ahead)
        self._to(back, int(Maneuver.REVERSE), t + self._params.reverse_time)
        turn = (walking & ~back & (off > TURN_FROM)) | (backing & over & (off > ALIGNED))
        side = np.where(self._map > 0, int(Maneuver.TURN_L), int(Maneuver.TURN_R))
        self._to(turn, side, t + self._params.return_time)
        self._to(backing & over & ~turn, int(Maneuver.FORWARD), t)
        return np.where(known, self._maneuver, int(Maneuver.HOLD))

    def _to(self, rows: Bools, maneuver: Ints | int, until: Floats) -> None:
        self._maneuver = np.where(rows, maneuver, self._maneuver)
        self._until = np.where(rows, until, self._until)
