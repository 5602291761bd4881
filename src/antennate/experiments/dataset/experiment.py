"""The experiment `dataset`: episodes, their windows as files, and the errors of the baselines."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from antennate.errors import SimulationError
from antennate.experiments.dataset.card import files
from antennate.experiments.dataset.columns import TASKS, Windows, columns_of, joined
from antennate.experiments.dataset.config import (
    FORMAT,
    HISTORY,
    TESTS,
    DatasetConfig,
    Kind,
    split_of,
)
from antennate.experiments.dataset.episodes import (
    EpisodeRow,
    drawn,
    gap_windows,
    push_windows,
    setting,
)
from antennate.experiments.dataset.estimates import BASELINES, summary
from antennate.experiments.dataset.walk import walk_windows
from antennate.studies.experiment import (
    Experiment,
    OneByOne,
    OnRow,
    OnStep,
    Outcome,
    Trials,
    no_row,
    no_step,
)
from antennate.studies.measures import Measure, Table, shown
from antennate.studies.parquet import require_parquet
from antennate.studies.pool import Workers

_MAKE = {"walk": walk_windows, "gap": gap_windows, "push": push_windows}
PUBLISHED = {"base_to_tip": 7.75, "gap": 6.73}
"""Errors that CITRAS published [%], arXiv:2507.23719: a real antenna with hinge sensors."""


@dataclass(frozen=True, slots=True)
class DatasetOutcome(Outcome):
    """All episodes and their windows.

    Attributes:
        episodes: A row for each episode.
        by_kind: Columns of the windows, by kind.
        summary: The content of result.json.
    """

    config: DatasetConfig
    episodes: list[EpisodeRow]
    by_kind: dict[Kind, Windows]
    summary: dict[str, Any]

    @property
    def rows(self) -> Sequence[EpisodeRow]:
        """The episodes, kind by kind."""
        return self.episodes

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return self.summary


def episode(config: DatasetConfig, kind: Kind, trial: int) -> tuple[EpisodeRow, Windows | None]:
    """One episode: its row, and its windows if there are any."""
    draw = drawn(config, kind, trial)
    names = {"profile": draw.profile, "speed_factor": draw.factor}
    key = (config.seed, trial, kind, draw.split)
    try:
        windows = _MAKE[kind](config, draw)
    except SimulationError as error:
        return EpisodeRow(*key, "invalid", **names, reason=str(error)), None
    label = next(task.label for task in TASKS if task.kind == kind)
    count = len(windows.get(label, ()))
    most = config.walk.windows if kind == "walk" else 1
    row = EpisodeRow(*key, "valid", **names, windows=count, untouched=most - count)
    return row, {**setting(draw, trial, count), **windows} if count else None


def invalid(config: DatasetConfig, kind: str, trial: int, reason: str) -> EpisodeRow:
    """The row of an episode whose worker died."""
    split = split_of(trial)
    return EpisodeRow(config.seed, trial, kind, split, "invalid", "", math.nan, reason=reason)


TRIALS = Trials[DatasetConfig](
    "kind",
    every=lambda config: [(kind, k) for k in range(config.trials) for kind in config.kinds],
    carry_out=OneByOne(episode),
    row=EpisodeRow,
    invalid=invalid,
)


def run(
    config: DatasetConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> DatasetOutcome:
    """Run all episodes, and let the baselines estimate their labels.

    Raises:
        WorkerError: A worker process failed.
    """
    ended, _ = TRIALS.gather(config, workers, on_step, on_row)
    rows = [row for row, _ in ended]
    by_kind: dict[Kind, Windows] = {}
    for kind in config.kinds:
        parts = [windows for row, windows in ended if row.kind == kind and windows is not None]
        by_kind[kind] = joined(columns_of(kind, config.robot), parts)
    result = {
        "schema": 1,
        "command": "dataset",
        "format": FORMAT,
        "seed": config.seed,
        "rate_hz": config.rate,
        "history": HISTORY,
        "kinds": {kind: _counts(rows, kind, by_kind[kind]) for kind in config.kinds},
        "tasks": summary(config, by_kind),
        "published_percent": PUBLISHED,
    }
    return DatasetOutcome(config, rows, by_kind, result)


def _counts(rows: Sequence[EpisodeRow], kind: str, windows: Windows) -> dict[str, Any]:
    own = [row for row in rows if row.kind == kind]
    splits = windows["split"].tolist()
    return {
        "trials": len(own),
        "invalid": sum(row.status == "invalid" for row in own),
        "windows": len(splits),
        "untouched": sum(row.untouched for row in own),
        "splits": {split: splits.count(split) for split in dict.fromkeys(splits)},
    }


KIND = (
    Measure("trials", "episodes", form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("windows", "windows", form="d"),
    Measure("untouched", "left out, untouched", form="d"),
)
TITLES = {
    "test": "test",
    "test_antenna": "other antennae",
    "test_speed": "other speeds",
}


def shown_error(name: str, unit: str) -> Measure:
    """How the error of a task is shown: in mm or degrees, with its interval."""
    if unit == "rad":
        return Measure("mae_rad", name, "deg", form=".2f", scale=math.degrees(1.0))
    return Measure("mae_m", name, "mm", form=".2f", scale=1e3)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Windows of each kind, and for each task the errors of the baselines by split."""
    counts = Table.of("Windows", result["kinds"], KIND)
    return counts, *(_table(result, name, entry) for name, entry in result["tasks"].items())


