"""Steps on the floor: parameters by regression on what simulated robots feel there.

Feet stick and slip, so that two walks of one robot part, and a slope by one small change is noise.
Instead robots are drawn, each walks all steps once, and each parameter is regressed on what was
felt, linearly with a ridge (approximate Bayesian computation with regression adjustment: Beaumont,
Zhang and Balding, Genetics 162, 2002). What the regression misses of robots that it did not see is
the standard deviation, so that a parameter that the steps do not tell keeps what was known before.
A second round draws about what the first has found.

Each walk tells the parameters, too. Where walks contradict one another more than those of nearly
all simulated robots (by the jackknife), the friction of the legs is taken to change on the way, as
on a dusty floor: the robots of the second round have legs whose friction wanders.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from antennate.errors import SimulationError
from antennate.robots.spec import RobotSpec
from antennate.studies.pool import Workers, gather
from antennate.studies.trials import OnStep
from antennate.types import Floats
from antennate_lab.fit import measures
from antennate_lab.fit.parameters import Parameter, bounds
from antennate_lab.fit.residuals import NOISE, moving
from antennate_lab.fit.simulated import Course, simulated
from dynamixel_bus.model import POSITION_UNIT

BINS = 10
"""Parts of a cycle over which what is felt is a mean."""
WIDER = 2.0
"""A second round draws from a distribution so many times as wide as what the first has found."""
POSTURE = POSITION_UNIT
"""Standard deviation of what the posture at the beginning of a walk is off [rad] (assumed: a
position unit of the servos)."""
LEAST = np.array([0.004, 0.05])
"""Speed [m/cycle] and turn [rad/cycle] of cycles that differ by less are alike (assumed)."""
ARM = 0.01
"""Standard deviation of what the middle of the markers is off that of the head [m] (assumed)."""
SHARE = 0.1
"""What speed and turn by motion capture count, over all else that is felt in a walk."""
CONTRARY = 0.95
"""Share of the simulated robots whose walks contradict one another less, beyond which friction is
taken to wander."""
WANDER = 0.6
"""Largest standard deviation of the logarithm of a friction that wanders (assumed: twice that of
`variation.slip_log_sd`, whose `slip_time` it has)."""
_FARTHEST = 3.5
"""A parameter is not told if the regression goes farther from what was known before [standard
deviations]: no robot that was drawn felt the like."""
_RIDGES = 10.0 ** np.arange(-3.0, 3.0, 0.25)


@dataclass(frozen=True)
class Known:
    """Normal distributions of parameters on the scale of the search.

    Attributes:
        mean: Of each, shape (P,).
        own: Standard deviation of what each has of its own, shape (P,).
        shared: Standard deviation of what all have in common.
    """

    mean: Floats
    own: Floats
    shared: float = 0.0

    @property
    def sd(self) -> Floats:
        """Standard deviation of each, shape (P,)."""
        return np.hypot(self.own, self.shared)

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Places of the search, shape (count, P)."""
        own = self.own * rng.standard_normal((count, len(self.mean)))
        return self.mean + own + self.shared * rng.standard_normal((count, 1))


def scatter(courses: Sequence[Course]) -> Floats:
    """Standard deviation of speed [m/cycle] and turn [rad/cycle] between cycles, shape (2,).

    The first cycle of a walk differs, as it begins with a robot that stands.
    """
    later = [measures.strides(course)[1:] for course in courses]
    known = [rows[np.isfinite(rows[:, 0])] for rows in later]
    spread = [rows.var(axis=0, ddof=1) for rows in known if len(rows) > 1]
    return np.maximum(np.sqrt(np.mean(spread, axis=0)), LEAST) if spread else LEAST


