"""The springs of an antenna: what they are, and how others would be wound."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from antennate import figures as style
from antennate.antenna import springs
from antennate.antenna.springs import Winding
from antennate.errors import ConfigError
from antennate.params.spring import SpringParams
from antennate.robots.antenna import N_MM_PER_DEG
from antennate.studies.columns import column, percent, tabular
from antennate.studies.experiment import Done, Experiment
from antennate.studies.tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER_TABLE = {3.0: 0.274, 6.0: 0.137, 9.0: 0.091}
"""Stiffness by active coils as printed in the paper [N·mm/deg]."""
PAPER_DIGITS = 3
"""Decimals of that table."""
_TABLED, _DRAWN = 6, 5
"""Sets of springs in the table, and in the figure."""


@tabular
class Spring:
    """A spring of the wire and the coil as they are."""

    active_coils: float
    """Active coils."""
    stiffness_n_mm_per_deg: float = column("stiffness", "N·mm/deg", form=".4f")
    """Torque over angle."""
    paper_n_mm_per_deg: float | None = column("  the paper prints", form=".3f")
    """Stiffness that the paper prints for so many coils; `null` if it prints none."""
    paper_exact_n_mm_per_deg: float | None
    """Stiffness by the paper's entry of three coils, not rounded; `null` where it prints none."""
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
    coil_mm: float
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
class SpringsResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "springs"
    wire: str
    """Kind of wire."""
    modulus_pa: float
    """Young's modulus of the wire."""
    wire_mm: float
    """Diameter of the wire."""
    coil_mm: float
    """Mean diameter of the coils."""
    spring_index: float
    """Mean diameter of the coils over that of the wire."""
    springs: list[Spring]
    """Springs, one for each count of active coils."""
    wanted_n_mm_per_deg: list[float]
    """Stiffnesses that new sets are wound for."""
    windings: list[WoundSet]
    """Sets that could be wound, the best of each stock wire, the smallest error first."""


def run(config: SpringParams) -> Done:
    """Work out the springs as they are, and sets that could be wound.

    Raises:
        ConfigError: The spring index lies outside its limits, where the law does not hold, or
            limits are the wrong way round.
    """
    for name in ("index_limits", "coil_limits"):
        low, high = getattr(config, name)
        if low >= high:
            raise ConfigError(f"{name}: expected the smaller first, found {low:g} and {high:g}")
    wire, (low, high) = config.wire_mm, config.index_limits
    if not low * (1 - 1e-9) <= config.coil_mm / wire <= high * (1 + 1e-9):
        raise ConfigError(
            f"coil_mm: expected {low:g} to {high:g} wire diameters of {wire:g} mm, "
            f"{low * wire:.3g} to {high * wire:.3g} mm, found {config.coil_mm:g}"
        )
    wanted = tuple(k * N_MM_PER_DEG for k in config.wanted_n_mm_per_deg)
    result = SpringsResult(
        wire=config.wire,
        modulus_pa=springs.modulus_of(config),
        wire_mm=wire,
        coil_mm=config.coil_mm,
        spring_index=(1e-3 * config.coil_mm) / (1e-3 * wire),
        springs=[_spring(config, coils) for coils in config.active_coils],
        wanted_n_mm_per_deg=list(config.wanted_n_mm_per_deg),
        windings=[_wound(winding) for winding in springs.windings(config, wanted)],
    )
    return Done(rows=(), found=result)


def _spring(config: SpringParams, coils: float) -> Spring:
    wire, coil = 1e-3 * config.wire_mm, 1e-3 * config.coil_mm
    k = springs.spring_stiffness(springs.modulus_of(config), wire, coil, coils)
    printed = PAPER_TABLE.get(coils)
    return Spring(
        active_coils=coils,
        stiffness_n_mm_per_deg=k / N_MM_PER_DEG,
        stiffness_n_m_per_rad=k,
        paper_n_mm_per_deg=printed,
        paper_exact_n_mm_per_deg=None if printed is None else 3 * PAPER_TABLE[3.0] / coils,
        angle_deg=config.angle_deg,
        torque_at_angle_n_mm=1e3 * k * math.radians(config.angle_deg),
        yield_angle_deg=math.degrees(springs.yield_angle(config, wire, coil, coils)),
    )


def _wound(winding: Winding) -> WoundSet:
    return WoundSet(
        wire_mm=1e3 * winding.wire,
        coil_mm=1e3 * winding.coil,
        mandrel_mm=1e3 * (winding.coil - winding.wire),
        spring_index=winding.index,
        active_coils=list(winding.coils),
        stiffness_n_mm_per_deg=[k / N_MM_PER_DEG for k in winding.stiffness],
        largest_error=winding.error,
        yield_angle_deg=math.degrees(winding.yield_angle),
        body_length_mm=1e3 * winding.length,
    )


