"""Effects of the parameters, and how large they come out where nothing has an effect.

Of a Morris plan they are mean sizes of elementary effects, of a random or a Sobol plan slopes over
the range of each parameter.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.study.config import StudyConfig
from antennate.jackknife import student95
from antennate.studies import statistics
from antennate.studies.columns import Ends, column, tabular
from antennate.studies.plan import Axes, Point, Range, elementary_effects
from antennate.types import Floats

SUCCESS = "success_share"
"""The response of rows that have an outcome."""
CHANCE = 0.05
"""Share of studies without any effect in which one is found, over all that is compared."""
_DRAWS = 1000
"""How often trials are shuffled, or signs drawn."""
_AT_ONCE = 2_000_000
"""Trials shuffled, or signs drawn, at once, to bound the memory."""
_ROUNDING = 1e-9
Row = Mapping[str, Any]


@tabular
class Effect:
    """An effect of a parameter on the response."""

    of: str
    """Condition whose response it is, or two as `second minus first`; empty without conditions."""
    parameter: str
    """Name of the parameter; `name = choice` for each choice of a list but the first."""


@tabular
class Elementary(Effect):
    """Elementary effects of a parameter, each over its whole range, in a Morris plan."""

    mu_star: float | None = column(interval="mu_star95")
    """Mean size of the effects, and its interval over trajectories; `null` without any."""
    mu_star95: Ends | None
    noise: float | None
    """Noise limit of the sizes, one for all parameters; `null` with one trial a point."""
    above_noise: bool | None
    """Whether the mean size exceeds it; `null` where either is not known."""
    mu: float | None
    """Mean of the effects."""
    sigma: float | None
    """Standard deviation of the effects; `null` with fewer than two."""

    @property
    def size(self) -> tuple[float | None, Ends | None]:
        """How large it is, with its interval."""
        return self.mu_star, self.mu_star95


@tabular
class Slope(Effect):
    """Slope of the response over the range of a parameter, in a random or a Sobol plan."""

    slope: float | None = column(interval="slope95")
    """Change of the response over the whole range, or from the first choice to this one, and its
    interval; `null` where the points do not tell it."""
    slope95: Ends | None
    noise: float | None
    """Noise limit of this slope; `null` where the slope is."""
    above_noise: bool | None
    """Whether the slope exceeds it in size; `null` where the slope is."""

    @property
    def size(self) -> tuple[float | None, Ends | None]:
        """How large it is, with its interval."""
        return self.slope, self.slope95


def value(row: Row, response: str | None) -> float:
    """What a trial adds to the response of its point; NaN if it says nothing."""
    if row["status"] != "ok":
        return math.nan
    if response == SUCCESS:
        return float(row.get("outcome") == "success")
    cell = row.get(response or "")
    return float(cell) if isinstance(cell, float | int) and math.isfinite(cell) else math.nan


def effects(
    config: StudyConfig,
    axes: Axes,
    by_cell: Mapping[tuple[int, str], Sequence[Row]],
    points: Sequence[Point],
    names: Sequence[str],
    response: str | None,
) -> Sequence[Elementary | Slope]:
    """The effects of each parameter, on conditions, which are `names`, and on their differences.

    Of a random and a Sobol plan they are those of `slopes`, of other plans there are none.

    Of a Morris plan each has `noise`: the size that the largest effect of a study stays below if
    nothing has an effect, in all but `CHANCE` of such studies over all targets (Bonferroni). Then a
    trial comes out alike at every point. So the trials of each number are shuffled between the
    points, those of all conditions alike, and the largest mu* is taken of each shuffled study
    (permutation test with the maximum, Westfall and Young, Resampling-Based Multiple Testing,
    1993). A strong cause raises the noise, so that weak ones may be missed; it finds none that is
    not there. From one
    trial a point nothing can be said: `noise` and `above_noise` are None.
    """
    if config.plan in ("grid", "list", "optuna") or response is None or not by_cell:
        return []
    values = _values(by_cell, len(points), names, response)
    if config.plan != "morris":
        return slopes(axes, points, _targets(_mean(values), names))
    plan = (len(axes), config.points, config.seed)
    noise = _noise(values, names, plan)
    return [
        _spread(target, name, sizes, noise[target])
        for target, means in _targets(_mean(values), names).items()
        for name, sizes in zip(axes, elementary_effects(*plan, means), strict=True)
    ]


def _values(
    by_cell: Mapping[tuple[int, str], Sequence[Row]],
    points: int,
    names: Sequence[str],
    response: str,
) -> Floats:
    """The response of every trial, NaN where it is missing: (conditions, trials, points)."""
    trials: dict[tuple[int, Any], Floats] = {}
    for (point, name), rows in by_cell.items():
        times: Counter[Any] = Counter()
        for row in rows:
            trial = row.get("trial")
            key = times[trial], trial
            if key not in trials:
                trials[key] = np.full((len(names), points), np.nan)
            trials[key][names.index(name), point] = value(row, response)
            times[trial] += 1
    return np.stack(list(trials.values()), axis=1)


def _mean(values: Floats) -> Floats:
    """Mean over the trials that are known; NaN without any."""
    known = np.isfinite(values)
    counts = known.sum(axis=-2)
    return np.where(known, values, 0.0).sum(axis=-2) / np.where(counts, counts, np.nan)


def _targets(means: Floats, names: Sequence[str]) -> dict[str, Floats]:
    """Responses of the points, (conditions, ..., points), and those of each difference."""
    targets = dict(zip(names, means, strict=True))
    for first, second in combinations(names, 2):
        targets[f"{second} minus {first}"] = targets[second] - targets[first]
    return targets


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


def _spread(target: str, name: str, effects: Floats, noise: float | None) -> Elementary:
    """Morris's measures: mean size of the effects, their mean and their standard deviation."""
    known = effects[np.isfinite(effects)]
    count = len(known)
    size, ends = statistics.mean95(np.abs(known), least=0.0)
    return Elementary(
        of=target,
        parameter=name,
        mu_star=size if count else None,
        mu_star95=ends,
        noise=noise,
        above_noise=size > noise * (1.0 + _ROUNDING) if count and noise is not None else None,
        mu=float(known.mean()) if count else None,
        sigma=float(known.std(ddof=1)) if count > 1 else None,
    )