def felt(course: Course, unit: Floats = LEAST) -> Floats:
    """Means over parts of a cycle of how far joints lag and of the head's turning, shape (F,).

    The first half of a cycle is left out: how the robot came to stand is not known. Speed and turn
    of each cycle that motion capture has seen stand beside them, so often that they count `SHARE`.

    Args:
        course: A walk.
        unit: Scatter of speed and turn between cycles, shape (2,).
    """
    lag = (course.positions - course.commands)[:, moving(course)]
    values = np.concatenate([lag / NOISE["position"], course.gyro / NOISE["gyro"]], axis=1)
    width = max(1, round(course.cycle / course.period / BINS))
    values = values[BINS // 2 * width :]
    count = len(values) // width
    own = np.nan_to_num(values[: count * width].reshape(count, width, -1).mean(axis=1).ravel())
    seen = measures.strides(course) / unit
    seen = seen[np.isfinite(seen)]
    return np.concatenate([own, *[seen] * max(1, round(SHARE * len(own) / max(len(seen), 1)))])


def _felt_of(
    robot: RobotSpec, courses: Sequence[Course], unit: Floats, seed: int, wander: float
) -> list[Floats]:
    """What a simulated robot feels in each course; NaN where the simulation fails.

    Each walk begins a little off the posture that was measured, and the markers sit a little off
    the middle of the head, so that chance counts as noise. The friction of its legs wanders with
    a standard deviation of `wander` in its logarithm.
    """
    rng, parts = np.random.default_rng(seed), []
    arm = ARM * np.random.default_rng([seed, 1]).standard_normal(2)
    for number, course in enumerate(courses):
        off = POSTURE * rng.standard_normal(course.positions.shape[1])
        begin = replace(course, positions=course.positions + off)
        try:
            made = simulated(robot, begin, wander=wander, seed=(seed, 2, number))
            parts.append(felt(_marked(made, arm), unit))
        except SimulationError:
            parts.append(np.full_like(felt(course, unit), np.nan))
    return parts


def _marked(course: Course, arm: Floats) -> Course:
    """A simulated course with markers ahead of the head's middle and left of it by so much [m]."""
    if course.poses is None:
        return course
    x, y, heading = course.poses.T
    c, s = np.cos(heading), np.sin(heading)
    places = [x + arm[0] * c - arm[1] * s, y + arm[0] * s + arm[1] * c, heading]
    return replace(course, poses=np.stack(places, axis=1))


@dataclass(frozen=True)
class Told:
    """What steps tell of the parameters, on the scale of the search.

    Attributes:
        mean, sd: Of each, shape (P,).
        correlation: Of what the regression misses, shape (P, P).
        wanders: Whether friction is taken to change on the way.
    """

    mean: Floats
    sd: Floats
    correlation: Floats
    wanders: bool = False


def regressed(
    places: Floats, features: Floats, measured: Floats, proposal: Known, prior: Known
) -> Told:
    """Parameters of a robot from what it felt.

    Args:
        places: Parameters of the robots that were drawn, shape (N, P).
        features: What they felt, shape (N, F).
        measured: What the robot felt, shape (F,).
        proposal: Distribution that they were drawn from.
        prior: What was known before.
    """
    found, missed = _fitted(places, features, measured)
    told = Told(found, missed.std(axis=0), np.atleast_2d(np.corrcoef(missed.T)))
    return _corrected(told, proposal, prior)


def _fitted(places: Floats, features: Floats, measured: Floats) -> tuple[Floats, Floats]:
    """What a regression finds, shape (P,), and what it misses of each robot, shape (N, P)."""
    scale = np.hypot(features.std(axis=0), 1.0)
    centre = features.mean(axis=0)
    rows, new = (features - centre) / scale, (measured - centre) / scale
    middle = places.mean(axis=0)
    left, size, _ = np.linalg.svd(rows @ rows.T / rows.shape[1])
    aim = left.T @ (places - middle)
    own = left.T @ (rows @ new / rows.shape[1])
    found, missed = np.empty(places.shape[1]), np.empty_like(places)
    for p in range(places.shape[1]):
        fits = []
        for ridge in _RIDGES:
            shrink = size / (size + ridge)
            hat = np.einsum("ij,j,ij->i", left, shrink, left) + 1.0 / len(places)
            away = places[:, p] - middle[p] - left @ (shrink * aim[:, p])
            away = away / np.maximum(1.0 - hat, 1e-9)
            fits.append((float((away**2).mean()), ridge, away))
        _, ridge, missed[:, p] = min(fits, key=lambda fit: fit[0])
        found[p] = middle[p] + own @ (aim[:, p] / (size + ridge))
    return found, missed


def contrary(places: Floats, walks: Sequence[Floats], measured: Sequence[Floats]) -> float:
    """Share of the robots whose walks contradict one another less than those that were measured.

    Each walk in turn is left out. How much the others then say otherwise, by the jackknife's
    variance, is a mean over the parameters.

    Args:
        places: Parameters of the robots that were drawn, shape (N, P).
        walks: What they felt in each walk, shape (N, F) each.
        measured: What the robot felt in each, shape (F,) each.
    """
    if len(walks) < 3:  # two that differ do not say which is wrong, nor by how much
        return 0.0
    found, missed = [], []
    for out in range(len(walks)):
        rest = [k for k in range(len(walks)) if k != out]
        features = np.concatenate([walks[k] for k in rest], axis=1)
        one = _fitted(places, features, np.concatenate([measured[k] for k in rest]))
        found.append(one[0])
        missed.append(one[1])
    own = np.var(found, axis=0).mean()
    return float((np.var(missed, axis=0).mean(axis=1) < own).mean())


def _corrected(told: Told, proposal: Known, prior: Known) -> Told:
    """What is known with the prior in place of the distribution that robots were drawn from."""
    sds = (np.maximum(told.sd, 1e-6), proposal.sd, prior.sd)
    own, drawn_from, before = (sd**-2.0 for sd in sds)
    precision = np.maximum(own - drawn_from, 0.0) + before
    pull = np.maximum(own - drawn_from, 0.0)
    # what the data alone say: the regression without the distribution that it was drawn from
    alone = np.where(
        pull > 0.0,
        (own * told.mean - drawn_from * proposal.mean) / np.where(pull > 0.0, pull, 1.0),
        prior.mean,
    )
    mean, sd = (pull * alone + before * prior.mean) / precision, precision**-0.5
    far = ~(abs(mean - prior.mean) < _FARTHEST * prior.sd)
    correlation = np.where(far | far[:, None], np.eye(len(far)), told.correlation)
    return Told(np.where(far, prior.mean, mean), np.where(far, prior.sd, sd), correlation)


def search(
    made: Callable[[Floats], RobotSpec],
    chosen: Sequence[Parameter],
    courses: Sequence[Course],
    prior: Known,
    count: int,
    workers: Workers,
    rng: np.random.Generator,
    on_step: OnStep,
) -> Told:
    """What courses on the floor tell, in two rounds of `count` robots each.

    Args:
        made: Robot of a place of the search.
        chosen: The parameters.
        courses: What was measured.
        prior: What was known before.
        count: Robots of a round.
        workers: Where they walk.
        rng: What they are drawn with.
        on_step: Told of each robot, of both rounds.
    """
    unit = scatter(courses)
    measured = [felt(course, unit) for course in courses]
    proposal, told = prior, Told(prior.mean, prior.sd, np.eye(len(prior.mean)))
    wanders = False
    for number in range(2):
        places = np.clip(proposal.draw(count, rng), *bounds(chosen))
        slips = rng.uniform(0.0, WANDER, count) if wanders else np.zeros(count)
        pairs = zip(places, slips.tolist(), strict=True)
        tasks = [(made(x), courses, unit, seed, slip) for seed, (x, slip) in enumerate(pairs)]
        features = gather(
            _felt_of,
            tasks,
            workers,
            lambda done, _, number=number: on_step(number * count + done, 2 * count),
        )
        walks = [np.array(walk) for walk in zip(*features, strict=True)]
        sound = np.isfinite(np.concatenate(walks, axis=1)).all(axis=1)
        places, walks = places[sound], [walk[sound] for walk in walks]
        whole = np.concatenate(walks, axis=1)
        told = regressed(places, whole, np.concatenate(measured), proposal, prior)
        if number == 0:
            wanders = contrary(places, walks, measured) >= CONTRARY
        proposal = Known(told.mean, np.minimum(WIDER * told.sd, prior.sd))
    return replace(told, wanders=wanders)


def is_walk(course: Course) -> bool:
    """Whether a course is a walk on the floor."""
    return not course.hanging and course.cycle > 0.0