def tables(result: SpringsResult) -> Sequence[Table]:
    """The springs, and the sets that could be wound."""
    wire = f"{result.wire}, wire {result.wire_mm:g} mm, coil {result.coil_mm:g} mm"
    asked = Table.of(
        "Springs",
        {f"{spring.active_coils:g} coils": spring for spring in result.springs},
        note=f"{wire}, index {result.spring_index:.1f}, E {result.modulus_pa / 1e9:g} GPa.\n"
        f"{_rounding(result.springs)}",
    )
    wound = Table.of(
        "Sets to wind",
        {f"{each.wire_mm:.2f} mm": each for each in result.windings[:_TABLED]},
        note="The best mandrel of each stock wire, nearest first.\n" if result.windings else "",
    )
    return asked, wound


def _rounding(found: Sequence[Spring]) -> str:
    """Where the paper's table is rounded."""
    rounded = [
        f"{spring.active_coils:g} coils {exact:.4f}, printed {printed:.{PAPER_DIGITS}f}"
        for spring in found
        if (exact := spring.paper_exact_n_mm_per_deg) is not None
        and (printed := spring.paper_n_mm_per_deg) is not None
        and abs(exact - printed) > 1e-9
    ]
    law = "Stiffness goes with 1 / coils"
    return f"{law}; the paper rounds: {'; '.join(rounded)} N·mm/deg.\n" if rounded else f"{law}.\n"


def sentence(result: SpringsResult) -> str:
    """How near the wanted stiffnesses can be wound."""
    wanted = ", ".join(f"{k:g}" for k in result.wanted_n_mm_per_deg)
    if not result.windings:
        return f"No stock wire gives {wanted} N·mm/deg within the limits."
    best = result.windings[0]
    return (
        f"Wire of {best.wire_mm:.2f} mm on a mandrel of {best.mandrel_mm:.1f} mm comes "
        f"within {100 * best.largest_error:.1f} % of {wanted} N·mm/deg; computed, not measured."
    )


@style.styled
def figures(outcome: Done) -> dict[str, Figure]:
    """Torque of each spring up to its yield, and the errors of what could be wound instead."""
    figure = style.canvas(style.WIDTH, 7.4)
    torque, wound = figure.subplots(2, 1)
    _draw_torque(torque, outcome.found)
    _draw_windings(wound, outcome.found)
    return {"springs": figure}


def _draw_torque(panel: Axes, result: SpringsResult) -> None:
    found = result.springs
    end = 1.15 * min(360.0, max(spring.yield_angle_deg for spring in found))
    for spring, colour in zip(found, style.series(len(found)), strict=True):
        k, limit = spring.stiffness_n_mm_per_deg, spring.yield_angle_deg
        angle, label = np.array([0.0, min(limit, end)]), f"{spring.active_coils:g} coils, {k:.3f}"
        panel.plot(angle, k * angle, color=colour, label=label)
        if limit <= end:
            panel.plot(limit, k * limit, color=colour, marker="x", markersize=7)
    panel.set(
        xlabel="angle [deg]",
        ylabel="torque [N·mm]",
        title=f"{result.wire}, wire {result.wire_mm:g} mm, \ncoil {result.coil_mm:g} mm; × yields",
    )
    panel.set_xlim(0, end)
    panel.set_ylim(0)
    panel.legend(title="stiffness [N·mm/deg]", loc="lower right")


def _draw_windings(panel: Axes, result: SpringsResult) -> None:
    wanted = np.array(result.wanted_n_mm_per_deg)
    drawn = result.windings[:_DRAWN]
    places = np.arange(len(wanted))
    for i, (each, colour) in enumerate(zip(drawn, style.series(len(drawn)), strict=True)):
        error = 100 * (np.array(each.stiffness_n_mm_per_deg) / wanted - 1)
        panel.plot(
            places + 0.08 * (i - (len(drawn) - 1) / 2),
            error,
            color=colour,
            marker="o",
            linestyle="",
            label=f"wire {each.wire_mm:.2f}, mandrel {each.mandrel_mm:.1f} mm",
        )
    panel.axhline(0.0, color=style.MUTED, linewidth=0.8)
    panel.set_xticks(places, [f"{k:g}" for k in wanted])
    panel.set(
        xlabel="wanted stiffness [N·mm/deg]",
        ylabel="error of what can be wound [%]",
        title="Nearest sets from stock wire",
    )
    panel.set_xlim(-0.5, len(wanted) - 0.5)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.75 * (high - low))
    if drawn:
        panel.legend(loc="upper left", fontsize=8)


EXPERIMENT = Experiment.of_folder(
    __name__,
    SpringParams,
    lambda config, *_: run(config),
    tables,
    sentence,
    result=SpringsResult,
    figures=figures,
    captions={
        "springs": "Torque of each spring up to its yield, and the errors of what could "
        "be wound in its place.",
    },
    workers="none",
)