def slopes(axes: Axes, points: Sequence[Point], targets: Mapping[str, Floats]) -> list[Slope]:
    """Least squares over all parameters at once: the change of each target over a whole range.

    A choice is compared with the first one of its list. The interval holds also where the spread
    differs from point to point (HC3: MacKinnon and White, Journal of Econometrics 29 (1985) 305).
    `noise` is what the changes of a study stay below, all of them, if nothing has an effect, in all
    but `CHANCE` of such studies over all targets: what the fit leaves over is given random signs,
    and the largest change that it makes is taken each time, each over its own standard error (wild
    bootstrap: Davidson and Flachaire, Journal of Econometrics 146 (2008) 162; maximum: Romano and
    Wolf, Econometrica 73 (2005) 1237). So a strong cause hides no weak one. What goes up and down
    within one range is not seen.

    Args:
        axes: What varies.
        points: Values of what varies.
        targets: A response of each point, by name; NaN where it is missing.

    Returns:
        A slope for each target and parameter; numbers are None where the points do not tell them.
    """
    columns = dict(_columns(axes, points))
    effects: list[Slope] = []
    for target, response in targets.items():
        known = np.isfinite(response)
        design = np.column_stack([np.ones(len(points)), *columns.values()])[known]
        effects += _fit(target, list(columns), design, response[known], CHANCE / len(targets))
    return effects


def _columns(axes: Axes, points: Sequence[Point]) -> Iterator[tuple[str, Floats]]:
    """Each parameter from 0 to 1 over its range, and each further choice as 0 or 1: (points,)."""
    for name, axis in axes.items():
        values = [point[name] for point in points]
        if isinstance(axis, Range):
            ends = np.array([axis.low, axis.high, *values], float)
            low, high, *spread = np.log(ends) if axis.log else ends
            yield name, (np.array(spread) - low) / (high - low)
            continue
        texts = [_text(value) for value in values]
        for choice in axis[1:]:
            yield f"{name} = {_text(choice)}", np.array([text == _text(choice) for text in texts])


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _fit(
    target: str, names: Sequence[str], design: Floats, response: Floats, chance: float
) -> list[Slope]:
    """The slope of each column behind the constant one, by these names."""
    count, width = design.shape
    nothing = dict.fromkeys(("slope", "slope95", "noise", "above_noise"))
    unknown = [Slope(of=target, parameter=name, **nothing) for name in names]
    if count <= width or np.linalg.matrix_rank(design) < width:
        return unknown
    solve: Floats = np.linalg.pinv(design).astype(float)
    fitted = solve @ response
    leverage = np.einsum("ij,ji->i", design, solve)
    if (leverage > 1.0 - _ROUNDING).any():  # one point alone decides a slope: no spread is known
        return unknown
    errors = (response - design @ fitted) / (1.0 - leverage)
    error = np.sqrt((solve**2) @ errors**2)
    half = student95(count - width) * error
    noise = _largest(solve[1:], errors, error[1:], chance) * error
    least = np.maximum(noise, np.abs(response).max() * _ROUNDING)
    return [
        Slope(
            of=target,
            parameter=name,
            slope=float(slope),
            slope95=(float(slope - h), float(slope + h)),
            noise=float(n),
            above_noise=bool(abs(slope) > at_least),
        )
        for name, slope, h, n, at_least in zip(
            names, fitted[1:], half[1:], noise[1:], least[1:], strict=True
        )
    ]


def _largest(solve: Floats, errors: Floats, error: Floats, chance: float) -> float:
    """What the largest slope over its error stays below, errors with random signs; but a share."""
    if not error.any():
        return 0.0
    rng, largest = np.random.default_rng(0), list[float]()
    scale = np.where(error > 0.0, error, np.inf)[:, None]
    block = max(1, min(_DRAWS, _AT_ONCE // len(errors)))
    for first in range(0, _DRAWS, block):
        signs = rng.choice((-1.0, 1.0), (len(errors), min(block, _DRAWS - first)))
        slopes = np.abs(solve @ (signs * errors[:, None])) / scale
        largest += slopes.max(axis=0).tolist()
    return float(np.quantile(largest, 1.0 - chance, method="higher"))
