"""The experiment `study`."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.control.registry import compared
from antennate.experiments.study import measures
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import size
from antennate.experiments.study.run import StudyOutcome, check, planned, run
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Measure, Table, few, share, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 60
"""Most lines of a table."""
_MOST_AXES = 8
"""Most parameters whose values a table of points shows."""
_NAMED = 3
"""Parameters that the sentence names."""


_BELOW = "The largest stays below the noise in 95 % of studies without any effect, found from "
_MORRIS = (
    "Mean size of the change of the {} over the whole range of a parameter (Morris's mu*), with a "
    "95 % interval over trajectories. Sizes cannot be negative: an interval above 0 is no effect. "
    f"{_BELOW}these trials, shuffled between the points."
)
_SLOPES = (
    "Change of the {} from one end of a parameter's range to the other, or from the first choice "
    "to the one named (least squares over all parameters at once), with its 95 % interval. "
    f"{_BELOW}what the fit leaves over, with random signs."
)
_MOST_SIZES = 12
"""Effects drawn for each target, the largest."""
_MOST_MAPS = 12
_MOST_COLUMNS = 5
"""Columns of a map whose cells have room for interval and counts."""
_LINE = 0.135
"""Height of a line of small text [inches]."""
Result = Mapping[str, Any]
_text = functools.partial(measures.text, digits=3)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What the response depends on, or the points one by one."""
    known = any(size(effect)[0] is not None for effect in result["effects"])
    table = _effects(result) if known else _points(result)
    return [table] if table.rows else []


def _points(result: Mapping[str, Any]) -> Table:
    """The response at each point."""
    cells, axes = result["points"], result["axes"]
    shown_axes = axes if len(axes) <= _MOST_AXES else []
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    by_point: dict[int, list[Mapping[str, Any]]] = {}
    for cell in cells:
        by_point.setdefault(cell["point"], []).append(cell)
    measure = measures.measure(result)
    heads = [f"{name}: {measure.title}" if name else measure.title for name in names]
    rows = [
        (
            str(number),
            [
                *(measures.text(of[0]["values"][axis]) for axis in shown_axes),
                *(measures.cell(measure, c["response"], c["response95"]) for c in of),
            ],
        )
        for number, of in by_point.items()
    ]
    so_few = _few(result)
    interval = "" if so_few else " with its 95 % interval"
    note = f"Mean of each point{interval}, {_ended(result)} in all."
    if so_few and result["effects"]:  # without effects the sentence says it
        note += f" {so_few}"
    if len(rows) > _MOST:
        note += f" The first {_MOST} of {len(rows)} points; result.json has all."
    if not shown_axes:
        note += f" The values of the {len(axes)} parameters of each point are in trials.csv."
    columns = [*(measures.axis(result, axis) for axis in shown_axes), *heads]
    return Table("Points", columns, rows[:_MOST], note, leading=len(shown_axes))


def _ended(result: Mapping[str, Any]) -> str:
    """How many trials there are, of how many if some are missing."""
    missing = f"{result['ended']} of " if result["interrupted"] else ""
    return f"{missing}{result['trials']} trials"


def _effects(result: Mapping[str, Any]) -> Table:
    """The parameters, the one of the largest effect first."""
    targets, headline = _targets(result)
    by_name: dict[str, dict[str, Mapping[str, Any]]] = {}
    for effect in result["effects"]:
        by_name.setdefault(effect["parameter"], {})[effect["of"]] = effect
    ranked = sorted(by_name.items(), key=lambda item: -abs(size(item[1][headline])[0] or 0.0))
    measure = measures.measure(result)
    rows = [
        (
            name,
            [
                *(measures.cell(measure, *size(of[target])) for target in targets),
                ", ".join(t or "yes" for t, e in of.items() if e.get("above_noise")) or NONE,
            ],
        )
        for name, of in ranked
    ]
    note = _SLOPES
    if result["plan"] == "morris":
        note = _MORRIS
        floors = [measures.cell(measure, ranked[0][1][target].get("noise")) for target in targets]
        rows.insert(0, (f"noise of {measures.sample(result)}", [*floors, ""]))
    return Table(
        "Effects",
        [*(target or measure.title for target in targets), "above the noise"],
        rows,
        note.format(measure.title),
    )


