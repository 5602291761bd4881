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

from antennate.experiments.dataset.closed_form import closed_form
from antennate.experiments.dataset.columns import TASKS, Task, Windows
from antennate.experiments.dataset.config import TESTS, DatasetConfig, Kind
from antennate.experiments.dataset.features import features
from antennate.studies.statistics import mean95
from antennate.types import Bools, Floats, Ints

BASELINES = ("mean", "closed_form", "polynomial", "neighbours")
PENALTIES = (0.01, 0.1, 1.0, 10.0, 100.0)
NEIGHBOURS = (1, 3, 5, 9, 15)
LEAST = 5
"""Fewest training windows to learn from."""

Estimate = Callable[[Floats], Floats]
"""estimate(features (m, k)) -> estimates (m,)."""


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


def score(task: Task, windows: Windows, told: Mapping[str, Floats], rows: Bools) -> dict[str, Any]:
    """Errors of each baseline on some windows, by name.

    Returns:
        For each `windows`, `episodes`, `untold`, mean absolute error `mae_m` or `mae_rad`, and in %
        of the truth `mape_percent` where that means something; `gain_m` or `gain_rad`, by how much
        less it errs than the mean of the training labels. Each is a mean over episodes of their
        means, with its 95 % interval.
    """
    truth, episode, unit = windows[task.label][rows], windows["episode"][rows], task.unit
    rival = abs(told["mean"][rows] - truth) if "mean" in told else np.full(len(truth), math.nan)
    result: dict[str, Any] = {}
    for name, guess in told.items():
        error = abs(guess[rows] - truth)
        known = np.isfinite(error)
        entry: dict[str, Any] = {
            "windows": int(known.sum()),
            "episodes": len(np.unique(episode[known])),
            "untold": int((~known).sum()),
        }
        measures = {f"mae_{unit}": (error, 0.0), f"gain_{unit}": (rival - error, -math.inf)}
        if task.relative:
            measures["mape_percent"] = (100.0 * error / truth, 0.0)
        for key, (values, least) in measures.items():
            mean, ends = mean95(by_episode(values[known], episode[known]), least)
            entry |= {key: mean, f"{key}_95": ends}
        result[name] = entry
    return result


def by_episode(values: Floats, episode: Ints) -> Floats:
    """Mean of the values of each episode, in the order of their numbers."""
    _, place = np.unique(episode, return_inverse=True)
    return np.bincount(place, values) / np.maximum(np.bincount(place), 1)


def summary(config: DatasetConfig, by_kind: Mapping[Kind, Windows]) -> dict[str, Any]:
    """What each baseline comes to in each task whose episodes there are, by split of test."""
    tasks: dict[str, Any] = {}
    for task in TASKS:
        if task.kind not in by_kind:
            continue
        windows = by_kind[task.kind]
        told, options = estimates(config, task, windows)
        tests = {name: score(task, windows, told, windows["split"] == name) for name in TESTS}
        best = _best(task, windows, told)
        tasks[task.name] = {
            "label": task.label,
            "unit": task.unit,
            "chosen": options,
            "best": best,
            "told": {name: _told(task, test, best) for name, test in tests.items()},
            "tests": tests,
        }
    return tasks


def _told(task: Task, test: Mapping[str, Any], best: str | None) -> bool | None:
    """Whether the best baseline errs less than the mean, its whole interval; None if unknown."""
    ends = None if best is None else test[best][f"gain_{task.unit}_95"]
    return None if ends is None or math.isnan(ends[0]) else bool(ends[0] > 0.0)


def _best(task: Task, windows: Windows, told: Mapping[str, Floats]) -> str | None:
    """The baseline of least error on the validation split, the mean of the labels apart."""
    if "mean" not in told:
        return None
    rows = windows["split"] == "validation"
    entries = score(task, windows, {n: t for n, t in told.items() if n != "mean"}, rows)
    able = {
        n: e[f"mae_{task.unit}"] for n, e in entries.items() if e["windows"] and not e["untold"]
    }
    return min(able, key=lambda name: able[name]) if able else None
