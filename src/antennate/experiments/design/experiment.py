"""The experiment `design`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.design import run as design
from antennate.experiments.design.config import DesignConfig
from antennate.experiments.study import labels
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Table, few, shown

_MOST = 40
"""Most lines of a table."""
_GOOD = {"minimize": "small is good", "maximize": "large is good"}
Each = Mapping[str, Any]


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The front beside the references, and both on fresh seeds."""
    judged = [each for each in result["designs"] if each["objectives"]]
    judged = [each for each in judged if each["reference"] or each["front"]]
    objectives = result["objectives"]
    names = [_title(objective) for objective in objectives]
    heads = [axis.rpartition(".")[2] for axis in result["axes"]]
    rows = [
        (
            f"{each['name']}{' *' if each['front'] else ''}",
            [
                *(labels.text(each["values"].get(axis, NONE)) for axis in result["axes"]),
                *(_worth(each, "objectives", objective) for objective in objectives),
            ],
        )
        for each in judged[:_MOST]
    ]
    note = "".join(
        f"{name}: {_GOOD[o['goal']]}.\n" for name, o in zip(names, objectives, strict=True)
    )
    note += (
        "* is on the front: no other design is as good in all of these and better in one.\nMeans "
        "with 95 % intervals. The front was chosen by these values, so they are optimistic."
    )
    if (so_few := _few(judged, "objectives")) and any(each["fresh"] for each in result["designs"]):
        note += f" {so_few}"  # without fresh trials the sentence says it
    if len(judged) > _MOST:
        note += f" The first {_MOST} of {len(judged)} designs; result.json has all."
    found = [Table("The front and the references", [*heads, *names], rows, note)]
    again = [each for each in result["designs"] if each["fresh"]]
    if again:
        lines = [
            (
                f"{each['name']}{' *' if each['fresh_front'] else ''}",
                [_both(each, objective) for objective in objectives],
            )
            for each in again
        ]
        found.append(
            Table(
                "On fresh seeds",
                names,
                lines,
                "Search, then fresh seeds by which nothing was chosen, with the 95 % interval.\n"
                "* is on the front of these designs on fresh seeds.",
            )
        )
    return [table for table in found if table.rows]


def _few(designs: Sequence[Each], part: str) -> str:
    """What is said where a design has few trials."""
    return few(value["trials"] for each in designs for value in (each[part] or {}).values())


def _title(objective: Each) -> str:
    """The label of an evaluation, and what is measured there with its unit."""
    return f"{objective['name'].partition('.')[0]}: {objective['title']}"


def _worth(each: Each, part: str, objective: Each) -> str:
    """A value of a design in the unit of the title, with its interval if it has one."""
    found, scale = each[part][objective["name"]], objective["scale"]
    ends = found["value95"]
    text = shown(found["value"], ".3g", scale)
    return f"{text} ({shown(ends, '.3g', scale)})" if ends else text


def _both(each: Each, objective: Each) -> str:
    found = each["objectives"][objective["name"]]["value"]
    return f"{shown(found, '.3g', objective['scale'])}, {_worth(each, 'fresh', objective)}"


def sentence(result: Mapping[str, Any]) -> str:
    """How many designs were compared, and the best ones beside the first reference."""
    designs = result["designs"]
    proposed = [each for each in designs if not each["reference"]]
    text = (
        f"Designs proposed: {len(proposed)}, references: {len(designs) - len(proposed)}, "
        f"trials: {result['trials']}, on the front: {sum(each['front'] for each in designs)}"
    )
    again = [each for each in designs if each["fresh"]]
    part, known = ("fresh", again) if again else ("objectives", designs)
    known = [each for each in known if each[part]]
    first = next((each for each in known if each["reference"]), None)
    if known:
        best = [_best(known, part, objective, first) for objective in result["objectives"]]
        seeds = "fresh seeds" if again else "the seeds of the search, which flatter"
        text += f". Best of each objective on {seeds} (95 % interval): {'; '.join(best)}"
    if so_few := _few(known, part):
        text += f". {so_few.removesuffix('.')}"
    text += labels.silent(result["statuses"])
    lost = sum(each["state"] in ("failed", "refused") for each in designs)
    return text + (f". Designs that could not be judged: {lost}." if lost else ".")


def _best(known: Sequence[Each], part: str, objective: Each, first: Each | None) -> str:
    name = objective["name"]
    chosen = min if objective["goal"] == "minimize" else max
    valued = [each for each in known if each[part][name]["value"] is not None]
    if not valued:
        return f"{_title(objective)}: none"
    best = chosen(valued, key=lambda each: each[part][name]["value"])
    text = f"{_title(objective)}: {_called(best)} {_worth(best, part, objective)}"
    if first is not None and first is not best:
        text += f", {first['name']} {_worth(first, part, objective)}"
    return text


def _called(each: Each) -> str:
    return each["name"] if each["reference"] else f"design {each['name']}"


CAPTIONS = {
    "tradeoff": "Every design by its objectives, with the front, the references, and "
    "those run again with their intervals.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, DesignConfig, design.run, tables, sentence),
    check=design.check,
    continued=True,
    captions=CAPTIONS,
    in_shards=False,
)
