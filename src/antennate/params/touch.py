"""Structured walls that an antenna is moved along."""

from __future__ import annotations

from antennate.params.base import Params, number

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
