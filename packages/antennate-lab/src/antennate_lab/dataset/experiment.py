"""The experiment `dataset`: episodes, their windows as files, and the errors of the baselines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from antennate.errors import SimulationError
from antennate.studies.columns import NONE, Frame, column, column_of, tabular
from antennate.studies.experiment import Experiment, Files, checked
from antennate.studies.parquet import require_parquet
from antennate.studies.pooling import INVALID, by, pooled
from antennate.studies.tables import Table
from antennate.studies.trials import Found, Trials
from antennate_lab.dataset.card import card, parquet
from antennate_lab.dataset.columns import TASKS, Windows, columns_of, joined
from antennate_lab.dataset.config import (
    FORMAT,
    HISTORY,
    TESTS,
    DatasetConfig,
    Kind,
    split_of,
)
from antennate_lab.dataset.episodes import (
    EpisodeRow,
    Kept,
    drawn,
    gap_windows,
    push_windows,
    setting,
)
from antennate_lab.dataset.estimates import (
    BASELINES,
    MAE,
    LengthErrors,
    TaskResult,
    summary,
)
from antennate_lab.dataset.walk import walk_windows

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

    @property
    def failed(self) -> bool:
        """Whether every episode of some kind is invalid."""
        return any(0 < kind.trials == kind.invalid for kind in self.kinds.values())


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


FoundWindows = Found[DatasetConfig, DatasetResult, Windows]
"""All episodes and their windows."""


def windows_of(found: FoundWindows, kind: Kind) -> Windows:
    """Columns of the windows of all episodes of a kind."""
    parts = [windows for (of, _), windows in found.drawn.items() if of == kind]
    return joined(columns_of(kind, found.config.robot), parts)


def by_kind(found: FoundWindows) -> dict[Kind, Windows]:
    """Columns of the windows of all episodes, by kind."""
    return {kind: windows_of(found, kind) for kind in found.config.kinds}


def summarise(found: FoundWindows) -> DatasetResult:
    """The result of a run: the baselines estimate the labels of its windows."""
    config = found.config
    windows = by_kind(found)
    return DatasetResult(
        format=FORMAT,
        seed=config.seed,
        rate_hz=config.rate,
        history=HISTORY,
        kinds={
            kind: _kind(some, windows[kind])
            for kind, some in by(found.frame, "kind", config.kinds).items()
        },
        tasks=summary(config, windows),
        published_percent=PUBLISHED,
    )


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


def files(config: DatasetConfig) -> Files:
    """The card, and a Parquet file for each kind."""
    tables = {f"{kind}.parquet": partial(_parquet, kind=kind) for kind in config.kinds}
    return {"README.md": _card, **tables}


def _card(found: FoundWindows) -> str:
    return card(found.config, by_kind(found))


def _parquet(found: FoundWindows, kind: Kind) -> bytes:
    return parquet(found.config, kind, windows_of(found, kind))


EXPERIMENT = Experiment.of_folder(
    __name__,
    DatasetConfig,
    Trials[DatasetConfig](
        episode,
        row=EpisodeRow,
        summarise=summarise,
        every=lambda config: [(kind, k) for k in range(config.trials) for kind in config.kinds],
        invalid=invalid,
    ),
    tables,
    sentence,
    result=DatasetResult,
    files=files,
    settled=checked(lambda config: require_parquet("dataset") and None),
    captions={
        "dataset": "Mean absolute error of each baseline, by task and split, with its interval "
        "over episodes."
    },
)
