"""The figure of `study design`: every two objectives against one another."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.design.designs import DesignOutcome

_MOST_PANELS = 6
_MARKERS = "*^vDsPX<>"
"""The first reference is a star."""
Each = Mapping[str, Any]


def figures(outcome: DesignOutcome) -> dict[str, Figure]:
    """The trade-off; nothing where no design was judged."""
    result = outcome.result()
    return {"tradeoff": tradeoff(result)} if any(d["objectives"] for d in result["designs"]) else {}


@style.styled
def tradeoff(result: Mapping[str, Any]) -> Figure:
    """All designs, the front, the references, and those that were run again with intervals."""
    objectives = result["objectives"]
    pairs = list(combinations(objectives, 2))[:_MOST_PANELS] or [(None, objectives[0])]
    figure = style.canvas(style.WIDTH, 1.0 + 3.1 * len(pairs))
    panels = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    for panel, (x, y) in zip(panels, pairs, strict=True):
        _panel(panel, result["designs"], x, y)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _panel(panel: Axes, designs: Sequence[Each], x: Each | None, y: Each) -> None:
    judged = [each for each in designs if each["objectives"]]
    proposed = [each for each in judged if not each["reference"]]
    rest = [each for each in proposed if not each["front"]]
    best = [each for each in proposed if each["front"]]
    _points(panel, rest, x, y, color=style.FAINT, marker="o", label="proposed")
    _points(panel, best, x, y, color=style.SERIES[0], marker="o", label="front, in the search")
    references = [each for each in judged if each["reference"]]
    looks = zip(style.series(len(references) + 1)[1:], _MARKERS * len(references), strict=False)
    for each, (colour, marker) in zip(references, looks, strict=False):
        look = {"color": colour, "marker": marker, "label": each["name"], "zorder": 4}
        _points(panel, [each], x, y, markersize=11 if marker == "*" else 7, **look)
        _again(panel, [each], x, y, colour, marker)
    again = [each for each in best if each["fresh"]]
    _again(panel, again, x, y, style.SERIES[0], "o", label="on fresh seeds, 95 %")
    panel.set_xlabel("design" if x is None else _words(x))
    panel.set_ylabel(_words(y))


def _points(panel: Axes, each: Sequence[Each], x: Each | None, y: Each, **look: Any) -> None:
    if each:
        places = [_value(d, x, "objectives") for d in each]
        look = {"linestyle": "", "markersize": 5, **look}
        panel.plot(places, [_value(d, y, "objectives") for d in each], **look)


def _again(
    panel: Axes,
    designs: Sequence[Each],
    x: Each | None,
    y: Each,
    colour: str,
    marker: str,
    **look: Any,
) -> None:
    """Open marks with intervals, each joined to its value in the search."""
    for each in designs:
        if not each["fresh"]:
            continue
        ends = [[_value(each, axis, part) for part in ("objectives", "fresh")] for axis in (x, y)]
        panel.plot(*ends, color=colour, linewidth=0.8, linestyle=(0, (2, 1.5)))
        whiskers = {"yerr": _whiskers(each, y), "xerr": None if x is None else _whiskers(each, x)}
        panel.errorbar(
            [ends[0][1]],
            [ends[1][1]],
            **whiskers,
            color=colour,
            marker=marker,
            markerfacecolor="white",
            markersize=9 if marker == "*" else 5,
            capsize=2.5,
            elinewidth=1.0,
            linestyle="",
            zorder=3,
            **look,
        )
        look = {}


def _whiskers(each: Each, objective: Each) -> Any:
    found = each["fresh"][objective["name"]]
    known = found["value95"] if found["trials"] >= style.ENOUGH_TRIALS else None
    value = _value(each, objective, "fresh")
    low, high = np.array(known) * objective["scale"] if known else (value, value)
    return np.nan_to_num(np.maximum(0.0, [[value - low], [high - value]]))


def _value(each: Each, objective: Each | None, part: str) -> float:
    """A value as it is drawn, NaN if there is none."""
    if objective is None:
        return each["design"]
    value = each[part][objective["name"]]["value"]
    return math.nan if value is None else objective["scale"] * value


def _words(objective: Each) -> str:
    better = "small" if objective["goal"] == "minimize" else "large"
    return f"{objective['title']}\n{better} is good"
