"""Wire, coils and the animal's taper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from antennate.params.base import Params, number


@dataclass(frozen=True, slots=True)
class Wire:
    """A spring wire; tensile strength is `strength` / d^`exponent`, d in mm.

    Attributes:
        modulus: Young's modulus [Pa].
        strength: Tensile strength of a wire of 1 mm [Pa].
        exponent: How it falls with the diameter.
        yield_share: Yield stress in bending over tensile strength.
        fatigue_share: Largest bending stress over tensile strength that a torsion spring bears a
            million times from 0, not shot-peened; None where the table has no such wire.
        thinnest: Smallest diameter of the data [m]; `thickest` the largest.
    """

    modulus: float
    strength: float
    exponent: float
    yield_share: float
    fatigue_share: float | None
    thinnest: float
    thickest: float


WIRES = {
    "stainless_302": Wire(193e9, 1867e6, 0.146, 0.61, 0.50, 0.3e-3, 2.5e-3),
    "music_wire": Wire(203e9, 2211e6, 0.145, 0.78, 0.50, 0.1e-3, 6.5e-3),
    "hard_drawn": Wire(198e9, 1783e6, 0.190, 0.78, None, 0.7e-3, 12.7e-3),
    "phosphor_bronze": Wire(103e9, 1000e6, 0.0, 0.61, None, 0.1e-3, 0.6e-3),
}
"""Shigley, Mechanical Engineering Design, 9th edition, tables 10-4 and 10-5; the yield shares are
those of torsion springs, section 10-12, and the fatigue shares those of its table 10-10 (Associated
Spring) for ASTM A228 and stainless 302."""

RATE_FACTOR = 10.8
"""Rate per turn = E d^4 / (10.8 D N): spring makers' figure; 10.186 = 64 / 2 pi follows from beam
theory, the rest is friction between coils and curvature of the wire."""

STOCK_WIRES_MM = (
    *(0.20, 0.22, 0.25, 0.28, 0.30, 0.32, 0.36, 0.40, 0.45, 0.50, 0.55, 0.60, 0.65, 0.70),
    *(0.75, 0.80, 0.85, 0.90, 0.95, 1.00),
)
"""Wire diameters that makers stock [mm]: the usual metric series."""

_Positive = Annotated[float, Field(gt=0)]
_Diameter = Annotated[float, Field(gt=0, le=100)]
_Coils = Annotated[int, Field(ge=1, le=1000)]


class SpringParams(Params):
    """Torsion springs of one wire and one coil diameter, and how new ones may be wound."""

    wire: Literal["stainless_302", "music_wire", "hard_drawn", "phosphor_bronze"] = number(
        "stainless_302", "1", "assumed: a wire that does not rust"
    )
    """Kind of wire."""
    modulus_pa: float | None = number(None, "Pa", "assumed: that of the kind of wire")
    """Young's modulus if it is known better."""
    wire_mm: float = number(0.50, "mm", "assumed: a stock wire, spring index 7.5", gt=0.01, le=10)
    """Wire diameter."""
    coil_mm: float = number(3.77, "mm", "assumed: follows from the paper's table", gt=0.05, le=200)
    """Mean coil diameter."""
    wanted_n_mm_per_deg: tuple[_Positive, ...] = number(
        (0.274, 0.137, 0.091), "N·mm/deg", "paper: table of springs", min_length=1, max_length=50
    )
    """Stiffnesses that a new set is wound for."""
    index_limits: tuple[_Positive, _Positive] = number(
        (4.0, 12.0), "1", "datasheet: makers' usual range of coil over wire diameter"
    )
    """Smallest and largest spring index."""
    coil_limits: tuple[_Positive, _Positive] = number(
        (2.0, 12.0), "1", "assumed: fewer give no clean rate, more grow longer than a link"
    )
    """Fewest and most active coils."""
    coil_step: float = number(0.25, "1", "datasheet: legs are bent at quarter turns", gt=0, le=1)
    """Step of active coils."""
    mandrel_step_mm: float = number(0.1, "mm", "assumed: drill rod", gt=0.001, le=5)
    """Step of inner coil diameters."""
    angle_deg: float = number(30.0, "deg", "paper: no spring bends farther", gt=0, le=720)
    """Angle a spring must bear."""


class TaperParams(Params):
    """A tapering antenna as a row of segments, and the springs that follow it."""

    segments: int = number(14, "1", "paper: segments of the model of the animal", ge=2, le=1000)
    """Number of segments."""
    base_mm: float = number(1.5, "mm", "paper: Scolopendra's antenna", gt=0, le=100)
    """Diameter at the base."""
    tip_mm: float = number(0.2, "mm", "paper: Scolopendra's antenna", gt=0, le=100)
    """Diameter at the tip."""
    law: Literal["linear", "geometric"] = number("linear", "1", "assumed: unpublished")
    """How diameters fall from base to tip."""
    diameters_mm: tuple[_Diameter, ...] | None = number(
        None, "mm", "assumed: no measurement", min_length=2, max_length=1000
    )
    """Measured diameters, base first; they replace segments, ends and law."""
    ladder_limits: tuple[_Coils, _Coils] = number(
        (3, 30), "1", "assumed: fewest of the paper's springs, most that a link holds"
    )
    """Fewest and most coils of a suggested ladder."""
