"""The law of torsion springs: from wire and coils to stiffness, and which springs can be wound.

    rate per turn = E d^4 / (10.8 D N)

with Young's modulus E, wire diameter d, mean coil diameter D and N active coils. The rate is a
torque per turn: divide it by 2 pi for a stiffness per radian. Stress at the inside of the coil
is K_i 32 M / (pi d^3), K_i = (4 C^2 - C - 1) / (4 C (C - 1)), C = D / d (Shigley, section 10-12).
A spring bears a million cycles where amplitude a and mean m of that stress satisfy Gerber's
a / S_e + (m / S_ut)^2 < 1 (the same section).

A ladder of springs follows a tapering antenna. Bending stiffness E I of a round section goes with
the fourth power of its diameter, so that the proxy is K = (d / d_1)^4 with d_1 at the base. The
angles of springs in a row add up, each under the same torque: one spring that replaces a stretch of
antenna has the harmonic mean of its stiffnesses.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from antennate import checks
from antennate.errors import ConfigError
from antennate.params.spring import RATE_FACTOR, STOCK_WIRES_MM, WIRES, SpringParams, TaperParams
from antennate.types import Floats

Numbers = float | Floats | Sequence[float]
"""A number, or numbers in an array or a list."""


@overload
def spring_stiffness(modulus: float, wire: float, coil: float, coils: float) -> float: ...


@overload
def spring_stiffness(
    modulus: Numbers, wire: Numbers, coil: Numbers, coils: Numbers
) -> float | Floats: ...


def spring_stiffness(
    modulus: Numbers, wire: Numbers, coil: Numbers, coils: Numbers
) -> float | Floats:
    """Stiffness of torsion springs [N·m/rad].

    E d^4 / (10.8 D N) per turn (Shigley, Mechanical Engineering Design, section 10-12), over 2 pi.

    Each argument is a number or an array; arrays are broadcast against one another.

    Args:
        modulus: Young's modulus of the wire [Pa].
        wire: Wire diameter [m].
        coil: Mean coil diameter [m].
        coils: Number of active coils.

    Returns:
        A float of four numbers, else an array of the common shape.

    Raises:
        ConfigError: One holds no finite numbers above 0, the shapes do not fit together, or a
            stiffness is no such number.
    """
    given = (
        _positive("modulus", modulus, "Pa"),
        _positive("wire", wire, "m"),
        _positive("coil", coil, "m"),
        _positive("coils", coils, ""),
    )
    try:
        with np.errstate(all="ignore"):
            found = _stiffness(*given)
    except ArithmeticError:  # a power that is too large, a product that is 0
        found = math.inf
    except ValueError:
        shapes = ", ".join(str(np.shape(value)) for value in given)
        raise ConfigError(
            f"spring_stiffness: expected shapes that broadcast, found {shapes}"
        ) from None
    return _positive("stiffness of these", found, "N·m/rad")


def _positive(name: str, value: Any, unit: str) -> float | Floats:
    """A finite number above 0, or an array of such."""
    if not isinstance(value, list | tuple) and np.ndim(value) == 0:
        return checks.real(name, value, unit, above=0.0)
    numbers = checks.array(name, value, (), unit)
    if (numbers <= 0.0).any():
        raise ConfigError(
            f"{name}: expected finite numbers above 0{f' [{unit}]' if unit else ''}, found "
            f"{numbers[numbers <= 0.0][0]:g}"
        )
    return numbers


def _stiffness(modulus: Any, wire: Any, coil: Any, coils: Any) -> Any:
    return modulus * wire**4 / (RATE_FACTOR * coil * coils) / (2.0 * math.pi)


def modulus_of(params: SpringParams) -> float:
    """Young's modulus of the wire in use [Pa]."""
    return WIRES[params.wire].modulus if params.modulus_pa is None else params.modulus_pa


def yield_angle(params: SpringParams, wire: float, coil: float, coils: float) -> float:
    """Angle [rad] at which a spring of these diameters [m] begins to yield."""
    limit = WIRES[params.wire].yield_share * _strength(params, wire)
    torque = _stiffness(modulus_of(params), wire, coil, coils)
    return limit / _stress(wire, coil, torque)


