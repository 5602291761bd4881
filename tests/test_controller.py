"""The composed control: holds on bad readings, keeps rows apart, favours no side."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recorded import robot_for

from antennate.control.registry import BUILT_IN, make_controller
from antennate.errors import ConfigError
from antennate.params.control import ControlParams
from antennate.types import AntennaFrame, Maneuver

FEELING = ("open", "paper", "closed")
"""Controllers that do what they feel, `open` among them: where nothing touches, all walk."""
PARAMS = ControlParams()
PERIOD = PARAMS.period
STRAIGHT, BENT = 1872.0, 1399.0
LONG = 1000
"""Ticks in which every maneuver is chosen."""
SWAP = np.array(
    [Maneuver.FORWARD, Maneuver.TURN_R, Maneuver.TURN_L, Maneuver.REVERSE, Maneuver.HOLD]
)


def pressed(ticks: int, left: float, right: float, rng: np.random.Generator) -> np.ndarray:
    """Counts of a robot that walks on the spot against something, shape (ticks, 2)."""
    phase = 2 * math.pi * PARAMS.gait.frequency * PERIOD * np.arange(ticks)
    bend = np.stack([left * (1 + 0.4 * np.sin(phase)), right * (1 + 0.4 * np.cos(phase))], axis=1)
    return np.rint(STRAIGHT - (STRAIGHT - BENT) * bend + rng.normal(0, 2.5, bend.shape))


def streams(ticks: int, rows: int) -> np.ndarray:
    """Counts unlike one another: pressed, jumping, with a gap, blocked; shape (ticks, rows, 2)."""
    rng = np.random.default_rng(7)
    counts = np.stack(
        [pressed(ticks, 0.3 + 0.1 * k, 0.9 - 0.1 * k, rng) for k in range(rows)], axis=1
    )
    jumps = rng.uniform(BENT, STRAIGHT, (ticks // 50 + 1, 2)).round().repeat(50, axis=0)
    counts[:, 1] = jumps[:ticks]
    if rows > 3:
        counts[ticks // 2 : ticks // 2 + 5, 2, 0] = np.nan
        counts[:100, 3] = BENT - rng.integers(0, 40, (100, 2))
    return counts


FLOOR = 1745.0
"""Counts of an antenna that is lowered to the floor; `climb` takes a straight one for a drop."""


def run(name: str, counts: np.ndarray, phase: float = 0.0) -> dict[str, np.ndarray]:
    """All that a fresh controller says to counts of shape (ticks, B, 2)."""
    batch = counts.shape[1]
    control = make_controller(name, PARAMS, robot_for(name), batch)
    control.reset(np.arange(batch), phase)
    said: dict[str, list[np.ndarray]] = {"b": [], "maneuver": [], "yaw": [], "leg": []}
    for i, reading in enumerate(counts):
        command = control.step(AntennaFrame(t=np.full(batch, i * PERIOD), counts=reading))
        for name, value in (
            ("b", control.level),
            ("maneuver", control.maneuver),
            ("yaw", command.yaw),
            ("leg", command.leg),
        ):
            said[name].append(value.copy())
    return {name: np.array(values) for name, values in said.items()}


def test_a_name_that_does_not_exist_is_refused_with_the_valid_ones() -> None:
    with pytest.raises(ConfigError, match=r"open, timed, paper, closed, .*did you mean closed\?"):
        make_controller("clsoed", PARAMS)


@pytest.mark.parametrize("name", FEELING)
def test_a_robot_that_touches_nothing_walks_forward(name: str) -> None:
    said = run(name, np.full((800, 1, 2), STRAIGHT))
    assert (said["maneuver"] == Maneuver.FORWARD).all()


def test_open_walks_on_whatever_it_touches() -> None:
    assert (run("open", np.full((300, 1, 2), BENT))["maneuver"] == Maneuver.FORWARD).all()


@pytest.mark.parametrize(
    ("bend", "expected"),
    [((1, 0), Maneuver.TURN_R), ((0, 1), Maneuver.TURN_L), ((1, 1), Maneuver.REVERSE)],
)
def test_paper_answers_touch_at_once(bend: tuple[int, int], expected: Maneuver) -> None:
    counts = STRAIGHT - (STRAIGHT - BENT) * np.array(bend, dtype=float)
    said = run("paper", np.tile(counts, (200, 1, 1)))
    assert (said["maneuver"] == expected).all()


@pytest.mark.parametrize(
    ("left", "right", "away"), [(0.9, 0.3, Maneuver.TURN_R), (0.3, 0.9, Maneuver.TURN_L)]
)
def test_closed_backs_off_and_turns_away_when_readings_repeat(
    left: float, right: float, away: Maneuver
) -> None:
    counts = pressed(1500, left, right, np.random.default_rng(1))[:, None]
    maneuvers = run("closed", counts)["maneuver"][:, 0]
    order = maneuvers[np.flatnonzero(np.diff(maneuvers, prepend=-1))]
    assert order[:3].tolist() == [Maneuver.FORWARD, Maneuver.REVERSE, away]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("name", BUILT_IN)
def test_a_reading_that_is_no_number_stops_the_robot_at_once(
    name: str, side: int, bad: float
) -> None:
    counts = np.full((60, 1, 2), STRAIGHT)
    counts[20:, 0, side] = bad
    said = run(name, counts)
    assert (said["maneuver"][20:] == Maneuver.HOLD).all()
    assert (said["leg"][20:] == said["leg"][19]).all()
    assert (said["yaw"][20:] == said["yaw"][19]).all()


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_robot_walks_again_once_the_window_has_passed_a_gap(name: str) -> None:
    counts = np.full((60, 1, 2), FLOOR if name == "climb" else STRAIGHT)
    counts[20, 0, 0] = np.nan
    holding = run(name, counts)["maneuver"][:, 0] == Maneuver.HOLD
    assert np.flatnonzero(holding).tolist() == list(range(20, 30))  # T_avg is ten samples


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in ("climb", "lifted") else ())
        for name in BUILT_IN
    ],
)
def test_a_row_says_the_same_alone_and_in_a_batch_of_seven(name: str) -> None:
    counts = streams(LONG, 7)
    together = run(name, counts)
    for row in range(5):  # those after it are pressed as the first and the fifth
        alone = run(name, counts[:, row : row + 1])
        for what, values in alone.items():
            assert np.array_equal(values[:, 0], together[what][:, row], equal_nan=True), (what, row)


def test_the_streams_of_the_batch_test_make_controllers_act() -> None:
    counts = streams(LONG, 7)
    assert set(np.unique(run("closed", counts)["maneuver"])) == set(Maneuver)
    assert set(np.unique(run("paper", counts)["maneuver"])) == set(Maneuver)


@pytest.mark.parametrize("name", FEELING)
def test_swapping_the_antennae_swaps_the_turns_and_mirrors_the_gait(name: str) -> None:
    counts = streams(LONG, 5)
    here = run(name, counts)
    there = run(name, counts[:, :, ::-1], phase=math.pi)
    assert (there["maneuver"] == SWAP[here["maneuver"]]).all()
    assert there["yaw"] == pytest.approx(-here["yaw"], abs=1e-9)


@pytest.mark.ci
@pytest.mark.parametrize("name", BUILT_IN)
def test_a_row_that_is_reset_says_what_a_new_controller_says(name: str) -> None:
    counts = streams(900, 2)
    control = make_controller(name, PARAMS, robot_for(name), 2)
    control.reset(np.arange(2))
    for i in range(777):  # any number that leaves the rings mid-way
        control.step(AntennaFrame(t=np.full(2, i * PERIOD), counts=np.full((2, 2), 100.0 + i)))
    control.reset(np.array([0]))
    fresh = run(name, counts)
    for i in range(900):
        command = control.step(AntennaFrame(t=np.full(2, i * PERIOD), counts=counts[i]))
        assert control.maneuver[0] == fresh["maneuver"][i, 0]
        assert np.array_equal(command.yaw[0], fresh["yaw"][i, 0])


@pytest.mark.parametrize("frequency", [1, 5, 20, 50])
def test_a_contact_that_chatters_starts_at_most_one_maneuver_per_hold_time(frequency: int) -> None:
    duration, hold_time = 20.0, PARAMS.rule.hold_time
    counts = np.full((round(duration / PERIOD), 1, 2), STRAIGHT)
    high = (2 * frequency * np.arange(len(counts)) // round(1 / PERIOD)) % 2 == 0
    counts[high, 0, 0] = BENT
    maneuver = run("paper", counts)["maneuver"][:, 0]
    starts = np.count_nonzero((np.diff(maneuver, prepend=0) != 0) & (maneuver != Maneuver.FORWARD))
    assert starts <= duration / hold_time + 1
