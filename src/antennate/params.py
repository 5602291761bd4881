"""Every physical number of the system: its value, its unit, and where it comes from.

Each class groups the numbers of one part as a frozen model: unknown keys, non-finite numbers and
values out of bounds are refused. A source begins with one of `paper` (arXiv:2603.07795),
`datasheet`, `measured`, `fitted` (by which command) or `assumed` (why). Derived numbers are
properties, computed here and never typed.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from antennate.anatomy import ANTENNA_LINK_COUNT, LINK_COUNT


class Params(BaseModel):
    """A frozen group of numbers; unknown keys, NaN and infinities are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def number(default: Any, unit: str, source: str, meaning: str, **bounds: Any) -> Any:
    """Declare one parameter with its unit, source and meaning; `bounds` as for pydantic's Field."""
    return Field(
        default,
        description=f"{meaning} [{unit}]" if unit != "1" else meaning,
        json_schema_extra={"unit": unit, "source": source, "meaning": meaning},
        **bounds,
    )


_Coils = Annotated[int, Field(gt=0)]

N_MM_PER_DEG = 1e-3 * 180.0 / math.pi
"""One N·mm/deg in N·m/rad."""


class AntennaParams(Params):
    """One antenna: a chain of six torsion springs with a film sensor along its base."""

    active_coils: tuple[_Coils, _Coils, _Coils, _Coils, _Coils, _Coils] = number(
        (3, 6, 6, 9, 9, 9),
        "1",
        "paper: one spring of 3, two of 6 and three of 9 active coils, stiff base to soft tip",
        "active coils of each spring, base to tip",
    )
    three_coil_stiffness_n_mm_per_deg: float = number(
        0.274,
        "N·mm/deg",
        "paper: table of springs; stiffness goes with 1/coils, so 0.137 and 0.091 follow",
        "stiffness of a spring of three active coils",
        gt=0,
    )
    film_stiffness_n_mm_per_deg: float = number(
        0.048,
        "N·mm/deg",
        "assumed: bending stiffness of a 10 x 0.25 mm PET strip, E 3.5 GPa, per 16.7 mm hinge",
        "stiffness the sensor film adds to each hinge it covers",
        ge=0,
    )
    length: float = number(
        0.12,
        "m",
        "assumed: unpublished; six springs and holders under a sensor of about 0.1 m",
        "length from base to tip",
        gt=0.02,
        le=0.4,
    )
    radius: float = number(
        0.003, "m", "assumed: coils of about 5 mm diameter and wire", "outer radius", gt=0, le=0.02
    )
    link_mass: float = number(
        0.0008,
        "kg",
        "assumed: unpublished; steel coil and printed holder",
        "mass of one link",
        gt=0,
    )
    base_mass: float = number(
        0.001, "kg", "assumed: printed horn", "mass that turns with the base servo", gt=0
    )
    damping_time: float = number(
        0.04,
        "s",
        "assumed: damping over stiffness of a hinge; with less, the gait alone swings the antenna",
        "relaxation time of a hinge",
        ge=0,
    )
    armature: float = number(
        3e-6,
        "kg·m²",
        "assumed: keeps the light chain well conditioned",
        "inertia added per hinge",
        gt=0,
    )
    range: float = number(
        1.4, "rad", "assumed: neighbouring holders meet", "largest angle of one hinge", gt=0, lt=3.1
    )
    base_angle: float = number(
        math.radians(47.0),
        "rad",
        "assumed: unpublished; tips then lead the head and span the body width",
        "mounting angle from the heading, outwards",
        ge=0,
        lt=math.pi / 2,
    )
    base_spacing: float = number(
        0.04,
        "m",
        "assumed: two XL330 servos (20 mm wide) side by side",
        "distance of the two bases",
        gt=0,
    )
    friction: float = number(
        0.3, "1", "assumed: printed plastic on paper", "friction against obstacles", ge=0, le=2
    )

    @property
    def link_length(self) -> float:
        """Length of one link [m]."""
        return self.length / ANTENNA_LINK_COUNT

    def spring_stiffness(self) -> tuple[float, ...]:
        """Stiffness of the six springs alone, base to tip [N·m/rad]."""
        per_coil = 3.0 * self.three_coil_stiffness_n_mm_per_deg * N_MM_PER_DEG
        return tuple(per_coil / coils for coils in self.active_coils)

    def hinge_stiffness(self, covered: int) -> tuple[float, ...]:
        """Stiffness of the six hinges with the film over the first `covered` of them [N·m/rad]."""
        film = self.film_stiffness_n_mm_per_deg * N_MM_PER_DEG
        springs = self.spring_stiffness()
        return tuple(k + film * (i < covered) for i, k in enumerate(springs))


