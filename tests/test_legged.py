"""The legged body: loads, twist, step and yaw, against closed forms, symmetries and a peer."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams
from antennate.robots.mechanics import (
    body_of,
    cycles,
    phase_law,
    require_wave,
    wave_of,
)
from antennate.robots.spec import RobotSpec
from geometric_locomotion.legged import Body, Feet, cycle, rolling_feet, twists
from geometric_locomotion.twist import Wave

ROBOT, GAIT = RobotSpec(), GaitParams()


def test_round_legs_roll_without_slip():
    """Without body wave and eccentricity the step is the circumference, and costs nothing."""
    robot = RobotSpec(leg_eccentricity=0.0)
    walked = cycles(robot, GAIT, Wave(0.0, 1.0, 0.0, 0.0))
    assert walked.step[0] == pytest.approx(2 * math.pi * robot.leg_radius, rel=1e-6)
    assert abs(walked.yaw[0]) < 1e-9
    assert walked.work[0] < 0.05 * body_of(robot, 0.6).friction * 20 * walked.step[0]


def test_loads_carry_the_weight_and_balance():
    """Forces and moments of the feet balance the weight of the links at every phase."""
    walked = cycles(ROBOT, GAIT, wave_of(GAIT, 0.1))
    body = body_of(ROBOT, 0.6)
    np.testing.assert_allclose(walked.load.sum((2, 3)), body.weight, rtol=1e-6)
    assert walked.load.min() >= 0.0


def test_loads_of_three_feet_are_those_of_the_lever():
    """A stiff straight body on three feet: N by the lever rule about its middle."""
    body = Body(0.1, np.array([10.0, 10.0]), 1e7, 1e4, 0.0, 0.6)
    reach = np.array([[[0.03, 0.01], [0.03, 0.03]]])  # front left, rear left, rear right
    place = np.tile(np.array([[0.0, 0.1], [0.0, -0.1]]), (1, 1, 2, 1, 1))[0]
    feet = Feet(
        np.tile(reach, (4, 1, 1))[None],
        np.tile(place, (4, 1, 1, 1))[None],
        np.zeros((1, 4, 2, 2, 2)),
    )
    walked = cycle(body, np.zeros((1, 4, 1)), feet)
    # the middle lies midway between front left and rear right
    np.testing.assert_allclose(walked.load[0, 0], [[10.0, 0.0], [0.0, 10.0]], atol=0.05)


def test_twist_is_that_of_another_optimiser():
    """SciPy's minimum of Σ N |v| over the twist, with velocities by finite differences."""
    body = body_of(ROBOT, 0.6)
    bend = np.array([[0.2, -0.1, 0.3, 0.1, -0.2]])
    rate = np.array([[0.3, 0.1, -0.2, 0.4, 0.1]])
    lateral = (ROBOT.width - ROBOT.leg_width) / 2
    feet = rolling_feet(0.025, 0.0, lateral, np.zeros((1, 6, 2)))
    ours = twists(body, bend, rate, feet)[0]

    def feet_at(time: float) -> tuple[np.ndarray, np.ndarray]:
        """Feet of the body at a time, head at the origin: plan geometry written out anew."""
        heading, middle, points, along = 0.0, np.zeros(2), [], []
        for i in range(6):
            if i:
                before = np.array([math.cos(heading), math.sin(heading)])
                heading += bend[0, i - 1] + time * rate[0, i - 1]
                after = np.array([math.cos(heading), math.sin(heading)])
                middle = middle - 0.06 * (before + after)
            left = np.array([-math.sin(heading), math.cos(heading)])
            points += [middle + lateral * left, middle - lateral * left]
            along += 2 * [np.array([math.cos(heading), math.sin(heading)])]
        return np.array(points), np.array(along)

    (before, _), (now, along), (after, _) = (feet_at(t) for t in (-1e-5, 0.0, 1e-5))
    drift = (after - before) / 2e-5 - 0.025 * along
    load = _loads(body, bend, feet)

    def dissipation(twist: np.ndarray) -> float:
        spin = twist[2] * np.stack([-now[:, 1], now[:, 0]], 1)
        slip = drift + twist[:2] + spin  # 1e-6: ROUNDING squared
        return float((load * np.sqrt((slip**2).sum(1) + 1e-6)).sum())

    peer = minimize(dissipation, np.array([0.025, 0.0, 0.0]), tol=1e-12)
    np.testing.assert_allclose(ours, peer.x, atol=2e-5)


def _loads(body: Body, bend: np.ndarray, feet: Feet) -> np.ndarray:
    """Loads of a body that stands still at a bend."""
    still = Feet(feet.reach[:, None], feet.place[:, None], 0 * feet.slide[:, None])
    return cycle(body, bend[:, None], still).load[0, 0].ravel()


def test_mirror_image_turns_the_other_way():
    offset = np.array([0.2, -0.2])
    walked = cycles(ROBOT, GAIT, Wave(0.3, 1.0, 3.4, offset))
    assert walked.yaw[0] == pytest.approx(-walked.yaw[1], rel=0.02)
    assert walked.step[0] == pytest.approx(walked.step[1], rel=0.02)
    assert walked.yaw[0] < -0.1


def test_friction_and_stiff_servos_leave_the_step():
    """Least dissipation does not depend on μ where the joints follow their goals."""
    wave = Wave(0.4, 1.0, 3.5, 0.1)
    first, second = (
        cycles(RobotSpec(leg_friction=mu), GAIT, wave, stiff=True) for mu in (0.3, 0.9)
    )
    assert first.step[0] == pytest.approx(second.step[0], rel=1e-3)
    assert 3 * first.work[0] == pytest.approx(second.work[0], rel=1e-2)


@pytest.mark.slow
def test_phase_law_on_stiff_servos():
    """First harmonic of speed over the lead of a small wave, within 1 deg of the law."""
    lead = np.arange(24) * math.pi / 12
    for number in (0.5, 0.75, 1.0, 1.25, 1.5):
        speed = cycles(ROBOT, GAIT, Wave(0.1, number, lead, 0.0), stiff=True).step
        best = np.angle((speed * np.exp(1j * lead)).sum())
        apart = (best - phase_law(6, number) + math.pi) % (2 * math.pi) - math.pi
        assert abs(math.degrees(apart)) < 1.0


@pytest.mark.parametrize("links", [4, 7, 10])
def test_other_numbers_of_links(links):
    """A wave near its best lead walks faster than legs alone, for 4 to 10 links."""
    robot = RobotSpec(links=links, mass=links / 3)
    lead = float(phase_law(links, 1.0)) - 0.25
    walked = cycles(robot, GAIT, Wave(np.array([0.0, 0.4]), 1.0, lead, 0.0), phases=24)
    assert walked.step[1] > 1.2 * walked.step[0]
    assert abs(walked.yaw).max() < math.radians(2)


def test_a_finer_cycle_agrees():
    coarse, fine = (cycles(ROBOT, GAIT, wave_of(GAIT), phases=n) for n in (48, 96))
    assert coarse.step[0] == pytest.approx(fine.step[0], rel=0.02)


def test_waves_beyond_the_joints_are_refused():
    with pytest.raises(ConfigError, match=r"gait.amplitude: expected at most 0\.5087 rad"):
        require_wave(ROBOT, GaitParams(amplitude=0.6))
    robot = RobotSpec.named("hexapod")
    with pytest.raises(ConfigError, match=r"yaw joints that move at most 4\.5 rad/s"):
        require_wave(robot, GaitParams(amplitude=1.1, frequency=1.0))
