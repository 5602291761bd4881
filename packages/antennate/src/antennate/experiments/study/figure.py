"""Figures of a study: effects, maps over two parameters, or lines over one."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.experiments.study import measures, tradeoff
from antennate.experiments.study.effects import SUCCESS, Elementary, Slope
from antennate.experiments.study.result import Cell, CellOfSuccesses, StudyResult
from antennate.studies.columns import NONE, Column, shown
from antennate.studies.experiment import Done
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_SIZES = 12
"""Effects drawn for each target, the largest."""
_MOST_MAPS = 12
_MOST_COLUMNS = 5
"""Columns of a map whose cells have room for interval and counts."""
_ASIDE = 0.025
"""Distance between two conditions at one place, over the width of all places."""
_LINE = 0.135
"""Height of a line of small text [inches]."""
_text = functools.partial(measures.text, digits=3)


def figures(outcome: Done) -> dict[str, Figure]:
    """The figure that suits the plan."""
    result: StudyResult = outcome.result()
    if result.search:
        judged = any(design.objectives for design in result.search.designs)
        return {"tradeoff": tradeoff.draw(result.search)} if judged else {}
    if result.tells_effects:
        return {"effects": _draw_effects(result)}
    if result.plan == "grid" and len(result.axes) > 1:
        return {"map": _draw_maps(result)}
    return {"points": _draw_lines(result)}


@style.styled
def _draw_effects(result: StudyResult) -> Figure:
    """The largest effects and the noise; a panel for each target."""
    targets = list(dict.fromkeys(effect.of for effect in result.effects))
    parameters = len(result.effects) // len(targets)
    count = min(_MOST_SIZES, parameters)
    figure = style.canvas(style.WIDTH, 1.0 + len(targets) * (0.75 + 0.35 * count))
    panels = figure.subplots(len(targets), 1, squeeze=False, sharex=True)[:, 0]
    measure = result.measure
    signed = result.plan != "morris"
    for panel, target in zip(panels, targets, strict=True):
        known = sorted(result.known_effects(target), key=lambda each: abs(each.size[0] or 0.0))
        _draw_sizes(panel, known[-count:], measure, signed)
        some = f", the {count} largest of {parameters}" if count < parameters else ""
        panel.set_title(f"{result.label(target) or measure.label}{some}")
    if signed:
        most = max(map(abs, panels[0].get_xlim()))
        panels[0].set_xlim(-most, most)
    else:
        panels[0].set_xlim(left=0.0)  # of all panels; only now, as it ends their scaling
    unit = f" [{measure.unit}]" if measure.unit else ""
    what = "change" if signed else "mean size of the change"
    panels[-1].set_xlabel(f"{what} of\n{measure.label}{unit}")
    handles, names = panels[0].get_legend_handles_labels()
    of = result.sample
    note = f"noise of {of}" if names else f"no noise known of {of}"
    figure.legend(handles, [note], loc="outside upper left") if names else figure.suptitle(note)
    return figure


def _draw_sizes(
    panel: Axes, effects: Sequence[Elementary | Slope], measure: Column, signed: bool
) -> None:
    """Each effect with its interval, its name above it; grey as far as noise alone would reach."""
    noises = [effect.noise for effect in effects]
    if noises and not signed and noises[0] is not None:
        end = measure.scale * noises[0]
        panel.axvspan(0.0, end, color=style.FAINT, linewidth=0, label="noise")
    elif signed:
        wide = measure.scale * np.array(noises)
        look = {"color": style.FAINT, "linewidth": 0, "label": "noise"}
        panel.barh(range(len(effects)), 2 * wide, 0.22, -wide, **look)
    for place, effect in enumerate(effects):
        middle, interval = effect.size
        ends = measure.scale * np.array(interval or (middle, middle))
        colour = style.SERIES[0] if effect.above_noise else style.MUTED
        panel.plot(ends, [place, place], color=colour, linewidth=1.0)
        look = {"marker": "o", "markersize": 5, "color": colour}
        panel.plot(
            measure.scale * np.array([middle]),
            [place],
            **look,
            markerfacecolor=colour if effect.above_noise else "white",
        )
        panel.annotate(
            effect.parameter,
            (0.0, place),
            xytext=(4, 6),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            fontsize=8,
        )
    panel.tick_params(labelbottom=True)
    panel.set_yticks([])
    panel.set_ylim(-0.6, len(effects) - 0.1)
    panel.spines["left"].set_visible(False)


@style.styled
def _draw_maps(result: StudyResult) -> Figure:
    """A map over the first two parameters for each condition and each value of the others."""
    x, y, *others = result.axes
    cells = result.points
    names = list(dict.fromkeys(cell.condition for cell in cells))
    titles = {axis: measures.axis(result.experiment, axis) for axis in result.axes}
    rests = list(dict.fromkeys(_rest(titles, cell, others) for cell in cells))
    pairs = [(name, rest) for rest in rests for name in names]
    drawn = pairs[:_MOST_MAPS]
    steps = [len(dict.fromkeys(_text(cell.values[axis]) for cell in cells)) for axis in (x, y)]
    full = steps[0] <= _MOST_COLUMNS
    height = steps[1] * ((3.6 if full else 1.6) * _LINE) + 0.35
    figure = style.canvas(style.WIDTH, 1.5 + height * len(drawn))
    panels = figure.subplots(len(drawn), 1, squeeze=False, sharex=True)[:, 0]
    measure = result.measure
    ends = _colours(result)
    image: Any = None
    for panel, (name, rest) in zip(panels, drawn, strict=True):
        of = [c for c in cells if (c.condition, _rest(titles, c, others)) == (name, rest)]
        image = _draw_map(panel, of, (x, y), ends, measure, full)
        panel.set_title(", ".join(filter(None, [result.label(name), rest])))
        panel.set_ylabel(titles[y])
    panels[-1].set_xlabel(titles[x])
    title = measure.title
    if full:
        interval = any(cell.response95 for cell in cells)
        title += f"\nwith {'its 95 % interval and ' * interval}how many trials it is of"
    if len(drawn) < len(pairs):
        title += f"\nthe first {len(drawn)} of {len(pairs)} maps"
    bar = figure.colorbar(image, ax=panels, label=title, **style.above(figure))
    bar.ax.xaxis.set_major_formatter(lambda value, _: f"{measure.scale * value:.3g}")
    return figure


def _colours(result: StudyResult) -> tuple[float, float]:
    """Values of the first and the last colour: all shares, or those that there are."""
    known = [cell.response for cell in result.points if cell.response is not None]
    if result.response == SUCCESS or not known:
        return 0.0, 1.0
    low, high = float(np.nanmin(known)), float(np.nanmax(known))
    return (low - 0.5, high + 0.5) if low == high else (low, high)  # of one value one colour


def _draw_map(
    panel: Axes,
    cells: Sequence[Cell],
    axes: tuple[str, str],
    ends: tuple[float, float],
    measure: Column,
    full: bool,
) -> Any:
    """One map; its cells tell the value and, if they are to be full, interval and counts."""
    columns, rows = (list(dict.fromkeys(_text(c.values[a]) for c in cells)) for a in axes)
    grid = np.full((len(rows), len(columns)), np.nan)
    for cell in cells:
        j, i = columns.index(_text(cell.values[axes[0]])), rows.index(_text(cell.values[axes[1]]))
        value = grid[i, j] = np.nan if cell.response is None else cell.response
        dark = value < ends[0] + 0.48 * (ends[1] - ends[0])
        colour = "white" if dark else "black"
        text = _text_of(cell, measure)
        text = text if full else text.partition("\n")[0]
        panel.text(j, i, text, ha="center", va="center", color=colour, fontsize=7)
    image = panel.imshow(
        grid, origin="lower", aspect="auto", vmin=ends[0], vmax=ends[1], cmap="cividis"
    )
    panel.set_xticks(range(len(columns)), columns)
    panel.set_yticks(range(len(rows)), rows)
    panel.grid(visible=False)
    return image


def _text_of(cell: Cell, measure: Column) -> str:
    """Value, interval if there is one, and counts of a cell, a line each."""
    valid = cell.trials - cell.invalid
    counts = f"n {valid}"
    if isinstance(cell, CellOfSuccesses) and valid:
        counts = f"{cell.successes} of {valid}"
    if cell.response is None:
        return f"{NONE}\n{counts}"
    value = shown(cell.response, measure.form, measure.scale)
    if not cell.response95:
        return f"{value}\n{counts}"
    of = shown(cell.response95, measure.form, measure.scale).replace(" to ", "–")
    return f"{value}\n{of}\n{counts}"


@style.styled
def _draw_lines(result: StudyResult) -> Figure:
    """The response against each parameter, with the interval of each point."""
    axes, cells = result.axes, result.points
    names = list(dict.fromkeys(cell.condition for cell in cells))
    figure = style.canvas(style.WIDTH, 0.4 + 2.4 * len(axes))
    panels = figure.subplots(len(axes), 1, squeeze=False, sharey=True)[:, 0]
    measure = result.measure
    for panel, axis in zip(panels, axes, strict=True):
        values = [cell.values[axis] for cell in cells]
        words = None
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
            words = list(dict.fromkeys(map(_text, values)))
        shifts = _shifts(len(names), values if words is None else range(len(words)))
        for name, colour, shift in zip(names, style.series(len(names)), shifts, strict=True):
            own = [cell for cell in cells if cell.condition == name]
            at = [cell.values[axis] for cell in own]
            x = at if words is None else [float(words.index(_text(v))) for v in at]
            look = {"marker": "o", "color": colour, "label": result.label(name) or None}
            rows = [_scaled(cell, measure.scale) for cell in own]
            x = [each + shift for each in x]
            style.intervals(panel, x, rows, ("response", "response95"), **look)
        if words is not None:
            style.categories(panel, words)
        panel.set_xlabel(measures.axis(result.experiment, axis))
        panel.set_ylabel(measure.title)
    if len(names) > 1:
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _shifts(count: int, places: Sequence[float]) -> Floats:
    """How far aside of its place each condition stands, so that none covers another."""
    width = float(max(places) - min(places)) or 1.0
    return _ASIDE * width * (np.arange(count, dtype=float) - (count - 1) / 2)


def _scaled(cell: Cell, scale: float) -> dict[str, Any]:
    """The response of a cell and its interval in the unit shown."""
    value, ends = cell.response, cell.response95
    return {
        "response": None if value is None else scale * value,
        "response95": ends and [scale * end for end in ends],
    }


def _rest(titles: Mapping[str, str], cell: Cell, others: Sequence[str]) -> str:
    return ", ".join(f"{titles[o]} {_text(cell.values[o])}" for o in others)
