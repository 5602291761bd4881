"""The paper's table, its mirror, and the hold."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from antennate.control.controllers import Hold, decide
from antennate.params.control import RuleParams
from antennate.types import Contact, Maneuver

F, C, U = Contact.FREE, Contact.CONTACT, Contact.UNKNOWN
FORWARD, TURN_L, TURN_R = Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R
REVERSE, HOLD = Maneuver.REVERSE, Maneuver.HOLD
PARAMS = RuleParams(strong=0.7, similar=0.15)
MIRROR = {TURN_L: TURN_R, TURN_R: TURN_L}

contacts = st.sampled_from(list(Contact))
levels = st.floats(0, 1)


def decision(contact: tuple[int, int], b: tuple[float, float]) -> Maneuver:
    return Maneuver(int(decide(PARAMS, np.array([contact]), np.array([b]))[0]))


@pytest.mark.parametrize(
    ("contact", "b", "expected"),
    [
        ((F, F), (0.1, 0.3), FORWARD),
        ((C, F), (0.6, 0.1), TURN_R),
        ((F, C), (0.1, 0.6), TURN_L),
        ((C, F), (0.42, 0.49), TURN_R),
        ((C, C), (0.9, 0.6), TURN_R),
        ((C, C), (0.6, 0.9), TURN_L),
        ((C, C), (0.95, 0.72), TURN_R),
        ((C, C), (0.65, 0.6), TURN_R),
        ((C, C), (0.8, 0.8), REVERSE),
        ((C, C), (0.9, 0.8), REVERSE),
        ((C, C), (0.7, 0.7), REVERSE),
        ((U, F), (math.nan, 0.1), HOLD),
        ((U, C), (math.nan, 0.9), HOLD),
        ((C, U), (0.9, math.nan), HOLD),
        ((U, U), (math.nan, math.nan), HOLD),
    ],
)
def test_the_table_answers_as_the_paper_says(
    contact: tuple[int, int], b: tuple[float, float], expected: Maneuver
) -> None:
    assert decision(contact, b) == expected


@pytest.mark.parametrize(
    ("b", "expected"),
    [((1.0, 0.75), TURN_R), ((0.75, 1.0), TURN_L), ((1.0, 0.875), REVERSE), ((0.25, 0.25), TURN_R)],
)
def test_levels_that_differ_by_the_bound_are_not_similar_and_a_tie_turns_right(
    b: tuple[float, float], expected: Maneuver
) -> None:
    params = RuleParams(strong=0.5, similar=0.25)
    assert decide(params, np.array([(C, C)]), np.array([b])).tolist() == [expected]


@given(contacts, contacts, levels, levels)
def test_swapping_the_sides_swaps_the_turns(left: int, right: int, bl: float, br: float) -> None:
    assume(not (left == right == C and bl == br))  # a tie has no side to turn away from
    there = decision((left, right), (bl, br))
    assert decision((right, left), (br, bl)) == MIRROR.get(there, there)


def held(
    wanted: list[Maneuver], duration: float, tick: float = 1 / 64, forward: bool = False
) -> list[Maneuver]:
    """What the hold lets through, tick by tick; ticks are exact in binary."""
    hold = Hold(1, forward)
    times = tick * np.arange(len(wanted))
    return [
        Maneuver(int(hold.step(times[i : i + 1], np.array([w]), duration)[0]))
        for i, w in enumerate(wanted)
    ]


def test_forward_is_kept_too_where_that_is_wanted() -> None:
    """By hand: two seconds of 64 ticks, each maneuver alike."""
    wanted = [FORWARD] * 3 + [TURN_L] * 130 + [FORWARD] * 200
    kept = [FORWARD] * 128 + [TURN_L] * 128 + [FORWARD] * 77
    assert held(wanted, duration=2.0, forward=True) == kept
    assert held(wanted, duration=2.0) == [FORWARD] * 3 + [TURN_L] * 256 + [FORWARD] * 74


@pytest.mark.parametrize("kept", [TURN_L, TURN_R, REVERSE])
def test_a_maneuver_is_kept_for_exactly_its_time(kept: Maneuver) -> None:
    said = held([FORWARD, kept] + [FORWARD] * 200, duration=2.0)
    assert said == [FORWARD] + [kept] * 128 + [FORWARD] * 73


def test_a_held_maneuver_is_not_replaced_by_another() -> None:
    said = held([TURN_L] + [REVERSE] * 100, duration=1.0)
    assert said == [TURN_L] * 64 + [REVERSE] * 37


def test_forward_is_left_at_once() -> None:
    assert held([FORWARD, FORWARD, TURN_R], duration=1.0)[-1] == TURN_R


def test_unknown_stops_a_held_maneuver_at_once_and_ends_with_its_cause() -> None:
    said = held([TURN_L, HOLD, HOLD, FORWARD, TURN_R], duration=1.0)
    assert said == [TURN_L, HOLD, HOLD, FORWARD, TURN_R]


@given(st.lists(st.sampled_from(list(Maneuver)), max_size=300))
def test_hold_is_always_obeyed_and_never_invented(wanted: list[Maneuver]) -> None:
    said = held(wanted, duration=0.5)
    assert [s == HOLD for s in said] == [w == HOLD for w in wanted]


@pytest.mark.parametrize("frequency", [1, 3, 7, 20, 50])
def test_a_chattering_contact_starts_at_most_one_maneuver_per_hold_time(frequency: int) -> None:
    rate, duration, hold_time = 100, 20, 2.0
    wanted = [
        TURN_R if (2 * frequency * i // rate) % 2 == 0 else FORWARD for i in range(rate * duration)
    ]
    said = held(wanted, hold_time, tick=1 / rate)
    starts = sum(b != FORWARD and a != b for a, b in itertools.pairwise([FORWARD, *said]))
    changes = sum(a != b for a, b in itertools.pairwise(said))
    assert starts <= duration / hold_time + 1
    assert changes <= 2 * (duration / hold_time + 1)


def test_rows_hold_on_their_own() -> None:
    hold = Hold(2)
    hold.step(np.zeros(2), np.array([TURN_L, FORWARD]), 1.0)
    said = hold.step(np.full(2, 0.5), np.array([FORWARD, REVERSE]), 1.0)
    assert said.tolist() == [TURN_L, REVERSE]


def test_reset_frees_a_held_row() -> None:
    hold = Hold(1)
    hold.step(np.zeros(1), np.array([TURN_L]), 10.0)
    hold.reset(np.array([0]))
    assert hold.step(np.full(1, 0.1), np.array([FORWARD]), 10.0).tolist() == [FORWARD]