class SensorParams(Params):
    """Flex film, voltage divider and the ESP32's converter."""

    active_length: float = number(
        0.0953, "m", "datasheet: Spectra Symbol FS-L-0095-103, active length", "sensed length", gt=0
    )
    flat_resistance: float = number(
        10e3,
        "Ohm",
        "datasheet: Spectra Symbol FS-L-0095-103, flat 10 kOhm",
        "resistance unbent",
        gt=0,
    )
    bend_gain: float = number(
        1.2 / math.pi,
        "1/rad",
        "datasheet: at least doubled at 180 deg (FS-L-0095-103); 2.2 assumed",
        "relative rise of resistance per radian of flex",
        gt=0,
    )
    directions: Literal["both", "one"] = number(
        "both",
        "1",
        "assumed: the paper's ZD10-100 is sold as a pressure strip, which answers bending either "
        "way",
        "whether the film sees bending towards the tail only (one) or either way",
    )
    divider_resistance: float = number(
        10e3,
        "Ohm",
        "assumed: the value makers pair with this film",
        "fixed resistor to ground",
        gt=0,
    )
    supply: float = number(3.3, "V", "datasheet: ESP32 supply", "voltage over the divider", gt=0)
    adc_gain: float = number(
        0.8056e-3, "V", "datasheet: ESP-IDF line fit at 11 dB, Vref 1.1 V", "volts per count", gt=0
    )
    adc_offset: float = number(
        0.142,
        "V",
        "datasheet: ESP-IDF line fit at 11 dB, Vref 1.1 V",
        "voltage that reads zero",
        ge=0,
    )
    noise_counts: float = number(
        2.5,
        "counts",
        "assumed: 8 counts a sample; averaging 16 leaves 2-3 as part of it is correlated",
        "standard deviation of one reading",
        ge=0,
    )
    rate: float = number(
        100.0, "Hz", "paper: about 100 Hz over serial", "readings per second", gt=0, le=1000
    )

    def covered_hinges(self, antenna: AntennaParams) -> int:
        """Number of hinges, from the base, that lie under the film."""
        pitch = antenna.link_length
        return min(ANTENNA_LINK_COUNT, math.ceil(self.active_length / pitch - 1e-9))


class ServoParams(Params):
    """DYNAMIXEL XC430-W240-T at 11.1 V, in position mode."""

    stall_torque: float = number(
        1.7, "N·m", "datasheet: XC430-W240, 11.1 V", "torque at standstill", gt=0
    )
    no_load_speed: float = number(
        65.0 * 2.0 * math.pi / 60.0,
        "rad/s",
        "datasheet: XC430-W240, 65 rpm at 11.1 V",
        "speed unloaded",
        gt=0,
    )
    position_gain: float = number(
        700 / 128 * 4096 / (2 * math.pi) / 885,
        "1/rad",
        "datasheet: Position P Gain 700, scaled by 1/128 to PWM counts a tick of 1/4096 turn, PWM "
        "limit 885",
        "share of the full drive per radian of position error",
        gt=0,
    )
    armature: float = number(
        0.003,
        "kg·m²",
        "assumed: rotor of about 5e-8 kg·m² behind a 245:1 gear",
        "inertia at the output",
        ge=0,
    )

    @property
    def stiffness(self) -> float:
        """Torque per radian of position error, before saturation [N·m/rad]."""
        return self.stall_torque * self.position_gain

    @property
    def damping(self) -> float:
        """Slope of the torque-speed line [N·m·s/rad]: full drive holds no_load_speed unloaded."""
        return self.stall_torque / self.no_load_speed


