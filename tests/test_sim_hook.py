"""A robot that hangs: how far its hook gives, and how it swings there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from antennate.params.scene import GRAVITY, HookParams, PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.hook import Hook
from antennate.sim.world import PREFIX, World, add_robot, new_spec

ROBOT, PHYSICS = RobotSpec(), PhysicsParams()


def hung(params: HookParams) -> tuple[World, Hook]:
    spec = new_spec(PHYSICS)
    add_robot(spec, ROBOT, PHYSICS)
    spec.body(PREFIX + ROBOT.link_names[0]).pos[2] += 0.2  # a head that sags is not below 0
    world = World(spec.compile(), ROBOT)
    world.place_drives(np.zeros(len(ROBOT.joint_names)))
    hook = Hook(world, params)
    hook.grasp()
    world.forces = hook.pull
    return world, hook


@pytest.mark.parametrize("height", [0.0, 0.05])
def test_a_hook_gives_by_weight_over_stiffness(height: float) -> None:
    world, hook = hung(HookParams())
    world.forces = lambda: hook.pull(height)
    middle = ROBOT.links // 2
    before = world.link_places()[middle, 2]
    world.step(1000)
    weight = GRAVITY * float(world.model.body_mass.sum())
    down = before + height - world.link_places()[middle, 2]
    assert down == pytest.approx(weight / 3000.0, rel=0.03)


ENDS = {
    "soft": HookParams(stiffness=500.0, damping=20.0, twist_stiffness=20.0, twist_damping=0.3),
    "hard": HookParams(stiffness=6000.0, damping=80.0, twist_stiffness=120.0, twist_damping=0.6),
    "hard, less damped": HookParams(
        stiffness=6000.0, damping=20.0, twist_stiffness=120.0, twist_damping=0.3
    ),
}


@pytest.mark.parametrize("params", ENDS.values(), ids=ENDS)
def test_a_robot_comes_to_rest_by_any_hook(params: HookParams) -> None:
    world, _ = hung(params)
    world.step(4000)
    assert abs(world.data.qvel).max() < 0.05
    assert abs(world.heading) < math.radians(1.0)
