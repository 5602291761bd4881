"""The experiment `dataset`: episodes, their windows as files, and the errors of the baselines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    Kept,
    drawn,
    gap_windows,
    push_windows,
    setting,
)
from antennate.experiments.dataset.estimates import (
    BASELINES,
    MAE,
    LengthErrors,
    TaskResult,
    summary,
)
from antennate.experiments.dataset.walk import walk_windows
from antennate.studies.columns import NONE, Frame, column, column_of, tabular
from antennate.studies.experiment import Done, Experiment
from antennate.studies.parquet import require_parquet
from antennate.studies.pool import Workers
from antennate.studies.pooling import INVALID, by, frame, pooled
from antennate.studies.tables import Table
from antennate.studies.trials import OneByOne, OnRow, OnStep, Trials, no_row, no_step

MAKE = {"walk": walk_windows, "gap": gap_windows, "push": push_windows}
"""What makes the windows of an episode, by its kind."""
PUBLISHED = {"base_to_tip": 7.75, "gap": 6.73}
"""Errors that CITRAS published [%], arXiv:2507.23719: a real antenna with hinge sensors."""


@tabular
class Ran:
    """Episodes of a kind."""

    trials: int = column("episodes", form="d")
    """Episodes run."""
    invalid: int = column("invalid", form="d")
    """Episodes whose physics became invalid."""


@tabular
class KindSummary(Kept, Ran):
    """All episodes of a kind."""

    splits: dict[str, int]
    """Windows of each split."""


@tabular
class DatasetResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "dataset"
    format: int
    """Version of columns, splits and definitions."""
    seed: int
    rate_hz: float
    """Samples a second."""
    history: int
    """Samples of a window."""
    kinds: dict[str, KindSummary]
    """Episodes of each kind: `walk`, `gap` and `push`."""
    tasks: dict[str, TaskResult]
    """Result of each task: `distance`, `angle`, `gap`, `place` and `base_to_tip`."""
    published_percent: dict[str, float]
    """Published errors of CITRAS, of `base_to_tip` and `gap`."""


@dataclass(frozen=True)
class DatasetOutcome(Done):
    """All episodes and their windows.

    Attributes:
        by_kind: Columns of the windows, by kind.
    """

    config: DatasetConfig
    by_kind: dict[Kind, Windows]


def episode(config: DatasetConfig, kind: Kind, trial: int) -> tuple[EpisodeRow, Windows | None]:
    """One episode: its row, and its windows if there are any."""
    draw = drawn(config, kind, trial)
    row = EpisodeRow(
        seed=config.seed,
        trial=trial,
        kind=kind,
        split=draw.split,
        status="valid",
        profile=draw.profile,
        speed_factor=draw.factor,
    )
    try:
        windows = MAKE[kind](config, draw)
    except SimulationError as error:
        return replace(row, status="invalid", reason=str(error)), None
    label = next(task.label for task in TASKS if task.kind == kind)
    count = len(windows.get(label, ()))
    most = config.walk.windows if kind == "walk" else 1
    row = replace(row, windows=count, untouched=most - count)
    return row, {**setting(draw, trial, count), **windows} if count else None


def invalid(config: DatasetConfig, kind: str, trial: int, reason: str) -> EpisodeRow:
    """The row of an episode whose worker died."""
    return EpisodeRow(
        seed=config.seed,
        trial=trial,
        kind=kind,
        split=split_of(trial),
        status="invalid",
        profile="",
        speed_factor=None,
        reason=reason,
    )


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
    result = DatasetResult(
        format=FORMAT,
        seed=config.seed,
        rate_hz=config.rate,
        history=HISTORY,
        kinds={
            kind: _kind(some, by_kind[kind])
            for kind, some in by(frame(rows, EpisodeRow), "kind", config.kinds).items()
        },
        tasks=summary(config, by_kind),
        published_percent=PUBLISHED,
    )
    return DatasetOutcome(rows, result, config, by_kind)


def _kind(rows: Frame, windows: Windows) -> KindSummary:
    """Episodes of a kind, and the rows of their file in each split."""
    splits = Counter(windows["split"].tolist())
    bad = int((rows["status"] == INVALID).sum())
    return pooled(KindSummary, rows, invalid=bad, splits=dict(splits))


TITLES = {
    "test": "test",
    "test_antenna": "other antennae",
    "test_speed": "other speeds",
}


def tables(result: DatasetResult) -> Sequence[Table]:
    """Windows of each kind, and for each task the errors of the baselines by split."""
    counts = Table.of("Windows", result.kinds)
    return counts, *(_table(result, name, task) for name, task in result.tasks.items())


def _table(result: DatasetResult, name: str, task: TaskResult) -> Table:
    rows = [
        (baseline.replace("_", " "), [_cell(task, split, baseline) for split in TESTS])
        for baseline in BASELINES
    ]
    test, notes = task.tests["test"], [_verdict(task)]
    best, mape = test.get(task.best or ""), column_of(LengthErrors, "mape_percent")
    if isinstance(best, LengthErrors):
        ours, rival = mape.cell(best), mape.cell(test["mean"])
        notes.append(f"On test it errs by {ours} % of the truth, the mean by {rival} %.")
    if name in result.published_percent:
        notes.append(f"CITRAS, a real antenna: {result.published_percent[name]:g} %.")
    untold = {b: e.untold for b, e in test.items() if e.untold}
    notes += [f"{b.replace('_', ' ')}: {n} windows of test not told." for b, n in untold.items()]
    mae = MAE[task.unit]
    title = f"{name.replace('_', ' ')}: {mae.label} in {mae.unit} (95 %)"
    return Table(title, [TITLES[split] for split in TESTS], rows, "\n".join(notes))


def _verdict(task: TaskResult) -> str:
    """On which splits the best baseline errs less than the mean."""
    if task.best is None:
        return "Too few windows to learn from."
    words = {True: "yes", False: "no", None: "too few"}
    told = ", ".join(f"{TITLES[split]}: {words[told]}" for split, told in task.told.items())
    return f"Best on validation: {task.best.replace('_', ' ')}. Less error than the mean? {told}."


def _cell(task: TaskResult, split: str, baseline: str) -> str:
    """Error of a baseline with its interval, if there are any."""
    mae, errors = MAE[task.unit], task.tests[split].get(baseline)
    if errors is None:
        return NONE
    value, ends = mae.cell(errors), mae.ends.cell(errors)
    return value if ends == NONE else f"{value} ({ends})"


def sentence(result: DatasetResult) -> str:
    """What touch tells by the best baseline of each task, beside the mean of the labels."""
    told = []
    for name, task in result.tasks.items():
        mean = task.tests["test"].get("mean")
        if name == TASKS[-1].name or task.best is None or mean is None:
            continue
        mae = MAE[task.unit]
        told.append(
            f"{name} {_cell(task, 'test', task.best)} {mae.unit} by {task.best.replace('_', ' ')} "
            f"(mean {mae.cell(mean)})"
        )
    if not told:
        return "Too few windows to learn from."
    return f"Mean absolute error on test (95 %): {'; '.join(told)}."


EXPERIMENT = Experiment.of_folder(
    *(__name__, DatasetConfig, run, tables, sentence),
    trials=TRIALS,
    result=DatasetResult,
    row=EpisodeRow,
    names=lambda config: ["README.md", *(f"{kind}.parquet" for kind in config.kinds)],
    files=lambda outcome: files(outcome.config, outcome.by_kind),
    check=lambda config: require_parquet("dataset") and None,
    failed=lambda result: any(0 < kind.trials == kind.invalid for kind in result.kinds.values()),
    parts="episodes",
    captions={
        "dataset": "Mean absolute error of each baseline, by task and split, with its interval "
        "over episodes."
    },
    explained="docs/dataset.md",
)
