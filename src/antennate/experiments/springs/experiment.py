"""The springs of an antenna: what they are, and how others would be wound."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna import springs
from antennate.antenna.springs import Winding
from antennate.errors import ConfigError
from antennate.params.spring import SpringParams
from antennate.robots.antenna import N_MM_PER_DEG
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.measures import Measure, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER_TABLE = {3.0: 0.274, 6.0: 0.137, 9.0: 0.091}
"""Stiffness by active coils as printed in the paper [N·mm/deg]."""
PAPER_DIGITS = 3
"""Decimals of that table."""


@dataclass(frozen=True)
class SpringsOutcome(Outcome):
    """The springs as they are, and sets that could be wound.

    Attributes:
        windings: The best set of each stock wire, the smallest error first.
    """

    config: SpringParams
    windings: list[Winding]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        return {
            "schema": 1,
            "command": "springs",
            "wire": config.wire,
            "modulus_pa": springs.modulus_of(config),
            "wire_mm": config.wire_mm,
            "coil_mm": config.coil_mm,
            "spring_index": (1e-3 * config.coil_mm) / (1e-3 * config.wire_mm),
            "springs": [self._spring(coils) for coils in config.active_coils],
            "wanted_n_mm_per_deg": list(config.wanted_n_mm_per_deg),
            "windings": [_winding(winding) for winding in self.windings],
        }

    def _spring(self, coils: float) -> dict[str, Any]:
        config = self.config
        wire, coil = 1e-3 * config.wire_mm, 1e-3 * config.coil_mm
        k = springs.spring_stiffness(springs.modulus_of(config), wire, coil, coils)
        printed = PAPER_TABLE.get(coils)
        return {
            "active_coils": coils,
            "stiffness_n_mm_per_deg": k / N_MM_PER_DEG,
            "stiffness_n_m_per_rad": k,
            "paper_n_mm_per_deg": printed,
            "paper_exact_n_mm_per_deg": None if printed is None else 3 * PAPER_TABLE[3.0] / coils,
            "angle_deg": config.angle_deg,
            "torque_at_angle_n_mm": 1e3 * k * math.radians(config.angle_deg),
            "yield_angle_deg": math.degrees(springs.yield_angle(config, wire, coil, coils)),
        }


def _winding(winding: Winding) -> dict[str, Any]:
    return {
        "wire_mm": 1e3 * winding.wire,
        "coil_mm": 1e3 * winding.coil,
        "mandrel_mm": 1e3 * (winding.coil - winding.wire),
        "spring_index": winding.index,
        "active_coils": list(winding.coils),
        "stiffness_n_mm_per_deg": [k / N_MM_PER_DEG for k in winding.stiffness],
        "largest_error": winding.error,
        "yield_angle_deg": math.degrees(winding.yield_angle),
        "body_length_mm": 1e3 * winding.length,
    }


def run(config: SpringParams) -> SpringsOutcome:
    """Work out the springs.

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
    return SpringsOutcome(config, springs.windings(config, wanted))


_TABLED, _DRAWN = 6, 5
"""Sets of springs in the table, and in the figure."""

