"""The figures of an antenna: drawing, springs, taper, sensor, bending, ring-down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna.dynamics import least_damping
from antennate.experiments.antenna.drawing import drawing
from antennate.experiments.antenna.physics import ANIMAL_CYCLE, Readings, Trace
from antennate.experiments.antenna.result import Bending, Point, Ringdown, Sensor, Springs, Taper
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from antennate.experiments.antenna.experiment import AntennaOutcome

_ANIMALS = (
    ("rat", (27.0, 260.0), (0.11, 0.17)),
    ("cockroach", (1 / ANIMAL_CYCLE, 1 / ANIMAL_CYCLE), (least_damping(0.1), 1.0)),
    ("cricket", (11.0, 30.0), (1.0, 1.0)),
)
"""Range of frequencies [Hz] and of damping ratios; sources in docs/science/dynamics.md."""
_ANIMAL, _STRETCHES = style.INK, style.MUTED
_LADDER, _SUGGESTED = style.PROFILE_LOOKS["descending"][0], "#56B4E9"
"""The ladder is that of the descending profile, unless told otherwise; no profile has the other."""


@style.styled
def figures(outcome: AntennaOutcome) -> dict[str, Figure]:
    """Figures by their names: the drawing first."""
    found = outcome.found
    return {
        "drawing": drawing(outcome.config),
        "bending": _of_bending(found.bending),
        "springs": _of_springs(found.springs),
        "taper": _of_taper(found.taper),
        "sensor": _of_sensor(found.sensor, outcome.readings),
        "ringdown": _of_ringdown(found.ringdown, outcome.trace),
    }


def _of_bending(found: Bending) -> Figure:
    """Force and reading over the tip's deflection, up to the last force that is borne."""
    figure = style.canvas(style.WIDTH, 4.6)
    panels = figure.subplots(2, 1, sharex=True)
    colours = style.series(2)
    tip = [push.tip_mm for push in found.curve]
    forces = [push.force_n for push in found.curve]
    for panel, name, scale, label, colour in (
        (panels[0], "force_n", 1e3, "force [mN]", colours[0]),
        (panels[1], "counts", 1.0, "reading [counts]", colours[1]),
    ):
        values = [scale * getattr(push, name) for push in found.curve]
        panel.plot(tip, values, color=colour)
        panel.set(ylabel=label)
        if found.bearable_n:
            at = [np.interp(found.bearable_n, forces, line) for line in (tip, values)]
            panel.plot(*at, color=style.INK, marker="o", linestyle="")
    title = f"Up to {1e3 * found.sound_n:.0f} mN, beyond: {found.ends_by}"
    if found.bearable_n:
        title += f"\ndot: {1e3 * found.bearable_n:.0f} mN turn a hinge by {found.angle_deg:g} deg"
    panels[0].set_title(title)
    panels[1].set(xlabel="tip aside [mm]", xlim=(0, None))
    return figure


def _of_springs(of: Springs) -> Figure:
    """Torque of each spring up to its yield."""
    figure = style.canvas(style.WIDTH, 3.8)
    panel = figure.subplots()
    found = of.springs
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
        title=f"Springs of index {of.spring_index:.1f}; × yields",
    )
    panel.set_xlim(0, end)
    panel.set_ylim(0)
    panel.legend(title="stiffness [N·mm/deg]", loc="lower right")
    return figure


def _of_taper(found: Taper) -> Figure:
    """The proxy of the animal, its stretches, the ladder, and the ladder that follows it best."""
    figure = style.canvas(style.WIDTH, 3.8)
    panel = figure.subplots()
    segments = np.array(found.proxy)
    places = (np.arange(len(segments)) + 0.5) / len(segments)
    panel.plot(
        places,
        segments,
        color=_ANIMAL,
        marker="o",
        markersize=4,
        label=f"animal, {len(segments)} segments: {found.base_over_tip:.0f} : 1",
    )
    _steps(panel, found.stretches, _STRETCHES, (0, (2, 1.5)), "animal, one stretch a spring")
    ladders = ("ladder", found.ladder, _LADDER), ("suggested", found.suggested, _SUGGESTED)
    for name, ladder, colour in ladders:
        label = f"{name} {ladder.name}: {ladder.base_over_tip:.3g} : 1"
        _steps(panel, ladder.proxy, colour, "solid", label)
    panel.set_yscale("log")
    panel.set(
        xlim=(0, 1),
        xlabel="place along the antenna, base to tip",
        ylabel="stiffness over that of the base",
    )
    panel.legend(loc="lower left", fontsize=8)
    return figure


def _steps(panel: Axes, values: list[float], colour: Any, line: Any, label: str) -> None:
    edges = np.linspace(0.0, 1.0, len(values) + 1)
    look = {"color": colour, "linestyle": line, "linewidth": 1.8}
    above = 3 if line != "solid" else 2  # dashes show a line below them
    panel.stairs(values, edges, baseline=None, label=label, zorder=above, **look)