def _targets(result: Mapping[str, Any]) -> tuple[list[str], str]:
    """What the effects are of, and the one that a headline tells of: against the rival, if any."""
    targets = list(dict.fromkeys(effect["of"] for effect in result["effects"]))
    pair = compared([target for target in targets if " minus " not in target])
    names = [f"{first} minus {second}" for first, second in permutations(pair or (), 2)]
    return targets, next((target for target in targets if target in names), targets[-1])


def _few(result: Mapping[str, Any]) -> str:
    """What is said where a point has few trials."""
    return few(cell["trials"] - cell["invalid"] for cell in result["points"])


def sentence(result: Mapping[str, Any]) -> str:
    """What came out over all points, and how many trials say nothing."""
    points = len({cell["point"] for cell in result["points"]})
    text = f"{result['experiment']} at {points} points, {_ended(result)}"
    counts = {n: c for n, c in result["conditions"].items() if c.get(measures.SUCCESS) is not None}
    if counts:
        rates = (
            (f"{name} " if name else "")
            + share(c["successes"], c["trials"] - c["invalid"], c["wilson95"])
            for name, c in counts.items()
        )
        text += f"; successes over all of them (95 % interval): {', '.join(rates)}"
    if result["effects"]:
        text += f". {_depends(result)}"
    elif so_few := _few(result):
        text += f". {so_few.removesuffix('.')}"
    return f"{text}{measures.silent(result['statuses'])}."


def _depends(result: Mapping[str, Any]) -> str:
    """What the response depends on, of the last target: the parameters above the noise."""
    _, last = _targets(result)
    known = [e for e in result["effects"] if e["of"] == last and size(e)[0] is not None]
    known.sort(key=lambda effect: -abs(size(effect)[0] or 0.0))
    what = "the " + " of ".join(filter(None, [measures.measure(result).label, last]))
    above = [effect["parameter"] for effect in known if effect.get("above_noise")]
    of = measures.sample(result)
    if above:
        more = f" and {len(above) - _NAMED} more" if len(above) > _NAMED else ""
        return f"Above the noise of {of}, {what} depends on {', '.join(above[:_NAMED])}{more}"
    if not known or any(effect.get("above_noise") is None for effect in known):
        return f"Of {of} no noise is known, so nothing tells what {what} depends on"
    return f"Of {len(known)} parameters nothing moves {what} above the noise of {of}"


def figures(outcome: StudyOutcome) -> dict[str, Figure]:
    """The figure that suits the plan."""
    result = outcome.result()
    if any(size(effect)[0] is not None for effect in result["effects"]):
        return {"effects": _draw_effects(result)}
    if outcome.config.plan == "grid" and len(result["axes"]) > 1:
        return {"map": _draw_maps(result)}
    return {"points": _draw_lines(result)}


