"""Checks for the tests of a controller, a robot or a scene of your own."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from antennate.control.gait import targets
from antennate.control.loop import CheckedController, Wrapped
from antennate.control.registry import ControllerFactory, make_controller
from antennate.errors import FAILURES, raised
from antennate.params.control import ConditioningParams, ControlParams
from antennate.params.gaits import GaitParams
from antennate.params.scene import GRAVITY, PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.episode import Episode
from antennate.sim.scenes.scene import Scene, SceneInstance
from antennate.sim.trial import MEMBERS, make_world, place_at_start, require_room
from antennate.sim.world import World, compile_world
from antennate.types import AntennaFrame, Contact, Floats, JointCommand, Maneuver, joint_angles

__all__ = ["check_controller", "check_robot", "check_scene"]


_ROWS = 5
_TICKS = 700
_RESET_AT = 350
"""Tick in which one row is reset while the others go on."""
_LEAPS = (0.0, 120.0, 3600.0)
"""Times from which readings are given [s]."""
_BLIND_FROM, _BLIND_TO = 400, 420
"""Ticks in which a row reads NaN."""


@dataclass(frozen=True, slots=True)
class _Trace:
    """All answers of a run, the first axis over ticks, the second over rows."""

    commands: dict[str, Floats]
    decisions: dict[str, Floats]

    def expect_same(
        self, what: str, other: _Trace, mine: Sequence[int], its: Sequence[int]
    ) -> None:
        """Expect the same answers in these rows of the two."""
        for name, values in (self.commands | self.decisions).items():
            here = values[:, list(mine)]
            there = (other.commands | other.decisions)[name][:, list(its)]
            equal = (here == there) | (np.isnan(here) & np.isnan(there))
            for tick in np.argwhere(~equal)[:1, 0].tolist():
                raise AssertionError(f"expected {what}, found another {name} at tick {tick}")


def check_controller(
    factory: str | ControllerFactory,
    robot: RobotSpec | None = None,
    control: ControlParams | None = None,
) -> None:
    """Check a controller.

    It can be made for one robot and for many. Its answers have the right shapes; angles are finite,
    maneuvers and contacts exist, levels are within 0 and 1. The same readings give the same answers
    again. Rows do not influence one another, whatever their order and number. A row that is reset
    answers as a new controller, and the others go on. A reading that is not finite makes its
    antenna UNKNOWN and its row HOLD, with joint targets that stand still. Frames are left as they
    are, in 700 steps from 0 s on and in as many from 2 and from 60 minutes on. A command that was
    returned does not change later, and changing it does not change later answers.

    Args:
        factory: The controller: its name, a class, or a function (control, robot, batch).
        robot: The robot, the default one if None.
        control: Numbers of the control, the defaults if None.

    Raises:
        AssertionError: It does not; the text says what was expected and found.
    """
    run = _Runs(factory, robot or RobotSpec(), control or ControlParams())
    counts, rows = run.counts, list(range(_ROWS))
    together = run.trace(counts, rows)
    again, spoiled = run.trace(counts, rows), run.trace(counts, rows, spoil=True)
    again.expect_same("the same answers to the same readings", together, rows, rows)
    what = "the same answers when a command that was returned is changed"
    spoiled.expect_same(what, together, rows, rows)
    turned = rows[::-1]
    other = run.trace(counts[:, turned], turned)
    other.expect_same("the same answers from rows in another order", together, rows, turned)
    for row in rows:
        alone = run.trace(counts[:, [row]], [row])
        alone.expect_same(f"row {row} alone to answer as in a batch", together, [0], [row])
    _check_reset(run, together)
    _check_blind(run, together)
    run.trace(np.concatenate([counts] * len(_LEAPS)), rows)


class _Runs:
    """Runs of fresh controllers over readings."""

    def __init__(
        self, factory: str | ControllerFactory, robot: RobotSpec, control: ControlParams
    ) -> None:
        self._factory, self._robot, self._control = factory, robot, control
        self._parts = tuple(robot.command_shapes(1))
        self.counts = _readings(control.conditioning, control.period, control.gait.frequency)

    def trace(
        self,
        counts: Floats,
        rows: Sequence[int],
        reset: int | None = None,
        first: int = 0,
        spoil: bool = False,
    ) -> _Trace:
        """Answers to counts (ticks, rows, 2) from tick `first` on; row `reset` is reset then.

        Time and phase of a row depend on its number in `rows`; after _TICKS time leaps to the next
        of _LEAPS. With `spoil` each command is overwritten after it was noted.
        """
        batch, period = len(rows), self._control.period
        offsets = 0.37 * np.array(rows, float)
        try:
            controller = make_controller(self._factory, self._control, self._robot, batch)
            watched = _Watched(controller)
            checked = CheckedController(watched, self._robot, batch)
            checked.reset(np.arange(batch), offsets)
            commands: list[JointCommand] = []
            copies_of: list[list[Floats]] = []
            names = ("maneuver", "contact", "level")
            decisions: dict[str, list[Floats]] = {name: [] for name in names}
            for tick, reading in enumerate(counts[first:], first):
                if tick == _RESET_AT and reset is not None:
                    checked.reset(np.array([reset]), offsets[[reset]])
                t = offsets + period * (tick % _TICKS) + _LEAPS[tick // _TICKS]
                frame = AntennaFrame(t, reading, self._positions(t), *self._motion(t))
                commands.append(_step(checked, watched, frame))
                copies_of.append([getattr(commands[-1], part).copy() for part in self._parts])
                for part in self._parts if spoil else ():
                    getattr(commands[-1], part)[...] = math.nan
                for name, values in decisions.items():
                    values.append(np.array(getattr(controller, name), float))
        except FAILURES as error:
            raise AssertionError(f"{error} (with {batch} rows)") from error
        for tick, (command, copies) in enumerate(zip(commands, copies_of, strict=True)):
            if spoil:
                break
            for part, copy in zip(self._parts, copies, strict=True):
                _expect(
                    np.array_equal(getattr(command, part), copy),
                    "a command that stays as it was returned",
                    f"another {part} in that of tick {tick} later",
                )
        arrays = {part: np.array([c[i] for c in copies_of]) for i, part in enumerate(self._parts)}
        trace = _Trace(arrays, {name: np.array(values) for name, values in decisions.items()})
        _check_values(trace)
        return trace

    def _positions(self, t: Floats) -> Floats:
        """Joint angles at the time of each row [rad], shape (rows, n): slow waves."""
        lags = np.arange(len(self._robot.joint_names))
        return 0.3 * np.sin(2.0 * math.pi * self._control.gait.frequency * t[:, None] - lags)

    def _motion(self, t: Floats) -> tuple[Floats, Floats]:
        """What an inertial sensor feels at the time of each row, shapes (rows, 3) or (rows, 0).

        A head that turns to and fro and stays level.
        """
        if not self._robot.has_imu:
            return np.zeros((len(t), 0)), np.zeros((len(t), 0))
        turning = np.sin(2.0 * math.pi * self._control.gait.frequency * t[:, None])
        return turning * [0.0, 0.0, 1.0], np.tile([0.0, 0.0, GRAVITY], (len(t), 1))


class _Watched(Wrapped):
    """A controller whose last command is kept as it gave it, and what it wrote into its frame."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        before = frame.copy()
        self.command = super().step(frame)
        self.written = [
            part.name
            for part in fields(before)
            if not np.array_equal(*(getattr(f, part.name) for f in (before, frame)), equal_nan=True)
        ]
        return self.command


