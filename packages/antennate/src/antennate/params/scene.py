"""What stands around the robot, what differs between trials, and the numerics."""

from __future__ import annotations

from collections.abc import Mapping
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
    lining_inset: float = number(0.0, "m", "assumed: a lining is straight", ge=0, le=1)
    """How far cylinders of a lining may stand in; there the way is narrower by so much."""
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
    reading_noise: float = number(1.0, "1", "assumed: as the flex sensor has it", ge=0, le=100)
    """Factor on the noise of all readings."""
    broken: Literal["none", "left", "right", "random"] = number(
        "none", "1", "assumed: both are whole"
    )
    """Antenna that is broken off: its flex sensor stays straight."""


class CorridorsParams(Params):
    """A distribution of corridors: how many pieces, how long, how wide, with what in them.

    From low to high all are uniform, but the mass: its logarithm is. What cannot stand, as a
    corridor that runs into itself, is drawn anew.
    """

    pieces: tuple[int, int] = number(
        (1, 4), "1", "assumed: from no corner to three, one more than a U-turn"
    )
    """Straight pieces, fewest and most."""
    length: tuple[float, float] = number(
        (0.5, 3.0), "m", "assumed: from less than the robot's 0.72 m to four times that"
    )
    """Length of a piece, shortest and longest."""
    largest_turn: float = number(
        120.0, "deg", "assumed: beyond, the way back is nearer than the way on", ge=0, le=120
    )
    """Largest turn between two pieces, to either side."""
    straight_share: float = number(
        0.2, "1", "assumed: a way that goes straight on must not be turned out of", ge=0, le=1
    )
    """Share of turns that are none."""
    free_width: tuple[float, float] = number(
        (0.36, 0.60), "m", "paper: twice the robot's width is 0.4 m; assumed: to three times it"
    )
    """Free width between the linings, narrowest and widest."""
    mass: tuple[float, float] = number(
        (0.05, 0.5), "kg", "assumed: half of our paper tube, to what the robot hardly pushes"
    )
    """Mass of the cylinders of one draw, least and most."""
    strewn: tuple[float, float] = number((0.0, 3.0), "1/m", "assumed: the tunnel has 2 on a metre")
    """Cylinders that stand in the way, on a metre, fewest and most."""
    room_share: float = number(0.2, "1", "assumed: sometimes", ge=0, le=1)
    """Share of draws with a room."""
    room_length: tuple[float, float] = number(
        (0.8, 1.2), "m", "assumed: about the room of the scene `room`, 1 m"
    )
    """Length of a room, shortest and longest."""
    room_width: tuple[float, float] = number(
        (0.9, 1.4), "m", "assumed: about the room of the scene `room`, 1.2 m"
    )
    """Width of a room, narrowest and widest."""
    arm_share: float = number(0.2, "1", "assumed: sometimes", ge=0, le=1)
    """Share of draws of two and more pieces with a blind arm, straight on where the way turns."""
    arm_depth: tuple[float, float] = number(
        (0.3, 1.0), "m", "assumed: from a niche to more than the robot's length"
    )
    """Depth of a blind arm behind the outer wall of the turn, least and most."""
    arm_turn: float = number(
        60.0,
        "deg",
        "assumed: at a smaller turn arm and way part too slowly to be two",
        ge=30,
        le=120,
    )
    """Smallest turn at which an arm goes straight on."""
    pace: float = number(
        50.0, "s/m", "paper: 0.04 m/s without feedback, half of that: 100 s for 2 m", gt=0, le=1000
    )
    """Time limit of a draw on a metre of its way."""

    @model_validator(mode="after")
    def _ranges(self) -> CorridorsParams:
        least = {
            "pieces": 1,
            "length": 0.3,
            "free_width": 0.1,
            "mass": 1e-3,
            "strewn": 0.0,
            "room_length": 0.1,
            "room_width": 0.1,
            "arm_depth": 0.05,
        }
        most = {"pieces": 10, "length": 20.0, "free_width": 2.0, "mass": 10.0, "strewn": 20.0}
        for name, bound in least.items():
            low, high = getattr(self, name)
            if not bound <= low <= high <= most.get(name, 5.0):
                raise ValueError(
                    f"{name} must rise from at least {bound:g} to at most {most.get(name, 5.0):g}, "
                    f"found {low:g} and {high:g}"
                )
        if self.room_share + self.arm_share > 1:
            raise ValueError(
                f"room_share and arm_share must not exceed 1 together, found "
                f"{self.room_share + self.arm_share:g}: a draw has one of them at most"
            )
        if self.arm_share and self.largest_turn < self.arm_turn:
            raise ValueError(
                f"largest_turn must be at least arm_turn, {self.arm_turn:g} deg, where there are "
                f"blind arms, found {self.largest_turn:g} deg"
            )
        return self


