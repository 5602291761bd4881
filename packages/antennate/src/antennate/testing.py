"""Checks for the tests of a controller, a robot or a scene of your own."""

from __future__ import annotations

import json
import math

import numpy as np

from antennate.control.checking import check_controller, expect
from antennate.control.gait import targets
from antennate.errors import FAILURES, raised
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.episode import Episode
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.trial import MEMBERS, make_world, place_at_start, require_room
from antennate.sim.world import World, compile_world
from antennate.types import Floats, joint_angles

__all__ = ["check_controller", "check_robot", "check_scene"]


_TURNED = 0.05
"""Turn of each joint in its test [rad]."""
_REST, _FOLLOW = 0.5, 0.3
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
    rest = joint_angles(start, robot.command_shapes())[0]
    world.place(0.0, 0.0, 0.0, start.yaw[0], start.leg[0])
    _hold(world, rest, _REST)
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
    goals[i] += _TURNED
    _hold(world, goals, _FOLLOW)
    turned = float(world.drives()[i]) - before
    _hold(world, rest, _FOLLOW)
    expect(turned > _TURNED / 4, f"{name} to turn by {_TURNED} rad", f"{turned:.4g} rad")


def _hold(world: World, goals: Floats, time: float) -> None:
    world.command(goals)
    mujoco.mj_forward(world.model, world.data)
    world.step(round(time / world.model.opt.timestep))


_SEEDS = (0, 1, 2)
_FAR = 50.0
"""A head so far away has left any scene [m]."""
_NEAR = 0.02
"""Distance before and behind the exit line [m]."""
_STEP = 0.05
"""Step ahead from the start [m]."""
_STANDING = 250
"""Physics steps for which the robot stands."""


def check_scene(scene: Scene, robot: RobotSpec | None = None) -> None:
    """Check a scene.

    The same seed gives the same instance, other seeds give others if the scene says that it is
    random. An instance compiles; the robot has room at its start and stands there. Progress is 0 at
    the start, grows ahead of it and is the length at the exit; the head succeeds by crossing the
    exit and not before it, and has left far outside and not at the start. A time limit of its own
    is a time.

    Args:
        scene: The scene.
        robot: The robot in it, the default one if None.

    Raises:
        AssertionError: It does not; the text says what was expected and found.
    """
    robot = robot or RobotSpec()
    fits = hasattr(scene, "draw") and hasattr(scene, "random") and not isinstance(scene, type)
    expect(fits, "a scene, an object with draw and random", repr(scene))
    models = [_checked_model(_draw(scene, robot, seed), robot) for seed in _SEEDS]
    for seed, model in zip(_SEEDS, models, strict=True):
        again = _checked_model(_draw(scene, robot, seed), robot)
        expect(again == model, f"seed {seed}: the same instance again", "another")
    differ = len(set(models)) > 1
    expect(isinstance(scene.random, bool), "random to be True or False", repr(scene.random))
    if scene.random:
        expect(differ, "other instances from other seeds, as random is True", "one and the same")
    else:
        expect(not differ, "one instance, as random is False", "others from other seeds")
    for seed in _SEEDS:
        _check_course(_draw(scene, robot, seed))


def _draw(scene: Scene, robot: RobotSpec, seed: int) -> SceneInstance:
    try:
        drawn = scene.draw(robot, np.random.default_rng(seed))
    except Exception as error:
        raise AssertionError(f"expected draw to work, found: {raised(error)}") from error
    lacking = [name for name in MEMBERS if not hasattr(drawn, name)]
    expect(not lacking, f"an instance with {', '.join(MEMBERS)} from draw", repr(drawn))
    return drawn


def _checked_model(drawn: SceneInstance, robot: RobotSpec) -> bytes:
    """Compile, let the robot stand at the start, and return the whole model."""
    try:
        world = make_world(PhysicsParams(), robot, drawn)
        place_at_start(world, drawn, GaitParams())
        saved = np.zeros(mujoco.mj_sizeModel(world.model), dtype=np.uint8)
        mujoco.mj_saveModel(world.model, None, saved)
        require_room(world)
        world.command(world.drives().copy())
        world.step(_STANDING)
    except FAILURES as error:
        raise AssertionError(f"expected the robot to stand at the start, found: {error}") from error
    except Exception as error:
        raise AssertionError(f"expected build to work, found: {raised(error)}") from error
    return saved.tobytes()


def _check_course(drawn: SceneInstance) -> None:
    x, y, heading = drawn.start
    start = np.array([x, y])
    ahead = np.array([math.cos(heading), math.sin(heading)])
    expect(bool(np.isfinite([x, y, heading]).all()), "a finite start", str(drawn.start))
    expect(0.0 < drawn.length < math.inf, "a length above 0 m", f"{drawn.length} m")
    first, then = drawn.progress(start.copy()), drawn.progress(start + _STEP * ahead)
    expect(abs(first) < 1e-3, "progress 0 m at the start", f"{first} m")
    expect(then > first, f"progress to grow over {_STEP} m ahead of the start", f"{then} m")
    ended = _ended(drawn, start)
    expect(ended != "success", "no success at the start", "success")
    expect(ended is None, "a start inside", "a robot that has left")
    _check_exit(drawn)
    for turn in np.arange(8) * math.pi / 4:
        where = start + _FAR * np.array([math.cos(turn), math.sin(turn)])
        expect(drawn.left(where), f"the robot to have left at {_shown(where)}", "it inside")


def _check_exit(drawn: SceneInstance) -> None:
    exit_line = np.asarray(drawn.exit, dtype=float)
    expect(exit_line.shape == (2, 2), "an exit line of shape (2, 2)", str(exit_line.shape))
    middle, along = exit_line.mean(axis=0), exit_line[1] - exit_line[0]
    expect(bool(np.hypot(*along) > 0.0), "an exit line with a length", "none")
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    sides = [middle + _NEAR * normal, middle - _NEAR * normal]
    ways = [drawn.progress(side) for side in sides]
    expect(bool(np.isfinite(ways).all()), "finite progress about the exit", f"{ways} m")
    before, past = sorted(sides, key=drawn.progress)
    there = _ended(drawn, before)
    expect(there != "success", f"no success before it, at {_shown(before)}", "success")
    expect(there is None, f"{_shown(before)}, before the exit, inside", "outside")
    out = _ended(drawn, before, past)
    expect(out == "success", f"success past the exit, at {_shown(past)}", "none")
    gap = drawn.progress(middle) - drawn.length
    expect(abs(gap) < _NEAR, "progress at the exit to be the length", f"{gap:+.3f} m more")


def _ended(drawn: SceneInstance, *heads: Floats) -> str | None:
    """How a trial ends whose head is seen at these places, one after the other."""
    try:
        episode = Episode(drawn)
        return [episode.judge.look(head.copy()) for head in heads][-1]
    except FAILURES as error:
        raise AssertionError(f"expected to be told how a trial ends, found: {error}") from error


def _shown(where: Floats) -> str:
    return f"({where[0]:.2f}, {where[1]:.2f}) m"
