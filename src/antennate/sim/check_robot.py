"""Check a robot's description: it compiles, stands, and each joint answers its command."""

from __future__ import annotations

import json
import math

import numpy as np

from antennate.control.expect import expect
from antennate.control.gait import targets
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.world import World, compile_world
from antennate.types import Floats

_STEP = 0.05
"""Turn of each joint in its test [rad]."""
_SETTLE, _TURN = 0.5, 0.3
"""Time to come to rest, and to follow a command [s]."""


def check_robot(robot: RobotSpec) -> None:
    """Check that a description makes a robot that stands and obeys.

    Its ids differ and fit its joints, it survives JSON, its bodies add up to its mass, it comes to
    rest on its legs, and each joint that a servo moves turns the way its command goes.

    Raises:
        AssertionError: Something is otherwise than expected.
    """
    expect(isinstance(robot, RobotSpec), "a RobotSpec", repr(robot))
    _check_numbers(robot)
    world = World(compile_world(PhysicsParams(), robot), robot)
    mass = float(world.model.body_mass.sum())
    expect(
        math.isclose(mass, robot.mass, rel_tol=1e-9),
        f"bodies of {robot.mass} kg in all",
        f"{mass} kg",
    )
    start = targets(GaitParams(amplitude=0.0), robot, np.zeros(1), np.zeros(1), lifting=False)
    rest = np.concatenate([getattr(start, name).ravel() for name in robot.command_shapes()])
    world.place(0.0, 0.0, 0.0, start.yaw[0], start.leg[0])
    _hold(world, rest, _SETTLE)
    expect(world.head[2] > 0.0, "it to stand", f"its head {world.head[2]} m high")
    for i, name in enumerate(robot.joint_names):
        _check_joint(world, rest, i, name)


def _check_numbers(robot: RobotSpec) -> None:
    count = len(robot.joint_names)
    for what in ("ids", "directions", "zeros", "limits", "fastest"):
        found = len(getattr(robot, what))
        expect(found == count, f"{count} {what}, one a joint", f"{found}")
    expect(len(set(robot.ids)) == count, "ids that differ", f"{robot.ids}")
    again = RobotSpec.model_validate_json(json.dumps(robot.model_dump(mode="json")), strict=True)
    expect(again == robot, "the same robot back from JSON", "another")


def _check_joint(world: World, rest: Floats, i: int, name: str) -> None:
    before = float(world.drives()[i])
    goals = rest.copy()
    goals[i] += _STEP
    _hold(world, goals, _TURN)
    turned = float(world.drives()[i]) - before
    _hold(world, rest, _TURN)
    expect(turned > _STEP / 4, f"{name} to turn by {_STEP} rad", f"{turned:.4g} rad")


def _hold(world: World, goals: Floats, time: float) -> None:
    world.command(goals)
    mujoco.mj_forward(world.model, world.data)
    world.step(round(time / world.model.opt.timestep))
