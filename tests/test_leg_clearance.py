"""Neighbouring legs stay apart, whatever their angles: by the engine's distance of real rings."""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from antennate.control.gait import targets
from antennate.errors import ConfigError
from antennate.params.base import from_values
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.sim.parts import build_robot

QUARTER_TURN = [math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0]


def rings(robot: RobotSpec) -> mujoco.MjModel:
    """The robot with flat rings for legs, as they are printed, in place of crowned ones."""
    spec = build_robot(robot)
    for geom in spec.geoms:
        if geom.name in robot.leg_names:
            geom.type = mujoco.mjtGeom.mjGEOM_CYLINDER
            geom.size = [robot.leg_radius, robot.leg_width / 2, 0.0]
            geom.quat = QUARTER_TURN
    return spec.compile()


def gap(model: mujoco.MjModel, robot: RobotSpec, yaw: np.ndarray, leg: np.ndarray) -> float:
    """Smallest distance between two legs of one side [m]."""
    data = mujoco.MjData(model)
    for name, angle in zip((*robot.yaw_names, *robot.leg_names), (*yaw, *leg), strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    ids = [model.geom(name).id for name in robot.leg_names]
    sides = (ids[0::2], ids[1::2])
    return min(
        mujoco.mj_geomDistance(model, data, front, rear, 1.0, None)
        for side in sides
        for front, rear in pairwise(side)
    )


ROBOTS = (RobotSpec(), RobotSpec(links=4, link_pitch=0.15), RobotSpec(leg_radius=0.03, width=0.16))


@pytest.mark.parametrize("robot", ROBOTS)
def test_at_the_largest_bend_no_leg_touches_another_at_any_angle(robot: RobotSpec) -> None:
    model, chance = rings(robot), np.random.default_rng(1)
    for _ in range(50):
        yaw = robot.yaw_limit * chance.choice([-1.0, 1.0], robot.yaw_count)
        leg = chance.choice([-0.5, 0.5, 0.0, 1.0], robot.leg_count) * math.pi
        assert gap(model, robot, yaw, leg) > 0.0


def test_beyond_it_legs_touch() -> None:
    robot = RobotSpec()
    yaw = np.full(robot.yaw_count, robot.clear_bend + math.radians(3.0))
    leg = np.array([[math.pi / 2, math.pi / 2], [-math.pi / 2, -math.pi / 2]] * 3).ravel()
    assert gap(rings(robot), robot, yaw, leg) < 0.0


@pytest.mark.parametrize("offset", [0.0, 0.3, -0.9])
def test_the_gait_keeps_within_it(offset: float) -> None:
    robot = RobotSpec()
    phase = np.linspace(0.0, 2.0 * math.pi, 37)
    command = targets(GaitParams(), robot, phase, np.full(37, offset))
    assert np.abs(command.yaw).max() <= robot.yaw_limit
    model = rings(robot)
    poses = zip(command.yaw, command.leg.reshape(37, -1), strict=True)
    assert min(gap(model, robot, yaw, leg) for yaw, leg in poses) > 0.0


def test_a_limit_at_which_legs_meet_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"yaw\.limit.*expected at most 0\.509 rad.*found 1"):
        from_values(RobotSpec, {"yaw": {"limit": 1.0}})
    with pytest.raises(ConfigError, match=r"link_pitch.*legs do not touch"):
        from_values(RobotSpec, {"link_pitch": 0.05})
    assert RobotSpec.model_validate({"yaw": {"limit": 0.3}}).yaw_limit == 0.3
