"""Bending level to contact: threshold 0.5, free again at 0.4, NaN is UNKNOWN."""

from __future__ import annotations

import math

import numpy as np

from antennate.control.conditioning import ContactState, contact_of
from antennate.params.control import RuleParams
from antennate.types import Contact

PARAMS = RuleParams(threshold=0.5, hysteresis=0.1)


def states(*levels: float) -> list[Contact]:
    """Contact of the left side for levels that follow one another."""
    state = ContactState(PARAMS, 1)
    return [Contact(int(state.step(np.array([[b, 0.0]]))[0, 0])) for b in levels]


def test_contact_begins_at_the_threshold_and_ends_below_the_hysteresis() -> None:
    free, touch = Contact.FREE, Contact.CONTACT
    assert states(0.45, 0.5, 0.45, 0.401, 0.399, 0.45) == [free, touch, touch, touch, free, free]


def test_nan_is_unknown_and_is_not_remembered_as_contact() -> None:
    assert states(0.9, math.nan, 0.45) == [Contact.CONTACT, Contact.UNKNOWN, Contact.FREE]


def test_a_side_does_not_know_of_the_other() -> None:
    said = contact_of(PARAMS, np.array([[0.9, math.nan]]), np.zeros((1, 2), dtype=np.int64))
    assert said.tolist() == [[Contact.CONTACT, Contact.UNKNOWN]]


def test_reset_forgets_contact_of_its_rows_only() -> None:
    state = ContactState(PARAMS, 2)
    state.step(np.ones((2, 2)))
    state.reset(np.array([True, False]))
    after = state.step(np.full((2, 2), 0.45))
    assert after.tolist() == [[Contact.FREE] * 2, [Contact.CONTACT] * 2]
