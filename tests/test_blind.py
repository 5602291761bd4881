"""Controllers that feel nothing: what they do is the clock's, or chance's, whatever they touch."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from antennate.control.registry import make_controller
from antennate.params.control import ControlParams
from antennate.types import AntennaFrame, Maneuver

BLIND = ("timed", "schedule", "zigzag", "random")
FORWARD, LEFT, RIGHT, REVERSE, HOLD = (int(m) for m in Maneuver)
STRAIGHT, BENT = 1872.0, 1399.0


def run(name: str, seconds: float, counts: float = STRAIGHT, **groups: object) -> list[int]:
    """The maneuver of each tick."""
    return maneuvers(name, seconds, 0.0, counts, **groups)


def maneuvers(
    name: str, seconds: float, phase: float, counts: float = STRAIGHT, **groups: object
) -> list[int]:
    control = ControlParams.model_validate(groups)
    made = make_controller(name, control)
    made.reset(np.array([0]), phase)
    found: list[int] = []
    for tick in range(round(seconds / control.period)):
        t = np.array([tick * control.period])
        made.step(AntennaFrame(t=t, counts=np.full((1, 2), counts)))
        found.append(made.maneuver.item())
    return found


def stretches(found: list[int]) -> list[tuple[int, float]]:
    """Each maneuver in order, and how long it lasted [s]."""
    cuts = [0, *(np.flatnonzero(np.diff(found)) + 1).tolist(), len(found)]
    return [(found[a], (b - a) / 100.0) for a, b in itertools.pairwise(cuts)]


@pytest.mark.parametrize("name", BLIND)
def test_what_touches_changes_nothing_and_a_lost_reading_holds(name: str) -> None:
    found = run(name, 40.0)
    assert found == run(name, 40.0, BENT)
    assert len(set(found)) == 4  # FORWARD, REVERSE and both turns
    assert set(run(name, 1.0, math.nan)) == {HOLD}


@pytest.mark.parametrize("walk", [4.0, 18.0])  # 18 s is longer than escape.retry_time
def test_timed_walks_its_time_then_escapes_to_the_right_and_left_alternately(walk: float) -> None:
    """Nothing was touched, so right first; then the other way, half as far again, and so on."""
    found = stretches(run("timed", 3 * walk + 28.0, timed={"walk_time": walk}))
    told = [(FORWARD, walk), (REVERSE, 2.2), (RIGHT, 2.2), (FORWARD, walk), (REVERSE, 2.2)]
    told += [(LEFT, 3.3), (FORWARD, walk), (REVERSE, 2.2), (RIGHT, 3.3)]
    assert [m for m, _ in found[:9]] == [m for m, _ in told]
    assert [s for _, s in found[:9]] == pytest.approx([s for _, s in told], abs=0.021)


def test_schedule_turns_to_headings_about_the_first_one() -> None:
    """To 30, -30 and 90 degrees at 30 degrees a second takes 1, 2 and 4 s; then anew."""
    deg = math.radians(30.0)
    params = {"headings": (deg, deg, 3 * deg), "turn_rate": deg, "walk_time": 1.0}
    found = stretches(run("schedule", 30.0, schedule={**params, "reverse_times": (0.5, 1.5)}))
    told = [(FORWARD, 1.0), (REVERSE, 0.5), (RIGHT, 1.0), (FORWARD, 1.0), (REVERSE, 1.5)]
    told += [(LEFT, 2.0), (FORWARD, 1.0), (REVERSE, 1.5), (RIGHT, 4.0)]
    assert found[:12] == [*told, *told[:3]]


def test_zigzag_turns_by_as_much_to_both_sides() -> None:
    params = {"walk_time": 1.0, "reverse_time": 0.0, "turn_time": 2.0}
    found = stretches(run("zigzag", 12.0, zigzag=params))
    turns = [(RIGHT, 1.0), (LEFT, 2.0), (RIGHT, 2.0)]
    assert found[:6] == [part for turn in turns for part in ((FORWARD, 1.0), turn)]


@pytest.mark.slow
def test_random_chooses_by_its_seed_and_phase_alone() -> None:
    found = maneuvers("random", 60.0, 1.25)
    assert found == maneuvers("random", 60.0, 1.25)
    assert found != maneuvers("random", 60.0, 1.26)
    assert found != maneuvers("random", 60.0, 1.25, random={"seed": 1})
    # each begins with a walk, of 5 s in the mean: of 40, within four standard errors
    walks = [
        stretches(maneuvers("random", 40.0, phase, rate=10.0))[0][1] * 10.0
        for phase in np.linspace(0.0, 6.0, 40)
    ]
    assert np.mean(walks) == pytest.approx(5.0, abs=4 * 5.0 / math.sqrt(40))
