"""Active touch: how a base sweeps, and which shapes of the antenna are told apart."""

from __future__ import annotations

import math

from antennate.params.base import Params, number


class SweepParams(Params):
    """The sweep of an antenna's base, theta0 + A sin(2 pi f t)."""

    centre: float = number(
        math.radians(47.0),
        "rad",
        "assumed: unpublished; the mounting angle of the antenna",
        "theta0, centre of the sweep from the heading, outwards",
        ge=0,
        le=2.0,
    )
    amplitude: float = number(
        math.radians(30.0),
        "rad",
        "assumed: unpublished; from nearly ahead to nearly sideways",
        "A, amplitude of the sweep",
        gt=0,
        le=1.5,
    )
    frequency: float = number(
        0.5,
        "Hz",
        "assumed: unpublished; one sweep a gait cycle, and slow: inertia then bends the antenna by "
        "2.3 deg in free air, at 1 Hz by 7",
        "f, sweeps a second",
        gt=0,
        le=3,
    )


class ShapeParams(Params):
    """What tells the shapes of a touching antenna apart."""

    flex: float = number(
        math.radians(5.0),
        "rad",
        "assumed: twice the 2.3 deg of inertia in free air, and far above the noise of a reading",
        "summed hinge angles under the film below which the antenna is straight",
        gt=0,
        le=1,
    )
    offset: float = number(
        math.radians(2.5),
        "rad",
        "assumed: half of that flex; the tip of an evenly bent chain is off by half its flex",
        "angle of the tip off the base's direction below which the antenna is straight",
        gt=0,
        le=1,
    )
    gap: float = number(
        5e-4,
        "m",
        "assumed: the depth over which a contact stiffens; light links chatter within it",
        "distance to a wall that counts as touching",
        gt=0,
        le=0.01,
    )
