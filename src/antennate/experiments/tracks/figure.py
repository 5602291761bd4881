"""Figure of `antennate tracks`: shapes by trial, an angle over time, and the criteria varied."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.tracks import measures
from antennate.experiments.tracks.measures import FREE, NAMES, SHAPES, UNKNOWN, Antenna
from antennate.experiments.tracks.run import TracksOutcome
from antennate.types import Ints

_MOST_TRIALS = 24
"""More are not drawn one by one."""
_LONGEST = 20.0
"""Time that is drawn [s]."""
_OUTLINES = 40
"""Outlines of each shape."""
_MARKS = dict(zip(SHAPES, ("o", "s", "^", "D"), strict=True))


@style.styled
def figures(outcome: TracksOutcome) -> dict[str, Figure]:
    """Shares by trial and over trials, outlines of each shape, an angle over time, sensitivity."""
    figure, result = style.canvas(style.WIDTH, 13.0), outcome.result()
    shares, outlines, angle, change = figure.subplots(4, 1, height_ratios=(1.2, 1.4, 0.9, 1.5))
    shapes = [measures.shapes_of(outcome.config.criteria, a) for a in outcome.antennae]
    _draw_shares(shares, outcome, result)
    _draw_outlines(outlines, outcome, shapes)
    contact = [int((frames >= 0).sum()) for frames in shapes]
    most = int(np.argmax(contact))
    _draw_angle(angle, outcome.antennae[most], shapes[most])
    _draw_change(change, result)
    handles = [
        shares.plot([], [], _MARKS.get(shape, "s"), color=colour, label=shape)[0]
        for shape, colour in style.SHAPE_COLOURS.items()
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return {"tracks": figure}


def _draw_shares(panel: Axes, outcome: TracksOutcome, result: Mapping[str, Any]) -> None:
    """A bar for each trial in contact, and the mean over all with its interval."""
    table = measures.by_trial(outcome.config.criteria, outcome.antennae)
    bars = table if len(table) <= _MOST_TRIALS else table[:0]
    left = 0.0
    for at, share in enumerate(bars):
        bottom = 0.0
        for name, part in zip(SHAPES, share, strict=True):
            panel.bar(at, part, 0.85, bottom, color=style.SHAPE_COLOURS[name])
            bottom += part
        left = at + 1.6
    for k, (name, row) in enumerate(result["shapes"].items()):
        style.intervals(
            panel,
            [left + k],
            [row],
            ("share", "share_95"),
            len(table),
            marker=_MARKS[name],
            color=style.SHAPE_COLOURS[name],
            markeredgecolor=style.INK,
            ecolor=style.INK,
        )
    ticks = [*range(len(bars)), left + 1.5]
    names = [str(at + 1) for at in range(len(bars))]
    panel.set_xticks(
        ticks, [*names, f"mean of {len(table)},\n{style.interval_note('95 %', len(table))}"]
    )
    panel.set_ylim(-0.02, 1.02)
    panel.set_ylabel("share of frames in contact")
    panel.set_title("Shapes in contact, by trial and over trials")
    panel.grid(visible=False, axis="x")


def _draw_outlines(panel: Axes, outcome: TracksOutcome, shapes: list[Ints]) -> None:
    """Antennae as seen from above the body, ahead upwards, of one side each."""
    rng = np.random.default_rng(0)
    points = np.concatenate([antenna.points for antenna in outcome.antennae])
    joined = np.concatenate(shapes)
    for value, name in enumerate(SHAPES):
        frames = np.flatnonzero(joined == value)
        for i in rng.permutation(frames)[:_OUTLINES]:
            relative = points[i] - points[i, 0]
            panel.plot(
                relative[:, 1], relative[:, 0], color=style.SHAPE_COLOURS[name], linewidth=0.7
            )
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel("outwards / length")
    panel.set_ylabel("ahead / length")
    panel.set_title(f"Antennae in contact, up to {_OUTLINES} of each shape")


def _draw_angle(panel: Axes, antenna: Antenna, shapes: Ints) -> None:
    """Direction from base to tip over the time with most contact, coloured by shape."""
    count = min(len(shapes), round(_LONGEST * antenna.rate))
    touched = np.concatenate([[0], np.cumsum(shapes >= 0)])
    start = int(np.argmax(touched[count:] - touched[: len(touched) - count]))
    at = slice(start, start + count)
    t, angle = (
        np.arange(start, start + count) / antenna.rate,
        np.degrees(antenna.outline.direction[at]),
    )
    panel.plot(t, angle, color=style.FAINT, linewidth=0.8, zorder=1)
    for value, name in NAMES.items():
        frames = shapes[at] == value
        if value != UNKNOWN:
            colour, size = style.SHAPE_COLOURS[name], 3 if value == FREE else 7
            panel.scatter(t[frames], angle[frames], size, colour, zorder=2, linewidths=0)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("base to tip [deg]")
    panel.set_title(f"Angle from the body axis, trial {antenna.trial + 1}, {antenna.side} antenna")


def _draw_change(panel: Axes, result: Mapping[str, Any]) -> None:
    """Share of every shape with each criterion less and more; equal ones stand side by side."""
    rows = result["sensitivity"]
    for k, name in enumerate(SHAPES):
        usual = result["shapes"][name]["share"]
        if usual is None or math.isnan(usual):
            continue
        colour = style.SHAPE_COLOURS[name]
        panel.axvline(usual, color=colour, linewidth=1.0)
        panel.plot(
            [row["share"][name] for row in rows],
            np.arange(len(rows)) + 0.15 * (k - 1.5),
            marker=_MARKS[name],
            linestyle="",
            color=colour,
            markeredgecolor=style.INK,
        )
    percent = f"{100 * result['vary']:g} %"
    signs = ("−", "+") * len(rows)
    labels = [f"{row['criterion']} {s}{percent}" for row, s in zip(rows, signs, strict=False)]
    panel.set_yticks(range(len(rows)), labels)
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.margins(x=0.12)
    panel.set_xlim(left=-0.03)
    panel.set_xlabel("share, mean over trials")
    panel.set_title("With one criterion changed; lines: with none changed")
    panel.grid(visible=False, axis="y")