class RobotParams(Params):
    """Six links, five yaw joints, twelve O-legs."""

    link_pitch: float = number(
        0.10,
        "m",
        "assumed: one yaw servo and two leg servos (28.5 x 46.5 x 34 mm) a link",
        "joint spacing",
        gt=0.03,
    )
    mass: float = number(
        2.0,
        "kg",
        "assumed: 17 servos of 65 g (datasheet) and as much again in frames and legs",
        "total mass",
        gt=0.3,
    )
    width: float = number(
        0.20,
        "m",
        "paper: a free section of 0.40 m is called about twice the robot's width",
        "width over the legs",
        gt=0.08,
    )
    leg_radius: float = number(
        0.030,
        "m",
        "assumed: a ring under the 34 mm body that gives 0.12 m/s within the servo's speed",
        "outer radius of an O-leg",
        gt=0,
    )
    leg_eccentricity: float = number(
        0.012, "m", "assumed: as leg_radius", "distance of the ring's centre from its axle", ge=0
    )
    leg_width: float = number(
        0.016, "m", "assumed: printed ring with a rubber tread", "thickness of an O-leg", gt=0
    )
    leg_mass: float = number(0.020, "kg", "assumed: printed ring", "mass of one O-leg", gt=0)
    leg_friction: float = number(
        0.6,
        "1",
        "assumed: rubber on a laboratory floor, 0.5 to 0.8",
        "friction of a leg on the floor",
        gt=0,
        le=2,
    )
    body_friction: float = number(
        0.3,
        "1",
        "assumed: printed plastic on paper",
        "friction of the body against obstacles",
        ge=0,
        le=2,
    )
    body_radius: float = number(
        0.020,
        "m",
        "assumed: half the height of the servo and its frame",
        "radius of spine and cross-beams",
        gt=0,
    )
    pitch_stiffness: float = number(
        30.0,
        "N·m/rad",
        "assumed: a servo that holds; the paper leaves pitch unused",
        "stiffness of a locked pitch joint",
        gt=0,
    )
    antenna: AntennaParams = AntennaParams()
    sensor: SensorParams = SensorParams()
    servo: ServoParams = ServoParams()

    @property
    def length(self) -> float:
        """Body length without antennae [m]."""
        return LINK_COUNT * self.link_pitch

    @property
    def link_mass(self) -> float:
        """Mass of one link without its legs [kg]."""
        antennae = 2 * (ANTENNA_LINK_COUNT * self.antenna.link_mass + self.antenna.base_mass)
        return (self.mass - 2 * LINK_COUNT * self.leg_mass - antennae) / LINK_COUNT

    @model_validator(mode="after")
    def _mass_left_for_links(self) -> RobotParams:
        if self.link_mass <= 0.01:
            raise ValueError(
                f"mass must leave more than 10 g a link beside legs and antennae, got {self.mass} "
                "kg"
            )
        return self


