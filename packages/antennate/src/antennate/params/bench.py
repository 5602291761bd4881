"""The bench: what the antenna meets there, how it is moved, and how it is recorded."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from antennate.params.base import Params, number


class WallParams(Params):
    """A vertical line of touching spheres, passed from below by an antenna at a fixed angle."""

    sphere_diameter: float = number(0.00635, "m", "paper: spheres of 6.35 mm", gt=1e-4, le=0.1)
    """Diameter and pitch."""
    speed: float = number(0.008, "m/s", "paper: 8 mm/s", gt=1e-5, le=0.5)
    """Speed of the base."""
    travel: float = number(
        0.16, "m", "assumed: unpublished; four times what `start` leaves out", gt=0.02, le=2
    )
    """Travel of the base along the wall."""
    base_angle: float = number(
        math.radians(53.0),
        "rad",
        "fitted: where the profiles differ most (docs/science/wall_study.py window)",
        gt=0.17,
        lt=2.9,
    )
    """Angle of the antenna from the direction of travel; a right angle faces the wall."""
    overlap: float = number(0.008, "m", "assumed: a few spheres' radii", gt=0, le=0.1)
    """How far the straight antenna would reach behind the crests."""
    gravity: Literal["down", "up", "off"] = number(
        "down", "1", "assumed: the wall is vertical, the base moves up, weight acts along it"
    )
    """Gravity against the travel, along it, or out of the plane."""
    jam_advance: float = number(0.001, "m", "assumed: a sixth of a sphere", gt=0)
    """A jammed tip advances less."""
    jam_travel: float = number(0.019, "m", "assumed: three spheres", gt=0)
    """Over this travel of the base."""
    slip_time: float = number(0.8, "s", "assumed: one sphere at the paper's speed", gt=0)
    """Contact lost for longer."""
    start: float = number(0.040, "m", "assumed: the antenna bows from its approach", ge=0)
    """Travel that the second count leaves out."""


class BenchVariationParams(Params):
    """What differs from trial to trial on the bench."""

    stiffness: float = number(
        0.05, "1", "assumed: makers quote 10 % of the rate, taken as two sigma", ge=0, le=0.3
    )
    """Standard deviation of a spring's stiffness."""
    friction: float = number(0.02, "1", "assumed: clean and dusty places", ge=0)
    """Standard deviation of the friction."""
    base_angle: float = number(math.radians(1.0), "rad", "assumed: clamped by hand", ge=0)
    """Half range of the base angle."""
    overlap: float = number(0.0005, "m", "assumed: set by hand", ge=0, le=0.01)
    """Half range of the overlap."""


_BLUNT = "assumed: a blunt end, which the antenna meets from the side"
_GRAZED = "assumed: the tip comes to the wall at a shallow angle, as beside a robot that drifts"


class FlatWallParams(Params):
    """A straight wall, parallel to the traverse."""

    entry_deg: float = number(15.0, "deg", _GRAZED, ge=5, le=90)
    """Angle of the faces at both ends to the traverse; 90 is blunt."""


class SinusoidalWallParams(Params):
    """A wavy wall about the straight one."""

    amplitude: float = number(0.005, "m", "assumed: as thick as the antenna", gt=0, le=0.05)
    """Amplitude."""
    wavelength: float = number(0.05, "m", "assumed: half the length of the antenna", ge=0.004, le=1)
    """Length of a wave."""
    entry_deg: float = number(15.0, "deg", _GRAZED, ge=5, le=90)
    """Angle of the faces at both ends to the traverse; 90 is blunt."""


class BouldersWallParams(Params):
    """Spheres in a row; the wall's surface touches them all."""

    radius: float = number(0.003175, "m", "paper: spheres of 6.35 mm", ge=0.0005, le=0.1)
    """Radius of a sphere."""
    pitch: float = number(0.00635, "m", "paper: spheres in a column, touching", ge=0.001)
    """Distance of neighbours."""


class StepWallParams(Params):
    """A wall that steps back in its middle."""

    depth: float = number(0.06, "m", "assumed: half the antenna; it then comes off", gt=0, le=0.4)
    """How far it steps back."""
    entry_deg: float = number(90.0, "deg", _BLUNT, ge=5, le=90)
    """Angle of the faces at both ends to the traverse; 90 is blunt."""


class GapWallParams(Params):
    """A wall with a gap in its middle."""

    width: float = number(0.20, "m", "assumed: a trailing antenna swings in 0.16 m", gt=0, le=2)
    """Width of the gap."""
    entry_deg: float = number(90.0, "deg", _BLUNT, ge=5, le=90)
    """Angle of the faces at both ends to the traverse; 90 is blunt."""


class CornerWallParams(Params):
    """A wall that turns towards the traverse behind its middle, and ends there."""

    turn_deg: float = number(30.0, "deg", "assumed: an obtuse inner corner", ge=5, le=90)
    """Turn of the wall."""
    rise: float = number(0.02, "m", "assumed: as far as the overlap", gt=0, le=0.4)
    """How much nearer the wall comes."""
    entry_deg: float = number(90.0, "deg", _BLUNT, ge=5, le=90)
    """Angle of the faces at both ends to the traverse; 90 is blunt."""


class TouchWallsParams(Params):
    """The walls of `antennate bench touch` by kind."""

    flat: FlatWallParams = FlatWallParams()
    sinusoidal: SinusoidalWallParams = SinusoidalWallParams()
    boulders: BouldersWallParams = BouldersWallParams()
    step: StepWallParams = StepWallParams()
    gap: GapWallParams = GapWallParams()
    corner: CornerWallParams = CornerWallParams()


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