class GroundParams(Params):
    """Sizes of ground that is not flat; each scene of it reads its own."""

    height: float = number(0.10, "m", "assumed: 8 to 15 cm are to be climbed", ge=0.001, le=0.5)
    """Height of a step, of each step of stairs, or of a ramp."""
    start: tuple[float, float] = number(
        (0.35, 0.95), "m", "assumed: the antennae do not touch it yet, and a body length more"
    )
    """Distance of the first edge from the head at the start, nearest and farthest."""
    width: float = number(0.10, "m", "assumed: a link pitch", gt=0.0, le=0.5)
    """Width of a gap."""
    depth: float = number(
        0.35, "m", "assumed: half the robot; it does not come out", ge=0.001, le=1
    )
    """Depth of a gap."""
    steps: int = number(3, "1", "assumed: enough to be on two edges at once", ge=1, le=20)
    """Steps of stairs."""
    tread: float = number(0.30, "m", "assumed: of usual stairs (DIN 18065: 29 cm)", gt=0.05, le=2)
    """Depth of a step of stairs, from edge to edge."""
    slope: float = number(15.0, "deg", "assumed: wheelchair ramps have 3 to 7 deg", gt=0, le=45)
    """Slope of a ramp."""
    block: float = number(0.02, "m", "assumed: above half the robot's clearance", gt=0.0, le=0.2)
    """Height of the highest block of rubble; blocks are half as high to as high."""
    density: float = number(60.0, "1/m²", "assumed: a fifth of the field is covered", ge=0, le=400)
    """Blocks of rubble on a square metre."""

    @model_validator(mode="after")
    def _start_in_front(self) -> GroundParams:
        near, far = self.start
        if not 0.25 <= near <= far <= 10.0:
            raise ValueError(
                f"start must rise from at least 0.25 to at most 10 m, found {near:g} and {far:g}"
            )
        return self


GROUND_READS: Mapping[str, tuple[str, ...]] = {
    "step_up": ("start", "height"),
    "step_down": ("start", "height"),
    "stairs": ("start", "height", "steps", "tread"),
    "gap": ("start", "width", "depth"),
    "ramp": ("start", "height", "slope"),
    "rubble": ("start", "block", "density"),
    "step_tunnel": ("height",),
}
"""Sizes that each scene of ground reads."""


class HookParams(Params):
    """Hook by which a robot hangs: a spring that holds its middle link level, for recordings."""

    firm: bool = number(False, "1", "assumed: a hook, as the twin has one")
    """Whether the link is held firmly, as in a vice; then nothing else counts."""
    stiffness: float = number(
        3000.0, "N/m", "assumed: a robot of 2 kg makes it give by 7 mm", ge=500, le=6000
    )
    """Stiffness against a shift in any direction."""
    damping: float = number(40.0, "N·s/m", "assumed: a swing dies in a second", ge=20, le=80)
    """Damping of that."""
    twist_stiffness: float = number(
        100.0, "N·m/rad", "assumed: a clamp of plastic, 1 mm at 0.1 m under 10 N", ge=20, le=120
    )
    """Stiffness against a turn about any axis."""
    twist_damping: float = number(
        0.3, "N·m·s/rad", "assumed: a twist dies in a second", ge=0.3, le=0.6
    )
    """Damping of that."""


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
        5e-4,
        "s",
        "measured: bench wall at half of it gives the same table",
        gt=1e-5,
        le=0.002,
    )
    """Physics step."""
    contact_time: float = number(
        1e-3, "s", "assumed: two timesteps, the stiffest that the engine allows", gt=1e-5, le=0.05
    )
    """Time constant of contacts."""
    impratio: float = number(10.0, "1", "assumed: with 1 friction creeps", gt=0, le=1000)
    """Stiffness of friction over that of the normal."""