class GaitParams(Params):
    """The serpenoid body wave and the stepping O-legs."""

    frequency: float = number(
        0.5,
        "Hz",
        "assumed: unpublished; legs then turn at 46 % of the servo's no-load speed",
        "cycles per second",
        gt=0,
        le=1.0,
    )
    wave_number: float = number(
        1.0,
        "1",
        "assumed: unpublished; one wave on the body, as in related robots",
        "waves along the body",
        gt=0,
        le=3,
    )
    amplitude: float = number(
        math.radians(25.0),
        "rad",
        "assumed: unpublished; 15 to 35 deg is usual",
        "amplitude of a yaw joint",
        ge=0,
        le=1.2,
    )
    body_phase: float = number(
        math.radians(200.0),
        "rad",
        "fitted: antennate gait, sweep of the leg phase; left feet are down where the body bends "
        "to the left",
        "lead of the body wave over the legs",
        ge=-2 * math.pi,
        le=2 * math.pi,
    )
    turn_offset: float = number(
        math.radians(20.0),
        "rad",
        "assumed: unpublished; antennate gait measures 66 deg of yaw a cycle",
        "yaw offset while turning",
        ge=0,
        le=1.0,
    )
    offset_rate: float = number(
        1.5,
        "rad/s",
        "assumed: a full change of turn in half a second, within the servo's speed",
        "largest change of the offset",
        gt=0,
    )


class ConditioningParams(Params):
    """From counts to the bending level b."""

    averaging_time: float = number(
        0.1,
        "s",
        "assumed: unpublished; ten samples",
        "T_avg, length of the running mean",
        gt=0,
        le=5,
    )
    midpoint: float = number(
        0.305,
        "1",
        "paper: midpoint of the sigmoid, in normalised reading",
        "reading at which b is one half",
        gt=-1,
        lt=2,
    )
    slope: float = number(
        18.3, "1", "paper: slope of the sigmoid", "slope of the sigmoid", gt=0, le=1000
    )
    polarity: Literal[-1, 1] = number(
        -1,
        "1",
        "paper: called a decreasing sigmoid; counts fall when the film bends",
        "+1 if the reading rises with bending",
    )
    counts_low: float = number(
        1399.0,
        "counts",
        "fitted: antennate.sensor, flex of a right angle without noise",
        "reading that normalises to 0",
        ge=0,
        le=4095,
    )
    counts_high: float = number(
        1872.0,
        "counts",
        "fitted: antennate.sensor, straight antenna without noise",
        "reading that normalises to 1",
        ge=0,
        le=4095,
    )

    @model_validator(mode="after")
    def _span(self) -> ConditioningParams:
        if self.counts_high - self.counts_low < 1:
            raise ValueError(
                f"counts_high must exceed counts_low by at least 1 count, got {self.counts_low} "
                f"and {self.counts_high}"
            )
        return self


class CylinderParams(Params):
    """The loose paper cylinders."""

    radius: float = number(0.07, "m", "paper: cylinders of 7 cm radius", "radius", gt=0.005, le=0.5)
    height: float = number(
        0.20, "m", "assumed: unpublished; well above the robot's 6 cm", "height", gt=0.05, le=2
    )
    mass: float = number(
        0.10,
        "kg",
        "assumed: unpublished; a tube of 1.1 kg/m² board",
        "mass of one cylinder",
        gt=0,
        le=10,
    )
    friction: float = number(
        0.4,
        "1",
        "assumed: unpublished; paper on a laboratory floor",
        "Coulomb friction on the floor",
        ge=0,
        le=2,
    )
    contact_friction: float = number(
        0.3,
        "1",
        "assumed: unpublished; paper on paper and on walls",
        "friction against walls and one another",
        ge=0,
        le=2,
    )

    @property
    def spin_friction(self) -> float:
        """Friction torque per load [m]: the rim of a standing tube drags at its radius."""
        return self.friction * self.radius


