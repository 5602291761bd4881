"""What is measured on a walk over a flat floor: speed, yaw and the work it costs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

_STANDSTILL = 0.01
"""Robot lengths a cycle under which a cost of transport means nothing."""
_TINY = 1e-6
"""Rounding of tick times [s]."""


@dataclass(frozen=True, slots=True)
class Walk:
    """One walk on the flat floor, settling included.

    Attributes:
        name: A maneuver in small letters, `wave_off`, or `sweep` and its number.
        t: Times of the ticks [s], shape (n,).
        head: Plan positions of the head [m], shape (n, 2).
        centre: Mean of the links [m], shape (n, 2).
        heading: Direction from the rear three links to the front three [rad], shape (n,).
        work: Positive mechanical work of all servos since the start [J], shape (n,).
        weight: Weight of the robot [N].
        length: Robot length [m].
    """

    name: str
    gait: GaitParams
    t: Floats
    head: Floats
    centre: Floats
    heading: Floats
    work: Floats
    weight: float
    length: float


@dataclass(frozen=True, slots=True)
class Pace:
    """What a walk comes to over whole cycles.

    Attributes:
        speed: Mean speed of the centre along the body's mean axis [m/s]; negative is backwards.
        body_lengths: The same in body lengths per cycle.
        yaw: Turn of the body per cycle [rad]; positive is to the left.
        cost_of_transport: Positive mechanical work over weight times distance, or None if it
            hardly moves.
    """

    speed: float
    body_lengths: float
    yaw: float
    cost_of_transport: float | None


def measure(walk: Walk, settling_cycles: int, cycles: int) -> Pace:
    """The pace of a walk after settling.

    Every tick starts one cycle, so that the phase at which a cycle is cut does not count.
    """
    period = 1.0 / walk.gait.frequency
    first, last = settling_cycles * period, (settling_cycles + cycles) * period
    start = walk.t[(walk.t > first - _TINY) & (walk.t < last - period - _TINY)]
    axis = _gain(walk.t, _integral(walk.t, walk.heading), start, period) / period
    moved = [_gain(walk.t, walk.centre[:, k], start, period) for k in range(2)]
    step = float((moved[0] * np.cos(axis) + moved[1] * np.sin(axis)).mean())
    yaw = float(_gain(walk.t, walk.heading, start, period).mean())
    work = np.interp([first, last], walk.t, walk.work)
    drag = float(work[1] - work[0]) / cycles / walk.weight
    moves = abs(step) > _STANDSTILL * walk.length
    return Pace(
        speed=step / period,
        body_lengths=step / walk.length,
        yaw=yaw,
        cost_of_transport=drag / abs(step) if moves else None,
    )


def _integral(t: Floats, value: Floats) -> Floats:
    """Trapezoidal integral of `value` over t from its start, shape (n,)."""
    return np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(t))])


def _gain(t: Floats, value: Floats, start: Floats, period: float) -> Floats:
    """Change of `value` over one period from each start."""
    return np.interp(start + period, t, value) - np.interp(start, t, value)


def rolling_speed(gait: GaitParams, robot: RobotSpec) -> float:
    """Speed of legs that roll on their longest radius, 2 pi f (R + e) [m/s]."""
    return 2.0 * math.pi * gait.frequency * (robot.leg_radius + robot.leg_eccentricity)
