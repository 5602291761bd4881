"""Figures of `antennate study`: a map of the response, or what it hangs on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.study.run import StudyOutcome

_MOST_BARS = 20
"""Parameters drawn of a Morris plan."""
_MOST_ROWS = 6
"""Rows of maps drawn."""
Result = Mapping[str, Any]


def figures(outcome: StudyOutcome) -> dict[str, Figure]:
    """The figure that suits the plan."""
    result = outcome.result()
    if result["effects"]:
        return {"effects": effects(result)}
    if outcome.config.plan == "grid" and len(result["axes"]) > 1:
        return {"map": maps(result)}
    return {"points": lines(result)}


@style.styled
def effects(result: Result) -> Figure:
    """Morris's mu* of each parameter, the largest above; a panel for each condition."""
    targets = list(dict.fromkeys(effect["of"] for effect in result["effects"]))
    by_name: dict[str, list[Result]] = {}
    for effect in result["effects"]:
        by_name.setdefault(effect["parameter"], []).append(effect)
    ranked = sorted(by_name, key=lambda name: by_name[name][-1]["mu_star"] or 0.0)[-_MOST_BARS:]
    figure = style.canvas(2.6 + 2.4 * len(targets), 1.2 + 0.22 * len(ranked))
    panels = figure.subplots(1, len(targets), squeeze=False, sharey=True)[0]
    for place, (panel, target) in enumerate(zip(panels, targets, strict=True)):
        found = [by_name[name][place] for name in ranked]
        sizes = np.array([effect["mu_star"] or 0.0 for effect in found])
        ends = np.array([e["mu_star95"] or (s, s) for e, s in zip(found, sizes, strict=True)])
        whiskers = np.maximum(0.0, [sizes - ends[:, 0], ends[:, 1] - sizes])
        panel.barh(ranked, sizes, xerr=whiskers, color=style.SERIES[0], ecolor=style.MUTED)
        panel.set_title(target or result["response"])
        panel.set_xlabel(f"change of {_words(result['response'])}")
        panel.grid(visible=False, axis="y")
    return figure


@style.styled
def maps(result: Result) -> Figure:
    """A map over the first two parameters; a column for each condition, a row for the others."""
    x, y, *others = result["axes"]
    cells = result["points"]
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    rows = list(dict.fromkeys(_rest(cell, others) for cell in cells))[:_MOST_ROWS]
    figure = style.canvas(1.6 + 2.6 * len(names), 1.0 + 2.1 * len(rows))
    panels = figure.subplots(len(rows), len(names), squeeze=False, sharex=True, sharey=True)
    known = [c["response"] for c in cells if c["response"] is not None]
    shares = result["response"] == "success_share" or not known
    ends = (0.0, 1.0) if shares else (float(np.nanmin(known)), float(np.nanmax(known)))
    image: Any = None
    for i, rest in enumerate(rows):
        for j, name in enumerate(names):
            here = [c for c in cells if c["condition"] == name and _rest(c, others) == rest]
            image = _map(panels[i, j], here, (x, y), ends)
            panels[i, j].set_title(", ".join(filter(None, [name, rest])), fontsize=8)
    for panel in panels[-1]:
        panel.set_xlabel(_words(x))
    for panel in panels[:, 0]:
        panel.set_ylabel(_words(y))
    figure.colorbar(image, ax=panels, label=_words(result["response"]), shrink=0.8)
    return figure


def _map(panel: Axes, cells: Sequence[Result], axes: tuple[str, str], ends: Any) -> Any:
    columns, rows = (list(dict.fromkeys(_text(c["values"][a]) for c in cells)) for a in axes)
    grid = np.full((len(rows), len(columns)), np.nan)
    for cell in cells:
        place = (
            rows.index(_text(cell["values"][axes[1]])),
            columns.index(_text(cell["values"][axes[0]])),
        )
        grid[place] = np.nan if cell["response"] is None else cell["response"]
    image = panel.imshow(
        grid, origin="lower", aspect="auto", vmin=ends[0], vmax=ends[1], cmap="cividis"
    )
    for (i, j), value in np.ndenumerate(grid):
        dark = value < ends[0] + 0.6 * (ends[1] - ends[0])
        text = "-" if np.isnan(value) else f"{value:.2g}"
        colour = "white" if dark else "black"
        panel.text(j, i, text, ha="center", va="center", color=colour, fontsize=7)
    panel.set_xticks(range(len(columns)), columns)
    panel.set_yticks(range(len(rows)), rows)
    panel.grid(visible=False)
    return image


@style.styled
def lines(result: Result) -> Figure:
    """The response against each parameter, with the interval of each point."""
    axes, cells = result["axes"], result["points"]
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    figure = style.canvas(1.2 + 3.0 * len(axes), 3.0)
    panels = figure.subplots(1, len(axes), squeeze=False, sharey=True)[0]
    for panel, axis in zip(panels, axes, strict=True):
        values = [cell["values"][axis] for cell in cells]
        words = None
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
            words = list(dict.fromkeys(map(_text, values)))
        for name, colour in zip(names, style.series(len(names)), strict=True):
            here = [cell for cell in cells if cell["condition"] == name]
            at = [cell["values"][axis] for cell in here]
            x = at if words is None else [float(words.index(_text(v))) for v in at]
            look = {"marker": "o", "color": colour, "label": name or None}
            style.intervals(panel, x, here, ("response", "response95"), **look)
        if words is not None:
            style.categories(panel, words)
        panel.set_xlabel(_words(axis))
    panels[0].set_ylabel(_words(result["response"]))
    if len(names) > 1:
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(names)
        )
    return figure


def _rest(cell: Result, others: Sequence[str]) -> str:
    return ", ".join(f"{_words(o)} {_text(cell['values'][o])}" for o in others)


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _words(name: str | None) -> str:
    return (name or "response").rpartition(".")[2].replace("_", " ")