class TunnelParams(Params):
    """A corridor with turns, lined and strewn with loose cylinders."""

    segments: tuple[float, ...] = number(
        (1.0, 1.0),
        "m",
        "assumed: unpublished; room for the body before the turn and after it",
        "lengths of the straight pieces of the centre line",
        min_length=1,
        max_length=20,
    )
    turns_deg: tuple[float, ...] = number(
        (90.0,),
        "deg",
        "fitted: antennate tunnel, open loop alone",
        "turn between one piece and the next",
        max_length=19,
    )
    mirror: Literal["random", "never", "always"] = number(
        "random", "1", "assumed: no side is favoured", "whether a trial's tunnel is mirrored"
    )
    free_width: float = number(
        0.40,
        "m",
        "paper: the widest section, about twice the robot's width",
        "widest free width between the linings",
        gt=0,
    )
    corner_radius: float = number(
        0.0,
        "m",
        "assumed: unpublished; a sharp corner is the harder case",
        "rounding of the outer wall at a turn",
        ge=0,
    )
    lining_gap: float = number(
        0.02,
        "m",
        "assumed: cylinders set side by side by hand",
        "mean gap between neighbours of a lining",
        ge=0,
    )
    strewn: int = number(
        4,
        "1",
        "assumed: unpublished; some cylinders stand in the way",
        "cylinders standing in the corridor",
        ge=0,
        le=400,
    )
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
                f"{len(self.segments) - 1}, "
                f"got {len(self.turns_deg)}"
            )
        if any(abs(turn) > 120 for turn in self.turns_deg):
            raise ValueError(f"turns_deg must lie within -120 and 120, got {self.turns_deg}")
        if any(s < 0.3 for s in self.segments):
            raise ValueError(f"segments must be at least 0.3 m long, got {self.segments}")
        return self


class VariationParams(Params):
    """What differs from trial to trial besides the tunnel itself."""

    start_lateral: float = number(
        0.03, "m", "assumed: placed by hand", "half range of the start's side offset", ge=0
    )
    start_heading: float = number(
        0.15, "rad", "assumed: placed by hand", "half range of the start's heading", ge=0, le=1.5
    )
    joint_bias: float = number(
        0.02,
        "rad",
        "assumed: a horn mounted by hand, about 1 deg",
        "standard deviation of a yaw joint's zero",
        ge=0,
        le=0.3,
    )
    slip_log_sd: float = number(
        0.3,
        "1",
        "assumed: dust and worn tread",
        "standard deviation of the logarithm of a leg's friction factor",
        ge=0,
        le=3,
    )
    slip_time: float = number(
        2.5, "s", "assumed: a few steps", "time after which a leg's friction is drawn anew", gt=0
    )


class PhysicsParams(Params):
    """Numerics of the simulation."""

    timestep: float = number(
        0.002,
        "s",
        "measured: benchmarks/numerics.py, agrees with 0.25 ms",
        "physics step",
        gt=1e-5,
        le=0.004,
    )
    contact_time: float = number(
        0.004,
        "s",
        "measured: benchmarks/numerics.py; longer lets the legs sink into the floor",
        "time constant of contacts",
        gt=1e-5,
        le=0.05,
    )
    impratio: float = number(
        1.0,
        "1",
        "measured: benchmarks/numerics.py, 10 and 100 change the speed by under 0.2 %",
        "stiffness of friction over that of the normal",
        gt=0,
        le=1000,
    )
    sleep_tolerance: float = number(
        1e-3,
        "m/s",
        "measured: benchmarks/numerics.py, outcomes as without sleep",
        "speed under which resting parts are skipped",
        gt=0,
        le=0.1,
    )


class RuleParams(Params):
    """The paper's rule: when an antenna touches, and what to do then."""

    threshold: float = number(
        0.5,
        "1",
        "assumed: unpublished; middle of the sigmoid",
        "theta: bending level that is contact",
        gt=0,
        lt=1,
    )
    hysteresis: float = number(
        0.1,
        "1",
        "assumed: unpublished; above twice the noise in b",
        "contact ends this far below the threshold",
        ge=0,
        lt=1,
    )
    strong: float = number(
        0.7,
        "1",
        "assumed: unpublished",
        "both sides at this level or above count as strong",
        gt=0,
        le=1,
    )
    similar: float = number(
        0.15, "1", "assumed: unpublished", "levels that differ by less are similar", ge=0, le=1
    )
    hold_time: float = number(
        2.0,
        "s",
        "assumed: unpublished; one gait cycle, so that every command turns by the same angle",
        "T_hold, how long a maneuver is kept",
        gt=0,
        le=30,
    )


