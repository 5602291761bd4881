"""Steps in the air: parameters by robust least squares over simulations of them.

A simulation in the air is smooth in its parameters and its paths do not part, so that every tick
counts. Simulations of one step for one change of one parameter are tasks for workers; a parameter
is changed only where the joints that move depend on it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import lsq_linear

from antennate.errors import SimulationError
from antennate.robots.spec import RobotSpec
from antennate.studies.pool import Workers, gather
from antennate.studies.trials import OnStep, no_step
from antennate.types import Bools, Floats, Ints
from antennate_lab.fit.parameters import BACKLASH, SHORTEST, Parameter, bounds, changed
from antennate_lab.fit.residuals import NOISE, channels, labels, moving, pieces
from antennate_lab.fit.simulated import Course, simulated

ROBUST = 3.0
"""Residuals beyond so many standard deviations count in proportion, not by their square."""
DRAWS = 400
"""Draws of a bootstrap."""
_ROUNDS = 40
"""Most steps of a search."""
_ENOUGH = 0.02
"""A search goes over to pieces when a step improves the cost by less than this share."""
_SHORT = 0.3
"""A search is done when a step is shorter than this in all directions [standard deviations]."""
_SMALL_PLAY = 3.0
"""A backlash of less than so many nudges is tried without."""
_LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e3
"""A search is done, too, when no shorter step than that of the most damping improves it."""


def _channels_of(robot: RobotSpec, course: Course) -> Floats:
    """Channels of a simulated course; far off where the simulation fails."""
    try:
        return channels(robot, simulated(robot, course), course)
    except SimulationError:
        return np.full_like(channels(robot, course, course), 10.0)


@dataclass
class Problem:
    """Courses, and the parameters that are searched in them.

    Attributes:
        robot: The robot that the search begins with.
        courses: Courses in the air.
        chosen: The parameters.
        workers: Where simulations run.
        on_step: Told of each round.
    """

    robot: RobotSpec
    courses: Sequence[Course]
    chosen: Sequence[Parameter]
    workers: Workers
    on_step: OnStep = no_step
    noise: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Begin with the least noise of each channel."""
        self.noise = self.least = [
            np.array([[NOISE[kind] for kind, _ in labels(self.robot, course)]])
            for course in self.courses
        ]
        self.measured = [channels(self.robot, course, course) for course in self.courses]
        self.told = np.array([*map(self._tells, self.courses, self.measured)]).reshape(
            len(self.courses), len(self.chosen)
        )
        self.start = np.array([each.searched(each.start) for each in self.chosen])
        self.spread = np.array([each.scale.spread for each in self.chosen])
        self.nudge = np.array([each.scale.nudge for each in self.chosen])
        self.plays = np.array([each.path == BACKLASH for each in self.chosen])
        delays = np.array([each.path.endswith("delay") for each in self.chosen])
        self.smallest = np.where(self.plays, self.nudge, np.where(delays, SHORTEST / 2.0, -np.inf))

    def _tells(self, course: Course, measured: Floats) -> Bools:
        """Which parameters change what is measured in a course."""
        joints = moving(course).tolist()
        servos = {self.robot.servo_names[joint] for joint in joints}
        own = {self.robot.joint_names[joint] for joint in joints}
        kinds = [kind for kind, _ in labels(self.robot, course)]
        reads = any(measured[:, at].any() for at, kind in enumerate(kinds) if kind == "counts")

        def depends(each: Parameter) -> bool:
            group, _, rest = each.path.partition(".")
            if group == "servos":
                return rest.partition(".")[0] in servos
            if group == "legs":
                return not own.isdisjoint(self.robot.leg_names)
            if group == "yaw":  # what swings on one joint, swings on the next
                return not own.isdisjoint(self.robot.yaw_names)
            return reads

        return np.array([depends(each) for each in self.chosen], bool)

    def swept(self) -> Bools:
        """Parameters that steps tell; of the backlash of a yaw joint, those in which it moves."""
        own = {
            self.robot.joint_names[joint]
            for course in self.courses
            for joint in moving(course).tolist()
        }
        names = self.robot.yaw_names
        return np.array(
            [
                self.told[:, p].any() and (each.path != BACKLASH or names[each.place or 0] in own)
                for p, each in enumerate(self.chosen)
            ]
        )

    def made(self, x: Floats) -> RobotSpec:
        """The robot at a place of the search."""
        values = [each.value(at) for each, at in zip(self.chosen, x.tolist(), strict=True)]
        return changed(self.robot, self.chosen, values)

    def predictions(self, places: Sequence[tuple[Floats, Ints]]) -> list[list[Floats]]:
        """Channels of some courses at each of several places of the search."""
        tasks = [(self.made(x), self.courses[i]) for x, which in places for i in which]
        found = iter(gather(_channels_of, tasks, self.workers, no_step))
        return [list(itertools.islice(found, len(which))) for _, which in places]

    def residuals(self, predicted: Sequence[Floats]) -> list[Floats]:
        """Residuals of all courses in units of the noise, each (n, C)."""
        parts = zip(predicted, self.measured, self.noise, strict=True)
        return [(simulated - measured) / noise for simulated, measured, noise in parts]

    def in_noise(self, slopes: Sequence[Floats]) -> list[Floats]:
        """Slopes of the residuals, from those of the channels."""
        return [slope / noise[..., None] for slope, noise in zip(slopes, self.noise, strict=True)]

    def cost(self, x: Floats, predicted: Sequence[Floats]) -> float:
        """Robust cost of a place, soft L1, the prior too."""
        spread = sum(
            float((np.sqrt(1.0 + (each / ROBUST) ** 2) - 1.0).sum())
            for each in self.residuals(predicted)
        )
        return ROBUST**2 * spread + 0.5 * float((self.prior(x) ** 2).sum())

    def slopes(self, x: Floats, predicted: Sequence[Floats]) -> list[Floats]:
        """Change of the channels with each parameter, (n, C, P), a simulation for each told one."""
        steps = np.where(self.plays & (x == 0.0), 3.0 * self.nudge, self.nudge)
        steps = np.where(x + steps > bounds(self.chosen)[1], -steps, steps)
        places = [
            (x + step * np.eye(len(x))[p], np.flatnonzero(self.told[:, p]))
            for p, step in enumerate(steps)
        ]
        slopes = [np.zeros((*each.shape, len(x))) for each in predicted]
        for p, found in enumerate(self.predictions(places)):
            for i, moved in zip(places[p][1].tolist(), found, strict=True):
                slopes[i][:, :, p] = (moved - predicted[i]) / steps[p]
        return slopes

    def updated(
        self, slopes: Sequence[Floats], step: Floats, changes: Sequence[Floats], scale: Floats
    ) -> list[Floats]:
        """Slopes that agree with what a step has changed, else as little changed as may be.

        Broyden's update (Mathematics of Computation 19, 1965), of what a course depends on alone.
        """
        found = []
        for told, slope, change in zip(self.told, slopes, changes, strict=True):
            along = scale * step * told
            missed = change - slope @ step
            found.append(slope + missed[..., None] * along / max(float(along @ step), 1e-300))
        return found

    def snapped(self, x: Floats) -> Floats:
        """The place with backlashes below a nudge, and delays of half a timestep, at 0.

        The ends of a play are soft, and a delay is at least a timestep, so that one of nearly 0
        differs from none.
        """
        return np.where(x < self.smallest, 0.0, x)

    def prior(self, x: Floats) -> Floats:
        """How far a place is from what was known before, in its standard deviations."""
        return (x - self.start) / self.spread


