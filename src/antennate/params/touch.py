"""Structured walls that an antenna is moved along."""

from __future__ import annotations

from antennate.params.base import Params, number

_BLUNT = "assumed: a blunt end, which the antenna meets from the side"
_GRAZED = "assumed: the tip comes to the wall at a shallow angle, as beside a robot that drifts"
_ENTRY = "angle of the faces at both ends to the traverse; 90 is blunt"


class FlatWallParams(Params):
    """A straight wall, parallel to the traverse."""

    entry_deg: float = number(15.0, "deg", _GRAZED, _ENTRY, ge=5, le=90)


class SinusoidalWallParams(Params):
    """A wavy wall about the straight one."""

    amplitude: float = number(
        0.005, "m", "assumed: about the thickness of the antenna", "amplitude", gt=0, le=0.05
    )
    wavelength: float = number(
        0.05, "m", "assumed: half the length of the antenna", "length of a wave", ge=0.004, le=1
    )
    entry_deg: float = number(15.0, "deg", _GRAZED, _ENTRY, ge=5, le=90)


class BouldersWallParams(Params):
    """Spheres in a row; the wall's surface touches them all."""

    radius: float = number(
        0.003175, "m", "paper: spheres of 6.35 mm", "radius of a sphere", ge=0.0005, le=0.1
    )
    pitch: float = number(
        0.00635, "m", "paper: spheres in a column, touching", "distance of neighbours", ge=0.001
    )


class StepWallParams(Params):
    """A wall that steps back in its middle."""

    depth: float = number(
        0.06,
        "m",
        "assumed: half the antenna; enough to let even a trailing antenna go",
        "how far it steps back",
        gt=0,
        le=0.4,
    )
    entry_deg: float = number(90.0, "deg", _BLUNT, _ENTRY, ge=5, le=90)


class GapWallParams(Params):
    """A wall with a gap in its middle."""

    width: float = number(
        0.20,
        "m",
        "assumed: a trailing antenna needs about 0.16 m to swing forward",
        "width of the gap",
        gt=0,
        le=2,
    )
    entry_deg: float = number(90.0, "deg", _BLUNT, _ENTRY, ge=5, le=90)


class CornerWallParams(Params):
    """A wall that turns towards the traverse behind its middle, and ends there."""

    turn_deg: float = number(
        30.0, "deg", "assumed: an obtuse inner corner", "turn of the wall", ge=5, le=90
    )
    rise: float = number(
        0.02, "m", "assumed: as far as the overlap", "how much nearer the wall comes", gt=0, le=0.4
    )
    entry_deg: float = number(90.0, "deg", _BLUNT, _ENTRY, ge=5, le=90)


class TouchWallsParams(Params):
    """The walls of `antennate touch` by kind."""

    flat: FlatWallParams = FlatWallParams()
    sinusoidal: SinusoidalWallParams = SinusoidalWallParams()
    boulders: BouldersWallParams = BouldersWallParams()
    step: StepWallParams = StepWallParams()
    gap: GapWallParams = GapWallParams()
    corner: CornerWallParams = CornerWallParams()