def _of_sensor(found: Sensor, readings: Readings) -> Figure:
    """The static curve with a loop, a held bend, and the choice of the divider."""
    figure = style.canvas(style.WIDTH, 8.7)
    curve, held, choice = figure.subplots(3, 1)
    _draw_curve(curve, found.curve, readings.loop)
    _draw_hold(held, readings.hold)
    _draw_choice(choice, found, readings)
    return figure


def _draw_curve(panel: Axes, points: Sequence[Point], loop: Floats) -> None:
    first, second, _ = style.series(3)
    panel.plot(np.degrees(loop[:, 0]), loop[:, 1], color=second, label="loop")
    panel.plot(
        [point.flex_deg for point in points],
        [point.counts for point in points],
        color=first,
        linestyle=(0, (4, 1.5)),
        label="static",
    )
    panel.set(xlabel="flex [deg]", ylabel="reading [counts]", title="Static curve and loop")
    panel.legend()


def _draw_hold(panel: Axes, hold: Floats) -> None:
    panel.plot(hold[:, 0], hold[:, 1], color=style.FAINT, linewidth=0.6, label="with noise")
    panel.plot(hold[:, 0], hold[:, 2], color=style.series(3)[0], label="without")
    panel.set(xlabel="time [s]", ylabel="reading [counts]", title="Bend held from 0 s on")
    panel.legend()


def _draw_choice(panel: Axes, result: Sensor, readings: Readings) -> None:
    resistors, spread = readings.resistors, readings.spread
    panel.plot(1e-3 * resistors, spread, color=style.series(3)[0])
    for ohm, marker, label in (
        (result.divider_ohm, "s", "in use"),
        (result.best_divider_ohm, "D", "best of E24"),
    ):
        panel.plot(
            1e-3 * ohm,
            np.interp(ohm, resistors, spread),
            color=style.INK,
            marker=marker,
            linestyle="",
            label=f"{label}: {1e-3 * ohm:g} kOhm",
        )
    panel.set_xscale("log")
    panel.set(xlabel="fixed resistor [kOhm]", ylabel="spread of readings [counts]", title="Divider")
    panel.set_ylim(0, 1.35 * float(spread.max()))
    panel.legend(loc="upper right")


def _of_ringdown(found: Ringdown, trace: Trace) -> Figure:
    """The swing of the tip, and animals beside it."""
    figure = style.canvas(style.WIDTH, 6.4)
    swing, beside = figure.subplots(2, 1)
    _draw_swing(swing, found, trace)
    _draw_animals(beside, found)
    return figure


def _draw_swing(panel: Axes, found: Ringdown, trace: Trace) -> None:
    first, second, _ = style.series(3)
    cycle, chain = 1e3 * found.engine.cycle_s, found.chain
    decay = np.exp(-chain.damping * 2 * np.pi * chain.natural_hz * trace.t)
    panel.axhspan(-0.1, 0.1, color=style.FAINT, zorder=0, linewidth=0)
    panel.plot(1e3 * trace.t, trace.tip, color=first, label="tip in the engine")
    look: dict[str, Any] = {"color": second, "linestyle": (0, (4, 1.5))}
    panel.plot(1e3 * trace.t, decay, label="decay of the chain", **look)
    panel.axvline(cycle, color=style.MUTED, linewidth=0.8)
    panel.axvline(1e3 * ANIMAL_CYCLE, color=style.MUTED, linewidth=0.8, linestyle=":")
    panel.set(xlabel="time [ms]", ylabel="deflection, 1 at the start")
    panel.set_title(
        f"Let go: {100 * found.rejected:.0f} % rejected in {cycle:.0f} ms (line);\n"
        f"cockroach {1e3 * ANIMAL_CYCLE:.0f} ms (dots), grey: 90 % rejected"
    )
    panel.legend()


def _draw_animals(panel: Axes, found: Ringdown) -> None:
    colours = style.series(len(_ANIMALS))
    for (name, (left, right), (low, high)), colour in zip(_ANIMALS, colours, strict=True):
        middle, centre = (low + high) / 2, (left * right) ** 0.5
        bars: dict[str, Any] = {"color": colour, "linewidth": 3.0, "solid_capstyle": "butt"}
        panel.plot([left, right], [middle, middle], **bars)
        panel.plot([centre, centre], [low, high], **bars)
        panel.text(right * 1.15, middle, name, va="center", fontsize=8)
    for name, swing in {"this antenna": found.engine, **found.beside}.items():
        at = swing.natural_hz, swing.damping
        panel.scatter(*at, color=style.INK, zorder=3)
        panel.annotate(name, at, (6, -1), textcoords="offset points", va="top", fontsize=8)
    panel.axhline(least_damping(0.1), color=style.MUTED, linewidth=0.8)
    panel.set_xscale("log")
    panel.set_xlim(min(1.0, found.engine.natural_hz / 2), 1000)
    panel.set_ylim(0, 1.05)
    panel.set(xlabel="frequency [Hz]", ylabel="damping ratio")
    panel.set_title("Animals; above the line 90 % are\nrejected in one cycle")
