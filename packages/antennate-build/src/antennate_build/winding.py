"""Springs of an antenna from stock wire, and what they need around them. Lengths are in mm here.

Both legs of a spring lie along the links that it joins, so it has a whole number of turns. The
specification's own counts are kept where a stock wire on some mandrel gives their stiffness; else
the nearest whole counts are taken.

A torsion spring that is wound up by an angle, `turn` as a share of a full turn, becomes narrower
and longer, and unwound it becomes wider (Shigley, Mechanical Engineering Design, section 10-12):

    D' = D N / (N + turn),   length = d (N + 1 + turn)

The arbor within it is at most 90 % of the inner diameter that is left then (makers' rule:
springipedia.com, torsion springs, general design).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from antennate.antenna.springs import Winding, spring_stiffness, windings, yield_angle
from antennate.antenna.springs import modulus_of as modulus
from antennate.errors import ConfigError
from antennate.params.base import number
from antennate.params.spring import SpringParams
from antennate.robots.antenna import N_MM_PER_DEG, AntennaSpec

ARBOR_SHARE = 0.9
"""Arbor over the inner diameter of the spring at its largest deflection, at most."""
STEEL_DENSITY = 7.9e-3
"""Of spring steel [g/mm³]: 7.85 of music wire, 7.9 of stainless 302 (EN 10270-1 and -3)."""
LARGEST_ERROR = 0.10
"""Error of a stiffness from which on a spring is another one: makers hold 5 to 10 % (DIN 2194)."""
_SPARE_ERROR = 0.02
"""Error that is as good as none beside that."""
THINNEST_PIN = 2.0
"""Diameter of the thinnest pin that is printed [mm] (assumed: five lines of 0.4 mm)."""
LEG_ROOM = 0.6
"""What a leg leaves to the middle of its link, from where the leg of the next spring comes [mm]."""
LONGEST_LEG = 7.0
"""Length of a leg if its links have room [mm] (assumed: 14 times the wire of the default)."""


class WireParams(SpringParams):
    """Wire, mandrels and limits for springs whose legs lie in line."""

    unread: ClassVar[tuple[str, ...]] = ("wire_mm", "coil_mm", "wanted_n_mm_per_deg")
    wire: Literal["stainless_302", "music_wire", "hard_drawn", "phosphor_bronze"] = number(
        "music_wire", "1", "assumed: shops for models have it, and it yields last; oil it"
    )
    """Kind of wire."""
    stop_share: float = number(
        0.95, "1", "assumed: play of legs and stops; softer plastic needs less", ge=0.3, le=10
    )
    """Where stops stand at most: the angle of their hinge over that at which its spring yields."""
    coil_step: float = number(1.0, "1", "assumed: both legs lie along their links", ge=1, le=1)
    """Step of active coils."""


@dataclass(frozen=True)
class Spring:
    """One torsion spring, right-hand wound, with legs that point away from each other.

    Attributes:
        turns: Turns of its body, all active.
        wire: Wire diameter [mm].
        coil: Mean coil diameter [mm].
        leg: Length of each leg from the coil on [mm].
        stiffness: Torque over angle with legs gripped from the coil on [N·m/rad].
        wanted: That of the specification [N·m/rad].
        yields: Angle at which the wire begins to yield [rad].
        stop: Largest angle of its hinge [rad].
    """

    turns: float
    wire: float
    coil: float
    leg: float
    stiffness: float
    wanted: float
    yields: float
    stop: float

    @property
    def item(self) -> str:
        """Its name in the bill and in the assembly."""
        return f"torsion spring of {self.turns:g} turns"

    @property
    def error(self) -> float:
        """What rounding to stock costs: stiffness over the wanted one, less 1."""
        return self.stiffness / self.wanted - 1.0

    @property
    def leg_turns(self) -> float:
        """Active turns that legs add which bear at their ends alone (Shigley, section 10-12)."""
        return 2.0 * self.leg / (3.0 * math.pi * self.coil)

    @property
    def loose_stiffness(self) -> float:
        """Torque over angle if both legs bear at their ends alone [N·m/rad]."""
        return self.stiffness * self.turns / (self.turns + self.leg_turns)

    @property
    def inner(self) -> float:
        """Inner diameter at rest [mm]: that of the coils on a mandrel after springback."""
        return self.coil - self.wire

    @property
    def narrowest(self) -> float:
        """Inner diameter wound up to the stop [mm]."""
        return self.coil * self.turns / (self.turns + self.stop / math.tau) - self.wire

    @property
    def widest(self) -> float:
        """Outer diameter unwound to the stop [mm]."""
        return self.coil * self.turns / (self.turns - self.stop / math.tau) + self.wire

    @property
    def body(self) -> float:
        """Length of its closely wound body at rest [mm]."""
        return self.wire * (self.turns + 1.0)

    @property
    def longest(self) -> float:
        """Length of its body wound up to the stop [mm]."""
        return self.wire * (self.turns + 1.0 + self.stop / math.tau)

    @property
    def wire_length(self) -> float:
        """Wire that it takes [mm]."""
        return math.pi * self.coil * self.turns + 2.0 * self.leg

    @property
    def mass(self) -> float:
        """Mass [g]."""
        return STEEL_DENSITY * math.pi * self.wire**2 / 4.0 * self.wire_length


def springs_of(antenna: AntennaSpec, params: WireParams | None = None) -> tuple[Spring, ...]:
    """The springs of an antenna, base to tip, all of one wire and one mandrel.

    Args:
        antenna: The antenna.
        params: Kind of wire, limits and steps.

    Raises:
        ConfigError: No stock wire gives these stiffnesses within the limits.
    """
    params = params or WireParams()
    wanted = antenna.spring_stiffness()
    whole = all(float(n).is_integer() for n in antenna.active_coils)
    found = windings(params, wanted, antenna.active_coils) if whole else []
    if not found or found[0].error > _SPARE_ERROR:
        found = sorted([*found, *windings(params, wanted)], key=lambda each: each.error)
    found = [each for each in found if _can_be_used(each, antenna.range)]
    if not found:
        raise ConfigError(_none(antenna, params, wanted))
    best = _best(found, antenna)
    leg = min(LONGEST_LEG, 500.0 * antenna.link_length - LEG_ROOM)
    return tuple(
        Spring(
            turns=turns,
            wire=1e3 * best.wire,
            coil=1e3 * best.coil,
            leg=leg,
            stiffness=float(spring_stiffness(modulus(params), best.wire, best.coil, turns)),
            wanted=k,
            yields=(yields := yield_angle(params, best.wire, best.coil, turns)),
            stop=min(most, params.stop_share * yields),
        )
        for turns, k, most in zip(best.coils, wanted, antenna.hinge_ranges, strict=True)
    )


def _can_be_used(winding: Winding, stop: float) -> bool:
    """Whether it is near enough, and leaves room for a pin when it is wound up to the stop."""
    fewest, turn = min(winding.coils), stop / math.tau
    left = winding.coil * fewest / (fewest + turn) - winding.wire
    return (
        winding.error <= LARGEST_ERROR and fewest > turn and 1e3 * ARBOR_SHARE * left > THINNEST_PIN
    )


def _best(found: list[Winding], antenna: AntennaSpec) -> Winding:
    """Of the sets that are near enough and fit into the antenna's radius the last to yield."""
    within = [each for each in found if each.coil + each.wire <= 2.0 * antenna.radius]
    choice = within or [min(found, key=lambda each: each.coil)]
    limit = max(_SPARE_ERROR, min(each.error for each in choice))
    return max((c for c in choice if c.error <= limit), key=lambda each: each.yield_angle)


def _none(antenna: AntennaSpec, params: WireParams, wanted: tuple[float, ...]) -> str:
    stiffness = ", ".join(f"{k / N_MM_PER_DEG:.3g}" for k in dict.fromkeys(wanted))
    index, coils = params.index_limits, params.coil_limits
    return (
        f"antenna.active_coils: expected springs that stock {params.wire} gives with a spring "
        f"index of {index[0]:g} to {index[1]:g}, {coils[0]:g} to {coils[1]:g} turns and "
        f"{params.angle_deg:g} deg without yielding, found none for {stiffness} N·mm/deg "
        f"(coils {', '.join(f'{n:g}' for n in antenna.active_coils)})"
    )


def set_of(springs: tuple[Spring, ...]) -> dict[Spring, int]:
    """Different springs with how many of each, stiff ones first."""
    counts: dict[Spring, int] = {}
    for spring in springs:
        plain = replace(spring, wanted=round(spring.wanted, 9))
        counts[plain] = counts.get(plain, 0) + 1
    return counts