SPRING = (
    Measure("stiffness_n_mm_per_deg", "stiffness", "N·mm/deg", form=".4f"),
    Measure("paper_n_mm_per_deg", "  the paper prints", form=".3f"),
    Measure("stiffness_n_m_per_rad", "stiffness", "N·m/rad", form=".5f"),
    Measure("angle_deg", "angle to bear", "deg", form="g"),
    Measure("torque_at_angle_n_mm", "  torque at it", "N·mm"),
    Measure("yield_angle_deg", "yields at", "deg", form=".0f"),
)
WINDING = (
    Measure("mandrel_mm", "mandrel", "mm", form=".1f"),
    Measure("spring_index", "spring index", form=".1f"),
    Measure("coils", "active coils"),
    Measure("largest_error", "largest error", "%", form=".1f", scale=100.0),
    Measure("yield_angle_deg", "yields at", "deg", form=".0f"),
    Measure("body_length_mm", "longest body", "mm", form=".1f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The springs, and the sets that could be wound."""
    wire = f"{result['wire']}, wire {result['wire_mm']:g} mm, coil {result['coil_mm']:g} mm"
    asked = Table.of(
        "Springs",
        {f"{row['active_coils']:g} coils": row for row in result["springs"]},
        SPRING,
        f"{wire}, index {result['spring_index']:.1f}, E {result['modulus_pa'] / 1e9:g} GPa.\n"
        f"{_rounding(result)}",
    )
    wound = Table.of(
        "Sets to wind",
        {
            f"{row['wire_mm']:.2f} mm": {
                **row,
                "coils": " ".join(f"{n:g}" for n in row["active_coils"]),
            }
            for row in result["windings"][:_TABLED]
        },
        WINDING if result["windings"] else (),
        "The best mandrel of each stock wire, nearest first.\n" if result["windings"] else "",
    )
    return asked, wound


def _rounding(result: Mapping[str, Any]) -> str:
    """Where the paper's table is rounded."""
    rounded = [
        f"{row['active_coils']:g} coils {row['paper_exact_n_mm_per_deg']:.4f}, printed "
        f"{row['paper_n_mm_per_deg']:.{PAPER_DIGITS}f}"
        for row in result["springs"]
        if row["paper_n_mm_per_deg"] is not None
        and abs(row["paper_exact_n_mm_per_deg"] - row["paper_n_mm_per_deg"]) > 1e-9
    ]
    exact = "Stiffness goes with 1 / coils"
    return (
        f"{exact}; the paper rounds: {'; '.join(rounded)} N·mm/deg.\n" if rounded else f"{exact}.\n"
    )


def sentence(result: Mapping[str, Any]) -> str:
    """How near the wanted stiffnesses can be wound."""
    wanted = ", ".join(f"{k:g}" for k in result["wanted_n_mm_per_deg"])
    if not result["windings"]:
        return f"No stock wire gives {wanted} N·mm/deg within the limits."
    best = result["windings"][0]
    return (
        f"Wire of {best['wire_mm']:.2f} mm on a mandrel of {best['mandrel_mm']:.1f} mm comes "
        f"within {100 * best['largest_error']:.1f} % of {wanted} N·mm/deg; computed, not measured."
    )


@style.styled
def figures(outcome: SpringsOutcome) -> dict[str, Figure]:
    """Torque of each spring up to its yield, and the errors of what could be wound instead."""
    figure, result = style.canvas(style.WIDTH, 7.4), outcome.result()
    torque, wound = figure.subplots(2, 1)
    _draw_torque(torque, result)
    _draw_windings(wound, result)
    return {"springs": figure}


def _draw_torque(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = result["springs"]
    end = 1.15 * min(360.0, max(row["yield_angle_deg"] for row in rows))
    for row, colour in zip(rows, style.series(len(rows)), strict=True):
        k, limit = row["stiffness_n_mm_per_deg"], row["yield_angle_deg"]
        angle = np.array([0.0, min(limit, end)])
        panel.plot(angle, k * angle, color=colour, label=f"{row['active_coils']:g} coils, {k:.3f}")
        if limit <= end:
            panel.plot(limit, k * limit, color=colour, marker="x", markersize=7)
    panel.set(
        xlabel="angle [deg]",
        ylabel="torque [N·mm]",
        title=f"{result['wire']}, wire {result['wire_mm']:g} mm, \ncoil {result['coil_mm']:g} mm; "
        "× yields",
    )
    panel.set_xlim(0, end)
    panel.set_ylim(0)
    panel.legend(title="stiffness [N·mm/deg]", loc="lower right")


def _draw_windings(panel: Axes, result: Mapping[str, Any]) -> None:
    wanted = np.array(result["wanted_n_mm_per_deg"])
    shown = result["windings"][:_DRAWN]
    places = np.arange(len(wanted))
    for i, (row, colour) in enumerate(zip(shown, style.series(len(shown)), strict=True)):
        error = 100 * (np.array(row["stiffness_n_mm_per_deg"]) / wanted - 1)
        panel.plot(
            places + 0.08 * (i - (len(shown) - 1) / 2),
            error,
            color=colour,
            marker="o",
            linestyle="",
            label=f"wire {row['wire_mm']:.2f}, mandrel {row['mandrel_mm']:.1f} mm",
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
    if shown:
        panel.legend(loc="upper left", fontsize=8)


EXPERIMENT = Experiment.of_folder(
    *(__name__, SpringParams, lambda config, *_: run(config), tables, sentence),
    figures=figures,
    captions={
        "springs": "Torque of each spring up to its yield, and the errors of what could "
        "be wound in its place.",
    },
    explained="docs/results.md",
    on_workers=False,
)
