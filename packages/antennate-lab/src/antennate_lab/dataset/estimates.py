"""Baselines: what simple estimates make of a task, trained and chosen without its test splits.

- `mean`: the mean of the training labels, the rival of all others.
- `closed_form`: mechanics alone, see `closed_form`.
- `polynomial`: of second degree in the features, least squares with a penalty.
- `neighbours`: mean label of the nearest training windows in the features.

Penalty and number of neighbours are those of least error on the validation split; so is the best
of the last three. Touch *tells* a task on a split of test if the best errs less than the mean, by
an interval that lies above 0 as a whole. An interval is over episodes, Student's t: windows of one
episode are alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.studies.columns import Ends, column, column_of, tabular
from antennate.studies.statistics import mean95
from antennate.types import Bools, Floats, Ints
from antennate_lab.dataset.closed_form import closed_form
from antennate_lab.dataset.columns import TASKS, Task, Windows
from antennate_lab.dataset.config import TESTS, DatasetConfig, Kind
from antennate_lab.dataset.features import features

BASELINES = ("mean", "closed_form", "polynomial", "neighbours")
PENALTIES = (0.01, 0.1, 1.0, 10.0, 100.0)
NEIGHBOURS = (1, 3, 5, 9, 15)
LEAST = 5
"""Fewest training windows to learn from."""

Estimate = Callable[[Floats], Floats]
"""estimate(features (m, k)) -> estimates (m,)."""


@tabular
class Estimated:
    """Windows of a split that a baseline estimates."""

    windows: int
    """Windows estimated."""
    episodes: int
    """Episodes of these windows."""
    untold: int
    """Windows in which the baseline cannot tell."""


@tabular
class LengthErrors(Estimated):
    """Errors of a baseline in a length, on a split of test.

    Each is a mean over episodes of their means, `null` without any, with its 95 % interval
    (Student's t over episodes), `null` below five of them.
    """

    mae_m: float | None = column(
        "mean absolute error", "mm", scale=1e3, join="–", interval="mae_m_95"
    )
    mae_m_95: Ends | None
    gain_m: float | None = column(interval="gain_m_95")
    """Mean absolute error of the mean of the training labels, less that of the baseline."""
    gain_m_95: Ends | None
    mape_percent: float | None = column(form=".1f", interval="mape_percent_95")
    """Mean absolute error over the true value."""
    mape_percent_95: Ends | None


@tabular
class AngleErrors(Estimated):
    """Errors of a baseline in an angle, on a split of test; in % they would mean nothing."""

    mae_rad: float | None = column(
        "mean absolute error", "deg", scale=math.degrees(1.0), join="–", interval="mae_rad_95"
    )
    mae_rad_95: Ends | None
    gain_rad: float | None = column(interval="gain_rad_95")
    """Mean absolute error of the mean of the training labels, less that of the baseline."""
    gain_rad_95: Ends | None


Errors = LengthErrors | AngleErrors
MAE = {"m": column_of(LengthErrors, "mae_m"), "rad": column_of(AngleErrors, "mae_rad")}
"""Mean absolute error, by the unit of a task."""
GAIN = {"m": column_of(LengthErrors, "gain_m"), "rad": column_of(AngleErrors, "gain_rad")}
"""Gain over the mean of the labels, likewise."""


@tabular
class TaskResult:
    """Errors of the baselines in a task."""

    label: str
    """Column to be estimated."""
    unit: str
    """Unit of the label."""
    chosen: dict[str, float]
    """Penalty of `polynomial` and number of `neighbours`, chosen by the validation split."""
    best: str | None
    """Baseline of least error in validation, `mean` apart; `null` if nothing is learned."""
    told: dict[str, bool | None]
    """Whether `best` errs less than `mean` on each split of test, by an interval that lies above 0
    as a whole; `null` without an interval."""
    tests: dict[str, dict[str, Errors]]
    """Errors of each baseline, by split of test."""


def polynomial(known: Floats, truth: Floats, penalty: float) -> Estimate:
    """A polynomial of second degree, fitted by least squares with a penalty on its size.

    Args:
        known: Features of n windows, shape (n, k), each of mean 0 and deviation 1.
        truth: Their labels, shape (n,).
        penalty: Weight of the squared coefficients, the constant apart.
    """
    matrix, middle = _products(known), float(truth.mean())
    weight = penalty * np.eye(matrix.shape[1])
    mean = matrix.mean(axis=0)
    centred = matrix - mean
    fit = np.linalg.solve(centred.T @ centred + weight, centred.T @ (truth - middle))
    return lambda asked: (_products(asked) - mean) @ fit + middle


def _products(known: Floats) -> Floats:
    """The features and their products of two, shape (n, k (k + 3) / 2)."""
    first, second = np.triu_indices(known.shape[1])
    return np.hstack([known, known[:, first] * known[:, second]])


def neighbours(known: Floats, truth: Floats, count: int) -> Estimate:
    """The mean label of so many windows whose features are nearest; arguments as above."""

    def estimate(asked: Floats) -> Floats:
        square = ((asked[:, None] - known[None]) ** 2).sum(axis=-1)
        nearest = np.argsort(square, axis=1, kind="stable")[:, :count]
        return truth[nearest].mean(axis=1)

    return estimate


def chosen_by(
    fit: Callable[[Floats, Floats, Any], Estimate],
    options: Sequence[Any],
    train: tuple[Floats, Floats],
    validation: tuple[Floats, Floats],
) -> tuple[Estimate, Any]:
    """The estimate of least mean absolute error on the validation split, and its option."""
    asked, truth = validation
    fits = [(fit(*train, option), option) for option in options]
    if not len(truth):
        return fits[0]
    return min(fits, key=lambda pair: float(abs(pair[0](asked) - truth).mean()))


def estimates(
    config: DatasetConfig, task: Task, windows: Windows
) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Estimates of all windows by each baseline, NaN where it cannot tell; and what was chosen.

    With fewer than LEAST training windows nothing is learned.
    """
    label, split = windows[task.label], windows["split"]
    told = {"closed_form": closed_form(config, task.name, windows)} if len(label) else {}
    train, validation = split == "train", split == "validation"
    if train.sum() < LEAST:
        return told, {}
    raw = features(config, task.kind, windows)
    middle, width = raw[train].mean(axis=0), raw[train].std(axis=0)
    scaled = (raw - middle) / np.where(width > 0, width, 1.0)
    told["mean"] = np.full(len(label), label[train].mean())
    options: dict[str, Any] = {}
    for name, fit, values in (
        ("polynomial", polynomial, PENALTIES),
        ("neighbours", neighbours, NEIGHBOURS),
    ):
        estimate, options[name] = chosen_by(
            fit,
            values,
            (scaled[train], label[train]),
            (scaled[validation], label[validation]),
        )
        told[name] = estimate(scaled)
    return {name: told[name] for name in BASELINES}, options


def score(
    task: Task, windows: Windows, told: Mapping[str, Floats], rows: Bools
) -> dict[str, Errors]:
    """Errors of each baseline on some windows, by name."""
    truth, episode = windows[task.label][rows], windows["episode"][rows]
    rival = abs(told["mean"][rows] - truth) if "mean" in told else None
    return {name: _errors(task, guess[rows], truth, episode, rival) for name, guess in told.items()}


def _errors(
    task: Task, guess: Floats, truth: Floats, episode: Ints, rival: Floats | None
) -> Errors:
    """Errors of a baseline, all of shape (n,); `rival` are those of the mean of the labels."""
    error = abs(guess - truth)
    known = np.isfinite(error)
    counts = {
        "windows": int(known.sum()),
        "episodes": len(np.unique(episode[known])),
        "untold": int((~known).sum()),
    }

    def mean(values: Floats, least: float) -> tuple[float | None, Ends | None]:
        means = by_episode(values[known], episode[known])
        return mean95(means, least) if len(means) else (None, None)

    mae, mae_95 = mean(error, 0.0)
    gain, gain_95 = (None, None) if rival is None else mean(rival - error, -math.inf)
    if task.unit == "rad":
        return AngleErrors(
            mae_rad=mae, mae_rad_95=mae_95, gain_rad=gain, gain_rad_95=gain_95, **counts
        )
    mape, mape_95 = mean(100.0 * error / truth, 0.0)
    return LengthErrors(
        mae_m=mae,
        mae_m_95=mae_95,
        gain_m=gain,
        gain_m_95=gain_95,
        mape_percent=mape,
        mape_percent_95=mape_95,
        **counts,
    )


def by_episode(values: Floats, episode: Ints) -> Floats:
    """Mean of the values of each episode, in the order of their numbers."""
    _, place = np.unique(episode, return_inverse=True)
    return np.bincount(place, values) / np.maximum(np.bincount(place), 1)


def summary(config: DatasetConfig, by_kind: Mapping[Kind, Windows]) -> dict[str, TaskResult]:
    """What each baseline comes to in each task whose episodes there are, by split of test."""
    tasks: dict[str, TaskResult] = {}
    for task in TASKS:
        if task.kind not in by_kind:
            continue
        windows = by_kind[task.kind]
        guesses, options = estimates(config, task, windows)
        tests = {name: score(task, windows, guesses, windows["split"] == name) for name in TESTS}
        best = _best(task, windows, guesses)
        tasks[task.name] = TaskResult(
            label=task.label,
            unit=task.unit,
            chosen=options,
            best=best,
            told={
                name: None if best is None else _told(task, test[best])
                for name, test in tests.items()
            },
            tests=tests,
        )
    return tasks


def _told(task: Task, best: Errors) -> bool | None:
    """Whether the best baseline errs less than the mean, its whole interval; None if unknown."""
    ends = GAIN[task.unit].ends.value(best)
    return None if ends is None else bool(ends[0] > 0.0)


def _best(task: Task, windows: Windows, told: Mapping[str, Floats]) -> str | None:
    """The baseline of least error on the validation split, the mean of the labels apart."""
    if "mean" not in told:
        return None
    errors = score(task, windows, told, windows["split"] == "validation")
    able = {
        name: MAE[task.unit].value(each)
        for name, each in errors.items()
        if name != "mean" and each.windows and not each.untold
    }
    return min(able, key=lambda name: able[name]) if able else None
