"""A fit from logs to a robot: first steps in the air, then walks, then both robots on all steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError, SimulationError
from antennate.messages import typed
from antennate.robots.spec import RobotSpec
from antennate.studies.pool import Workers, gather, workers_from
from antennate.studies.run_files import log_of
from antennate.studies.trials import OnStep, no_step
from antennate.telemetry.mocap import Poses, poses_of
from antennate.types import Floats
from antennate_lab.fit import least_squares, measures, recording, regression
from antennate_lab.fit.config import NO_POSES, FitConfig
from antennate_lab.fit.estimates import Estimate, correlations, of_air, of_legs
from antennate_lab.fit.least_squares import Problem
from antennate_lab.fit.parameters import BACKLASH, LEG, Parameter, changed, parameters
from antennate_lab.fit.recording import Recording
from antennate_lab.fit.regression import Known, is_walk
from antennate_lab.fit.residuals import YAW_AXIS, merged, moving
from antennate_lab.fit.result import FitResult, LogSummary, ParameterRow, StepRow
from antennate_lab.fit.simulated import Course, simulated

_GAINS = (0.5, 1.0, 2.0)
"""Gains of servos with which a search begins, over those of the robot's file."""
_DELAY = 0.005
"""Delay with which a search begins [s]."""
_LEVEL = 0.4
"""Standard deviation of the logarithm of the friction that all legs share, before."""
_START, _AIR, _ALL = 100, 400, 1000
"""Steps of the progress line when a search has its start, when the air is done, and at the end."""
_HALF = 2
"""Rounds of a search in the air that count as half of it: the first rounds take longest."""
_WANDERS = (
    "the walks contradict one another more than those of 95 of 100 simulated robots, as if the "
    "friction of the legs changed on the way; it is fitted as one that does. Clean floor and "
    "treads, or record more walks"
)


@dataclass(frozen=True)
class FitOutcome:
    """What a fit has found.

    Attributes:
        after: The fitted robot.
        recordings: Logs as they were read.
        courses: All courses of all logs, with the name of their log.
        held: Names of the steps that were not fitted.
        made: The courses as simulated with the robot before and the fitted one.
        found: What is known of each parameter.
        warnings: What is wrong.
    """

    config: FitConfig
    after: RobotSpec
    recordings: list[Recording]
    courses: list[tuple[str, Course]]
    held: frozenset[str]
    made: list[tuple[Course, Course]]
    found: list[Estimate]
    warnings: list[str]

    @property
    def rows(self) -> list[ParameterRow]:
        """A row for each parameter."""
        return [each.row() for each in self.found]

    def result(self) -> FitResult:
        """What the run comes to."""
        return FitResult(
            logs=[
                LogSummary(
                    name=each.name,
                    sha256=each.sha256,
                    steps=[course.name for course in each.courses],
                    left_out=each.left_out,
                    warnings=each.warnings,
                )
                for each in self.recordings
            ],
            parameters=self.rows,
            steps=self._steps(),
            correlations=correlations(self.found),
            noise=_noise(self.recordings),
            warnings=self.warnings,
            simulate="antennate tunnel --robot robot.toml",
        )

    def _steps(self) -> list[StepRow]:
        rows = []
        for (log, course), (before, after) in zip(self.courses, self.made, strict=True):
            if not len(moving(course)):
                continue
            three = (course, before, after)
            lag = [1e3 * float(measures.lags(each).mean()) for each in three]
            turns = [math.degrees(measures.turn(each)) for each in three]
            turned = [None if math.isnan(each) else each for each in turns]
            speeds = [1e3 * measures.speed(each, course) for each in three]
            gone = [None if math.isnan(each) else each for each in speeds]
            rows.append(
                StepRow(
                    log=log,
                    step=course.name,
                    fitted=course.name not in self.held,
                    error_before_deg=math.degrees(measures.error(before, course)),
                    error_deg=math.degrees(measures.error(after, course)),
                    lag_ms=lag[0],
                    lag_before_ms=lag[1],
                    lag_after_ms=lag[2],
                    turn_deg=turned[0],
                    turn_before_deg=turned[1],
                    turn_after_deg=turned[2],
                    speed_mm=gone[0],
                    speed_before_mm=gone[1],
                    speed_after_mm=gone[2],
                )
            )
        return rows


