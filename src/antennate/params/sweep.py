"""Active touch: how a base sweeps, and which shapes of the antenna are told apart."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from antennate.params.base import Params, number

_Place = Annotated[float, Field(gt=0, le=1)]


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
        "summed hinge angles under the flex sensor below which the antenna is straight",
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


class EstimateParams(Params):
    """Trials of the estimates, and what differs between them."""

    trials: int = number(
        60,
        "1",
        "assumed: three times the paper's 20",
        "trials to calibrate, and as many to judge, in every condition",
        ge=6,
        le=100000,
    )
    distance: tuple[_Place, _Place] = number(
        (0.4, 0.9),
        "1",
        "assumed: within reach of the default sweep",
        "range of wall distances, over the length of the antenna",
    )
    centre_range: float = number(
        math.radians(10.0),
        "rad",
        "assumed: the body yaws by so much while it walks",
        "half range of the centre where the sweep is varied",
        ge=0,
        le=1,
    )
    amplitude_range: float = number(
        math.radians(10.0),
        "rad",
        "assumed: a third of the default",
        "half range of the amplitude where the sweep is varied",
        ge=0,
        le=1,
    )
    tilt_range: float = number(
        0.15,
        "rad",
        "assumed: as the start's heading in the tunnel, placed by hand",
        "half range of the walls' angle where they are tilted",
        ge=0,
        le=1,
    )
    base_zero: float = number(
        0.02,
        "rad",
        "assumed: a horn mounted by hand, about 1 deg",
        "standard deviation of the base's zero",
        ge=0,
        le=0.3,
    )
    gain: float = number(
        0.05,
        "1",
        "assumed: flex sensor strips repeat within 10 %, taken as two standard deviations",
        "standard deviation of the sensor's gain from trial to trial, where there is sensor noise",
        ge=0,
        le=1,
    )
    friction: float = number(
        1.0 / 3.0,
        "1",
        "assumed: walls differ",
        "half range of the friction, over the antenna's",
        ge=0,
        le=1,
    )
