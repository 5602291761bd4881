"""The experiment `study`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.study import labels, measures
from antennate.experiments.study import run as study
from antennate.experiments.study.config import StudyConfig
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Measure, Table, shown

_MOST = 60
"""Most lines of a table."""
_NAMED = 3
"""Parameters that the sentence names."""


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What the response depends on, or the points one by one."""
    found = [_effects(result)] if result["effects"] else [_points(result)]
    return [table for table in found if table.rows]


def _points(result: Mapping[str, Any]) -> Table:
    cells, axes = result["points"], result["axes"]
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
                *(_value(of[0]["values"][axis]) for axis in axes),
                *(labels.cell(measure, c["response"], c["response95"]) for c in of),
            ],
        )
        for number, of in by_point.items()
    ]
    note = f"Mean of each point with its 95 % interval, {_ended(result)} in all."
    if len(rows) > _MOST:
        note += f" The first {_MOST} of {len(rows)} points; result.json has all."
    columns = [*(labels.axis(result, axis) for axis in axes), *heads]
    return Table("Points", columns, rows[:_MOST], note, leading=len(axes))


def _ended(result: Mapping[str, Any]) -> str:
    """How many trials there are, of how many if some are missing."""
    planned = f"{result['trials']} trials"
    if not result["interrupted"]:
        return planned
    return f"{result['ended']} of {planned}"


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return " ".join(map(_value, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _effects(result: Mapping[str, Any]) -> Table:
    targets = list(dict.fromkeys(effect["of"] for effect in result["effects"]))
    by_name: dict[str, dict[str, Mapping[str, Any]]] = {}
    for effect in result["effects"]:
        by_name.setdefault(effect["parameter"], {})[effect["of"]] = effect
    ranked = sorted(by_name.items(), key=lambda item: -(item[1][targets[-1]]["mu_star"] or 0.0))
    measure = labels.measure(result)
    rows = [(name, [*(_size(measure, of[t]) for t in targets), _above(of)]) for name, of in ranked]
    floors = [labels.cell(measure, ranked[0][1][target].get("noise")) for target in targets]
    return Table(
        "Effects",
        [*(target or measure.title for target in targets), "above the noise"],
        [(f"noise of {_trials(result)} a point", [*floors, ""]), *rows],
        f"Mean size of the change of the {measure.title} over the whole range of a parameter "
        "(Morris's mu*), with a 95 % interval over trajectories. Sizes cannot be negative: an "
        "interval above 0 is no effect. The largest stays below the noise in 95 % of studies "
        "without any effect, found from these trials, shuffled between the points.",
    )


def _size(measure: Measure, effect: Mapping[str, Any]) -> str:
    return labels.cell(measure, effect["mu_star"], effect["mu_star95"])


def _above(of: Mapping[str, Mapping[str, Any]]) -> str:
    found = [target or "yes" for target, effect in of.items() if effect.get("above_noise")]
    return ", ".join(found) or NONE


def _trials(result: Mapping[str, Any]) -> str:
    most = max(cell["trials"] for cell in result["points"])
    return f"{most} trial{'s' if most != 1 else ''}"


def sentence(result: Mapping[str, Any]) -> str:
    """What came out over all points, and how many trials say nothing."""
    points = len({cell["point"] for cell in result["points"]})
    text = f"{result['experiment']} at {points} points, {_ended(result)}"
    told = {n: c for n, c in result["conditions"].items() if c.get(measures.SUCCESS) is not None}
    if told:
        rates = (
            f"{f'{name} ' if name else ''}{c['successes']} of {c['trials'] - c['invalid']} "
            f"({shown(c['wilson95'])})"
            for name, c in told.items()
        )
        text += f"; successes over all of them (95 % interval): {', '.join(rates)}"
    if result["effects"]:
        text += f". {_depends(result)}"
    bad = {name: n for name, n in result["statuses"].items() if name != "ok"}
    text += "." if not bad else f". Trials that say nothing: {_counted(bad)}; trials.csv has why."
    return text


def _depends(result: Mapping[str, Any]) -> str:
    """What the response depends on, of the last target: the parameters above the noise."""
    last = result["effects"][-1]["of"]
    found = [e for e in result["effects"] if e["of"] == last and e["mu_star"] is not None]
    found.sort(key=lambda effect: -effect["mu_star"])
    what = "the " + " of ".join(filter(None, [labels.measure(result).label, last]))
    above = [effect["parameter"] for effect in found if effect.get("above_noise")]
    if above:
        more = f" and {len(above) - _NAMED} more" if len(above) > _NAMED else ""
        names = ", ".join(above[:_NAMED])
        return f"Above the noise of {_trials(result)} a point, {what} depends on {names}{more}"
    trials = _trials(result)
    if any(effect.get("above_noise") is None for effect in found):
        return f"Of {trials} a point no noise is known, so nothing tells what {what} depends on"
    return f"Of {len(found)} parameters nothing moves {what} above the noise of {trials} a point"


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{n} {name}" for name, n in counts.items())


EXPERIMENT = Experiment.of_folder(
    *(__name__, StudyConfig, study.run, tables, sentence),
    check=study.check,
    failed=lambda result: measures.NO_RESULT.issuperset(result["statuses"]),
    continued=True,
)
