"""Check that a scene keeps its protocol. Authors of scenes call it in their tests."""

from __future__ import annotations

import math

import numpy as np

from antennate.control.expect import expect
from antennate.errors import AntennateError, raised
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.trial import MEMBERS, Judge, make_world, place_at_start, require_room
from antennate.types import Floats

_SEEDS = (0, 1, 2)
_FAR = 50.0
"""A head so far away has left any scene [m]."""
_NEAR = 0.02
"""Distance before and behind the exit line [m]."""
_STEP = 0.05
"""Step ahead from the start [m]."""
_SETTLE = 250
"""Physics steps for which the robot stands."""


def check_scene(scene: Scene, robot: RobotSpec | None = None) -> None:
    """Check a scene.

    The same seed gives the same instance, other seeds give others if the scene says that it is
    random. An instance compiles; the robot has room at its start and stands there. Progress is 0 at
    the start, grows ahead of it and is the length at the exit; the head succeeds by crossing the
    exit and not before it, and has left far outside and not at the start.

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
        world.step(_SETTLE)
    except AntennateError as error:
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
    judge = Judge(drawn)
    try:
        return [judge.look(head.copy()) for head in heads][-1]
    except AntennateError as error:
        raise AssertionError(f"expected to be told how a trial ends, found: {error}") from error


def _shown(where: Floats) -> str:
    return f"({where[0]:.2f}, {where[1]:.2f}) m"
