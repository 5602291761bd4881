"""Contact to maneuver: the paper's table and its hold."""

from __future__ import annotations

import numpy as np

from antennate.params.control import RuleParams
from antennate.types import LEFT, RIGHT, Bools, Contact, Floats, Ints, Maneuver


def decide(params: RuleParams, contact: Ints, level: Floats) -> Ints:
    """The paper's table.

    No side in contact: FORWARD. Both strong and similar: REVERSE. Otherwise turn away from the side
    that touches, or that touches more; right if both touch alike. A side that is UNKNOWN: HOLD.

    Args:
        params: Bounds of strong and similar.
        contact: One `Contact` a side, shape (B, 2).
        level: Bending levels, shape (B, 2).

    Returns:
        One `Maneuver` a row, shape (B,).
    """
    touch = contact == Contact.CONTACT
    difference = level[:, LEFT] - level[:, RIGHT]
    strong = (level >= params.strong).all(axis=1)
    blocked = touch.all(axis=1) & strong & (np.abs(difference) < params.similar)
    lean = np.where(touch.all(axis=1), difference, touch[:, LEFT] * 1.0 - touch[:, RIGHT])
    turn = np.where(lean >= 0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
    chosen = np.where(touch.any(axis=1), turn, int(Maneuver.FORWARD))
    chosen = np.where(blocked, int(Maneuver.REVERSE), chosen)
    return np.where((contact == Contact.UNKNOWN).any(axis=1), int(Maneuver.HOLD), chosen)


class Hold:
    """Keeps a maneuver for its time; FORWARD is left as soon as something touches, HOLD at once."""

    def __init__(self, batch: int) -> None:
        self.current: Ints = np.full(batch, int(Maneuver.FORWARD))
        self.until: Floats = np.full(batch, -np.inf)

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows start FORWARD and free to change."""
        self.current[rows] = Maneuver.FORWARD
        self.until[rows] = -np.inf

    def step(self, t: Floats, wanted: Ints, duration: Floats | float) -> Ints:
        """The maneuver in force at t [s], shape (B,); a new one is kept for `duration` [s]."""
        stop = wanted == Maneuver.HOLD
        held = (t < self.until) & (self.current != Maneuver.HOLD) & ~stop
        chosen = np.where(held, self.current, wanted)
        renewed = ~held & (wanted != Maneuver.FORWARD) & ~stop
        self.until = np.where(renewed, t + duration, np.where(stop, -np.inf, self.until))
        self.current = chosen
        return chosen
