"""Controllers that leave the plane: the line over an edge, and what lowered antennae do."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from antennate.control.climbing.body import line, pitch_angles
from antennate.control.climbing.rule import Ground, Stage
from antennate.control.knowledge import Knowledge
from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.params.climb import ClimbParams
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Maneuver, joint_angles

ROBOT = RobotSpec.named("scuttle3d")
PARAMS = ClimbParams()
RISE = 0.12


def test_the_line_rises_before_the_edge_and_comes_down_to_the_step() -> None:
    far = np.array([-2.0, -PARAMS.before - PARAMS.ramp])
    assert line(PARAMS, ROBOT, far, RISE) == pytest.approx(0.0)
    top = np.array([-PARAMS.before, 0.0, 0.06])
    assert line(PARAMS, ROBOT, top, RISE) == pytest.approx(RISE + PARAMS.over)
    behind = np.array([0.06 + PARAMS.settle, 2.0])
    assert line(PARAMS, ROBOT, behind, RISE) == pytest.approx(RISE)


def angles(*progress: float) -> np.ndarray:
    """Pitch joints of a robot at these edges [rad], shape (P,)."""
    rise = np.full((1, len(progress)), RISE)
    return pitch_angles(PARAMS, ROBOT, np.array([progress]), rise)[0]


@pytest.mark.parametrize("progress", [-0.1, 0.0, 0.13, 0.4])
def test_each_link_does_what_the_link_before_did(progress: float) -> None:
    """Follow the leader: a link pitch later, each joint has the angle of the joint before it."""
    later = angles(progress + ROBOT.link_pitch)
    assert later[1:] == pytest.approx(angles(progress)[:-1], abs=1e-12)


def test_slopes_of_links_are_those_of_chords_of_the_line() -> None:
    """The joints add up to the slope of the head, as the tail is level."""
    ends = np.array([-0.1 + 0.06, -0.1 - 0.06])
    front, back = line(PARAMS, ROBOT, ends, RISE)
    assert angles(-0.1).sum() == pytest.approx(math.asin((front - back) / ROBOT.link_pitch))


def test_a_robot_far_from_all_edges_is_level_and_two_edges_add() -> None:
    assert angles(math.nan, -1.0) == pytest.approx(0.0)
    assert angles(math.nan, 0.0) == pytest.approx(angles(0.0))


def test_planar_robots_are_refused_in_one_line() -> None:
    with pytest.raises(ConfigError, match=r"pitch joints and antennae that rise.*without pitch"):
        make_controller("climb")


@pytest.mark.parametrize("name", ["climb", "lifted", "rhythm", "edges"])
def test_without_readings_no_joint_moves(name: str) -> None:
    """Whatever it was doing: the command stays as it was, to the bit."""
    controller = make_controller(name, ControlParams(), ROBOT, 1)
    controller.reset(np.array([0]))
    t = iter(np.arange(2000) * 0.01)

    def command(counts: float) -> np.ndarray:
        if name == "edges":
            edge = Knowledge(edges=np.array([[-0.3, math.nan, math.nan, math.nan]]))
            controller.know(edge)  # pyright: ignore[reportAttributeAccessIssue]
        frame = AntennaFrame(np.array([next(t)]), np.full((1, 2), counts))
        return joint_angles(controller.step(frame), ROBOT.command_shapes())

    moved = 0
    for tick in range(900):
        last = command(BENT if 200 < tick < 260 else FLOOR)
        if tick in (4, 10) or tick % 150 == 100:
            moved += not (last == command(FLOOR)).all()
            last = command(FLOOR)
            assert all((command(math.nan) == last).all() for _ in range(20))
    assert moved > 2  # at many of these times it would have moved


def test_a_plan_that_is_told_goes_on_at_its_pace_and_back_with_the_robot() -> None:
    control = ControlParams()
    controller = make_controller("edges", control, ROBOT, 1)
    controller.reset(np.array([0]))
    plans = []
    for tick, place in enumerate([-0.2] * 10 + [0.2] * 400 + [-0.15] * 10):
        knowledge = Knowledge(edges=np.array([[place, math.nan, math.nan, math.nan]]))
        controller.know(knowledge)  # pyright: ignore[reportAttributeAccessIssue]
        controller.step(AntennaFrame(np.array([0.01 * tick]), np.full((1, 2), FLOOR)))
        body = controller.body  # pyright: ignore[reportAttributeAccessIssue]
        plans.append(body.progress[0].copy())
    first = np.array(plans)[:, 0]
    assert first[9] == -0.2
    assert first[109] - first[11] == pytest.approx(0.98 * control.climb.pace)
    assert first[-1] == -0.15
    assert np.isnan(np.array(plans)[:, 1:]).all()


def test_legs_go_slower_while_the_plan_goes_on() -> None:
    """A leg makes one turn in each period of the gait, and of the slower one while it climbs."""
    control = ControlParams()
    walk, climb = control.gait.frequency, control.climb.frequency
    assert climb < walk
    controller = make_controller("rhythm", control, ROBOT, 1)
    controller.reset(np.array([0]))
    legs = [
        controller.step(AntennaFrame(np.array([0.01 * i]), np.full((1, 2), FLOOR))).leg[0, 0, 0]
        for i in range(1500)
    ]
    for begin, frequency in ((100, walk), (1000, climb)):
        period = 1.0 / (0.01 * frequency)
        end = np.interp(begin + period, np.arange(1500), legs)
        assert abs(end - legs[begin]) == pytest.approx(2.0 * math.pi, abs=0.01)


STRAIGHT, FLOOR, BENT = 1870.0, 1745.0, 1500.0
"""Counts of an antenna over a drop, on the floor and at a step: datasheet curve of the sensor."""


def felt(left: float, right: float, seconds: float = 2.0) -> tuple[int, int, list[int]]:
    """Stage and ground of `climb` after floor and then these counts, and its maneuvers since."""
    control = ControlParams()
    controller = make_controller("climb", control, ROBOT, 1)
    controller.reset(np.array([0]))
    maneuvers: list[int] = []
    for tick in range(200 + round(seconds / control.period)):
        counts = [[FLOOR, FLOOR]] if tick < 200 else [[left, right]]
        controller.step(AntennaFrame(np.array([tick * control.period]), np.array(counts)))
        if tick >= 200:
            maneuvers.append(int(controller.maneuver[0]))
    rule = controller.rule  # pyright: ignore[reportAttributeAccessIssue]
    return int(rule.stage[0]), int(rule.ground[0]), maneuvers


def test_on_the_floor_it_walks() -> None:
    stage, ground, maneuvers = felt(FLOOR, FLOOR)
    assert (stage, ground) == (Stage.WALK, Ground.FLOOR)
    assert set(maneuvers) == {Maneuver.FORWARD}


def test_what_bends_an_antenna_is_probed_standing() -> None:
    stage, _, maneuvers = felt(BENT, FLOOR, seconds=1.0)
    assert stage == Stage.PROBE_UP
    assert maneuvers[-1] == Maneuver.HOLD


def test_missing_ground_without_a_floor_within_reach_is_backed_off_from() -> None:
    stage, ground, maneuvers = felt(STRAIGHT, STRAIGHT, seconds=2.5)
    assert (stage, ground) == (Stage.BACK, Ground.DROP)
    assert maneuvers[-1] == Maneuver.REVERSE


def test_a_bump_behind_a_cliff_is_walked_over() -> None:
    """What it backed off from says nothing of what it meets next: no second retreat."""
    control = ControlParams()
    controller = make_controller("climb", control, ROBOT, 1)
    controller.reset(np.array([0]))
    stages = []
    for tick in range(1800):
        t = tick * control.period
        counts = STRAIGHT if 2.0 < t < 5.0 or t > 14.3 else BENT if t > 14.0 else FLOOR
        controller.step(AntennaFrame(np.array([t]), np.full((1, 2), counts)))
        rule = controller.rule  # pyright: ignore[reportAttributeAccessIssue]
        stages.append(Stage(int(rule.stage[0])))
    met = [stage for stage, then in pairwise(stages) if stage != then]
    assert met[:4] == [Stage.WALK, Stage.PROBE_DOWN, Stage.BACK, Stage.TURN]
    assert met[4:6] == [Stage.WALK, Stage.PROBE_UP]
    assert Stage.RETREAT not in stages


@pytest.mark.parametrize("counts", [(math.nan, FLOOR), (BENT, math.nan)])
def test_a_reading_that_is_missing_is_unknown_ground_and_holds(counts: tuple[float, float]) -> None:
    _, ground, maneuvers = felt(*counts, seconds=0.5)
    assert ground == Ground.UNKNOWN
    assert set(maneuvers) == {Maneuver.HOLD}