def run(config: FitConfig, workers: int | Workers, on_step: OnStep = no_step) -> FitOutcome:
    """Fit a robot to logs.

    Args:
        config: Logs and robot.
        workers: Where simulations run.
        on_step: Told of how many of how many parts are done.

    Raises:
        BadInputError: A log cannot be of that robot, or holds nothing to compare.
    """
    if not config.log:
        raise BadInputError("log: expected logs of `drive --protocol`, found none")
    robot = config.described
    cure = f"`{typed('drive')} --protocol identify` records one"
    paths = [log_of(Path(name), cure) for name in config.log]
    seen = _seen(config, paths)
    recordings = [recording.read(path, robot, own) for path, own in zip(paths, seen, strict=True)]
    courses = [(each.name, course) for each in recordings for course in each.courses]
    held = _left_out(config, [course for _, course in courses])
    fitted = [course for _, course in courses if course.name not in held]
    rng = np.random.default_rng(config.seed)
    with workers_from(workers).stay() as pool:
        air = merged(robot, [course for course in fitted if course.hanging])
        found = _in_air(robot, air, pool, rng, on_step) if air else []
        walks = [course for course in fitted if is_walk(course)]
        wanders = False
        if walks:
            legs, wanders = _on_floor(config, with_told(robot, found), walks, pool, rng, on_step)
            found += legs
        after = with_told(robot, found)
        tasks = [(each, course) for _, course in courses for each in (robot, after)]
        made = gather(_simulated, tasks, pool, no_step)
    pairs = list(zip(made[::2], made[1::2], strict=True))
    warnings = [f"{each.name}: {text}" for each in recordings for text in each.warnings]
    warnings += [_WANDERS] * wanders
    on_step(_ALL, _ALL)
    return FitOutcome(config, after, recordings, courses, held, pairs, found, warnings)


def _seen(config: FitConfig, paths: Sequence[Path]) -> list[tuple[str, Poses] | None]:
    """Motion capture beside each log: name of its table, and its poses in the time of the log."""
    if not config.poses:
        return [None] * len(paths)
    if len(config.poses) != len(paths):
        raise BadInputError(
            f"poses: expected a table or the word {NO_POSES} for each log, {len(paths)}, found "
            f"{len(config.poses)}"
        )

    def seen(path: Path, name: str) -> tuple[str, Poses] | None:
        if name == NO_POSES:
            return None
        table = Path(name)
        told = poses_of(path, table, config.markers, config.unit, config.up, config.mirrored)
        return table.name, told

    return [seen(*pair) for pair in zip(paths, config.poses, strict=True)]


def with_told(robot: RobotSpec, found: Sequence[Estimate]) -> RobotSpec:
    """The robot with all numbers that are told."""
    told = [each for each in found if each.told]
    return changed(robot, [each.parameter for each in told], [each.value for each in told])


def _simulated(robot: RobotSpec, course: Course) -> Course:
    """A course as simulated; where that fails, joints that follow their commands."""
    try:
        return simulated(robot, course)
    except SimulationError:
        return course


