"""What stands around the robot, what differs between trials, and the numerics."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from antennate.params.base import Params, number

GRAVITY = 9.81
"""Gravity: the engine's default [m/s²]."""


class CylinderParams(Params):
    """The loose paper cylinders."""

    radius: float = number(0.07, "m", "paper: cylinders of 7 cm radius", gt=0.005, le=0.5)
    """Radius."""
    height: float = number(0.20, "m", "assumed: well above the robot", gt=0.05, le=2)
    """Height."""
    mass: float = number(0.10, "kg", "assumed: a tube of 1.1 kg/m² board", gt=0, le=10)
    """Mass of one cylinder."""
    friction: float = number(0.4, "1", "assumed: paper on a floor", ge=0, le=2)
    """Friction on the floor (Coulomb)."""
    contact_friction: float = number(0.3, "1", "assumed: paper on paper", ge=0, le=2)
    """Friction against walls and one another."""

    @property
    def spin_friction(self) -> float:
        """Friction torque per load [m]: the rim of a standing tube drags at its radius."""
        return self.friction * self.radius


class TunnelParams(Params):
    """A corridor with turns, lined and strewn with loose cylinders."""

    segments: tuple[float, ...] = number(
        (1.0, 1.0), "m", "assumed: room for the body", min_length=1, max_length=20
    )
    """Lengths of the straight pieces of the centre line."""
    turns_deg: tuple[float, ...] = number(
        (90.0,), "deg", "fitted: antennate tunnel, without feedback alone", max_length=19
    )
    """Turn between one piece and the next."""
    mirror: Literal["random", "never", "always"] = number("random", "1", "assumed: sides are equal")
    """Whether a trial's tunnel is mirrored."""
    free_width: float = number(
        0.40, "m", "paper: the widest, twice the robot's width", gt=0, le=100
    )
    """Widest free width between the linings."""
    corner_radius: float = number(0.0, "m", "assumed: sharp is harder", ge=0)
    """Rounding of the outer wall at a turn."""
    lining_gap: float = number(0.02, "m", "assumed: cylinders set side by side by hand", ge=0)
    """Mean gap between neighbours of a lining."""
    strewn: int = number(4, "1", "assumed: some stand in the way", ge=0, le=400)
    """Cylinders standing in the corridor."""
    cylinder: CylinderParams = CylinderParams()

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return sum(self.segments)

    @property
    def wall_distance(self) -> float:
        """Distance of the fixed walls from the centre line [m]: they back the lining."""
        return self.free_width / 2 + 2 * self.cylinder.radius

    @model_validator(mode="after")
    def _turn_between_pieces(self) -> TunnelParams:
        if len(self.turns_deg) != len(self.segments) - 1:
            raise ValueError(
                f"turns_deg needs one value between every two segments: expected "
                f"{len(self.segments) - 1}, found {len(self.turns_deg)}"
            )
        if any(abs(turn) > 120 for turn in self.turns_deg):
            raise ValueError(f"turns_deg must lie within -120 and 120, found {self.turns_deg}")
        if any(s < 0.3 for s in self.segments):
            raise ValueError(f"segments must be at least 0.3 m long, found {self.segments}")
        return self


class VariationParams(Params):
    """What differs from trial to trial besides the tunnel itself."""

    start_lateral: float = number(0.03, "m", "assumed: placed by hand", ge=0)
    """Half range of the start's side offset."""
    start_heading: float = number(0.15, "rad", "assumed: placed by hand", ge=0, le=1.5)
    """Half range of the start's heading."""
    joint_bias: float = number(
        0.02, "rad", "assumed: a horn mounted by hand, about 1 deg", ge=0, le=0.3
    )
    """Standard deviation of a yaw joint's zero."""
    slip_log_sd: float = number(0.3, "1", "assumed: dust and worn tread", ge=0, le=3)
    """Standard deviation of the logarithm of a leg's friction factor."""
    slip_time: float = number(2.5, "s", "assumed: a few steps", gt=0)
    """Time after which a leg's friction is drawn anew."""


class PhysicsParams(Params):
    """Numerics of the simulation, measured by benchmarks/numerics.py."""

    timestep: float = number(
        0.002, "s", "measured: benchmarks/numerics.py, agrees with 0.25 ms", gt=1e-5, le=0.004
    )
    """Physics step."""
    contact_time: float = number(
        0.004,
        "s",
        "measured: benchmarks/numerics.py; with longer ones the legs sink into the floor",
        gt=1e-5,
        le=0.05,
    )
    """Time constant of contacts."""
    impratio: float = number(
        1.0,
        "1",
        "measured: benchmarks/numerics.py, 10 and 100 change speeds by less than 0.2 %",
        gt=0,
        le=1000,
    )
    """Stiffness of friction over that of the normal."""
    sleep_tolerance: float = number(
        1e-3, "m/s", "measured: benchmarks/numerics.py, outcomes as without sleep", gt=0, le=0.1
    )
    """Speed under which resting parts are skipped."""


class BenchPhysicsParams(PhysicsParams):
    """Numerics of the bench: a light chain that sticks and slips on small spheres."""

    timestep: float = number(
        5e-4, "s", "measured: antennate wall at half of it gives the same table", gt=1e-5, le=0.002
    )
    """Physics step."""
    contact_time: float = number(
        1e-3, "s", "assumed: two timesteps, the stiffest that the engine allows", gt=1e-5, le=0.05
    )
    """Time constant of contacts."""
    impratio: float = number(10.0, "1", "assumed: with 1 friction creeps", gt=0, le=1000)
    """Stiffness of friction over that of the normal."""
