"""Figures of `antennate compete`: ranks, scenes by controllers, performance profiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from antennate import figures as style
from antennate.control.registry import looks
from antennate.studies.experiment import Done
from antennate_lab.compete.page import ordered
from antennate_lab.compete.result import Standing
from antennate_lab.compete.scenes import label, labels
from antennate_lab.compete.standings import Rows, profiles

_DARK = 0.83
"""Share of successes whose blue is so dark that white stands out more on it."""


def figures(outcome: Done) -> dict[str, Figure]:
    """All three figures of a run."""
    return drawn(outcome.found, outcome.rows)


def drawn(result: Standing, rows: Rows) -> dict[str, Figure]:
    """All three figures of a result and its rows."""
    if not rows:
        return {}
    ranked = [name for name in ordered(result) if result.controllers[name].rank is not None]
    return {"ranks": ranks(result), "scenes": scenes(result), "profiles": profile(rows, ranked)}


@style.styled
def ranks(result: Standing) -> Figure:
    """Rank and success of each controller with their intervals, a line each."""
    names = ordered(result)
    colours = {name: colour for name, (colour, _) in looks(names).items()}
    short = style.plain(labels(names))
    figure = style.canvas(style.WIDTH, 2 * (0.9 + 0.27 * len(names)))
    rank, success = figure.subplots(2, 1)
    for i, name in enumerate(names):
        row = result.controllers[name]
        if row.rank is not None and row.rank_95 is not None:
            _interval(rank, i, row.rank, row.rank_95, colours[name])
        else:
            rank.text(1, i, "not ranked", va="center", fontsize=8, color=style.MUTED)
        if row.success_share is not None and row.wilson95 is not None:
            ends = [100.0 * end for end in row.wilson95]
            _interval(success, i, 100.0 * row.success_share, ends, colours[name])
    for panel in (rank, success):
        panel.set_yticks(range(len(names)), [short[name] for name in names])
        panel.set_ylim(len(names) - 0.5, -0.5)
        panel.grid(visible=False, axis="y")
    rank.xaxis.set_major_locator(MaxNLocator(integer=True))
    rank.set(xlabel="rank", title="Rank; 95 %, all together")
    ranked = sum(row.rank is not None for row in result.controllers.values())
    rank.set_xlim(0.7, max(2, ranked) + 0.3)
    success.set(xlabel="draws crossed [%]", title="Success; Wilson 95 %", xlim=(-2, 102))
    return figure


def _interval(panel: Axes, at: int, value: float, ends: Any, colour: str) -> None:
    panel.plot(list(ends), [at, at], color=colour, linewidth=2.4, solid_capstyle="butt")
    panel.plot(value, at, color=colour, marker="o", markersize=7, clip_on=False)


@style.styled
def scenes(result: Standing) -> Figure:
    """Share of successes, a line a scene and a column a controller."""
    names, places = ordered(result), list(result.scenes)
    short = style.plain(labels(names))
    shares = np.array(
        [[cells[name].success_share for name in names] for cells in result.scenes.values()], float
    )
    figure = style.canvas(style.WIDTH, 1.3 + 0.32 * len(places))
    panel = figure.subplots()
    panel.imshow(100.0 * shares, cmap="Blues", vmin=0, vmax=125, aspect="auto")
    for (i, j), share in np.ndenumerate(shares):
        if np.isfinite(share):
            ink = "white" if share > _DARK else style.INK
            number = str(int(100.0 * share + 0.5))  # halves go up
            panel.text(j, i, number, ha="center", va="center", fontsize=8, color=ink)
    ranked = sum(result.controllers[name].rank is not None for name in names)
    if 0 < ranked < len(names):  # the others stand apart
        panel.axvline(ranked - 0.5, color="white", linewidth=3)
    panel.set_xticks(range(len(names)), [short[name] for name in names], rotation=45, ha="right")
    panel.set_yticks(range(len(places)), [label(place) for place in places])
    panel.grid(visible=False)
    panel.set_title("Draws crossed [%]")
    return figure


@style.styled
def profile(rows: Rows, names: Sequence[str]) -> Figure:
    """Share of the draws crossed within a factor of the fastest, a line for each of these names."""
    factors, by_name = profiles(rows)
    shares = {name: by_name[name] for name in names}
    drawn = looks(shares)
    short = style.plain(labels([*shares]))
    figure = style.canvas(style.WIDTH, 3.6)
    panel = figure.subplots()
    for name, share in shares.items():
        colour, line = drawn[name]
        panel.step(
            factors,
            100.0 * share,
            where="post",
            color=colour,
            linestyle=line,
            linewidth=1.5,
            label=short[name],
        )
    panel.set_xscale("log")
    panel.set_xticks([1, 2, 3, 5, 10], ["1", "2", "3", "5", "10"])
    panel.minorticks_off()
    panel.set(xlim=(1, 10), ylim=(-2, 102))
    panel.set(xlabel="time over that of the fastest", ylabel="draws crossed [%]")
    if shares:
        figure.legend(loc="outside upper center", ncols=3, handlelength=2.6)
    return figure
