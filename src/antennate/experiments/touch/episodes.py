"""Contacts and alarms: runs of two states over time, matched with one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.types import Bools, Ints


def runs(state: Bools) -> Ints:
    """Begin and end (exclusive) of every run of True, shape (n, 2) [ticks]."""
    edges = np.flatnonzero(np.diff(state.astype(np.int8), prepend=0, append=0))
    return edges.reshape(-1, 2)


def merged(state: Bools, shortest: int) -> Bools:
    """The state with every gap between two runs filled that is shorter than `shortest` ticks."""
    filled = state.copy()
    found = runs(state)
    for end, begin in zip(found[:-1, 1], found[1:, 0], strict=True):
        if begin - end < shortest:
            filled[end:begin] = True
    return filled


@dataclass(frozen=True, slots=True)
class Matches:
    """How alarms answer contacts.

    Attributes:
        contacts: Begin and end of every contact, shape (n, 2) [ticks].
        found: Whether a contact matches an alarm, shape (n,).
        carried: Contacts that are found by an alarm that had begun before them.
        alarms: Number of alarms; `false` of them match no contact.
        onset: Begin of the first matching alarm after the begin of the contact [ticks].
        release: End of the last matching alarm after the end of the contact [ticks].
    """

    contacts: Ints
    found: Bools
    carried: int
    alarms: int
    false: int
    onset: Ints
    release: Ints


def match(truth: Bools, alarm: Bools, grace: int) -> Matches:
    """Match contacts and alarms that overlap, a contact taken `grace` ticks longer at its end.

    Args:
        truth: True state, shape (n,).
        alarm: Sensed state, shape (n,).
        grace: How much later an alarm may still answer [ticks].
    """
    contacts, alarms = runs(truth), runs(alarm)
    over = (alarms[None, :, 0] < contacts[:, None, 1] + grace) & (
        alarms[None, :, 1] > contacts[:, None, 0]
    )
    found, answering = np.asarray(over.any(axis=1)), np.asarray(over.any(axis=0))
    onset, release, carried = [], [], 0
    for i in np.flatnonzero(found):
        begin, end = contacts[i]
        answers = alarms[over[i]]
        if answers[0, 0] < begin:
            carried += 1
        else:
            onset.append(answers[0, 0] - begin)
        last = answers[-1, 1]
        onwards = i + 1 < len(contacts) and last > contacts[i + 1, 0]
        if not onwards and end < len(truth) and last < len(truth):
            release.append(last - end)
    return Matches(
        contacts=contacts,
        found=found,
        carried=carried,
        alarms=len(alarms),
        false=int((~answering).sum()),
        onset=np.array(onset, dtype=np.int64),
        release=np.array(release, dtype=np.int64),
    )
