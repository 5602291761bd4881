"""Backing off and turning: order, times, sides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from antennate.control.escape import Escape
from antennate.params.control import EscapeParams
from antennate.types import Maneuver

PERIOD = 1 / 64
PARAMS = EscapeParams(
    reverse_time=1.0,
    turn_time=2.0,
    turn_offset=0.5,
    second_turn=1.5,
    retry_time=12.0,
    memory_time=4.0,
    memory_delay=0.5,
    lost_time=3.0,
    return_time=5.0,
)
FORWARD, TURN_L, TURN_R = Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R
REVERSE, HOLD = Maneuver.REVERSE, Maneuver.HOLD
TOUCHED_LEFT, TOUCHED_RIGHT = (0.9, 0.2), (0.2, 0.9)


def tick(
    escape: Escape, t: float, b: tuple[float, float], stuck: bool = False, pressed: bool = True
) -> int:
    return int(escape.step(np.array([t]), np.array([b]), np.array([stuck]), np.array([pressed]))[0])


def episodes(
    b: tuple[float, float],
    stuck_at: tuple[float, ...],
    until: float,
    feels: Callable[[float], bool] = lambda t: True,
    params: EscapeParams = PARAMS,
) -> list[tuple[Maneuver, float]]:
    """Maneuvers and how long each lasted [s], for a robot found stuck at the given times [s]."""
    escape = Escape(params, 1, PERIOD)
    said = []
    for i in range(round(until / PERIOD)):
        t = i * PERIOD
        said.append(Maneuver(tick(escape, t, b, t in stuck_at, feels(t))))
    return [(m, len(list(run)) * PERIOD) for m, run in itertools.groupby(said)]


@pytest.mark.parametrize(("b", "away"), [(TOUCHED_LEFT, TURN_R), (TOUCHED_RIGHT, TURN_L)])
def test_it_backs_off_turns_away_from_the_touched_side_and_walks(
    b: tuple[float, float], away: Maneuver
) -> None:
    said = episodes(b, (2.0,), 10.0)
    assert said == [(FORWARD, 2.0), (REVERSE, 1.0), (away, 2.0), (FORWARD, 5.0)]


@pytest.mark.parametrize(
    ("b", "first", "second"), [(TOUCHED_LEFT, TURN_R, TURN_L), (TOUCHED_RIGHT, TURN_L, TURN_R)]
)
def test_stuck_again_soon_it_turns_the_other_way_and_half_as_far_again(
    b: tuple[float, float], first: Maneuver, second: Maneuver
) -> None:
    said = episodes(b, (2.0, 8.0, 20.0), 26.0)
    turns = [(m, d) for m, d in said if m in (TURN_L, TURN_R)]
    assert turns == [(first, 2.0), (second, 3.0), (first, 3.0)]


def test_stuck_again_much_later_it_starts_anew() -> None:
    said = episodes(TOUCHED_LEFT, (2.0, 18.0), 24.0)
    assert [(m, d) for m, d in said if m in (TURN_L, TURN_R)] == [(TURN_R, 2.0), (TURN_R, 2.0)]


def test_stuck_during_an_escape_changes_nothing() -> None:
    assert episodes(TOUCHED_LEFT, (2.0, 2.5, 4.0), 9.0) == episodes(TOUCHED_LEFT, (2.0,), 9.0)


def test_without_being_stuck_it_walks_for_ever() -> None:
    assert episodes((1.0, 1.0), (), 30.0) == [(FORWARD, 30.0)]


def test_the_memory_of_touch_is_a_first_order_lag() -> None:
    escape = Escape(PARAMS, 1, PERIOD)
    for i in range(4 * 64):
        tick(escape, i * PERIOD, (1.0, 0.5))
    assert escape.touch[0] == pytest.approx([1 - math.exp(-1), (1 - math.exp(-1)) / 2], rel=0.01)


def test_the_memory_of_touch_is_frozen_while_escaping() -> None:
    escape = Escape(PARAMS, 1, PERIOD)
    tick(escape, 0.0, TOUCHED_LEFT, stuck=True)
    before = escape.touch.tolist()
    tick(escape, PERIOD, TOUCHED_RIGHT)
    assert escape.touch.tolist() == before


@pytest.mark.parametrize("b", [(math.nan, 0.5), (0.5, math.nan), (math.nan, math.nan)])
def test_a_side_that_cannot_be_trusted_makes_it_hold_and_resume(b: tuple[float, float]) -> None:
    escape = Escape(PARAMS, 1, PERIOD)
    assert tick(escape, 0.0, TOUCHED_LEFT, stuck=True) == REVERSE
    assert tick(escape, 0.1, b) == HOLD
    assert tick(escape, 0.2, TOUCHED_LEFT) == REVERSE


def test_a_row_that_is_reset_answers_like_a_new_one() -> None:
    used, new = Escape(PARAMS, 1, PERIOD), Escape(PARAMS, 1, PERIOD)
    for i in range(400):
        tick(used, i * PERIOD, TOUCHED_RIGHT, i in (64, 300))
    used.reset(np.array([0]))
    for i in range(400):
        step = (i * PERIOD, TOUCHED_LEFT, i == 64, i < 250)
        assert tick(used, *step) == tick(new, *step)


def test_after_a_turn_three_seconds_without_touch_turn_it_round_the_other_way() -> None:
    said = episodes(TOUCHED_LEFT, (2.0,), 18.0, feels=lambda t: t < 6.0)
    assert said[:4] == [(FORWARD, 2.0), (REVERSE, 1.0), (TURN_R, 2.0), (FORWARD, 4.0)]
    assert said[4] == (TURN_L, 5.0)
    assert said[5][0] == FORWARD


def test_it_turns_round_once_and_not_at_all_before_the_first_turn() -> None:
    assert episodes(TOUCHED_LEFT, (), 30.0, feels=lambda t: False) == [(FORWARD, 30.0)]
    said = episodes(TOUCHED_LEFT, (2.0,), 40.0, feels=lambda t: t < 6.0)
    assert [m for m, _ in said].count(TURN_L) == 1


def test_a_first_turn_can_be_always_right_and_alternation_be_off() -> None:
    right = PARAMS.model_copy(update={"first_turn": "right"})
    said = episodes(TOUCHED_RIGHT, (2.0,), 8.0, params=right)
    assert [m for m, _ in said] == [FORWARD, REVERSE, TURN_R, FORWARD]
    same = PARAMS.model_copy(update={"alternate": False})
    turns = [x for x in episodes(TOUCHED_LEFT, (2.0, 8.0), 14.0, params=same) if x[0] == TURN_R]
    assert turns == [(TURN_R, 2.0), (TURN_R, 2.0)]


def test_touched_alike_on_both_sides_it_turns_right() -> None:
    assert episodes((0.9, 0.9), (2.0,), 6.0)[2] == (TURN_R, 2.0)


def test_what_was_touched_half_a_second_before_it_got_stuck_decides_the_side() -> None:
    """A light touch on the left for 1 s, then 0.45 s of a strong one on the right."""
    escape = Escape(PARAMS, 1, PERIOD)
    for i in range(64 + 29):
        tick(escape, i * PERIOD, (0.2, 0.0) if i < 64 else (0.0, 1.0), stuck=i == 92)
    assert escape.touch[0, 1] > escape.touch[0, 0]
    assert tick(escape, 92 * PERIOD + PARAMS.reverse_time, (0.0, 1.0)) == TURN_R


def test_a_row_that_is_reset_forgets_at_once_what_it_touched() -> None:
    escape = Escape(PARAMS, 1, PERIOD)
    for i in range(100):
        tick(escape, i * PERIOD, TOUCHED_RIGHT)
    escape.reset(np.array([0]))
    for i in range(5):
        tick(escape, i * PERIOD, TOUCHED_LEFT, stuck=i == 4)
    assert tick(escape, 4 * PERIOD + PARAMS.reverse_time, TOUCHED_LEFT) == TURN_R