def _strength(params: SpringParams, wire: float) -> float:
    """Tensile strength [Pa] of a wire of this diameter [m]."""
    kind = WIRES[params.wire]
    return kind.strength / (1e3 * wire) ** kind.exponent


def _stress(wire: float, coil: float, torque: float) -> float:
    """Bending stress at the inside of the coil [Pa], diameters in m, torque in N·m."""
    index = coil / wire
    factor = (4 * index**2 - index - 1) / (4 * index * (index - 1))
    return factor * 32.0 * torque / (math.pi * wire**3)


@dataclass(frozen=True, slots=True)
class Endurance:
    """What a spring bears of a load that comes back.

    Attributes:
        stress: Largest bending stress [Pa].
        yield_factor: Yield stress over it.
        fatigue_factor: By how much the load may grow until the spring breaks within a million
            cycles, by Gerber's line; NaN where no fatigue data of the wire are known.
    """

    stress: float
    yield_factor: float
    fatigue_factor: float


def endurance(params: SpringParams, low: float, high: float) -> Endurance:
    """What a spring of the wire and coil of `params` bears.

    Shigley, Mechanical Engineering Design, section 10-12: S_r of table 10-10 bounds a stress that
    comes back from 0; S_e = (S_r / 2) / (1 - (S_r / 2 S_ut)^2) follows for a mean of 0.

    Args:
        params: Kind of wire, and its diameters.
        low: Smallest torque of a cycle [N·m], negative where the spring is bent the other way.
        high: Largest torque of a cycle [N·m], at least the size of `low`.
    """
    low, high = checks.real("low", low, "N·m"), checks.real("high", high, "N·m")
    if abs(low) > high:
        raise ConfigError(f"low: expected at most {high:g} N·m in size, found {low:g}")
    wire, coil, kind = 1e-3 * params.wire_mm, 1e-3 * params.coil_mm, WIRES[params.wire]
    strength = _strength(params, wire)
    most, least = (_stress(wire, coil, torque) for torque in (high, low))
    if not most:
        return Endurance(0.0, math.inf, math.inf)
    yields = kind.yield_share * strength / most
    if kind.fatigue_share is None:
        return Endurance(most, yields, math.nan)
    half = kind.fatigue_share / 2
    swing = (most - least) / 2 / (half / (1 - half**2) * strength)
    mean = (most + least) / 2 / strength
    root = math.sqrt(swing**2 + 4 * mean**2)
    return Endurance(most, yields, 2.0 / (swing + root))


@dataclass(frozen=True, slots=True)
class Winding:
    """A set of springs wound of one wire on one mandrel.

    Attributes:
        wire: Wire diameter [m].
        coil: Mean coil diameter [m].
        coils: Active coils of each spring.
        stiffness: The stiffness that each then has [N·m/rad].
        error: Largest relative error of these stiffnesses.
        yield_angle: Smallest angle at which one of them yields [rad].
        length: Longest coil body, closely wound [m].
    """

    wire: float
    coil: float
    coils: tuple[float, ...]
    stiffness: tuple[float, ...]
    error: float
    yield_angle: float
    length: float

    @property
    def index(self) -> float:
        """Spring index, coil over wire diameter."""
        return self.coil / self.wire


def windings(
    params: SpringParams, wanted: tuple[float, ...], coils: tuple[float, ...] | None = None
) -> list[Winding]:
    """Sets of springs from stock wire that come near the wanted stiffnesses [N·m/rad].

    Every stock wire is tried on every mandrel within the index limits, with coils rounded to what
    can be wound. Sets with too few or too many coils, or that yield at the wanted angle, are left
    out.

    Args:
        params: Kind of wire, limits and steps.
        wanted: Stiffness of each spring [N·m/rad], shape (n,).
        coils: Active coils that each has, shape (n,); those nearest to what is wanted if absent.

    Returns:
        Of each wire diameter the set with the smallest error, the smallest error first.
    """
    best: dict[float, Winding] = {}
    for wire, coil in _stock(params):
        found = _wind(params, wire, coil, wanted, coils)
        if found is None or found.yield_angle < math.radians(params.angle_deg):
            continue
        if wire not in best or found.error < best[wire].error:
            best[wire] = found
    return sorted(best.values(), key=lambda winding: (winding.error, winding.wire))