def _table(result: Mapping[str, Any], name: str, entry: Mapping[str, Any]) -> Table:
    measure = shown_error(name, entry["unit"])
    rows = [
        (
            baseline.replace("_", " "),
            [_cell(measure, test, baseline) for test in entry["tests"].values()],
        )
        for baseline in BASELINES
    ]
    test, notes = entry["tests"]["test"], [_verdict(entry)]
    if "mape_percent" in test.get(entry["best"], {}):
        percent = [
            Measure("mape_percent", form=".1f").cell(test[b]) for b in (entry["best"], "mean")
        ]
        notes.append(f"On test it errs by {percent[0]} % of the truth, the mean by {percent[1]} %.")
    if name in result["published_percent"]:
        notes.append(f"CITRAS, a real antenna: {result['published_percent'][name]:g} %.")
    untold = {b: e["untold"] for b, e in test.items() if e["untold"]}
    notes += [f"{b.replace('_', ' ')}: {n} windows of test not told." for b, n in untold.items()]
    title = f"{name.replace('_', ' ')}: mean absolute error in {measure.unit} (95 %)"
    return Table(title, [TITLES[split] for split in TESTS], rows, "\n".join(notes))


def _verdict(entry: Mapping[str, Any]) -> str:
    """On which splits the best baseline errs less than the mean."""
    if entry["best"] is None:
        return "Too few windows to learn from."
    words = {True: "yes", False: "no", None: "too few"}
    told = ", ".join(f"{TITLES[split]}: {words[told]}" for split, told in entry["told"].items())
    return (
        f"Best on validation: {entry['best'].replace('_', ' ')}. Less error than the mean? {told}."
    )


def _cell(measure: Measure, test: Mapping[str, Any], baseline: str) -> str:
    if baseline not in test:
        return shown(None)
    entry = test[baseline]
    ends = entry[f"{measure.name}_95"]
    value = measure.cell(entry)
    return value if ends is None else f"{value} ({shown(ends, measure.form, measure.scale, '–')})"


def sentence(result: Mapping[str, Any]) -> str:
    """What touch tells by the best baseline of each task, beside the mean of the labels."""
    told = []
    for name, entry in result["tasks"].items():
        best, test = entry["best"], entry["tests"]["test"]
        if name == TASKS[-1].name or best is None or "mean" not in test:
            continue
        measure = shown_error(name, entry["unit"])
        told.append(
            f"{name} {_cell(measure, test, best)} {measure.unit} by {best.replace('_', ' ')} "
            f"(mean {measure.cell(test['mean'])})"
        )
    if not told:
        return "Too few windows to learn from."
    return f"Mean absolute error on test (95 %): {'; '.join(told)}."


EXPERIMENT = Experiment.of_folder(
    *(__name__, DatasetConfig, run, tables, sentence),
    trials=TRIALS,
    measures=KIND,
    names=lambda config: ["README.md", *(f"{kind}.parquet" for kind in config.kinds)],
    files=lambda outcome: files(outcome.config, outcome.by_kind),
    check=lambda config: require_parquet("dataset") and None,
    failed=lambda result: any(
        0 < kind["trials"] == kind["invalid"] for kind in result["kinds"].values()
    ),
    parts="episodes",
    captions={
        "dataset": "Mean absolute error of each baseline, by task and split, with its interval "
        "over episodes."
    },
    explained="docs/dataset.md",
)