@style.styled
def _draw_effects(result: Result) -> Figure:
    """The largest effects and the noise; a panel for each target."""
    targets = list(dict.fromkeys(effect["of"] for effect in result["effects"]))
    parameters = len(result["effects"]) // len(targets)
    count = min(_MOST_SIZES, parameters)
    figure = style.canvas(style.WIDTH, 1.0 + len(targets) * (0.75 + 0.35 * count))
    panels = figure.subplots(len(targets), 1, squeeze=False, sharex=True)[:, 0]
    measure = measures.measure(result)
    signed = result["plan"] != "morris"
    for panel, target in zip(panels, targets, strict=True):
        known = [e for e in result["effects"] if e["of"] == target and size(e)[0] is not None]
        known.sort(key=lambda effect: abs(size(effect)[0] or 0.0))
        _draw_sizes(panel, known[-count:], measure, signed)
        some = f", the {count} largest of {parameters}" if count < parameters else ""
        panel.set_title(f"{target or measure.label}{some}")
    if signed:
        most = max(map(abs, panels[0].get_xlim()))
        panels[0].set_xlim(-most, most)
    else:
        panels[0].set_xlim(left=0.0)  # of all panels; only now, as it ends their scaling
    unit = f" [{measure.unit}]" if measure.unit else ""
    what = "change" if signed else "mean size of the change"
    panels[-1].set_xlabel(f"{what} of\n{measure.label}{unit}")
    handles, names = panels[0].get_legend_handles_labels()
    of = measures.sample(result)
    note = f"noise of {of}" if names else f"no noise known of {of}"
    figure.legend(handles, [note], loc="outside upper left") if names else figure.suptitle(note)
    return figure


