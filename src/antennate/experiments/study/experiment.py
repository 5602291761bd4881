"""The experiment `study`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.study import measures
from antennate.experiments.study import run as study
from antennate.experiments.study.config import StudyConfig
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table, shown

_MOST = 60
"""Most lines of a table."""


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What the response hangs on, or the points one by one."""
    found = [_effects(result)] if result["effects"] else [_points(result)]
    return [table for table in found if table.rows]


def _points(result: Mapping[str, Any]) -> Table:
    cells, axes = result["points"], result["axes"]
    names = list(dict.fromkeys(cell["condition"] for cell in cells))
    by_point: dict[int, list[Mapping[str, Any]]] = {}
    for cell in cells:
        by_point.setdefault(cell["point"], []).append(cell)
    rows = [
        (
            str(number),
            [*(_value(of[0]["values"][axis]) for axis in axes), *map(_response, of)],
        )
        for number, of in by_point.items()
    ]
    label = result["response"] or "response"
    heads = [label.replace("_", " ") if not name else f"{name}: {label}" for name in names]
    note = f"Mean of each point with its 95 % interval, {result['trials']} trials in all."
    if len(rows) > _MOST:
        note += f" The first {_MOST} of {len(rows)} points; result.json has all."
    return Table(
        "Points", [*(axis.rpartition(".")[2] for axis in axes), *heads], rows[:_MOST], note
    )


def _response(cell: Mapping[str, Any]) -> str:
    mean, ends = cell["response"], cell["response95"]
    return shown(mean, ".3g") + (f" ({shown(ends, '.3g')})" if ends and mean == mean else "")


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
    rows = [(name, [_size(of[target]) for target in targets]) for name, of in ranked]
    return Table(
        "Effects",
        [target or result["response"] for target in targets],
        rows,
        f"Mean size of the change of {result['response']} over the whole range of a parameter "
        "(Morris's mu*), with its 95 % interval.",
    )


def _size(effect: Mapping[str, Any]) -> str:
    ends = effect["mu_star95"]
    return shown(effect["mu_star"], ".3g") + (f" ({shown(ends, '.3g')})" if ends else "")


def sentence(result: Mapping[str, Any]) -> str:
    """What came out over all points, and how many trials say nothing."""
    points = len({cell["point"] for cell in result["points"]})
    text = f"{result['experiment']} at {points} points, {result['trials']} trials"
    told = {n: c for n, c in result["conditions"].items() if c.get(measures.SUCCESS) is not None}
    if told:
        rates = (
            f"{f'{name} ' if name else ''}{c['successes']} of {c['trials'] - c['invalid']} "
            f"({shown(c['wilson95'])})"
            for name, c in told.items()
        )
        text += f"; successes over all of them (95 % interval): {', '.join(rates)}"
    if result["effects"]:
        last = result["effects"][-1]["of"]
        known = [e for e in result["effects"] if e["of"] == last and e["mu_star"] is not None]
        first = sorted(known, key=lambda effect: -effect["mu_star"])[:3]
        what = " ".join(filter(None, [result["response"], last and f"of {last}"]))
        text += (
            f". {what} hangs most on {', '.join(e['parameter'] for e in first)}" if first else ""
        )
    bad = {name: n for name, n in result["statuses"].items() if name != "ok"}
    text += "." if not bad else f". Trials that say nothing: {_counted(bad)}; trials.csv has why."
    return text


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{n} {name}" for name, n in counts.items())


EXPERIMENT = Experiment.of_folder(
    *(__name__, StudyConfig, study.run, tables, sentence),
    check=study.check,
    continued=True,
)
