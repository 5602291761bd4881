"""The search of `closed`: patience, turns that grow from the first heading, and what ends it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from antennate.control.search import Search
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
    memory_time=4.0,
    lost_time=4.0,
    return_time=12.0,
)
FORWARD, TURN_L, TURN_R = Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R
REVERSE, HOLD = Maneuver.REVERSE, Maneuver.HOLD
LEFT, RIGHT = (0.9, 0.2), (0.2, 0.9)
Story = list[tuple[Maneuver, float]]


def story(
    until: float,
    stuck: Callable[[float], bool] = lambda t: True,
    feels: Callable[[float], bool] = lambda t: True,
    level: Callable[[float], tuple[float, float]] = lambda t: LEFT,
    params: SearchParams = PARAMS,
) -> Story:
    """Maneuvers and how long each lasted [s]."""
    search, said = Search(params, 1, PERIOD), list[Maneuver]()
    for i in range(round(until / PERIOD)):
        t = i * PERIOD
        rows = (np.array([level(t)]), np.array([stuck(t)]), np.array([feels(t)]))
        said.append(Maneuver(int(search.step(np.array([t]), *rows)[0])))
    return [(m, len(list(run)) * PERIOD) for m, run in itertools.groupby(said)]


@pytest.mark.parametrize(("touched", "away"), [(LEFT, TURN_R), (RIGHT, TURN_L)])
def test_it_backs_off_and_turns_away_from_the_side_that_touched(
    touched: tuple[float, float], away: Maneuver
) -> None:
    said = story(10.0, lambda t: t == 4.0, level=lambda t: touched)
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


def test_it_turns_round_where_nothing_is_felt_for_long_after_a_turn() -> None:
    said = story(24.0, lambda t: t == 3.0, lambda t: t < 8.0)
    assert said[2:4] == [(TURN_R, 2.0), (FORWARD, 6.0)]
    assert said[4] == (TURN_L, 12.0)


def test_without_a_turn_before_it_walks_on_where_nothing_is_felt() -> None:
    assert story(20.0, lambda t: False, lambda t: t < 2.0) == [(FORWARD, 20.0)]


def test_it_holds_while_a_reading_is_not_known_and_goes_on_then() -> None:
    def level(t: float) -> tuple[float, float]:
        return (math.nan, 0.2) if 4.5 <= t < 5.5 else LEFT

    said = story(8.0, lambda t: t == 4.0, level=level)
    held = [(FORWARD, 4.0), (REVERSE, 0.5), (HOLD, 1.0), (TURN_R, 2.0), (FORWARD, 0.5)]
    assert said == held