def _draw_sizes(panel: Axes, effects: Sequence[Result], measure: Measure, signed: bool) -> None:
    """Each effect with its interval, its name above it; grey as far as noise alone would reach."""
    noises = [effect["noise"] for effect in effects]
    if noises and not signed and noises[0] is not None:
        end = measure.scale * noises[0]
        panel.axvspan(0.0, end, color=style.FAINT, linewidth=0, label="noise")
    elif signed:
        wide = measure.scale * np.array(noises)
        look = {"color": style.FAINT, "linewidth": 0, "label": "noise"}
        panel.barh(range(len(effects)), 2 * wide, 0.22, -wide, **look)
    for place, effect in enumerate(effects):
        middle, interval = size(effect)
        ends = measure.scale * np.array(interval or (middle, middle))
        colour = style.SERIES[0] if effect["above_noise"] else style.MUTED
        panel.plot(ends, [place, place], color=colour, linewidth=1.0)
        look = {"marker": "o", "markersize": 5, "color": colour}
        panel.plot(
            measure.scale * np.array([middle]),
            [place],
            **look,
            markerfacecolor=colour if effect["above_noise"] else "white",
        )
        panel.annotate(
            effect["parameter"],
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
def _draw_maps(result: Result) -> Figure:
    """A map over the first two parameters for each condition and each value of the others."""
    x, y, *others = result["axes"]
    cells = result["points"]
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    titles = {axis: measures.axis(result, axis) for axis in result["axes"]}
    rests = list(dict.fromkeys(_rest(titles, cell, others) for cell in cells))
    pairs = [(name, rest) for rest in rests for name in names]
    drawn = pairs[:_MOST_MAPS]
    steps = [len(dict.fromkeys(_text(cell["values"][axis]) for cell in cells)) for axis in (x, y)]
    full = steps[0] <= _MOST_COLUMNS
    height = steps[1] * ((3.6 if full else 1.6) * _LINE) + 0.35
    figure = style.canvas(style.WIDTH, 1.5 + height * len(drawn))
    panels = figure.subplots(len(drawn), 1, squeeze=False, sharex=True)[:, 0]
    measure = measures.measure(result)
    known = [c["response"] for c in cells if c["response"] is not None]
    shares = result["response"] == "success_share" or not known
    ends = (0.0, 1.0) if shares else (float(np.nanmin(known)), float(np.nanmax(known)))
    if ends[0] == ends[1]:  # one colour for one value in all maps
        ends = (ends[0] - 0.5, ends[1] + 0.5)
    image: Any = None
    for panel, (name, rest) in zip(panels, drawn, strict=True):
        of = [c for c in cells if (c["condition"], _rest(titles, c, others)) == (name, rest)]
        image = _draw_map(panel, of, (x, y), ends, measure, full)
        panel.set_title(", ".join(filter(None, [name, rest])))
        panel.set_ylabel(titles[y])
    panels[-1].set_xlabel(titles[x])
    title = measure.title
    if full:
        interval = any(cell["response95"] for cell in cells)
        title += f"\nwith {'its 95 % interval and ' * interval}how many trials it is of"
    if len(drawn) < len(pairs):
        title += f"\nthe first {len(drawn)} of {len(pairs)} maps"
    bar = figure.colorbar(image, ax=panels, label=title, **style.above(figure))
    bar.ax.xaxis.set_major_formatter(lambda value, _: f"{measure.scale * value:.3g}")
    return figure


def _draw_map(
    panel: Axes,
    cells: Sequence[Result],
    axes: tuple[str, str],
    ends: Any,
    measure: Measure,
    full: bool,
) -> Any:
    """One map; its cells tell the value and, if they are to be full, interval and counts."""
    columns, rows = (list(dict.fromkeys(_text(c["values"][a]) for c in cells)) for a in axes)
    grid = np.full((len(rows), len(columns)), np.nan)
    for cell in cells:
        i, j = (
            rows.index(_text(cell["values"][axes[1]])),
            columns.index(_text(cell["values"][axes[0]])),
        )
        value = grid[i, j] = np.nan if cell["response"] is None else cell["response"]
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


def _text_of(cell: Result, measure: Measure) -> str:
    """Value, interval if there is one, and counts of a cell, a line each."""
    valid = cell["trials"] - cell["invalid"]
    counts = f"{cell['successes']} of {valid}" if "successes" in cell and valid else f"n {valid}"
    if cell["response"] is None:
        return f"{NONE}\n{counts}"
    value = shown(cell["response"], measure.form, measure.scale)
    if not (ends := cell["response95"]):
        return f"{value}\n{counts}"
    of = shown(ends, measure.form, measure.scale).replace(" to ", "–")
    return f"{value}\n{of}\n{counts}"


@style.styled
def _draw_lines(result: Result) -> Figure:
    """The response against each parameter, with the interval of each point."""
    axes, cells = result["axes"], result["points"]
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    figure = style.canvas(style.WIDTH, 0.4 + 2.4 * len(axes))
    panels = figure.subplots(len(axes), 1, squeeze=False, sharey=True)[:, 0]
    measure = measures.measure(result)
    scaled = [
        {
            **cell,
            "response": None if cell["response"] is None else measure.scale * cell["response"],
            "response95": cell["response95"] and [measure.scale * v for v in cell["response95"]],
        }
        for cell in cells
    ]
    for panel, axis in zip(panels, axes, strict=True):
        values = [cell["values"][axis] for cell in cells]
        words = None
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
            words = list(dict.fromkeys(map(_text, values)))
        for name, colour in zip(names, style.series(len(names)), strict=True):
            rows = [cell for cell in scaled if cell["condition"] == name]
            at = [cell["values"][axis] for cell in rows]
            x = at if words is None else [float(words.index(_text(v))) for v in at]
            look = {"marker": "o", "color": colour, "label": name or None}
            style.intervals(panel, x, rows, ("response", "response95"), **look)
        if words is not None:
            style.categories(panel, words)
        panel.set_xlabel(measures.axis(result, axis))
        panel.set_ylabel(measure.title)
    if len(names) > 1:
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _rest(titles: Mapping[str, str], cell: Result, others: Sequence[str]) -> str:
    return ", ".join(f"{titles[o]} {_text(cell['values'][o])}" for o in others)


EXPERIMENT = Experiment.of_folder(
    *(__name__, StudyConfig, run, tables, sentence),
    check=check,
    failed=lambda result: measures.NO_RESULT.issuperset(result["statuses"]),
    continued=True,
    tasks=planned,
    figures=figures,
    captions={
        "effects": "The largest effects with their intervals, and how far noise alone would reach.",
        "map": "The response over two parameters, a map for each condition.",
        "points": "The response against each parameter, with the interval of each point.",
    },
)
