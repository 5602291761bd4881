"""Bending level to contact, per side, with hysteresis.

CONTACT begins at the threshold theta and ends below theta - hysteresis. NaN is UNKNOWN.
"""

from __future__ import annotations

import numpy as np

from antennate.params.control import RuleParams
from antennate.types import Bools, Contact, Floats, Ints

_FREE, _CONTACT, _UNKNOWN = int(Contact.FREE), int(Contact.CONTACT), int(Contact.UNKNOWN)
"""As plain integers: comparing an array with an enum costs four times as much."""


def classify(params: RuleParams, level: Floats, before: Ints) -> Ints:
    """Contact of each side.

    Args:
        params: Threshold and hysteresis.
        level: Bending levels, shape (B, 2); NaN where it is unknown.
        before: Contact at the tick before, shape (B, 2).

    Returns:
        One `Contact` a side, shape (B, 2).
    """
    touching = before == _CONTACT
    bound = params.threshold - params.hysteresis * touching
    state = np.where(level >= bound, _CONTACT, _FREE)
    return np.where(np.isnan(level), _UNKNOWN, state)


class ContactState:
    """Contact with its memory of the tick before."""

    def __init__(self, params: RuleParams, batch: int) -> None:
        self._params = params
        self._state: Ints = np.full((batch, 2), int(Contact.FREE))

    def reset(self, rows: Ints | Bools) -> None:
        """Some rows start free."""
        self._state[rows] = Contact.FREE

    def step(self, level: Floats) -> Ints:
        """Contact for bending levels, shape (B, 2)."""
        self._state = classify(self._params, level, self._state)
        return self._state
