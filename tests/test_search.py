"""The search of `closed`: patience, turns that grow from the first heading, and what ends it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from antennate.control.escape import Search
from antennate.params.control import SearchParams
from antennate.types import Maneuver

PERIOD = 1 / 64
PARAMS = SearchParams(
    patience=3.0,
    reverse_time=1.0,
    reverse_most=3.0,
    turn_time=2.0,
    growth=2.0,
    free_time=1.0,
    proof_time=9.0,
    lost_turn=3.0,
    lost_time=4.0,
    return_time=12.0,
)
FORWARD, TURN_L, TURN_R = Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R
REVERSE, HOLD = Maneuver.REVERSE, Maneuver.HOLD
LEFT, RIGHT, BOTH = (0.9, 0.2), (0.2, 0.9), (0.5, 0.5)
"""Flex of both antennae, as a share of the range."""
Story = list[tuple[Maneuver, float]]


def story(
    until: float,
    stuck: Callable[[float], bool] = lambda t: True,
    feels: Callable[[float], bool] = lambda t: True,
    flex: Callable[[float], tuple[float, float]] = lambda t: BOTH,
    params: SearchParams = PARAMS,
) -> Story:
    """Maneuvers and how long each lasted [s]."""
    search, said = Search(params, 1), list[Maneuver]()
    for i in range(round(until / PERIOD)):
        t = i * PERIOD
        rows = (np.array([flex(t)]), np.array([stuck(t)]), np.array([feels(t)]))
        said.append(Maneuver(int(search.step(np.array([t]), *rows)[0])))
    return [(m, len(list(run)) * PERIOD) for m, run in itertools.groupby(said)]


@pytest.mark.parametrize(("bent", "away"), [(LEFT, TURN_R), (RIGHT, TURN_L)])
def test_it_turns_away_from_the_antenna_that_stays_bent_while_it_backs_off(
    bent: tuple[float, float], away: Maneuver
) -> None:
    """Whatever was felt before."""
    before = LEFT if bent == RIGHT else RIGHT

    def flex(t: float) -> tuple[float, float]:
        return before if t < 4.0 else bent if t < 5.0 else BOTH

    said = story(10.0, lambda t: t == 4.0, flex=flex)
    assert said == [(FORWARD, 4.0), (REVERSE, 1.0), (away, 2.0), (FORWARD, 3.0)]


def test_it_walks_for_its_patience_before_each_escape() -> None:
    walks = [time for maneuver, time in story(60.0) if maneuver == FORWARD]
    assert len(walks) >= 3
    assert walks[:3] == [3.0, 3.0, 3.0]


def test_each_turn_goes_farther_from_the_first_heading_to_the_other_side() -> None:
    """From 0 to +2, -4, +8 and -12 s of turning, the last one no farther than turning round."""
    turns = [(m, time) for m, time in story(90.0) if m in (TURN_L, TURN_R)]
    assert turns[:4] == [(TURN_R, 2.0), (TURN_L, 6.0), (TURN_R, 12.0), (TURN_L, 20.0)]


def test_it_backs_off_for_longer_each_time_up_to_a_bound() -> None:
    backing = [time for m, time in story(90.0) if m == REVERSE]
    assert backing[:4] == [1.0, 2.0, 3.0, 3.0]


def second_turn(
    stuck: Callable[[float], bool], feels: Callable[[float], bool] = lambda t: True
) -> tuple[Maneuver, float]:
    """The second turn of a robot that walks from 6 s on, after its first escape."""
    said = story(40.0, stuck, feels)
    assert said[:3] == [(FORWARD, 3.0), (REVERSE, 1.0), (TURN_R, 2.0)]
    return [step for step in said if step[0] in (TURN_L, TURN_R)][1]


def test_stuck_again_soon_it_turns_the_other_way() -> None:
    assert second_turn(lambda t: t <= 3.0 or t >= 10.0) == (TURN_L, 6.0)


def test_after_a_long_walk_it_is_stuck_anew() -> None:
    assert second_turn(lambda t: t <= 3.0 or t >= 16.0) == (TURN_R, 2.0)


def test_after_a_time_without_touch_it_is_stuck_anew() -> None:
    free = second_turn(lambda t: t <= 3.0 or t >= 10.0, lambda t: not 7.0 <= t < 8.1)
    assert free == (TURN_R, 2.0)
    short = second_turn(lambda t: t <= 3.0 or t >= 10.0, lambda t: not 7.0 <= t < 7.9)
    assert short == (TURN_L, 6.0)


def test_it_turns_round_where_nothing_is_felt_for_long_after_a_turn_that_went_far() -> None:
    """The second turn goes to 4 s from the first heading."""
    said = story(40.0, lambda t: t in (3.0, 10.0), lambda t: t < 19.0)
    assert said[4:7] == [(REVERSE, 2.0), (TURN_L, 6.0), (FORWARD, 5.0)]
    assert said[7] == (TURN_R, 12.0)


@pytest.mark.parametrize("jams", [(), (3.0,)])
def test_without_a_turn_that_went_far_it_walks_on_where_nothing_is_felt(
    jams: tuple[float, ...],
) -> None:
    said = story(30.0, lambda t: t in jams, lambda t: t < 8.0)
    assert said[-1] == (FORWARD, 24.0 if jams else 30.0)


def test_it_holds_while_a_reading_is_not_known_and_goes_on_then() -> None:
    def flex(t: float) -> tuple[float, float]:
        return (math.nan, 0.5) if 4.5 <= t < 5.5 else BOTH

    said = story(8.0, lambda t: t == 4.0, flex=flex)
    held = [(FORWARD, 4.0), (REVERSE, 0.5), (HOLD, 1.0), (REVERSE, 0.5), (TURN_R, 2.0)]
    assert said == held


def test_a_walk_that_was_held_is_no_shorter_before_it_looks_for_a_way() -> None:
    lost = (math.nan, math.nan)
    said = story(9.5, flex=lambda t: lost if 1.0 <= t < 6.0 else BOTH)
    assert said == [(FORWARD, 1.0), (HOLD, 5.0), (FORWARD, 2.0), (REVERSE, 1.0), (TURN_R, 0.5)]
