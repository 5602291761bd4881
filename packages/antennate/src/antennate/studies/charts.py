"""Figures that several experiments have, declared in place of drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.studies.columns import Column, Frame
from antennate.studies.pooling import by, valid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TICKS = (1, 2, 5, 10, 20, 50, 100, 200)


@dataclass(frozen=True, slots=True)
class Shares:
    """How the trials of each condition ended, stacked, with Wilson's interval of success.

    Attributes:
        colours: Colour of each count of a summary, from below; `invalid` stands only where it is.
    """

    colours: Mapping[str, str]

    @style.styled
    def draw(self, panels: Mapping[str, Mapping[str, Any]]) -> Figure:
        """The figure.

        Args:
            panels: By title the summaries of all conditions, with `trials` and `wilson95`.
        """
        figure = style.canvas(style.WIDTH, 3.0 * len(panels))
        axes = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
        for panel, (title, conditions) in zip(axes, panels.items(), strict=True):
            self._stack(panel, conditions)
            panel.set(title=title, ylabel="share of trials", ylim=(0, 1.02))
        handles = axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=4, columnspacing=1.2)
        return figure

    def _stack(self, panel: Axes, conditions: Mapping[str, Any]) -> None:
        places, trials = np.arange(len(conditions)), [c.trials for c in conditions.values()]
        floor = np.zeros(len(conditions))
        for name, colour in self.colours.items():
            counts = np.array([getattr(each, name) for each in conditions.values()])
            shares = counts / np.maximum(trials, 1)
            if name != "invalid" or shares.any():
                panel.bar(places, shares, 0.6, floor, color=colour, label=name)
            floor += shares
        for place, each in enumerate(conditions.values()):
            if each.wilson95:
                panel.plot([place, place], each.wilson95, color=style.INK, linewidth=1.4)
        heads = [
            f"{name.replace('_', chr(10))}\nn = {each.trials}" for name, each in conditions.items()
        ]
        panel.set_xticks(places, heads)
        panel.grid(axis="x", visible=False)


@dataclass(frozen=True, slots=True)
class Strip:
    """A column of every valid trial, a heap of marks for each condition, and a border.

    Attributes:
        of: The column, whose label and unit the axis has.
        when: What it says, in a few words.
        title: Title.
        beyond: What is above the border; `{}` is the border.
    """

    of: Column
    when: str
    title: str
    beyond: str

    @style.styled
    def draw(self, rows: Frame, condition: str, border: float) -> Figure:
        """The figure of rows, a heap for each value in the column `condition`."""
        figure = style.canvas(style.WIDTH, 3.6)
        panel = figure.subplots()
        names: Sequence[str] = []
        for place, (name, some) in enumerate(by(rows, condition).items()):
            heights = np.sort(valid(some)[self.of.name])
            apart = place + np.linspace(-0.25, 0.25, len(heights)) if len(heights) > 1 else [place]
            colour, marker, _ = style.PROFILE_LOOKS[name]
            panel.plot(apart[: len(heights)], heights, marker, color=colour, markersize=4)
            names = [*names, name.replace("_", "\n")]
        panel.axhline(border, color=style.INK, linewidth=1.0)
        at: Any = ((len(names) - 0.45, border), (0, 3))
        look: Any = {"textcoords": "offset points", "ha": "right", "fontsize": 8}
        panel.annotate(self.beyond.format(f"{border:g}"), *at, **look)
        style.categories(panel, names)
        panel.set_yscale("log")
        low, high = panel.get_ylim()
        ticks = [tick for tick in _TICKS if low <= tick <= high]
        panel.set_yticks(ticks, [str(tick) for tick in ticks])
        panel.yaxis.minorticks_off()
        panel.set(ylabel=f"{self.of.label}:\n{self.when} [{self.of.unit}]", title=self.title)
        return figure