def _stock(params: SpringParams) -> Iterator[tuple[float, float]]:
    """Wire and mean coil diameters [m] that can be had."""
    kind, step = WIRES[params.wire], 1e-3 * params.mandrel_step_mm
    low, high = params.index_limits
    for wire in (1e-3 * mm for mm in STOCK_WIRES_MM):
        if not kind.thinnest <= wire * (1 + 1e-9) <= kind.thickest * (1 + 2e-9):
            continue
        first = math.ceil((low - 1) * wire / step - 1e-9)
        for n in itertools.count(max(first, 1)):
            coil = n * step + wire
            if coil > high * wire * (1 + 1e-9):
                break
            yield wire, coil


def _wind(
    params: SpringParams,
    wire: float,
    coil: float,
    wanted: tuple[float, ...],
    given: tuple[float, ...] | None,
) -> Winding | None:
    modulus, step = modulus_of(params), params.coil_step
    one = _stiffness(modulus, wire, coil, 1.0)
    coils = given or tuple(max(1, round(one / k / step)) * step for k in wanted)
    low, high = params.coil_limits
    if min(coils) < low or max(coils) > high:
        return None
    got = tuple(one / n for n in coils)
    return Winding(
        wire=wire,
        coil=coil,
        coils=coils,
        stiffness=got,
        error=max(abs(g / k - 1) for g, k in zip(got, wanted, strict=True)),
        yield_angle=min(yield_angle(params, wire, coil, n) for n in coils),
        length=(max(coils) + 1) * wire,
    )


def diameters(params: TaperParams) -> Floats:
    """Diameters base to tip [m], as measured or by the law, shape (segments,)."""
    if params.diameters_mm is not None:
        return 1e-3 * np.array(params.diameters_mm)
    ends, count = (1e-3 * params.base_mm, 1e-3 * params.tip_mm), params.segments
    return np.geomspace(*ends, count) if params.law == "geometric" else np.linspace(*ends, count)


def proxy(diameter: Floats) -> Floats:
    """Stiffness over that of the base, (d / d_1)^4, shape (n,)."""
    return (diameter / diameter[0]) ** 4


def binned(values: Floats, bins: int) -> Floats:
    """Harmonic means of equal stretches of a row of segments, shape (bins,).

    Args:
        values: Stiffness of each segment, shape (n,); a segment that lies in two stretches counts
            for each by its share.
        bins: Number of stretches.
    """
    edges = np.linspace(0.0, len(values), bins + 1)
    give = np.concatenate([[0.0], np.cumsum(1.0 / values)])
    return len(values) / bins / np.diff(np.interp(edges, np.arange(len(values) + 1), give))


def ladder_proxy(coils: Floats) -> Floats:
    """Stiffness of a ladder of springs over that of its first, shape (n,)."""
    return coils[0] / coils


def distance_decades(first: Floats, second: Floats) -> float:
    """Root mean square of the difference of two proxies in powers of ten."""
    return float(np.sqrt(np.mean(np.log10(first / second) ** 2)))


def follow(wanted: Floats, fewest: int, most: int) -> Floats:
    """Whole coil counts whose ladder follows a proxy best, within limits, shape of `wanted`.

    The base takes every count in turn; each further spring then takes the count that comes nearest
    in proportion. Of these ladders the one nearest in decades wins, of equals the shortest.
    """
    ladders = []
    for base in range(fewest, most + 1):
        exact = np.clip(base / wanted * wanted[0], fewest, most)
        below, above = np.floor(exact), np.minimum(np.ceil(exact), most)
        ladders.append(np.where(exact / below <= above / exact, below, above))
    aim = wanted / wanted[0]
    return min(ladders, key=lambda coils: distance_decades(ladder_proxy(coils), aim))
