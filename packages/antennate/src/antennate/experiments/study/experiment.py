"""The experiment `study`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

from antennate.control.registry import compared
from antennate.experiments.study import measures, tradeoff
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import Elementary, Slope
from antennate.experiments.study.result import Cell, StudyResult, Successes
from antennate.experiments.study.run import check, planned, run
from antennate.studies.columns import NONE
from antennate.studies.experiment import Experiment, checked
from antennate.studies.tables import Table, few, of_valid

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


def tables(result: StudyResult) -> Sequence[Table]:
    """What the response depends on, or the points one by one."""
    if result.search:
        return tradeoff.tables(result.search, result.axes)
    table = _effects(result) if result.tells_effects else _points(result)
    return [table] if table.rows else []


def _points(result: StudyResult) -> Table:
    """The response at each point."""
    axes = result.axes
    shown_axes = axes if len(axes) <= _MOST_AXES else []
    names = list(dict.fromkeys(cell.condition for cell in result.points))
    by_point: dict[int, list[Cell]] = {}
    for cell in result.points:
        by_point.setdefault(cell.point, []).append(cell)
    measure = result.measure
    heads = [f"{result.label(name)}: {measure.title}" if name else measure.title for name in names]
    rows = [
        (
            str(number),
            [
                *(measures.text(of[0].values[axis]) for axis in shown_axes),
                *(measures.cell(measure, cell.response, cell.response95) for cell in of),
            ],
        )
        for number, of in by_point.items()
    ]
    so_few = _few(result)
    interval = "" if so_few else " with its 95 % interval"
    note = f"Mean of each point{interval}, {_ended(result)} in all."
    if so_few and result.effects:  # without effects the sentence says it
        note += f" {so_few}"
    if len(rows) > _MOST:
        note += f" The first {_MOST} of {len(rows)} points; result.json has all."
    if not shown_axes:
        note += f" The values of the {len(axes)} parameters of each point are in trials.csv."
    columns = [*(measures.axis(result.experiment, axis) for axis in shown_axes), *heads]
    return Table("Points", columns, rows[:_MOST], note, leading=len(shown_axes))


def _ended(result: StudyResult) -> str:
    """How many trials there are, of how many if some are missing."""
    missing = f"{result.ended} of " if result.interrupted else ""
    return f"{missing}{result.trials} trials"


def _effects(result: StudyResult) -> Table:
    """The parameters, the one of the largest effect first."""
    targets, headline = _targets(result)
    by_name: dict[str, dict[str, Elementary | Slope]] = {}
    for effect in result.effects:
        by_name.setdefault(effect.parameter, {})[effect.of] = effect
    ranked = sorted(by_name.items(), key=lambda item: -abs(item[1][headline].size[0] or 0.0))
    measure = result.measure
    rows = [
        (
            name,
            [
                *(measures.cell(measure, *of[target].size) for target in targets),
                ", ".join(result.label(t) or "yes" for t, each in of.items() if each.above_noise)
                or NONE,
            ],
        )
        for name, of in ranked
    ]
    note = _SLOPES
    if result.plan == "morris":
        note = _MORRIS
        floors = [measures.cell(measure, ranked[0][1][target].noise) for target in targets]
        rows.insert(0, (f"noise of {result.sample}", [*floors, ""]))
    return Table(
        "Effects",
        [*(result.label(target) or measure.title for target in targets), "above the noise"],
        rows,
        note.format(measure.title),
    )


def _targets(result: StudyResult) -> tuple[list[str], str]:
    """What the effects are of, and the one that a headline tells of: against the rival, if any."""
    targets = list(dict.fromkeys(effect.of for effect in result.effects))
    pair = compared([target for target in targets if " minus " not in target])
    names = [f"{first} minus {second}" for first, second in permutations(pair or (), 2)]
    return targets, next((target for target in targets if target in names), targets[-1])


def _few(result: StudyResult) -> str:
    """What is said where a point has few trials."""
    return few((cell.trials - cell.invalid for cell in result.points), per_point=True)


def sentence(result: StudyResult) -> str:
    """What came out over all points, and how many trials say nothing."""
    if result.search:
        return tradeoff.sentence(result.search, result.ended, result.statuses)
    points = len({cell.point for cell in result.points})
    text = f"{result.experiment} at {points} points, {_ended(result)}"
    rates = [
        (f"{result.label(name)} " if name else "")
        + of_valid(each.successes, each.trials - each.invalid, each.wilson95)
        for name, each in result.conditions.items()
        if isinstance(each, Successes) and each.success_share is not None
    ]
    if rates:
        text += f"; successes over all of them (95 % interval): {', '.join(rates)}"
    if result.effects:
        text += f". {_depends(result)}"
    elif so_few := _few(result):
        text += f". {so_few.removesuffix('.')}"
    return f"{text}{measures.silent(result.statuses)}."


def _depends(result: StudyResult) -> str:
    """What the response depends on, of the last target: the parameters above the noise."""
    _, last = _targets(result)
    known = result.known_effects(last)
    what = "the " + " of ".join(filter(None, [result.measure.label, result.label(last)]))
    above = [effect.parameter for effect in known if effect.above_noise]
    of = result.sample
    if above:
        more = f" and {len(above) - _NAMED} more" if len(above) > _NAMED else ""
        return f"Above the noise of {of}, {what} depends on {', '.join(above[:_NAMED])}{more}"
    if not known or any(effect.above_noise is None for effect in known):
        return f"Of {of} no noise is known, so nothing tells what {what} depends on"
    return f"Of {len(known)} parameters nothing moves {what} above the noise of {of}"


EXPERIMENT = Experiment.of_folder(
    __name__,
    StudyConfig,
    run,
    tables,
    sentence,
    result=StudyResult,
    settled=checked(check),
    tasks=planned,
    unshared=lambda config: (
        "expected trials that are known before the run, found a plan whose trials follow from "
        "others"
        if config.plan == "optuna"
        else ""
    ),
    captions={
        "effects": "The largest effects with their intervals, and how far noise alone would reach.",
        "map": "The response over two parameters, a map for each condition.",
        "tradeoff": "Every design by its objectives, with the front, the references, and those run "
        "again with their intervals.",
        "points": "The response against each parameter, with the interval of each point; "
        "conditions stand a little aside of each other.",
    },
)
