"""The experiment `design`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.experiments.design.config import DesignConfig
from antennate.experiments.design.designs import DesignOutcome
from antennate.experiments.design.search import check, run
from antennate.experiments.study import measures
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Table, few, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 40
"""Most lines of a table."""
_GOOD = {"minimize": "small is good", "maximize": "large is good"}
Entry = Mapping[str, Any]
"""A design or an objective, as result.json has it."""
_MOST_PANELS = 6
_MARKERS = "*^vDsPX<>"
"""The first reference is a star."""


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The front beside the references, and both on fresh seeds."""
    return [table for table in (_front(result), _on_fresh_seeds(result)) if table.rows]


def _front(result: Mapping[str, Any]) -> Table:
    """The designs of the front and the references, by the trials of the search."""
    judged = [design for design in result["designs"] if design["objectives"]]
    judged = [design for design in judged if design["reference"] or design["front"]]
    objectives = result["objectives"]
    names = [_title(objective) for objective in objectives]
    rows = [
        (
            f"{design['name']}{' *' if design['front'] else ''}",
            [
                *(measures.text(design["values"].get(axis, NONE)) for axis in result["axes"]),
                *(_worth(design, "objectives", objective) for objective in objectives),
            ],
        )
        for design in judged[:_MOST]
    ]
    note = "".join(
        f"{name}: {_GOOD[o['goal']]}.\n" for name, o in zip(names, objectives, strict=True)
    )
    note += (
        "* is on the front: no other design is as good in all of these and better in one.\nMeans "
        "with 95 % intervals. The front was chosen by these values, so they are optimistic."
    )
    so_few = _few(judged, "objectives")
    if so_few and any(design["fresh"] for design in result["designs"]):
        note += f" {so_few}"  # without fresh trials the sentence says it
    if len(judged) > _MOST:
        note += f" The first {_MOST} of {len(judged)} designs; result.json has all."
    heads = [axis.rpartition(".")[2] for axis in result["axes"]]
    return Table("The front and the references", [*heads, *names], rows, note)


def _on_fresh_seeds(result: Mapping[str, Any]) -> Table:
    """The designs that were run again: in the search, and on fresh seeds."""
    rows: list[tuple[str, list[str]]] = []
    for design in (design for design in result["designs"] if design["fresh"]):
        cells: list[str] = []
        for objective in result["objectives"]:
            before = design["objectives"][objective["name"]]["value"]
            in_search = shown(before, ".3g", objective["scale"])
            cells.append(f"{in_search}, {_worth(design, 'fresh', objective)}")
        rows.append((f"{design['name']}{' *' if design['fresh_front'] else ''}", cells))
    note = (
        "Search, then fresh seeds by which nothing was chosen, with the 95 % interval.\n"
        "* is on the front of these designs on fresh seeds."
    )
    return Table("On fresh seeds", [_title(o) for o in result["objectives"]], rows, note)


def _few(designs: Sequence[Entry], part: str) -> str:
    """What is said where a design has few trials."""
    return few(value["trials"] for design in designs for value in (design[part] or {}).values())


def _title(objective: Entry) -> str:
    """The label of an evaluation, and what is measured there with its unit."""
    return f"{objective['name'].partition('.')[0]}: {objective['title']}"


def _worth(design: Entry, part: str, objective: Entry) -> str:
    """A value of a design in the unit of the title, with its interval if it has one."""
    value, scale = design[part][objective["name"]], objective["scale"]
    ends = value["value95"]
    text = shown(value["value"], ".3g", scale)
    return f"{text} ({shown(ends, '.3g', scale)})" if ends else text


def sentence(result: Mapping[str, Any]) -> str:
    """How many designs were compared, and the best ones beside the first reference."""
    designs = result["designs"]
    proposed = [design for design in designs if not design["reference"]]
    text = (
        f"Designs proposed: {len(proposed)}, references: {len(designs) - len(proposed)}, "
        f"trials: {result['trials']}, on the front: {sum(design['front'] for design in designs)}"
    )
    again = [design for design in designs if design["fresh"]]
    part, known = ("fresh", again) if again else ("objectives", designs)
    known = [design for design in known if design[part]]
    first = next((design for design in known if design["reference"]), None)
    if known:
        best = [_best(known, part, objective, first) for objective in result["objectives"]]
        seeds = "fresh seeds" if again else "the seeds of the search, which flatter"
        text += f". Best of each objective on {seeds} (95 % interval): {'; '.join(best)}"
    if so_few := _few(known, part):
        text += f". {so_few.removesuffix('.')}"
    text += measures.silent(result["statuses"])
    lost = sum(design["state"] in ("failed", "refused") for design in designs)
    return text + (f". Designs that could not be judged: {lost}." if lost else ".")


