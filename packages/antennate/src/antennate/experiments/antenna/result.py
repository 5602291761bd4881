"""What a run of `antenna` comes to: springs, taper, sensor, and ring-down."""

from __future__ import annotations

import math

from antennate.studies.columns import column, percent, tabular


@tabular
class Spring:
    """A spring of the wire and the coil as they are."""

    active_coils: float
    """Active coils."""
    stiffness_n_mm_per_deg: float = column("stiffness", "N·mm/deg", form=".4f")
    """Torque over angle."""
    paper_n_mm_per_deg: float | None = column("  the paper prints", form=".3f")
    """Stiffness that the paper prints for so many coils; `null` if it prints none."""
    stiffness_n_m_per_rad: float = column("stiffness", "N·m/rad", form=".5f")
    """Torque over angle, in SI units."""
    angle_deg: float = column("angle to bear", "deg", form="g")
    """Angle that the spring must bear."""
    torque_at_angle_n_mm: float = column("  torque at it", "N·mm")
    """Torque at that angle."""
    yield_angle_deg: float = column("yields at", "deg", form=".0f")
    """Angle at which the wire begins to yield."""


@tabular
class WoundSet:
    """A set of springs that could be wound of a stock wire."""

    wire_mm: float
    """Diameter of the wire."""
    coil_mm: float
    """Mean diameter of the coils."""
    mandrel_mm: float = column("mandrel", "mm", form=".1f")
    """Diameter of the mandrel, the inner one of the coils."""
    spring_index: float = column("spring index", form=".1f")
    """Mean diameter of the coils over that of the wire."""
    active_coils: list[float] = column("active coils", form="g", join=" ")
    """Active coils of each spring, in steps that can be wound."""
    stiffness_n_mm_per_deg: list[float]
    """Stiffness of each spring."""
    largest_error: float = percent("largest error", form=".1f")
    """Largest distance of a stiffness from the wanted one, over the wanted one."""
    yield_angle_deg: float = column("yields at", "deg", form=".0f")
    """Smallest angle at which one of the springs yields."""
    body_length_mm: float = column("longest body", "mm", form=".1f")
    """Length of the longest coil body, closely wound."""


@tabular
class Springs:
    """Springs as they are, and as they could be wound."""

    wire: str
    """Kind of wire."""
    spring_index: float
    """Mean diameter of the coils over that of the wire."""
    coil_outer_mm: float
    """Outer diameter of the coils. They overlap if it exceeds `hinge_distance_mm`."""
    hinge_distance_mm: float
    """Distance of a hinge from the next."""
    springs: list[Spring]
    """Springs, one for each count of active coils."""
    wanted_n_mm_per_deg: list[float]
    """Stiffnesses that new sets are wound for."""
    windings: list[WoundSet]
    """Sets that could be wound, the best of each stock wire, the smallest error first."""


@tabular
class Ladder:
    """Springs in a row, base first."""

    active_coils: list[float]
    """Active coils of each spring."""
    proxy: list[float]
    """Stiffness of each spring over that of the first."""
    base_over_tip: float
    """Stiffness of the first spring over that of the last."""
    distance_decades: float
    """RMS distance of the stiffnesses from those of the stretches, in powers of ten."""

    @property
    def name(self) -> str:
        """Coils as tables and figures name them, or the number of springs where there are many."""
        many = len(self.active_coils)
        return "-".join(f"{n:g}" for n in self.active_coils) if many <= 12 else f"{many} springs"


@tabular
class Taper:
    """The animal's antenna beside the springs of the robot's."""

    diameters_mm: list[float]
    """Diameters of the animal's segments, base first."""
    proxy: list[float]
    """Stiffness of each segment over that of the base."""
    base_over_tip: float
    """Stiffness of the base over that of the tip."""
    stretches: list[float]
    """Stiffness of the animal in as many stretches as the ladder has springs, over that of the
    first; of each stretch the harmonic mean."""
    stretch_ratio: float
    """Stiffness of the first stretch over that of the last."""
    ladder: Ladder
    """Springs of the antenna."""
    suggested: Ladder
    """Springs that follow the stretches best within the limits of coils."""


@tabular
class Point:
    """The sensor at one bend, without memory and noise."""

    flex_deg: float
    """Flex."""
    resistance_ohm: float = column("R", "kOhm", scale=1e-3)
    """Resistance of the flex sensor."""
    voltage_v: float = column("V", form=".3f")
    """Voltage at the converter."""
    counts: float = column("counts", form=".0f")
    """Reading [counts]."""