class RepetitionParams(Params):
    """When readings that repeat themselves mean that the robot is stuck."""

    window_cycles: float = number(
        0.5,
        "1",
        "fitted: open loop, 96 tunnels: half a cycle tells sooner than a whole one, at as few "
        "errors",
        "window of both means below, in gait cycles",
        gt=0,
        le=10,
    )
    change: float = number(
        0.06,
        "1",
        "fitted: open loop, 96 tunnels: 59 jams found, 8 alarms while still getting on",
        "mean change of deflection from cycle to cycle under which it repeats",
        gt=0,
        le=1,
    )
    pressure: float = number(
        0.2,
        "1",
        "fitted: open loop, 12 tunnels: free antennae stay below, stuck ones above",
        "mean deflection above which an antenna is pressed",
        ge=0,
        le=1,
    )


class EscapeParams(Params):
    """Backing off and turning when stuck."""

    trigger: Literal["repetition", "contact"] = number(
        "repetition",
        "1",
        "fitted: open loop; readings that repeat tell stuck from moving, both sides strong does "
        "not",
        "what counts as stuck: repeated readings, or the paper's both strong and similar",
    )
    reverse_time: float = number(
        2.2,
        "s",
        "fitted: study of the closed arm on 60 tuning tunnels; two thirds of the body length",
        "time to back off",
        gt=0,
        le=30,
    )
    turn_time: float = number(
        1.3,
        "s",
        "fitted: study of the closed arm on 60 tuning tunnels; about 60 deg at the offset below",
        "time of the first turn",
        gt=0,
        le=30,
    )
    turn_offset: float = number(
        0.52,
        "rad",
        "assumed: a tight turn, nearly on the spot",
        "yaw offset of turns",
        gt=0,
        le=1.0,
    )
    first_turn: Literal["memory", "right"] = number(
        "memory",
        "1",
        "assumed: the side touched more is the blocked one",
        "side of the first turn: away from what was touched more, or always right",
    )
    alternate: bool = number(
        True,
        "1",
        "assumed: searching both sides",
        "whether a second turn goes the other way and twice as far",
    )
    second_turn: float = number(
        2.0,
        "1",
        "assumed: once back to the first course and once beyond it",
        "length of a turn the other way, in first turns",
        gt=0,
        le=5,
    )
    retry_time: float = number(
        12.0,
        "s",
        "assumed: six gait cycles",
        "stuck again within this time, it turns the other way",
        gt=0,
        le=300,
    )
    memory_time: float = number(
        4.0, "s", "assumed: two gait cycles", "time constant of the memory of touch", gt=0, le=300
    )
    memory_delay: float = number(
        3.0,
        "s",
        "fitted: open loop, 96 tunnels, 57 jams: the first turn is right in 61 % with it, 56 % "
        "without",
        "how long before the jam was noticed the memory is read",
        ge=0,
        le=60,
    )
    lost_time: float = number(
        2.0,
        "s",
        "fitted: open loop, 96 tunnels: ten times in 30 s nothing is felt for longer",
        "nothing felt for so long after a turn means that the walls are lost",
        gt=0,
        le=3600,
    )
    return_time: float = number(
        3.8, "s", "assumed: about 180 deg at the offset above", "time to turn round", gt=0, le=60
    )


class ControllerParams(Params):
    """Everything in front of the wall."""

    rate: float = number(
        100.0, "Hz", "paper: about 100 Hz over serial", "control ticks per second", gt=0, le=1000
    )
    gait: GaitParams = GaitParams()
    conditioning: ConditioningParams = ConditioningParams()
    rule: RuleParams = RuleParams()
    repetition: RepetitionParams = RepetitionParams()
    escape: EscapeParams = EscapeParams()

    @property
    def period(self) -> float:
        """Control period [s]."""
        return 1.0 / self.rate
