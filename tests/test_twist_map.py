"""The twist map: there and back, its reach, and the time of a call."""

import math
import time

import numpy as np
import pytest

from antennate.control.gait import targets
from antennate.control.geometric import AMPLITUDE_RATE, LEAD_RATE, TwistGait
from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams
from antennate.robots.mechanics import cycles, twist_map
from antennate.robots.spec import RobotSpec
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.twist import TwistMap, Wave

GAIT = GaitParams()


@pytest.fixture(scope="module")
def map_of_robot() -> TwistMap:
    return twist_map(RobotSpec(), GAIT)


def test_there_and_back(map_of_robot):
    for curvature in np.linspace(-2.5, 2.5, 11).tolist():
        for speed in np.linspace(*map_of_robot.speeds(curvature), 7).tolist():
            gait = map_of_robot.gait(speed, curvature)
            again = map_of_robot.twist(float(gait.amplitude), float(gait.offset))
            np.testing.assert_allclose(again, (speed, curvature), rtol=0.01, atol=0.005)


def test_a_turn_to_the_left_has_a_negative_offset(map_of_robot):
    left, right = (map_of_robot.gait(0.17, k) for k in (1.0, -1.0))
    assert left.offset < 0.0 < right.offset
    assert left.amplitude == right.amplitude


def test_gaits_change_smoothly(map_of_robot):
    """A small change of what is wanted is a small change of every number of the gait."""
    wanted = np.linspace(-2.0, 2.0, 801)
    gaits = np.array([map_of_robot.gait(0.16, k) for k in wanted.tolist()], float)
    assert abs(np.diff(gaits, axis=0)).max() < 0.01


def test_out_of_reach_is_the_nearest(map_of_robot):
    fast = map_of_robot.gait(9.0, 0.0)
    assert fast.amplitude == pytest.approx(RobotSpec().yaw_limit)
    assert map_of_robot.gait(0.0, 0.0).amplitude == pytest.approx(0.0, abs=1e-9)
    assert map_of_robot.gait(0.2, 99.0) == map_of_robot.gait(0.2, map_of_robot.sharpest)


@pytest.mark.parametrize("wanted", [(math.nan, 0.0), (0.2, math.inf)])
def test_a_twist_that_is_not_finite_is_refused(map_of_robot, wanted):
    with pytest.raises(BadInputError, match="expected a finite speed and curvature"):
        map_of_robot.gait(*wanted)


def test_the_model_walks_what_is_wanted(map_of_robot):
    """A full cycle of the model, four times as fine, has the speed and the curvature asked for."""
    for speed, curvature in ((0.2, 0.5), (0.16, -1.5)):
        gait = map_of_robot.gait(speed, curvature)
        walked = cycles(RobotSpec(), GAIT, Wave(*gait), phases=96)
        assert GAIT.frequency * walked.step[0] == pytest.approx(speed, abs=0.01)
        assert walked.yaw[0] / walked.step[0] == pytest.approx(curvature, abs=0.15)


def test_a_call_takes_less_than_20_microseconds(map_of_robot):
    def once() -> float:
        begin = time.perf_counter()
        for _ in range(200):
            map_of_robot.gait(0.2, 1.0)
        return (time.perf_counter() - begin) / 200

    assert min(once() for _ in range(20)) < 20e-6


def test_lifting_legs_are_refused():
    with pytest.raises(ConfigError, match="rolling legs, found lifting"):
        twist_map(RobotSpec.named("hexapod"), GAIT)


def test_targets_do_not_jump_when_the_wanted_twist_does(map_of_robot):
    """A joint goes no farther in a tick than wave, offset, amplitude and lead can change."""
    robot, period = RobotSpec(), 0.01
    gait = TwistGait(GAIT, robot, 2, period, map_of_robot)
    rng = np.random.default_rng(5)
    yaw = []
    for _ in range(400):
        if rng.random() < 0.05 or not yaw:
            speed, curvature = rng.uniform(0.1, 0.25, 2), rng.uniform(-3.0, 3.0, 2)
        yaw.append(gait.step(speed, curvature).yaw)
    turning = 2 * math.pi * GAIT.frequency + LEAD_RATE
    most = robot.yaw_limit * turning + AMPLITUDE_RATE + GAIT.offset_rate
    assert abs(np.diff(yaw, axis=0)).max() <= period * most
    assert abs(np.array(yaw)).max() > 0.8 * robot.yaw_limit


def test_it_settles_at_the_gait_of_the_map(map_of_robot):
    """After a second the commands are those of the plain gait with the numbers of the map."""
    robot, period = RobotSpec(), 0.01
    gait = TwistGait(GAIT, robot, 1, period, map_of_robot)
    for _ in range(200):
        command = gait.step(np.array([0.17]), np.array([0.8]))
    wave = map_of_robot.gait(0.17, 0.8)
    params = GaitParams(amplitude=wave.amplitude, body_phase=wave.lead)
    plain = targets(params, robot, gait.phase, np.array([wave.offset]))
    np.testing.assert_allclose(command.yaw, plain.yaw, atol=1e-12)
    np.testing.assert_allclose(command.leg, plain.leg, atol=1e-12)
