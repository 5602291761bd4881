"""What a ring-down comes to: modes in the engine and of chains, a cone, and what animals do."""

from __future__ import annotations

from dataclasses import field
from typing import Any, Self

from antennate.antenna.dynamics import Mode, least_damping
from antennate.studies.columns import Ends, column, percent, tabular

REJECTED = 0.9
"""Share of a deflection that a cockroach's antenna has lost after one cycle (Mongeau 2014)."""
ANIMAL_CYCLE = 0.05
"""How long that cycle takes [s]; same source."""


@tabular
class Animal:
    """An animal's antenna or whisker, as others measured it."""

    name: str
    """Name of the animal and its organ."""
    source: str
    """Publication."""
    natural_hz: Ends | None = column("frequency", "Hz", form=".0f")
    """Lowest and highest frequency; `null` where no number was published."""
    damping: Ends | None = column("damping ratio")
    """Lowest and highest damping ratio; `null` where no number was published."""
    finding: str
    """What was found, in words."""


ANIMALS = (
    Animal(
        name="rat whisker",
        source="Hartmann 2003, PMC6740620",
        natural_hz=(27.0, 260.0),
        damping=(0.11, 0.17),
        finding="first mode, the faster the shorter",
    ),
    Animal(
        name="cockroach antenna",
        source="Mongeau 2014, J. Exp. Biol. 217:3333",
        natural_hz=(1 / ANIMAL_CYCLE, 1 / ANIMAL_CYCLE),
        damping=(least_damping(1 - REJECTED), 1.0),
        finding="over 90 % rejected in the first cycle of about 50 ms; so damping is .34 or more",
    ),
    Animal(
        name="cricket antenna",
        source="J. Exp. Biol. 228(9), jeb249243",
        natural_hz=(11.0, 30.0),
        damping=(1.0, 1.0),
        finding="about 11 Hz bent, resonance at 30 Hz, near critical damping",
    ),
    Animal(
        name="stick insect antenna",
        source="rian.ie/94390",
        natural_hz=None,
        damping=None,
        finding="does not swing; slower at the base",
    ),
)
"""Facts of other people's measurements, from their abstracts."""


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

    @classmethod
    def of(cls, mode: Mode, **more: Any) -> Self:
        """A mode, with what else is known of it."""
        return cls(
            natural_hz=mode.natural_hz,
            swing_hz=mode.swing_hz,
            damping=mode.damping,
            cycle_s=mode.cycle,
            **more,
        )


@tabular
class EngineSwing(Swing):
    """The first mode of the ring-down in the physics engine."""

    rejected: float = percent("rejected in the first cycle", form=".1f")
    """Share of the tip's deflection that is gone for good after one cycle."""


@tabular
class OtherSwing(Swing):
    """The first mode of the chain of another antenna."""

    name: str
    """Name of its file."""


@tabular
class Difference:
    """Engine over chain, minus 1."""

    natural_hz: float = column(unit="1")
    """Frequency without damping."""
    damping: float
    """Damping ratio."""


@tabular
class Cone:
    """A chain of hinges in place of a cone."""

    hinges: int
    """Hinges of the chain."""
    ratio: float = column("over the closed form", form=".4f")
    """First frequency of the chain over that of the cone."""


@tabular
class RingdownResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "ringdown"
    engine: EngineSwing
    """First mode of the ring-down in the engine."""
    chain: Swing
    """First mode by the chain's eigenvalues."""
    difference: Difference
    """Deviation of the engine from the chain."""
    rejected_in_animal_cycle: float
    """Share of the tip's deflection that is gone for good after 50 ms, a cockroach's cycle."""
    animal_damping: float
    """Damping ratio at which 90 % is gone after one cycle."""
    modes: list[Swing]
    """All modes of the chain with its servo, the slowest first."""
    beside: list[OtherSwing] = field(default_factory=list)
    """First modes of the chains of other antennae (`--beside`)."""
    cones: list[Cone]
    """Chains of more and more hinges, each for the same cone."""
    animals: list[Animal]
    """Animals to compare with."""
