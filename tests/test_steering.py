"""`follow` and `centre`: PD control of what is felt, by closed forms of its two terms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from antennate.control.registry import make_controller
from antennate.control.steering import STRAIGHT
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.trial import TrialConfig, draw_scene, scene_of
from antennate.studies.simulate import simulate
from antennate.types import AntennaFrame, Floats, Maneuver

CONTROL = ControlParams.model_validate(
    {
        "gait": {"amplitude": 0.0},  # so that the joints show the offset alone
        "conditioning": {"averaging_time": 0.01},
        "follow": {"bend": 0.2, "gain": 0.5, "rate_gain": 0.3, "smoothing_time": 0.5},
        "centre": {"gain": 0.5, "rate_gain": 0.3, "smoothing_time": 0.5},
    }
)
MOST = RobotSpec().yaw_limit
LEFT_WALL = {"follow": CONTROL.follow.model_copy(update={"side": "left"})}


def counts_of(flex: Floats) -> Floats:
    """Readings of a flex as a share of the calibrated range; it falls with bending."""
    own = CONTROL.conditioning
    return own.counts_high - np.asarray(flex) * (own.counts_high - own.counts_low)


def offsets(name: str, flex: Floats, **changes: Any) -> tuple[Floats, Floats]:
    """Yaw offset [rad] and maneuver at each tick of flexes, shape (n, 2); both (n,)."""
    control = CONTROL.model_copy(update=changes)
    made = make_controller(name, control)
    made.reset(np.array([0]))
    found = []
    for tick, each in enumerate(flex):
        frame = AntennaFrame(np.array([tick * control.period]), counts_of(each)[None])
        found.append((made.step(frame).yaw[0, 0], made.maneuver[0]))
    offset, maneuver = np.array(found).T
    return offset, maneuver


@pytest.mark.parametrize(
    ("name", "flex", "changes", "wanted"),
    [
        ("follow", (0.0, 0.6), {}, -0.5 * 0.4),  # too near on the right: to the left
        ("follow", (0.9, 0.0), {}, 0.5 * 0.2),  # no wall there: towards where it was
        ("follow", (0.6, 0.0), LEFT_WALL, 0.5 * 0.4),
        ("centre", (0.6, 0.2), {}, 0.5 * 0.4),
        ("centre", (0.3, 0.3), {}, 0.0),
    ],
)
def test_a_steady_reading_is_answered_in_proportion(
    name: str, flex: tuple[float, float], changes: Any, wanted: float
) -> None:
    offset, maneuver = offsets(name, np.tile(flex, (500, 1)), **changes)
    assert offset[-1] == pytest.approx(wanted, abs=1e-9)
    turn = Maneuver.TURN_R if wanted > 0 else Maneuver.TURN_L
    assert maneuver[-1] == (turn if wanted else Maneuver.FORWARD)


def test_a_ramp_is_answered_by_its_slope_and_by_a_level_that_lags_by_the_time_constant() -> None:
    """A first-order low-pass follows a ramp of slope s with the lag s T, within a tick."""
    slope, control = 0.05, CONTROL.centre
    t = CONTROL.period * np.arange(800)
    offset, _ = offsets("centre", np.stack([slope * t, np.zeros(800)], axis=1))
    lagged = slope * (t[-1] - control.smoothing_time)
    assert offset[-1] == pytest.approx(
        control.gain * lagged + control.rate_gain * slope,
        abs=1.01 * control.gain * slope * CONTROL.period,
    )


def test_the_offset_ends_at_that_of_an_escape_and_goes_there_at_its_rate() -> None:
    strong = CONTROL.centre.model_copy(update={"gain": 20.0})
    offset, _ = offsets("centre", np.tile((0.9, 0.0), (300, 1)), centre=strong)
    assert offset[-1] == pytest.approx(min(CONTROL.escape.turn_offset, MOST))
    most = CONTROL.gait.offset_rate * CONTROL.period
    assert np.abs(np.diff(offset)).max() == pytest.approx(most)


def test_little_steering_is_told_as_forward() -> None:
    share = 0.9 * STRAIGHT * CONTROL.escape.turn_offset / CONTROL.centre.gain
    offset, maneuver = offsets("centre", np.tile((share, 0.0), (400, 1)))
    assert offset[-1] > 0.0
    assert maneuver[-1] == Maneuver.FORWARD


@pytest.mark.parametrize("name", ["follow", "centre"])
@pytest.mark.parametrize("side", [0, 1])
def test_a_reading_that_is_unknown_holds_and_changes_nothing(name: str, side: int) -> None:
    """Behind the gap it goes on as if there had been none."""
    flex = np.tile((0.5, 0.1), (120, 1))
    gap = np.insert(flex, 60, np.full((40, 2), 0.5), axis=0)
    gap[60:100, side] = np.nan
    whole, _ = offsets(name, flex)
    offset, maneuver = offsets(name, gap)
    assert (maneuver[60:100] == Maneuver.HOLD).all()
    assert (offset[60:100] == offset[59]).all()
    np.testing.assert_allclose(offset[100:], whole[60:], atol=1e-12)


def test_left_and_right_are_alike() -> None:
    rng = np.random.default_rng(5)
    flex = np.abs(np.cumsum(rng.normal(0.0, 0.02, (400, 2)), axis=0))
    there, back = (offsets("centre", f)[0] for f in (flex, flex[:, ::-1]))
    np.testing.assert_allclose(there, -back, atol=1e-9)
    right, left = (
        offsets("follow", f, **c)[0] for f, c in ((flex, {}), (flex[:, ::-1], LEFT_WALL))
    )
    np.testing.assert_allclose(right, -left, atol=1e-9)


@pytest.mark.ci
def test_follow_stays_at_the_wall_that_open_leaves() -> None:
    """An antenna reaches 0.14 m beside the robot; both walls are on the right."""
    settings: dict[str, Any] = {"scene": "wall", "seed": 600_000}
    config = TrialConfig.model_validate(settings)
    for trial in (0, 1):
        wall: Any = draw_scene(config, scene_of(config), trial)
        gaps = {}
        for name in ("open", "follow"):
            series = simulate(name, trial, 14.0, **settings)
            gaps[name] = np.mean([wall.gap(head) for head in series.head[-400:]])
        assert abs(gaps["follow"]) < 0.14 < 0.5 < gaps["open"]