def _step(checked: CheckedController, watched: _Watched, frame: AntennaFrame) -> JointCommand:
    checked.step(frame)
    found = f"another {' and '.join(watched.written)} after a step at {frame.t[0]:.2f} s"
    _expect(not watched.written, "a frame that is left as it is", f"{found}; change a copy")
    for row, fault in checked.faults.items():
        raise AssertionError(f"{fault} in row {row}")
    return watched.command


def _check_values(trace: _Trace) -> None:
    level = trace.decisions["level"]
    wrong = (level < 0.0) | (level > 1.0)
    _expect(not wrong.any(), "levels of 0 to 1, or NaN", f"{level[wrong][:1]}")


def _check_reset(run: _Runs, together: _Trace) -> None:
    rows = list(range(_ROWS))
    after = run.trace(run.counts, rows, reset=1)
    others = [row for row in rows if row != 1]
    after.expect_same("the other rows to go on when one is reset", together, others, others)
    fresh = run.trace(run.counts[:, [1]], [1], first=_RESET_AT)
    parts = (after.commands, after.decisions)
    again = _Trace(*({name: v[_RESET_AT:] for name, v in part.items()} for part in parts))
    again.expect_same("a row that is reset to answer as a new one", fresh, [1], [0])


def _check_blind(run: _Runs, together: _Trace) -> None:
    rows = list(range(_ROWS))
    blind = slice(_BLIND_FROM, _BLIND_TO)
    for side in (0, 1):
        for bad in (math.nan, math.inf):
            counts = run.counts.copy()
            counts[blind, 2, side] = bad
            trace = run.trace(counts, rows)
            others = [row for row in rows if row != 2]
            what = f"the other rows to go on when one reads {bad}"
            trace.expect_same(what, together, others, others)
            held = trace.decisions["maneuver"][blind, 2] == int(Maneuver.HOLD)
            unknown = trace.decisions["contact"][blind, 2, side] == int(Contact.UNKNOWN)
            _expect(held.all(), f"HOLD while an antenna reads {bad}", "another maneuver")
            _expect(unknown.all(), f"UNKNOWN for a reading of {bad}", "another contact")
            for part, values in trace.commands.items():
                still = (values[blind, 2] == values[_BLIND_FROM - 1, 2]).all()
                _expect(still, "joint targets that stand still in HOLD", f"{part} moves")


