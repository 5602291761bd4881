"""What is told and drawn of a search: the front beside the references, and both on fresh seeds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.experiments.study import measures
from antennate.experiments.study.designs import Aim, Design, Search, Value, Worth
from antennate.studies.columns import NONE, shown
from antennate.studies.tables import Table, few

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 40
"""Most lines of a table."""
_GOOD = {"minimize": "small is good", "maximize": "large is good"}
_MOST_PANELS = 6
_MARKERS = "*^vDsPX<>"
"""The first reference is a star."""


def tables(found: Search, axes: Sequence[str]) -> list[Table]:
    """The front beside the references, and both on fresh seeds."""
    return [table for table in (_front(found, axes), _on_fresh_seeds(found)) if table.rows]


def _front(found: Search, axes: Sequence[str]) -> Table:
    """The designs of the front and the references, by the trials of the search."""
    judged = [
        (design, design.objectives)
        for design in found.designs
        if design.objectives and (design.reference or design.front)
    ]
    rows = [
        (
            f"{design.name}{' *' if design.front else ''}",
            [
                *(measures.text(design.values.get(axis, NONE)) for axis in axes),
                *(_cell(worth[aim.name], aim) for aim in found.objectives),
            ],
        )
        for design, worth in judged[:_MOST]
    ]
    note = "".join(f"{aim.title}: {_GOOD[aim.goal]}.\n" for aim in found.objectives)
    note += (
        "* is on the front: no other design is as good in all of these and better in one.\nMeans "
        "with 95 % intervals. The front was chosen by these values, so they are optimistic."
    )
    so_few = _few(worth for _, worth in judged)
    if so_few and any(design.fresh for design in found.designs):
        note += f" {so_few}"  # without fresh trials the sentence says it
    if len(judged) > _MOST:
        note += f" The first {_MOST} of {len(judged)} designs; result.json has all."
    heads = [*(axis.rpartition(".")[2] for axis in axes), *(aim.title for aim in found.objectives)]
    return Table("The front and the references", heads, rows, note)


def _on_fresh_seeds(found: Search) -> Table:
    """The designs that were run again: in the search, and on fresh seeds."""
    rows: list[tuple[str, list[str]]] = []
    for design in found.designs:
        if design.objectives and design.fresh:
            cells = [
                f"{shown(design.objectives[aim.name].value, '.3g', aim.scale)}, "
                f"{_cell(design.fresh[aim.name], aim)}"
                for aim in found.objectives
            ]
            rows.append((f"{design.name}{' *' if design.fresh_front else ''}", cells))
    note = (
        "Search, then fresh seeds by which nothing was chosen, with the 95 % interval.\n"
        "* is on the front of these designs on fresh seeds."
    )
    return Table("On fresh seeds", [aim.title for aim in found.objectives], rows, note)


def _few(worths: Iterable[Worth]) -> str:
    """What is said where a design has few trials."""
    return few(value.trials for worth in worths for value in worth.values())


def _cell(value: Value, aim: Aim) -> str:
    """A value in the unit of the title, with its interval if it has one."""
    text = shown(value.value, ".3g", aim.scale)
    return f"{text} ({shown(value.value95, '.3g', aim.scale)})" if value.value95 else text


def sentence(found: Search, trials: int, statuses: Mapping[str, int]) -> str:
    """How many designs were compared, and the best ones beside the first reference."""
    designs = found.designs
    proposed = [design for design in designs if not design.reference]
    text = (
        f"Designs proposed: {len(proposed)}, references: {len(designs) - len(proposed)}, "
        f"trials: {trials}, on the front: {sum(design.front for design in designs)}"
    )
    again = [(design, design.fresh) for design in designs if design.fresh]
    known = again or [(design, design.objectives) for design in designs if design.objectives]
    if known:
        best = [_best(known, aim) for aim in found.objectives]
        seeds = "fresh seeds" if again else "the seeds of the search, which flatter"
        text += f". Best of each objective on {seeds} (95 % interval): {'; '.join(best)}"
    if so_few := _few(worth for _, worth in known):
        text += f". {so_few.removesuffix('.')}"
    text += measures.silent(statuses)
    lost = sum(design.state in ("failed", "refused") for design in designs)
    return text + (f". Designs that could not be judged: {lost}." if lost else ".")


def _best(known: Sequence[tuple[Design, Worth]], aim: Aim) -> str:
    """The best design in an objective, beside the first reference."""
    values = [(design, worth[aim.name]) for design, worth in known]
    valued = [(design, value) for design, value in values if value.value is not None]
    if not valued:
        return f"{aim.title}: none"
    chosen = min if aim.goal == "minimize" else max
    best, value = chosen(valued, key=lambda each: each[1].value or 0.0)
    label = best.name if best.reference else f"design {best.name}"
    text = f"{aim.title}: {label} {_cell(value, aim)}"
    first = next((each for each in values if each[0].reference), None)
    if first is not None and first[0] is not best:
        text += f", {first[0].name} {_cell(first[1], aim)}"
    return text


@style.styled
def draw(found: Search) -> Figure:
    """All designs, the front, the references, and those that were run again with intervals."""
    aims = found.objectives
    pairs = list(combinations(aims, 2))[:_MOST_PANELS] or [(None, aims[0])]
    figure = style.canvas(style.WIDTH, 1.0 + 3.1 * len(pairs))
    panels = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    for panel, (x, y) in zip(panels, pairs, strict=True):
        _draw_pair(panel, found.designs, x, y)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _draw_pair(panel: Axes, designs: Sequence[Design], x: Aim | None, y: Aim) -> None:
    judged = [design for design in designs if design.objectives]
    proposed = [design for design in judged if not design.reference]
    rest = [design for design in proposed if not design.front]
    best = [design for design in proposed if design.front]
    _draw_points(panel, rest, x, y, color=style.FAINT, marker="o", label="proposed")
    _draw_points(panel, best, x, y, color=style.SERIES[0], marker="o", label="front, in the search")
    references = [design for design in judged if design.reference]
    looks = zip(style.series(len(references) + 1)[1:], _MARKERS * len(references), strict=False)
    for design, (colour, marker) in zip(references, looks, strict=False):
        look = {"color": colour, "marker": marker, "label": design.name, "zorder": 4}
        _draw_points(panel, [design], x, y, markersize=11 if marker == "*" else 7, **look)
        _draw_fresh(panel, [design], x, y, colour, marker)
    _draw_fresh(panel, best, x, y, style.SERIES[0], "o", label="on fresh seeds, 95 %")
    panel.set_xlabel("design" if x is None else _words(x))
    panel.set_ylabel(_words(y))


def _draw_points(
    panel: Axes, designs: Sequence[Design], x: Aim | None, y: Aim, **look: Any
) -> None:
    if designs:
        places = [[_value(each, aim, each.objectives) for each in designs] for aim in (x, y)]
        look = {"linestyle": "", "markersize": 5, **look}
        panel.plot(*places, **look)


def _draw_fresh(
    panel: Axes,
    designs: Sequence[Design],
    x: Aim | None,
    y: Aim,
    colour: str,
    marker: str,
    **look: Any,
) -> None:
    """Open marks with intervals, each joined to its value in the search."""
    for design in designs:
        if not design.fresh:
            continue
        ends = [
            [_value(design, aim, worth) for worth in (design.objectives, design.fresh)]
            for aim in (x, y)
        ]
        panel.plot(*ends, color=colour, linewidth=0.8, linestyle=(0, (2, 1.5)))
        panel.errorbar(
            [ends[0][1]],
            [ends[1][1]],
            yerr=_whiskers(design.fresh[y.name], y),
            xerr=None if x is None else _whiskers(design.fresh[x.name], x),
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


def _whiskers(fresh: Value, aim: Aim) -> Any:
    value = _scaled(fresh, aim)
    low, high = value, value
    if fresh.value95 and fresh.trials >= style.ENOUGH_TRIALS:
        low, high = np.array(fresh.value95) * aim.scale
    return np.nan_to_num(np.maximum(0.0, [[value - low], [high - value]]))


def _value(design: Design, aim: Aim | None, worth: Worth | None) -> float:
    """A value as it is drawn, NaN if there is none; without an objective the number of a design."""
    if aim is None:
        return design.point
    return _scaled(worth[aim.name], aim) if worth else math.nan


def _scaled(value: Value, aim: Aim) -> float:
    return math.nan if value.value is None else aim.scale * value.value


def _words(aim: Aim) -> str:
    return f"{aim.title}\n{_GOOD[aim.goal]}"
