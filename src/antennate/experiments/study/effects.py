"""Effects of the parameters, and how large they come out where nothing has an effect."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.regression import slopes
from antennate.studies import statistics
from antennate.studies.plan import Axes, Point, elementary_effects
from antennate.types import Floats

SUCCESS = "success_share"
"""The response of rows that have an outcome."""
CHANCE = 0.05
"""Share of studies without any effect in which one is found, over all that is compared."""
_DRAWS = 1000
"""How often trials are shuffled."""
_AT_ONCE = 2_000_000
"""Trials shuffled at once, to bound the memory."""
_ROUNDING = 1e-9
Row = Mapping[str, Any]


def value(row: Row, response: str | None) -> float:
    """What a trial adds to the response of its point; NaN if it says nothing."""
    if row["status"] != "ok":
        return math.nan
    if response == SUCCESS:
        return float(row.get("outcome") == "success")
    found = row.get(response or "")
    return float(found) if isinstance(found, float | int) and math.isfinite(found) else math.nan


def effects(
    config: StudyConfig,
    axes: Axes,
    by_cell: Mapping[tuple[int, str], Sequence[Row]],
    points: Sequence[Point],
    names: Sequence[str],
    response: str | None,
) -> list[dict[str, Any]]:
    """The effects of each parameter, on conditions, which are `names`, and on their differences.

    Of a random and a Sobol plan they are slopes (`regression.slopes`), of a grid and a list there
    are none.

    Of a Morris plan each has `noise`: the size that the largest effect of a study stays below if
    nothing has an effect, in all but `CHANCE` of such studies over all targets (Bonferroni). Then a
    trial comes out alike at every point. So the trials of each number are shuffled between the
    points, those of all conditions alike, and the largest mu* is taken of each shuffled study
    (permutation test with the maximum, Westfall and Young, Resampling-Based Multiple Testing,
    1993). A strong cause raises the noise, so that weak ones may be missed; it finds none that is
    not there. From one
    trial a point nothing can be said: `noise` and `above_noise` are None.
    """
    if config.plan in ("grid", "list") or response is None or not by_cell:
        return []
    values = _values(by_cell, len(points), names, response)
    if config.plan != "morris":
        return slopes(axes, points, _targets(_mean(values), names), CHANCE)
    plan = (len(axes), config.points, config.seed)
    noise = _noise(values, names, plan)
    return [
        {"of": target, "parameter": name, **_spread(found, noise[target])}
        for target, means in _targets(_mean(values), names).items()
        for name, found in zip(axes, elementary_effects(*plan, means), strict=True)
    ]


def size(effect: Row) -> tuple[float | None, tuple[float, float] | None]:
    """How large an effect is, with its interval: a slope, or Morris's mu*."""
    name = "slope" if "slope" in effect else "mu_star"
    return effect[name], effect[f"{name}95"]


def _values(
    by_cell: Mapping[tuple[int, str], Sequence[Row]],
    points: int,
    names: Sequence[str],
    response: str,
) -> Floats:
    """The response of every trial, NaN where it is missing: (conditions, trials, points)."""
    found: dict[tuple[int, Any], Floats] = {}
    for (point, name), rows in by_cell.items():
        times: Counter[Any] = Counter()
        for row in rows:
            trial = row.get("trial")
            key = times[trial], trial
            if key not in found:
                found[key] = np.full((len(names), points), np.nan)
            found[key][names.index(name), point] = value(row, response)
            times[trial] += 1
    return np.stack(list(found.values()), axis=1)


def _mean(values: Floats) -> Floats:
    """Mean over the trials that are known; NaN without any."""
    known = np.isfinite(values)
    counts = known.sum(axis=-2)
    return np.where(known, values, 0.0).sum(axis=-2) / np.where(counts, counts, np.nan)


def _targets(means: Floats, names: Sequence[str]) -> dict[str, Floats]:
    """Responses of the points, (conditions, ..., points), and those of each difference."""
    found = dict(zip(names, means, strict=True))
    for first, second in combinations(names, 2):
        found[f"{second} minus {first}"] = found[second] - found[first]
    return found


def _noise(
    values: Floats, names: Sequence[str], plan: tuple[int, int, int]
) -> dict[str, float | None]:
    """The noise of each target, from shuffled trials."""
    _, trials, points = values.shape
    largest: dict[str, list[float]] = {name: [] for name in _targets(values[:, 0], names)}
    if trials < 2:
        return dict.fromkeys(largest)
    rng = np.random.default_rng(plan[2])
    block = max(1, min(_DRAWS, _AT_ONCE // values.size))
    for first in range(0, _DRAWS, block):
        count = min(block, _DRAWS - first)
        places = np.broadcast_to(np.arange(points), (count, trials, points))
        shuffled = rng.permuted(places, axis=-1)
        means = np.stack(
            [_mean(np.take_along_axis(v[None], shuffled, axis=-1)) for v in values]
        )  # (conditions, draws, points)
        for target, response in _targets(means, names).items():
            sizes = _mean(np.swapaxes(np.abs(elementary_effects(*plan, response)), -1, -2))
            largest[target] += np.nanmax(sizes, axis=-1, initial=0.0).tolist()
    share = 1.0 - CHANCE / len(largest)
    return {name: float(np.quantile(v, share, method="higher")) for name, v in largest.items()}


def _spread(found: Floats, noise: float | None) -> dict[str, Any]:
    """Morris's measures: mean size of the effects, their mean and their standard deviation."""
    known = found[np.isfinite(found)]
    if not len(known):
        empty = ("mu_star", "mu_star95", "noise", "above_noise", "mu", "sigma")
        return {**dict.fromkeys(empty), "noise": noise}
    size, ends = statistics.mean95(np.abs(known), least=0.0)
    return {
        "mu_star": size,
        "mu_star95": ends,
        "noise": noise,
        "above_noise": None if noise is None else size > noise * (1.0 + _ROUNDING),
        "mu": float(known.mean()),
        "sigma": float(known.std(ddof=1)) if len(known) > 1 else None,
    }
