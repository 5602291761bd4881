"""What is known of each parameter in the end: value, interval, and whether the logs tell it.

An interval in the air holds the noise of the log, and what no log shows because the model and its
numerics leave it out (`floors`). The two are independent, so their variances add.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate.types import Floats
from antennate_lab.fit.least_squares import Problem, Solution
from antennate_lab.fit.parameters import BACKLASH, SHORTEST, Parameter, bounds, parameters
from antennate_lab.fit.regression import Known, Told
from antennate_lab.fit.result import Correlation, ParameterRow
from dynamixel_bus.model import POSITION_UNIT

LEVEL = 1.645
"""Half the width of a 90 % interval of a normal distribution [standard deviations]."""
TOLD = 0.5
"""A parameter is told if its interval is narrower than this share of what was known before."""
SHARE = 0.005
"""Share of its value by which a gain, an inertia, a spring or a factor may be off because the model
and its numerics leave something out: what fits missed of two simulated robots (docs/fit.md)."""
ROUNDING = POSITION_UNIT / 2.0
"""What the rounding of an angle hides [rad]."""
_DRAWS = 4000
_MOST = 8
_LEAST = 0.5
"""Correlations that are listed: so many, of this size at least."""
_RECORD = {
    "servos": "sweep a joint with this servo in the air (place hanging)",
    "yaw": "sweep this yaw joint in the air (place hanging), with an inertial sensor",
    "legs.gain_factor": "sweep legs and yaw joints in the air (place hanging)",
    "legs": "walk on the floor: forward, turns and reverse at several frequencies",
    "leg_friction": "walk on the floor: forward, turns and reverse at several frequencies",
    "antenna": "sweep antenna bases and yaw joints in the air (place hanging)",
    "antennae": "sweep antenna bases and yaw joints in the air (place hanging)",
}


@dataclass(frozen=True)
class Estimate:
    """One parameter.

    Attributes:
        parameter: Which one.
        value: Its value; as before where it is not told.
        interval: Ends of the 90 % interval.
        told: Whether the logs tell it.
        by: What tells it, `air` or `floor`.
        errors: Draws of its error on the scale of the search, shape (draws,).
    """

    parameter: Parameter
    value: float
    interval: tuple[float, float]
    told: bool
    by: str
    errors: Floats

    def row(self) -> ParameterRow:
        """The row of trials.csv."""
        path = self.parameter.path
        record = _RECORD.get(path) or _RECORD[path.partition(".")[0]]
        return ParameterRow(
            name=self.parameter.name,
            unit=self.parameter.scale.unit,
            before=self.parameter.start,
            value=self.value,
            low=self.interval[0],
            high=self.interval[1],
            told=self.told,
            by=self.by if self.told else "",
            record="" if self.told else record,
        )


def of_air(
    problem: Problem, solution: Solution, covariance: Floats, draws: Floats
) -> list[Estimate]:
    """Estimates by least squares; the wider one of Hessian and bootstrap, and the floor."""
    noise = np.maximum(np.sqrt(np.diag(covariance)), draws.std(axis=0))
    sd = np.hypot(noise, floors(problem, solution.x))
    low, high = bounds(problem.chosen)
    found, swept = [], problem.swept()
    for p, each in enumerate(problem.chosen):
        told = bool(swept[p] and sd[p] < TOLD * each.scale.spread)
        middle = solution.x[p] if told else problem.start[p]
        ends = np.clip(middle + LEVEL * np.array([-1.0, 1.0]) * sd[p], low[p], high[p])
        below, above = (np.exp(ends) if each.scale.log else ends).tolist()
        interval = (below, above)
        if each.path.endswith("delay") and interval[0] <= SHORTEST:
            interval = (0.0, max(interval[1], SHORTEST))
        value = each.value(solution.x[p]) if told else each.start
        interval = (min(interval[0], value), interval[1])  # a value that is nearly 0 is 0
        errors = draws[:, p] * sd[p] / max(draws[:, p].std(), 1e-12)
        found.append(Estimate(each, value, interval, told, "air", errors))
    return found


def floors(problem: Problem, x: Floats) -> Floats:
    """Standard deviations of what noise does not show, on the scale of the search, shape (P,).

    Each has a limit within which all values are alike: of a delay the timestep, of a backlash
    `ROUNDING`, of a friction the torque by which the servo answers to that. All others have a share
    of the value (load friction: of the load), `SHARE` and `ROUNDING` over the largest swing of the
    steps that tell it. A limit is that of a rectangular distribution, sd = limit / √3 (JCGM
    100:2008, 4.3.7).
    """
    robot = problem.made(x)
    swings = np.array([np.ptp(course.commands, axis=0).max() / 2.0 for course in problem.courses])
    limits = []
    for each, told in zip(problem.chosen, problem.told.T, strict=True):
        *_, group, name = each.path.split(".")
        if name == "delay":
            limits.append(SHORTEST)
        elif each.path == BACKLASH:
            limits.append(ROUNDING)
        elif name == "friction":
            limits.append(ROUNDING * getattr(robot.servos, group).stiffness)
        else:
            swing = float(swings[told].max(initial=1e-9))
            limits.append(float(np.hypot(SHARE, ROUNDING / swing)))
    return np.array(limits) / 3.0**0.5


def of_legs(robot: RobotSpec, legs: Told, prior: Known, rng: np.random.Generator) -> list[Estimate]:
    """Estimates of the common friction of the legs, their median, and of each over it."""
    count = robot.leg_count
    names = [("leg_friction", None), *(("legs.friction_factors", i) for i in range(count))]
    chosen = parameters(robot, names)
    covariance = legs.correlation * np.outer(legs.sd, legs.sd)
    drawn = rng.multivariate_normal(legs.mean, covariance, _DRAWS, method="eigh")
    before = _common(prior.draw(_DRAWS, rng))
    after = _common(drawn)
    found = []
    for p, each in enumerate(chosen):
        ends = np.quantile(after[:, p], [0.05, 0.95])
        middle = float(np.median(after[:, p]))
        sound = each.scale.low < np.exp(middle) < each.scale.high  # else no such robot can be
        narrow = np.ptp(ends) < TOLD * np.ptp(np.quantile(before[:, p], [0.05, 0.95]))
        told = bool(sound and narrow)
        value = each.value(middle) if told else each.start
        interval = (each.value(float(ends[0])), each.value(float(ends[1])))
        errors = after[:_DRAWS, p] - np.median(after[:, p])
        found.append(Estimate(each, value, interval, told, "floor", errors))
    return found


def _common(logs: Floats) -> Floats:
    """Median and what each is over it, of logarithms (n, legs), shape (n, 1 + legs)."""
    middle = np.median(logs, axis=1, keepdims=True)
    return np.concatenate([middle, logs - middle], axis=1)


def correlations(found: Sequence[Estimate]) -> list[Correlation]:
    """Pairs of told parameters whose errors go together most."""
    pairs = []
    told = [each for each in found if each.told and each.errors.std() > 0.0]
    for one, other in itertools.combinations(told, 2):
        if one.by == other.by:
            names = {"one": one.parameter.name, "other": other.parameter.name}
            r = float(np.corrcoef(one.errors, other.errors)[0, 1])
            pairs.append(Correlation(**names, correlation=r))
    large = [pair for pair in pairs if abs(pair.correlation) >= _LEAST]
    return sorted(large, key=lambda pair: -abs(pair.correlation))[:_MOST]