def _best(known: Sequence[Entry], part: str, objective: Entry, first: Entry | None) -> str:
    """The best design in an objective, beside the first reference."""
    name = objective["name"]
    chosen = min if objective["goal"] == "minimize" else max
    valued = [design for design in known if design[part][name]["value"] is not None]
    if not valued:
        return f"{_title(objective)}: none"
    best = chosen(valued, key=lambda design: design[part][name]["value"])
    label = best["name"] if best["reference"] else f"design {best['name']}"
    text = f"{_title(objective)}: {label} {_worth(best, part, objective)}"
    if first is not None and first is not best:
        text += f", {first['name']} {_worth(first, part, objective)}"
    return text


def figures(outcome: DesignOutcome) -> dict[str, Figure]:
    """The trade-off; nothing where no design was judged."""
    result = outcome.result()
    return (
        {"tradeoff": _draw_tradeoff(result)}
        if any(d["objectives"] for d in result["designs"])
        else {}
    )


@style.styled
def _draw_tradeoff(result: Mapping[str, Any]) -> Figure:
    """All designs, the front, the references, and those that were run again with intervals."""
    objectives = result["objectives"]
    pairs = list(combinations(objectives, 2))[:_MOST_PANELS] or [(None, objectives[0])]
    figure = style.canvas(style.WIDTH, 1.0 + 3.1 * len(pairs))
    panels = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    for panel, (x, y) in zip(panels, pairs, strict=True):
        _draw_pair(panel, result["designs"], x, y)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _draw_pair(panel: Axes, designs: Sequence[Entry], x: Entry | None, y: Entry) -> None:
    judged = [design for design in designs if design["objectives"]]
    proposed = [design for design in judged if not design["reference"]]
    rest = [design for design in proposed if not design["front"]]
    best = [design for design in proposed if design["front"]]
    _draw_points(panel, rest, x, y, color=style.FAINT, marker="o", label="proposed")
    _draw_points(panel, best, x, y, color=style.SERIES[0], marker="o", label="front, in the search")
    references = [design for design in judged if design["reference"]]
    looks = zip(style.series(len(references) + 1)[1:], _MARKERS * len(references), strict=False)
    for design, (colour, marker) in zip(references, looks, strict=False):
        look = {"color": colour, "marker": marker, "label": design["name"], "zorder": 4}
        _draw_points(panel, [design], x, y, markersize=11 if marker == "*" else 7, **look)
        _draw_fresh(panel, [design], x, y, colour, marker)
    again = [design for design in best if design["fresh"]]
    _draw_fresh(panel, again, x, y, style.SERIES[0], "o", label="on fresh seeds, 95 %")
    panel.set_xlabel("design" if x is None else _words(x))
    panel.set_ylabel(_words(y))


def _draw_points(
    panel: Axes, designs: Sequence[Entry], x: Entry | None, y: Entry, **look: Any
) -> None:
    if designs:
        places = [_value(d, x, "objectives") for d in designs]
        look = {"linestyle": "", "markersize": 5, **look}
        panel.plot(places, [_value(d, y, "objectives") for d in designs], **look)


def _draw_fresh(
    panel: Axes,
    designs: Sequence[Entry],
    x: Entry | None,
    y: Entry,
    colour: str,
    marker: str,
    **look: Any,
) -> None:
    """Open marks with intervals, each joined to its value in the search."""
    for design in designs:
        if not design["fresh"]:
            continue
        ends = [[_value(design, axis, part) for part in ("objectives", "fresh")] for axis in (x, y)]
        panel.plot(*ends, color=colour, linewidth=0.8, linestyle=(0, (2, 1.5)))
        whiskers = {
            "yerr": _whiskers(design, y),
            "xerr": None if x is None else _whiskers(design, x),
        }
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


def _whiskers(design: Entry, objective: Entry) -> Any:
    fresh = design["fresh"][objective["name"]]
    known = fresh["value95"] if fresh["trials"] >= style.ENOUGH_TRIALS else None
    value = _value(design, objective, "fresh")
    low, high = np.array(known) * objective["scale"] if known else (value, value)
    return np.nan_to_num(np.maximum(0.0, [[value - low], [high - value]]))


def _value(design: Entry, objective: Entry | None, part: str) -> float:
    """A value as it is drawn, NaN if there is none."""
    if objective is None:
        return design["design"]
    value = design[part][objective["name"]]["value"]
    return math.nan if value is None else objective["scale"] * value


def _words(objective: Entry) -> str:
    better = "small" if objective["goal"] == "minimize" else "large"
    return f"{objective['title']}\n{better} is good"


EXPERIMENT = Experiment.of_folder(
    *(__name__, DesignConfig, run, tables, sentence),
    check=check,
    continued=True,
    figures=figures,
    captions={
        "tradeoff": "Every design by its objectives, with the front, the references, and those run "
        "again with their intervals.",
    },
    in_shards=False,
)
