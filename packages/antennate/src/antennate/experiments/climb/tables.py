"""Tables and sentence of a result of `antennate climb`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from antennate.experiments.climb.config import ABOUT
from antennate.experiments.climb.grounds import Terrain
from antennate.experiments.climb.measures import PLAN_SHARE, VERDICTS
from antennate.experiments.climb.result import (
    REFERENCE,
    Climbing,
    ClimbResult,
    Crossing,
    Ended,
    OnGround,
    Pair,
    PlanError,
    Sensing,
    Walk,
)
from antennate.studies.columns import NONE, shown
from antennate.studies.tables import Table, of_valid, successes

LEAST_RATIO = 0.98
"""What `climb` is to keep of the speed on the flat floor, set beforehand."""


def tables(result: ClimbResult) -> Sequence[Table]:
    """Steps, other grounds, and what is felt."""
    return [*step_tables(result), *ground_tables(result), *felt_tables(result)]


def step_tables(result: ClimbResult) -> list[Table]:
    """Success over heights, what climbing costs, pairs and plan, with each divisor."""
    found = list[Table]()
    for entry in result.climbing:
        where = f", gain divisor {entry.divisor:g}"
        found += [_success(entry, where, result), _costs(entry, where)]
        if entry.pairs:
            found.append(_pairs(entry, where))
        if entry.plan:
            found.append(_plan(entry.plan, where))
    return found


def ground_tables(result: ClimbResult) -> list[Table]:
    """Crossings, how the others ended, pairs, and speed on the flat, with each divisor."""
    found, limit = list[Table](), result.time_limit_s
    for entry in result.grounds:
        where = f", gain divisor {entry.divisor:g}"
        if any(entry.grounds.values()):
            found += [_crossed(entry, where, limit), _ended(entry, where)]
        if any(entry.pairs.values()):
            found.append(_ground_pairs(entry, where))
        if entry.flat is not None:
            found.append(_flat(entry.flat, where))
    return found


def felt_tables(result: ClimbResult) -> list[Table]:
    """What is felt, with each divisor."""
    found = list[Table]()
    for entry in result.sensing:
        where = f", gain divisor {entry.divisor:g}"
        found += [_confusion(entry, where), _probes(entry, where), _rates(entry, where)]
    return found


def _success(entry: Climbing, where: str, result: ClimbResult) -> Table:
    heights = [f"{100 * h:g} cm" for h in result.heights_m]
    rows = [(name, list(map(_briefly, some))) for name, some in entry.heights.items()]
    note = (
        f"Successes of valid trials, and the Wilson 95 % interval [%]; within "
        f"{result.time_limit_s:g} s, seed {result.seed}.\nAll conditions meet the same "
        "steps, starts and disturbances."
    )
    about = "\n".join(f"{n}: {text}" for n, text in ABOUT.items() if n in entry.heights)
    return Table(f"Climbed{where}", heights, rows, note, preface=about)


def _briefly(row: Ended) -> str:
    """Successes and interval, so short that five heights fit into a terminal."""
    valid = row.trials - row.invalid
    return f"{row.successes}/{valid} {shown(row.wilson95, '.0f', 100.0, '-')}"


def _costs(entry: Climbing, where: str) -> Table:
    note = "All heights. Loads are means over trials, from a link before the edge to the end."
    return Table.of(f"Conditions{where}", entry.conditions, note=note)


def _pairs(entry: Climbing, where: str) -> Table:
    tests = {f"climb, {name}": pair for name, pair in entry.pairs.items()}
    note = "All heights pooled. McNemar's test is exact and two-sided."
    return Table.lines(f"Trial by trial{where}", tests, note=note)


def _plan(plan: Sequence[PlanError], where: str) -> Table:
    word = "reached" if (plan[-1].within or 0.0) >= PLAN_SHARE else "not reached"
    note = (
        "Head by the plan less the true one as the centre of each link crosses the edge; positive "
        f"is ahead of the robot.\nThe aim is {100 * PLAN_SHARE:g} % within -6 to +4 cm: {word}."
    )
    title = f"Error of the plan of climb{where}"
    return Table.lines(title, {row.link: row for row in plan}, note=note)


def _by_ground(entry: Crossing, cell: Callable[[OnGround], str]) -> list[tuple[str, list[str]]]:
    """A line for each ground that has trials, a cell for each condition."""
    return [
        (Terrain.of(some[0].ground).label, list(map(cell, some)))
        for some in zip(*entry.grounds.values(), strict=True)
        if any(row.trials for row in some)
    ]


def _crossed(entry: Crossing, where: str, limit: float) -> Table:
    note = (
        f"Crossings of valid trials, and the Wilson 95 % interval [%]; within {limit:g} s, on "
        f"stairs and in tunnels {2 * limit:g} s."
    )
    return Table(f"Crossed{where}", list(entry.grounds), _by_ground(entry, _briefly), note)


def _ended(entry: Crossing, where: str) -> Table:
    note = "Stopped: before the edge, 15 s after it was felt as a drop. Late: out of time."
    return Table(f"Not crossed{where}", list(entry.grounds), _by_ground(entry, _lost), note)


def _lost(row: OnGround) -> str:
    """How the trials ended that are no crossing."""
    ends = {
        "stopped": row.stopped,
        "fell": row.fell,
        "late": row.timeouts,
        "left": row.left,
        "overturned": row.overturned,
        "invalid": row.invalid,
    }
    return ", ".join(f"{number} {word}" for word, number in ends.items() if number) or NONE


def _ground_pairs(entry: Crossing, where: str) -> Table:
    names = [name for name in entry.grounds if name != "climb"]
    rows = [
        (kind.replace("_", " "), [_briefly_paired(tests.get(name)) for name in names])
        for kind, tests in entry.pairs.items()
    ]
    note = "Crossed by climb alone : by the other alone, and McNemar's exact p; all sizes pooled."
    return Table(f"Ground, trial by trial{where}", [f"climb, {n}" for n in names], rows, note)


def _briefly_paired(test: Pair | None) -> str:
    return NONE if test is None else f"{test.only_climb}:{test.only_other} {test.mcnemar_p:.3g}"


def _flat(flat: dict[str, Walk], where: str) -> Table:
    ends = flat["climb"].ratio_95 if "climb" in flat else None
    word = "not decided"
    if ends is not None and (ends[0] >= LEAST_RATIO or ends[1] < LEAST_RATIO):
        word = "reached" if ends[0] >= LEAST_RATIO else "not reached"
    note = (
        "Way of the middle of the robot over time. Ratios are of the same trials, with a jackknife "
        f"interval.\nThe aim is climb at {LEAST_RATIO:g} of {REFERENCE} or more: {word}."
    )
    return Table.of(f"Speed on the flat floor{where}", flat, note=note)


def _confusion(entry: Sensing, where: str) -> Table:
    rows = [
        (name, [str(counts[verdict]) for verdict in VERDICTS])
        for name, counts in entry.confusion.items()
    ]
    cliff = entry.cliff
    note = (
        "Valid trials by the first thing that climb feels.\nStopped at a drop of 35 cm: "
        f"{of_valid(cliff.stopped, cliff.trials, cliff.wilson95)}."
    )
    lost = f"\nInvalid: {entry.invalid}; the first, {entry.first_reason}." if entry.invalid else ""
    return Table(f"What climb takes the ground for{where}", VERDICTS, rows, note + lost)


def _probes(entry: Sensing, where: str) -> Table:
    error = entry.heights
    note = (
        f"Means. Height of steps of 2 to 10 cm: {error.told} of {error.steps} told, bias "
        f"{shown(error.bias_m, '+.1f', 100.0)} cm, RMSE {shown(error.rmse_m, '.1f', 100.0)} cm."
    )
    return Table.lines(f"The first probe{where}", entry.felt, note=note)


def _rates(entry: Sensing, where: str) -> Table:
    note = "Climbs begun where there is no step; Garwood's exact interval of a Poisson count."
    return Table.of(f"False climbs{where}", entry.false_climbs, note=note)


def sentence(result: ClimbResult) -> str:
    """How many steps were climbed by each condition, with each divisor."""
    parts = list[str]()
    lost = sum(entry.invalid for entry in result.sensing)
    for entry in result.climbing:
        run = {name: each for name, each in entry.conditions.items() if each.trials}
        if run:
            parts.append(f"with gain divisor {entry.divisor:g} {successes(run)}")
        lost += sum(each.invalid for each in run.values())
    why = f" Invalid trials: {lost}; trials.csv gives the reason of each." if lost else ""
    shares = "; ".join(parts) or "none"
    return f"Steps climbed, all heights (95 % interval): {shares}.{why}"
