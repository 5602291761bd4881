"""One antenna dragged sideways past a post: force of the contact against flex, until it slips off.

The antenna points along x; its base moves towards -y, so that the post bends it one way only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.errors import SimulationError
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Ball, Bench, Watch, compile_bench
from antennate.types import Floats

_CLEARANCE = 0.03
"""Way of the base before it meets the post [m]; it has come up to speed by then."""
_RISE = 0.2
"""Time over which the base comes up to speed [s]."""
_LOST = 0.1
"""Contact lost for so long has ended [s]."""


@dataclass(frozen=True, slots=True)
class Traverse:
    """What was recorded of one traverse while the post pressed.

    Attributes:
        flex: Flex under the flex sensor [rad], shape (n,).
        force: Size of the contact force, averaged over the time of a sample [N], shape (n,).
        place: Where the post touches, along the antenna over its length, shape (n,).
        age: Time since the post first touched [s], shape (n,).
        reason: Why the trial is invalid, or empty.
    """

    flex: Floats
    force: Floats
    place: Floats
    age: Floats
    reason: str = ""


def drag(
    physics: BenchPhysicsParams,
    antenna: AntennaSpec,
    overlap: float,
    speed: float,
    post_radius: float,
    limit: float,
    rate: float,
    watch: Watch | None = None,
) -> Traverse:
    """Drag the antenna past a post until it slips off or a hinge exceeds its limit.

    Args:
        physics: Numerics.
        antenna: The antenna.
        overlap: Place of the first contact, over the length of the antenna.
        speed: Speed of the base [m/s].
        post_radius: Radius of the post [m].
        limit: Largest hinge angle that still counts [rad].
        rate: Samples a second [Hz].
        watch: Looks at the bench after each physics step.
    """
    post = Ball(overlap * antenna.length, -(post_radius + antenna.radius + _CLEARANCE), post_radius)
    bench = Bench(compile_bench(physics, antenna, [post]), antenna)
    bench.place(0.0, 0.0, 0.0)
    steps = round(1.0 / (rate * physics.timestep))
    end = (_CLEARANCE + 2.0 * antenna.length) / speed + _RISE
    rows: list[tuple[float, float, float, float]] = []
    last = math.inf
    try:
        while bench.t < end and bench.t - last < _LOST:
            bench.command(0.0, -way(bench.t, speed), 0.0, -speed_at(bench.t, speed), 0.0)
            force = float(np.linalg.norm(bench.press(steps, watch)))
            if abs(bench.hinges()).max() > limit:
                break
            if force > 0.0:
                last = bench.t
                rows.append((bench.flex(), force, _place(bench.joints(), post), last))
    except SimulationError as error:
        none = np.zeros(0)
        return Traverse(none, none, none, none, str(error))
    flex, pressed, place, t = np.array(rows).reshape(-1, 4).T
    return Traverse(flex, pressed, place, t - t[:1])


def speed_at(t: float, speed: float) -> float:
    """Speed of a base that comes up to `speed` without a jerk [m/s]."""
    return speed * min(t / _RISE, 1.0)


def way(t: float, speed: float) -> float:
    """Way of such a base [m]: the integral of its speed."""
    return speed * (t * t / (2 * _RISE) if t < _RISE else t - _RISE / 2)


def _place(joints: Floats, post: Ball) -> float:
    """Where along the antenna lies the point nearest to the post, over its length."""
    starts, sides = joints[:-1], np.diff(joints, axis=0)
    square = (sides**2).sum(axis=1)
    to_post = np.array([post.x, post.y]) - starts
    share = np.clip((to_post * sides).sum(axis=1) / square, 0.0, 1.0)
    gap = np.linalg.norm(to_post - share[:, None] * sides, axis=1)
    nearest = int(gap.argmin())
    return float((nearest + share[nearest]) / len(sides))