def _readings(conditioning: ConditioningParams, period: float, frequency: float) -> Floats:
    """Counts (ticks, rows, 2): free, pressed on either side, blocked, and changing at random."""
    rng = np.random.default_rng(0)
    low, high = conditioning.counts_low, conditioning.counts_high
    phase = 2.0 * math.pi * frequency * period * np.arange(_TICKS)
    flex = np.zeros((_TICKS, _ROWS, 2))
    flex[:, 1, 0] = 0.8 + 0.2 * np.sin(phase)
    flex[:, 2, 1] = 0.7 + 0.2 * np.cos(phase)
    flex[:, 3] = 0.95
    flex[:, 4] = rng.uniform(0.0, 1.0, (_TICKS // 50, 2)).repeat(50, axis=0)
    straight, bent = (high, low) if conditioning.polarity < 0 else (low, high)
    noise = rng.normal(0.0, 2.5, flex.shape)
    return np.rint(straight + (bent - straight) * flex + noise)


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
    _expect(isinstance(robot, RobotSpec), "a RobotSpec", repr(robot))
    _check_numbers(robot)
    world = World(compile_world(PhysicsParams(), robot), robot)
    mass = float(world.model.body_mass.sum())
    _expect(
        math.isclose(mass, robot.mass, rel_tol=1e-9),
        f"bodies of {robot.mass} kg in all",
        f"{mass} kg",
    )
    start = targets(GaitParams(amplitude=0.0), robot, np.zeros(1), np.zeros(1), lifting=False)
    rest = joint_angles(start, robot.command_shapes())[0]
    world.place(0.0, 0.0, 0.0, start.yaw[0], start.leg[0])
    _hold(world, rest, _REST)
    _expect(world.head[2] > 0.0, "it to stand", f"its head {world.head[2]} m high")
    for i, name in enumerate(robot.joint_names):
        _check_joint(world, rest, i, name)


def _check_numbers(robot: RobotSpec) -> None:
    count = len(robot.joint_names)
    for what in ("ids", "directions", "zeros", "limits", "fastest"):
        found = len(getattr(robot, what))
        _expect(found == count, f"{count} {what}, one a joint", f"{found}")
    _expect(len(set(robot.ids)) == count, "ids that differ", f"{robot.ids}")
    again = RobotSpec.model_validate_json(json.dumps(robot.model_dump(mode="json")), strict=True)
    _expect(again == robot, "the same robot back from JSON", "another")


def _check_joint(world: World, rest: Floats, i: int, name: str) -> None:
    before = float(world.drives()[i])
    goals = rest.copy()
    goals[i] += _TURNED
    _hold(world, goals, _FOLLOW)
    turned = float(world.drives()[i]) - before
    _hold(world, rest, _FOLLOW)
    _expect(turned > _TURNED / 4, f"{name} to turn by {_TURNED} rad", f"{turned:.4g} rad")


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
    _expect(fits, "a scene, an object with draw and random", repr(scene))
    models = [_checked_model(_draw(scene, robot, seed), robot) for seed in _SEEDS]
    for seed, model in zip(_SEEDS, models, strict=True):
        again = _checked_model(_draw(scene, robot, seed), robot)
        _expect(again == model, f"seed {seed}: the same instance again", "another")
    differ = len(set(models)) > 1
    _expect(isinstance(scene.random, bool), "random to be True or False", repr(scene.random))
    if scene.random:
        _expect(differ, "other instances from other seeds, as random is True", "one and the same")
    else:
        _expect(not differ, "one instance, as random is False", "others from other seeds")
    for seed in _SEEDS:
        _check_course(_draw(scene, robot, seed))


def _draw(scene: Scene, robot: RobotSpec, seed: int) -> SceneInstance:
    try:
        drawn = scene.draw(robot, np.random.default_rng(seed))
    except Exception as error:
        raise AssertionError(f"expected draw to work, found: {raised(error)}") from error
    lacking = [name for name in MEMBERS if not hasattr(drawn, name)]
    _expect(not lacking, f"an instance with {', '.join(MEMBERS)} from draw", repr(drawn))
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
    _expect(bool(np.isfinite([x, y, heading]).all()), "a finite start", str(drawn.start))
    _expect(0.0 < drawn.length < math.inf, "a length above 0 m", f"{drawn.length} m")
    first, then = drawn.progress(start.copy()), drawn.progress(start + _STEP * ahead)
    _expect(abs(first) < 1e-3, "progress 0 m at the start", f"{first} m")
    _expect(then > first, f"progress to grow over {_STEP} m ahead of the start", f"{then} m")
    ended = _ended(drawn, start)
    _expect(ended != "success", "no success at the start", "success")
    _expect(ended is None, "a start inside", "a robot that has left")
    _check_exit(drawn)
    for turn in np.arange(8) * math.pi / 4:
        where = start + _FAR * np.array([math.cos(turn), math.sin(turn)])
        _expect(drawn.left(where), f"the robot to have left at {_shown(where)}", "it inside")


def _check_exit(drawn: SceneInstance) -> None:
    exit_line = np.asarray(drawn.exit, dtype=float)
    _expect(exit_line.shape == (2, 2), "an exit line of shape (2, 2)", str(exit_line.shape))
    middle, along = exit_line.mean(axis=0), exit_line[1] - exit_line[0]
    _expect(bool(np.hypot(*along) > 0.0), "an exit line with a length", "none")
    normal = np.array([-along[1], along[0]]) / np.hypot(*along)
    sides = [middle + _NEAR * normal, middle - _NEAR * normal]
    ways = [drawn.progress(side) for side in sides]
    _expect(bool(np.isfinite(ways).all()), "finite progress about the exit", f"{ways} m")
    before, past = sorted(sides, key=drawn.progress)
    there = _ended(drawn, before)
    _expect(there != "success", f"no success before it, at {_shown(before)}", "success")
    _expect(there is None, f"{_shown(before)}, before the exit, inside", "outside")
    out = _ended(drawn, before, past)
    _expect(out == "success", f"success past the exit, at {_shown(past)}", "none")
    gap = drawn.progress(middle) - drawn.length
    _expect(abs(gap) < _NEAR, "progress at the exit to be the length", f"{gap:+.3f} m more")


def _ended(drawn: SceneInstance, *heads: Floats) -> str | None:
    """How a trial ends whose head is seen at these places, one after the other."""
    try:
        episode = Episode(drawn)
        return [episode.judge.look(head.copy()) for head in heads][-1]
    except FAILURES as error:
        raise AssertionError(f"expected to be told how a trial ends, found: {error}") from error


def _shown(where: Floats) -> str:
    return f"({where[0]:.2f}, {where[1]:.2f}) m"


def _expect(holds: bool, expected: str, found: str) -> None:
    if not holds:
        raise AssertionError(f"expected {expected}, found {found}")