@dataclass(frozen=True)
class Solution:
    """What a search has found.

    Attributes:
        x: Place of the best parameters, shape (P,).
        misfit: Mean square of the residuals there in units of the least noise.
        residuals: Residuals of all courses there, each (n, C).
        slopes: Change of them with each parameter, each (n, C, P).
    """

    x: Floats
    misfit: float
    residuals: list[Floats]
    slopes: list[Floats]


def solve(problem: Problem, begin: Floats, rough: bool = False) -> Solution:
    """Best parameters from a place on.

    Levenberg and Marquardt's steps, each within the bounds by SciPy's `lsq_linear`, and in no
    direction longer than the standard deviation of what was known before. Slopes are simulated
    where a step does not do what those before say; in between each step corrects them. The noise of
    a channel is at least what its residuals are at present, so that a start that is far off counts
    all of them. When that has settled, a search that is not to be rough goes on with a noise of
    each piece of a course: what a step before has left swinging counts less.
    """
    low, high = bounds(problem.chosen)
    x = np.clip(begin, low, high)
    every = np.arange(len(problem.courses))
    predicted = problem.predictions([(x, every)])[0]
    slopes = problem.slopes(x, predicted)
    damping, by_piece, fresh = _LEAST_DAMPING, False, True
    for number in range(_ROUNDS):
        problem.noise = noises(problem, predicted, by_piece)
        cost = problem.cost(x, predicted)
        bend, pull = _normal(problem, x, problem.residuals(predicted), problem.in_noise(slopes))
        sure = np.sqrt(np.diag(np.linalg.inv(bend)))
        gain, short = 0.0, False
        while damping < _MOST_DAMPING and not short:
            ends = np.maximum(low - x, -problem.spread), np.minimum(high - x, problem.spread)
            step = _bounded(bend, pull, damping, *ends)
            short = bool((abs(step) < _SHORT * sure).all())
            step = problem.snapped(x + step) - x
            new = problem.predictions([(x + step, every)])[0]
            gain = cost - problem.cost(x + step, new)
            if gain > 0.0:
                damping = max(damping / 10.0, _LEAST_DAMPING)
                changes = [after - before for after, before in zip(new, predicted, strict=True)]
                slopes = problem.updated(slopes, step, changes, np.diag(bend))
                x, predicted = x + step, new
            if gain > 0.0 or not fresh:
                break
            damping *= 10.0
        problem.on_step(number + 1, _ROUNDS)
        settled = short or gain <= (0.0 if by_piece else _ENOUGH * cost)
        if fresh and settled and (rough or by_piece):
            break
        if fresh and settled:
            by_piece, damping = True, _LEAST_DAMPING
            x, predicted = _without_small_plays(problem, x, predicted)
        fresh = settled
        if settled:
            slopes = problem.slopes(x, predicted)
    if not fresh:
        slopes = problem.slopes(x, predicted)
    problem.noise = noises(problem, predicted, by_piece=True)
    whole = zip(noises(problem, predicted), problem.least, strict=True)
    misfit = float(np.mean([((noise / least) ** 2).mean() for noise, least in whole]))
    return Solution(x, misfit, problem.residuals(predicted), problem.in_noise(slopes))