def _left_out(config: FitConfig, courses: Sequence[Course]) -> frozenset[str]:
    """Steps that judge the fit: those that were named, else walks at the middle frequency."""
    names = {course.name for course in courses}
    if unknown := [name for name in config.leave_out if name not in names]:
        raise BadInputError(
            f"leave_out: expected steps of the logs, {', '.join(sorted(names))}, found {unknown[0]}"
        )
    cycles = sorted({course.cycle for course in courses if is_walk(course)})
    if config.leave_out or len(cycles) < 3:
        return frozenset(config.leave_out)
    middle = cycles[len(cycles) // 2]
    return frozenset(course.name for course in courses if course.cycle == middle)


def _in_air(
    robot: RobotSpec,
    air: list[Course],
    pool: Workers,
    rng: np.random.Generator,
    on_step: OnStep,
) -> list[Estimate]:
    """Servos, backlash and antennae from steps in the air."""
    chosen = parameters(robot, _names(robot))

    def told(done: int, _most: int) -> None:
        on_step(_START + (_AIR - _START) * done // (done + _HALF), _ALL)

    begin = _start(robot, chosen, air, pool, on_step)
    problem = Problem(robot, air, chosen, pool, told)
    solution = least_squares.solve(problem, begin)
    covariance, draws = least_squares.covariances(problem, solution, rng)
    on_step(_AIR, _ALL)
    return of_air(problem, solution, covariance, draws)


def _names(robot: RobotSpec) -> list[tuple[str, int | None]]:
    """Parameters that steps in the air may tell."""
    names: list[tuple[str, int | None]] = []
    rubbing = {robot.yaw.servo, robot.legs.servo}
    for servo in dict.fromkeys(robot.servo_names):
        own = ["gain_divisor", "delay", "armature"]
        own += ["friction", "load_friction"] if servo in rubbing else []
        names += [(f"servos.{servo}.{name}", None) for name in own]
    if robot.legs.servo == robot.yaw.servo:
        names.append(("legs.gain_factor", None))
    names += [(BACKLASH, place) for place in range(robot.yaw_count)]
    if robot.antenna_count:
        names += [
            ("antenna.three_coil_stiffness_n_mm_per_deg", None),
            ("antenna.damping_time", None),
            ("antennae.right_stiffness", None),
            ("antennae.right_gain", None),
        ]
        if robot.antenna.sensor.kind == "flex":
            names.append(("antenna.sensor.bend_gain", None))
    return names


def _start(
    robot: RobotSpec,
    chosen: Sequence[Parameter],
    air: list[Course],
    pool: Workers,
    on_step: OnStep,
) -> Floats:
    """Place at which the search begins: the best of several, by the lightest joints alone.

    Gains and delays alone are searched: inertia and friction would make up for a wrong gain.
    """
    light = [c for c in air if len(j := moving(c)) and j[0] >= robot.yaw_count] or air[:1]
    few = [each for each in chosen if each.path.endswith(("gain_divisor", "delay"))]
    found = []
    for gain in _GAINS:
        problem = Problem(robot, light, few, pool)
        begin = problem.start.copy()
        for place, each in enumerate(few):
            if each.path.endswith("gain_divisor"):
                begin[place] -= np.log(gain)
            if each.path.endswith("delay"):
                begin[place] = max(begin[place], _DELAY)
        found.append(least_squares.solve(problem, begin, rough=True))
        on_step(_START * len(found) // len(_GAINS), _ALL)
    best = min(found, key=lambda each: each.misfit)
    known = dict(zip([each.name for each in few], best.x.tolist(), strict=True))
    return np.array([known.get(each.name, each.searched(each.start)) for each in chosen])


def _on_floor(
    config: FitConfig,
    robot: RobotSpec,
    walks: list[Course],
    pool: Workers,
    rng: np.random.Generator,
    on_step: OnStep,
) -> tuple[list[Estimate], bool]:
    """Friction of each leg from walks of robots whose servos are as the air has told.

    Also whether it is taken to change on the way.
    """
    chosen = parameters(robot, [(LEG, place) for place in range(robot.leg_count)])
    own = np.array([each.scale.spread for each in chosen])
    start = np.array([each.searched(each.start) for each in chosen])
    prior = Known(start, own, _LEVEL)

    def made(x: Floats) -> RobotSpec:
        values = [each.value(at) for each, at in zip(chosen, x.tolist(), strict=True)]
        return changed(robot, chosen, values)

    def told(done: int, of: int) -> None:
        on_step(_AIR + round((_ALL - _AIR - 20) * done / of), _ALL)

    legs = regression.search(made, chosen, walks, prior, config.robots, pool, rng, told)
    return of_legs(robot, legs, prior, rng), legs.wanders


def _noise(recordings: Sequence[Recording]) -> dict[str, float]:
    """Noise of readings and gyroscope, and the zero of that, from steps in which nothing moves."""
    still = [course for each in recordings for course in each.courses if not len(moving(course))]
    told: dict[str, float] = {}
    if still and still[0].counts.size:
        told["counts"] = _spread([course.counts for course in still])
    if still and still[0].gyro.size:
        told["gyro"] = _spread([course.gyro[:, YAW_AXIS:] for course in still])
    if recordings[0].gyro_zero.size:
        told["gyro_zero"] = float(recordings[0].gyro_zero[YAW_AXIS])
    return told


def _spread(parts: Sequence[Floats]) -> float:
    """Standard deviation of one sample, by the differences of neighbours."""
    return float(np.median([np.std(np.diff(part, axis=0)) / np.sqrt(2.0) for part in parts]))
