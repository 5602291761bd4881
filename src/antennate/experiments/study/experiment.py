"""The experiment `study`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import Any

from antennate.control.registry import compared
from antennate.experiments.study import labels, measures
from antennate.experiments.study import run as study
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import size
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Table, few, share

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


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What the response depends on, or the points one by one."""
    found = [_effects(result)] if _known(result) else [_points(result)]
    return [table for table in found if table.rows]


def _known(result: Mapping[str, Any]) -> bool:
    """Whether any effect is known."""
    return any(size(effect)[0] is not None for effect in result["effects"])


def _points(result: Mapping[str, Any]) -> Table:
    cells, axes = result["points"], result["axes"]
    shown_axes = axes if len(axes) <= _MOST_AXES else []
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    by_point: dict[int, list[Mapping[str, Any]]] = {}
    for cell in cells:
        by_point.setdefault(cell["point"], []).append(cell)
    measure = labels.measure(result)
    heads = [f"{name}: {measure.title}" if name else measure.title for name in names]
    rows = [
        (
            str(number),
            [
                *(labels.text(of[0]["values"][axis]) for axis in shown_axes),
                *(labels.cell(measure, c["response"], c["response95"]) for c in of),
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
    columns = [*(labels.axis(result, axis) for axis in shown_axes), *heads]
    return Table("Points", columns, rows[:_MOST], note, leading=len(shown_axes))


def _ended(result: Mapping[str, Any]) -> str:
    """How many trials there are, of how many if some are missing."""
    planned = f"{result['trials']} trials"
    if not result["interrupted"]:
        return planned
    return f"{result['ended']} of {planned}"


def _effects(result: Mapping[str, Any]) -> Table:
    targets, headline = _targets(result)
    by_name: dict[str, dict[str, Mapping[str, Any]]] = {}
    for effect in result["effects"]:
        by_name.setdefault(effect["parameter"], {})[effect["of"]] = effect
    ranked = sorted(by_name.items(), key=lambda item: -abs(size(item[1][headline])[0] or 0.0))
    measure = labels.measure(result)
    rows = [
        (name, [*(labels.cell(measure, *size(of[t])) for t in targets), _above(of)])
        for name, of in ranked
    ]
    note = _SLOPES
    if result["plan"] == "morris":
        note = _MORRIS
        floors = [labels.cell(measure, ranked[0][1][target].get("noise")) for target in targets]
        rows.insert(0, (f"noise of {labels.sample(result)}", [*floors, ""]))
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


def _above(of: Mapping[str, Mapping[str, Any]]) -> str:
    found = [target or "yes" for target, effect in of.items() if effect.get("above_noise")]
    return ", ".join(found) or NONE


def sentence(result: Mapping[str, Any]) -> str:
    """What came out over all points, and how many trials say nothing."""
    points = len({cell["point"] for cell in result["points"]})
    text = f"{result['experiment']} at {points} points, {_ended(result)}"
    told = {n: c for n, c in result["conditions"].items() if c.get(measures.SUCCESS) is not None}
    if told:
        rates = (
            (f"{name} " if name else "")
            + share(c["successes"], c["trials"] - c["invalid"], c["wilson95"])
            for name, c in told.items()
        )
        text += f"; successes over all of them (95 % interval): {', '.join(rates)}"
    if result["effects"]:
        text += f". {_depends(result)}"
    elif so_few := _few(result):
        text += f". {so_few.removesuffix('.')}"
    return f"{text}{labels.silent(result['statuses'])}."


def _depends(result: Mapping[str, Any]) -> str:
    """What the response depends on, of the last target: the parameters above the noise."""
    _, last = _targets(result)
    found = [e for e in result["effects"] if e["of"] == last and size(e)[0] is not None]
    found.sort(key=lambda effect: -abs(size(effect)[0] or 0.0))
    what = "the " + " of ".join(filter(None, [labels.measure(result).label, last]))
    above = [effect["parameter"] for effect in found if effect.get("above_noise")]
    of = labels.sample(result)
    if above:
        more = f" and {len(above) - _NAMED} more" if len(above) > _NAMED else ""
        return f"Above the noise of {of}, {what} depends on {', '.join(above[:_NAMED])}{more}"
    if not found or any(effect.get("above_noise") is None for effect in found):
        return f"Of {of} no noise is known, so nothing tells what {what} depends on"
    return f"Of {len(found)} parameters nothing moves {what} above the noise of {of}"


CAPTIONS = {
    "effects": "The largest effects with their intervals, and how far noise alone would reach.",
    "map": "The response over two parameters, a map for each condition.",
    "points": "The response against each parameter, with the interval of each point.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, StudyConfig, study.run, tables, sentence),
    check=study.check,
    failed=lambda result: measures.NO_RESULT.issuperset(result["statuses"]),
    continued=True,
    tasks=study.every,
    captions=CAPTIONS,
)