def _without_small_plays(
    problem: Problem, x: Floats, predicted: list[Floats]
) -> tuple[Floats, list[Floats]]:
    """The place with those small backlashes at 0 that the courses do not need."""
    every = np.arange(len(problem.courses))
    for p in np.flatnonzero(problem.plays & (x > 0.0) & (x < _SMALL_PLAY * problem.nudge)):
        none = np.where(np.arange(len(x)) == p, 0.0, x)
        new = problem.predictions([(none, every)])[0]
        if problem.cost(none, new) < problem.cost(x, predicted):
            x, predicted = none, new
    return x, predicted


def _normal(
    problem: Problem, x: Floats, residuals: list[Floats], slopes: list[Floats]
) -> tuple[Floats, Floats]:
    """Curvature (P, P) and slope (P,) of the robust cost after Gauss and Newton, the prior too."""
    bend, pull = np.diag(problem.spread**-2.0), problem.prior(x) / problem.spread
    for residual, slope in zip(residuals, slopes, strict=True):
        weight = _weight(residual).ravel()
        rows = slope.reshape(len(weight), -1)
        bend = bend + (rows * weight[:, None]).T @ rows
        pull = pull + rows.T @ (weight * residual.ravel())
    return bend, pull


def _weight(residual: Floats) -> Floats:
    """What residuals count, less for outliers: soft L1."""
    return 1.0 / np.sqrt(1.0 + (residual / ROBUST) ** 2)


def _bounded(bend: Floats, pull: Floats, damping: float, low: Floats, high: Floats) -> Floats:
    """The damped step of least cost between two ends."""
    damped = bend + damping * np.diag(np.diag(bend))
    root = np.linalg.cholesky(damped).T
    ends = (np.minimum(low, -1e-12), np.maximum(high, 1e-12))
    return np.asarray(lsq_linear(root, -np.linalg.solve(root.T, pull), ends, method="bvls").x)


def noises(problem: Problem, predicted: Sequence[Floats], by_piece: bool = False) -> list[Floats]:
    """Noise of each channel, at least the least one, from the residuals of predictions.

    Args:
        problem: What was measured.
        predicted: What was simulated.
        by_piece: Whether each piece of a course has its own; else a course has one.

    Returns:
        For each course, shape (1, C), or (n, C).
    """
    found = []
    for course, least, made, measured in zip(
        problem.courses, problem.least, predicted, problem.measured, strict=True
    ):
        square = (made - measured) ** 2
        number = pieces(course) if by_piece else np.zeros(len(square), np.int64)
        means = [square[number == k].mean(axis=0) for k in range(number[-1] + 1)]
        rows = np.maximum(least, np.sqrt(means))
        found.append(rows[number] if by_piece else rows)
    return found


def covariances(
    problem: Problem, solution: Solution, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Covariance of the parameters by the local Hessian, and changes in a bootstrap over pieces.

    The bootstrap draws pieces of the courses, each course's own, and goes one Gauss-Newton step
    from the solution.

    Returns:
        Covariance, shape (P, P), and changes, shape (DRAWS, P).
    """
    size = len(problem.chosen)
    bends, pulls = [], []
    prior = np.diag(problem.spread**-2.0)
    for course, residual, slope in zip(
        problem.courses, solution.residuals, solution.slopes, strict=True
    ):
        weight = _weight(residual)
        number = pieces(course)
        for k in range(number[-1] + 1):
            rows = slope[number == k].reshape(-1, size)
            w, r = weight[number == k].ravel(), residual[number == k].ravel()
            bends.append((rows * w[:, None]).T @ rows)
            pulls.append(rows.T @ (w * r))
    counts = [pieces(course)[-1] + 1 for course in problem.courses]
    bend, pull = np.array(bends), np.array(pulls)
    pinned = _pinned(problem, solution.x)
    draws = []
    for _ in range(DRAWS):
        times = np.concatenate([rng.multinomial(n, np.full(n, 1.0 / n)) for n in counts])
        curvature = np.tensordot(times, bend, 1) + prior
        slope = (times[:, None] * pull).sum(axis=0) + problem.prior(solution.x) / problem.spread
        draws.append(-np.linalg.solve(curvature, slope * ~pinned))
    whole = np.linalg.inv(bend.sum(axis=0) + prior)
    return whole, np.array(draws)


def _pinned(problem: Problem, x: Floats) -> Bools:
    """Parameters at an end of the search: what pulls them outwards says nothing."""
    low, high = bounds(problem.chosen)
    near = 1e-3 * (high - low)
    return (x < low + near) | (x > high - near)
