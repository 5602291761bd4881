"""Active touch: how a base sweeps, and which shapes of the antenna are told apart."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from antennate.params.base import Params, number

_Place = Annotated[float, Field(gt=0, le=1)]


class SweepParams(Params):
    """The sweep of an antenna's base, theta0 + A sin(2 pi f t)."""

    centre: float = number(math.radians(47.0), "rad", "assumed: the mounting angle", ge=0, le=2.0)
    """Centre theta0 of the sweep from the heading, outwards."""
    amplitude: float = number(math.radians(30.0), "rad", "assumed: ahead to sideways", gt=0, le=1.5)
    """Amplitude A of the sweep."""
    frequency: float = number(
        0.5,
        "Hz",
        "assumed: that of the gait; inertia bends the antenna by 2.3 deg, at 1 Hz by 7",
        gt=0,
        le=3,
    )
    """Sweeps a second, f."""


class ShapeParams(Params):
    """What tells the shapes of a touching antenna apart."""

    flex: float = number(
        math.radians(5.0),
        "rad",
        "assumed: twice the 2.3 deg that inertia bends it in free air",
        gt=0,
        le=1,
    )
    """Summed hinge angles under the flex sensor below which the antenna is straight."""
    offset: float = number(
        math.radians(2.5),
        "rad",
        "assumed: half of that flex, as at the tip of an evenly bent chain",
        gt=0,
        le=1,
    )
    """Angle of the tip off the base's direction below which the antenna is straight."""
    gap: float = number(5e-4, "m", "assumed: depth over which contacts stiffen", gt=0, le=0.01)
    """Distance to a wall that counts as touching."""


class EstimateParams(Params):
    """Trials of the estimates, and what differs between them."""

    trials: int = number(60, "1", "assumed: three times the paper's 20", ge=6, le=100000)
    """Trials to calibrate, and as many to test, in every condition."""
    distance: tuple[_Place, _Place] = number(
        (0.4, 0.9), "1", "assumed: within reach of the default sweep"
    )
    """Range of wall distances, over the length of the antenna."""
    centre_range: float = number(
        math.radians(10.0), "rad", "assumed: the body yaws by so much while it walks", ge=0, le=1
    )
    """Half range of the centre where the sweep is varied."""
    amplitude_range: float = number(
        math.radians(10.0), "rad", "assumed: a third of the default amplitude", ge=0, le=1
    )
    """Half range of the amplitude where the sweep is varied."""
    tilt_range: float = number(0.15, "rad", "assumed: placed by hand, as in the tunnel", ge=0, le=1)
    """Half range of the walls' angle where they are tilted."""
    base_zero: float = number(
        0.02, "rad", "assumed: a horn mounted by hand, about 1 deg", ge=0, le=0.3
    )
    """Standard deviation of the base's zero."""
    gain: float = number(0.05, "1", "assumed: strips repeat within 10 % (2 sigma)", ge=0, le=1)
    """Standard deviation of the sensor's gain from trial to trial, where there is sensor noise."""
    friction: float = number(1.0 / 3.0, "1", "assumed: walls differ", ge=0, le=1)
    """Half range of the friction, over the antenna's."""