@tabular
class Sensor:
    """The flex sensor with its divider and converter."""

    kind: str
    """Kind of flex sensor."""
    polarity: int
    """1 if readings rise with bending, -1 if they fall."""
    curve: list[Point]
    """Static curve, from straight to the largest bend."""
    counts_span: float
    """Change of the reading from straight to the largest bend."""
    loop_width_share: float
    """Gap between loading and unloading at half the bend, over the span of readings."""
    creep_counts: float
    """Drift of the reading under a held bend."""
    noise_sd_counts: float
    """Standard deviation of the noise."""
    divider_ohm: float
    """Fixed resistor in use."""
    best_divider_ohm: float
    """Fixed resistor of series E24 that spreads readings farthest."""
    best_counts_span: float
    """Spread of readings with the best resistor [counts]."""
    clipped: bool
    """Whether a bend lies outside what the converter can tell."""


@tabular
class Swing:
    """One mode: how fast it swings and how soon it stops."""

    natural_hz: float = column("frequency without damping", "Hz", form=".3f")
    swing_hz: float = column("frequency of the swing", "Hz", form=".3f")
    """Frequency of the swing; 0 if the antenna creeps back."""
    damping: float = column("damping ratio", form=".3f")
    """Damping ratio; 1 if the antenna creeps back."""
    cycle_s: float = column("one cycle", "ms", form=".0f", scale=1e3)
    """One cycle of the swing, or of the undamped one if the antenna creeps back."""


@tabular
class Ringdown:
    """The antenna after it is let go, and its modes without the engine."""

    engine: Swing
    """First mode of the ring-down in the engine."""
    chain: Swing
    """First mode by the chain's eigenvalues."""
    rejected: float
    """Share of the tip's deflection that is gone for good after one cycle."""
    rejected_in_animal_cycle: float
    """Share of it that is gone for good after 50 ms, a cockroach's cycle."""
    modes: list[Swing]
    """All modes of the chain with its servo, the slowest first."""
    beside: dict[str, Swing]
    """First modes of the chains of other antennae (`--beside`), by the name of their file; its
    path where two files have the same name."""


@tabular
class Pushed:
    """The antenna at rest under a force on its tip, normal to its last link."""

    tip_mm: float = column("tip aside", "mm", form=".1f")
    """How far the tip is aside."""
    force_n: float = column("force", "mN", form=".1f", scale=1e3)
    """Force."""
    most_bent_deg: float = column("most bent hinge", "deg", form=".1f")
    """Angle of the hinge that is bent most."""
    flex_deg: float = column("flex", "deg", form=".1f")
    """Sum of the angles of the hinges under the flex sensor."""
    counts: float = column("reading", "counts", form=".0f")
    """Reading without memory and noise."""


@tabular
class Bending:
    """What a force on the tip does to the antenna."""

    curve: list[Pushed]
    """Forces from none to `sound_n`, normal to the last link. They turn with it."""
    bearable_n: float | None
    """Largest force at which no hinge turns beyond `angle_deg`; `null` if it exceeds `sound_n`."""
    angle_deg: float
    """Angle that a spring must bear."""
    sound_n: float
    """Largest force at which no wire yields, no hinge is at its stop, and the rest is stable."""
    ends_by: str
    """What the next larger force does: `yield` of a wire, `stop` of a hinge, or `unstable`."""
    ends_at_hinge: int | None
    """Which hinge yields or stops, 1 at the base; `null` if the rest is unstable."""


@tabular
class AntennaResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "antenna"
    seed: int
    """Seed of the sensor's noise."""
    springs: Springs
    """Springs as they are, and as they could be wound."""
    taper: Taper
    """The animal's antenna beside the springs."""
    sensor: Sensor
    """The flex sensor alone."""
    ringdown: Ringdown
    """The antenna after it is let go."""
    bending: Bending
    """The antenna under a force on its tip."""


def overlap(coil: float, distance: float) -> str:
    """A line if coils of an outer diameter overlap at this distance of hinges [mm], else none."""
    if coil <= distance or math.isclose(coil, distance):
        return ""
    return f"\nCoils overlap: they are {coil:.2f} mm wide, hinges are {distance:.2f} mm apart."
