"""Tables and figure of docs/science/climb.md: `python docs/science/climb.py`.

They are made of docs/science/climb*.csv, the trials.csv of the runs that the page names; with
--check the page is only compared.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from antennate.experiments.climb.config import CONTROLLERS, ClimbConfig
from antennate.experiments.climb.figure import success
from antennate.experiments.climb.measures import PLAN_BAND, pairs, summarise
from antennate.experiments.climb.physics import ClimbPath
from antennate.experiments.climb.result import ClimbResult
from antennate.experiments.climb.rows import ClimbRow
from antennate.experiments.climb.tables import ground_tables, sentence, step_tables, tables
from antennate.experiments.tunnel.physics import TrialResult
from antennate.experiments.tunnel.result import ControllerSummary, paired, summary
from antennate.figures import render
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies.columns import columns
from antennate.studies.experiment import Found
from antennate.studies.formats import from_csv
from antennate.studies.pooling import frame
from antennate.studies.statistics import mean95
from antennate.studies.tables import Table

ClimbOutcome = Found[ClimbConfig, ClimbResult, ClimbPath]
HERE = Path(__file__).parent
ROWS, PAGE, FIGURE = (HERE / f"climb.{end}" for end in ("csv", "md", "png"))
GROUND = HERE / "climb_ground.csv"
"""A run on other grounds, and on steps that are too high."""
WITHOUT = HERE / "climb_without.csv"
"""The trials of `climb` of the first run again, by a robot without an inertial sensor."""
FAR = HERE / "climb_far.csv"
"""Steps that stand up to 2.35 m ahead, for touch and for a clock that was tuned for them."""
PLANE = HERE / "climb_plane.csv"
"""Two runs of `tunnel`, one after the other: `scuttle3d` and `scuttle`."""
CROSSED = [
    measure
    for measure in columns(ControllerSummary)
    if measure.name.startswith(("success", "wilson", "timeouts", "left", "speed"))
    or measure.name == "restricted_mean_time_s"
]
"""Measures of those that the page shows."""
FELT = (0.045, 0.065, 0.08)
"""Heights by the probe between which plans are taken together [m]."""
NONE = "0/0 -"
"""A cell without a trial."""
REGION = re.compile(r"(<!-- climb: [^>]*-->\n).*(<!-- end of climb -->)", re.DOTALL)


def main() -> None:
    """Write the region of the page between its marks, and draw the figure."""
    text = "The long run has not been made yet.\n"
    if ROWS.exists():
        outcome = outcome_of(ROWS)
        result = outcome.result()
        text = f"{sentence(result)}\n\n"
        text += "![Success over heights of steps and widths of gaps](climb.png)\n\n"
        text += "\n".join(map(markdown, tables(result)))
        text += f"\n{lead(outcome.rows)}\n"
        if "--check" not in sys.argv[1:]:
            grounds = outcome_of(GROUND).result().grounds
            FIGURE.write_bytes(render(success(result.climbing, grounds))["png"])
        ground = outcome_of(GROUND).result()
        text += "\n### On other grounds\n\n"
        text += "\n".join(markdown(t) for t in [*first_of(ground), *ground_tables(ground)])
        text += "\n### Steps 0.35 to 2.35 m ahead\n\n"
        text += "\n".join(map(markdown, far()))
        text += "\n### Without the inertial sensor\n\n"
        text += "\n".join(map(markdown, without(outcome)))
        text += f"\n### In the plane\n\n{markdown(plane())}"
    page = PAGE.read_text()
    new = REGION.sub(lambda found: f"{found[1]}\n{text}\n{found[2]}", page)
    if "--check" in sys.argv[1:] and new != page:
        sys.exit("docs/science/climb.md is out of date: run `uv run python docs/science/climb.py`")
    PAGE.write_text(new)


def first_of(result: ClimbResult) -> list[Table]:
    """Tables of success over the height of steps, one each divisor that has trials."""
    shown = [entry for entry in result.climbing if entry.conditions["climb"].trials]
    found = step_tables(replace(result, climbing=shown))
    return [table for table in found if table.title.startswith("Climbed")]


def without(outcome: ClimbOutcome) -> Iterator[Table]:
    """Success of `climb` without an inertial sensor, and the pairs with those of a run with it."""
    run = outcome_of(WITHOUT)
    runs = {"climb": outcome.frame[outcome.frame["condition"] == "climb"], "without": run.frame}
    climbs = {name: rows[rows["part"] == "climbing"] for name, rows in runs.items()}
    for table in first_of(run.result()):
        divisor = float(table.title.rpartition(" ")[2])
        of = {name: rows[rows["divisor"] == divisor] for name, rows in climbs.items()}
        test = pairs(of)["without"]
        note = (
            f"Seed {outcome.config.seed}. Of {test.trials} pairs {test.only_climb} were climbed "
            f"with the sensor alone, {test.only_other} without it alone; McNemar p "
            f"{test.mcnemar_p:.3g}."
        )
        yield replace(table, title=f"{table.title}, without the sensor", note=note)


def far() -> Iterator[Table]:
    """Success where the distance of the step is drawn from two metres, and the pairs."""
    result = outcome_of(FAR).result()
    for table, entry in zip(first_of(result), result.climbing, strict=True):
        test = entry.pairs["rhythm"]
        note = (
            f"Steps 0.35 to 2.35 m ahead, within {result.time_limit_s:g} s, seed {result.seed}; "
            f"`rhythm` walks for 10 s. Of {test.trials} pairs {test.only_climb} were climbed by "
            f"climb alone, {test.only_other} by rhythm alone; McNemar p {test.mcnemar_p:.3g}."
        )
        yield replace(table, title=f"{table.title}, 0.35 to 2.35 m ahead", note=note)


def lead(rows: Sequence[ClimbRow]) -> str:
    """How good the plan of `climb` is, less what half of the trials tell of its error."""
    (low, high), words = PLAN_BAND, list[str]()
    for divisor in sorted({row.divisor for row in rows}, reverse=True):
        halves: tuple[dict[tuple[int, int], list[float]], ...] = ({}, {})
        for row in rows:
            if (row.part, row.condition, row.divisor) == ("climbing", "climb", divisor):
                felt = math.inf if row.felt_height_m is None else row.felt_height_m
                for link, error in (part.split(":") for part in row.plan_error_m.split()):
                    place = int(link), int(np.digitize(felt, FELT))
                    halves[row.trial % 2].setdefault(place, []).append(float(error))
        told, asked = halves
        rest = np.concatenate(
            [np.array(errors) - np.median(told[at]) for at, errors in asked.items() if at in told]
        )
        words.append(f"{np.mean((low < rest) & (rest < high)):.0%} ({divisor:g})")
    return (
        "The median error of each link and height by the probe (to 4.5, 6.5, 8 cm, and more) in "
        "the trials of even number is taken off in those of odd number. Then "
        f"{' and '.join(words)} of these are within {100 * low:+g} to {100 * high:+g} cm."
    )


def plane() -> Table:
    """Two robots in the same tunnels, and the pair of them."""
    rows = [TrialResult(**{**row, "reason": ""}) for row in from_csv(PLANE.read_text())]
    half = len(rows) // 2
    robots = {"scuttle3d": rows[:half], "scuttle": rows[half:]}
    frames = {name: frame(own) for name, own in robots.items()}
    crossed = {name: summary(own, TIME_LIMIT) for name, own in frames.items()}
    pair = paired(frames, TIME_LIMIT)["scuttle3d-scuttle"]
    low, high = pair.time_difference_95 or (np.nan, np.nan)
    better = [
        (a.outcome == "success") - (b.outcome == "success")
        for a, b in zip(*robots.values(), strict=True)
    ]
    mean, ends = mean95(100.0 * np.array(better))
    assert ends is not None
    note = (
        f"`closed` in {half} tunnels, seed {rows[0].seed}. Only scuttle3d crossed "
        f"{pair.only_first}, only scuttle {pair.only_second}; McNemar p "
        f"{pair.mcnemar_p:.3g}; {mean:+.1f} points ({ends[0]:+.1f} to {ends[1]:+.1f}, Student's "
        f"of the pairs). Time, a failure as the limit: {pair.time_difference_s:+.1f} "
        f"s ({low:+.1f} to {high:+.1f})."
    )
    return Table.of(
        "Tunnels crossed by robots with pitch joints and without", crossed, CROSSED, note
    )


def outcome_of(path: Path) -> ClimbOutcome:
    """The run of which a table of trials is."""
    rows = [
        ClimbRow(
            **{**row, "reason": row["reason"] or "", "plan_error_m": row["plan_error_m"] or ""}
        )
        for row in from_csv(path.read_text())
    ]
    climbs = [row for row in rows if row.part != "sensing"]
    felt = [row for row in rows if row.part == "sensing"]
    config = ClimbConfig(
        trials=max(row.trial for row in climbs) + 1,
        grounds=tuple(dict.fromkeys(row.ground for row in rows if row.part == "ground")),
        heights=tuple(dict.fromkeys(row.height_m for row in climbs if row.height_m)),
        conditions=tuple(n for n in CONTROLLERS if any(row.condition == n for row in climbs)),
        divisors=tuple(dict.fromkeys(row.divisor for row in climbs)),
        sensing=max((row.trial + 1 for row in felt), default=0),
        seed=rows[0].seed - round(10_000 * (rows[0].height_m or 0.0)),
    )
    return Found(
        config, rows, {}, False, ClimbRow, lambda found: summarise(found.config, found.frame)
    )


def markdown(table: Table) -> str:
    """A table of a result as one of the page."""
    every = list(zip(*(cells for _, cells in table.rows), strict=True))
    kept = [i for i, cells in enumerate(every) if table.rows[0][0] != "trials" or cells[0] != "0"]
    heads = [table.columns[i] for i in kept]
    lines: list[Sequence[str]] = [("", *heads), ("---",) * (len(heads) + 1)]
    lines += [
        (name.strip(), *("-" if cells[i] == NONE else cells[i] for i in kept))
        for name, cells in table.rows
        if set(cells) != {NONE}
    ]
    body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"**{table.title}**\n\n{body}\n\n{table.note}\n"


if __name__ == "__main__":
    main()
