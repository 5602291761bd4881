"""The points of a study: which values its parameters have, one after the other."""

from __future__ import annotations

import functools
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Discriminator, model_validator

from antennate.errors import ConfigError
from antennate.params.base import Strict
from antennate.types import Floats, Ints

Kind = Literal["grid", "list", "random", "sobol", "morris", "optuna"]
Point = dict[str, Any]
"""Values of the parameters that vary, by dotted name."""
MOST_POINTS = 100_000
"""Most points of a plan."""
_MOST_ENTRIES = 100
LEVELS = 4
"""Levels of each parameter in a Morris plan, as Morris proposes."""
STEP = LEVELS / (2 * (LEVELS - 1))
"""How far one parameter moves in it, over its range: all levels are then equally likely."""


class Range(Strict):
    """A range of one parameter, or of each entry of a list.

    Attributes:
        low: Its lower end.
        high: Its upper end.
        log: Whether values are spread evenly by their logarithm.
        whole: Whether only whole numbers are values.
        entries: Fewest and most entries of a list, for optuna; None if it is one number.
        rising: Whether the entries are put into rising order.
    """

    low: float
    high: float
    log: bool = False
    whole: bool = False
    entries: tuple[int, int] | None = None
    rising: bool = False

    @model_validator(mode="after")
    def _in_order(self) -> Range:
        if self.low >= self.high or (self.log and self.low <= 0):
            what = "0 < low < high" if self.log else "low < high"
            raise ValueError(f"expected {what}, found low {self.low:g} and high {self.high:g}")
        if self.whole and not (self.low.is_integer() and self.high.is_integer()):
            raise ValueError(f"expected whole ends, found low {self.low:g} and high {self.high:g}")
        width = self.high / self.low if self.log else self.high - self.low
        if not math.isfinite(width):
            raise ValueError(f"expected ends less far apart, found {self.low:g} and {self.high:g}")
        if self.rising and self.entries is None:
            raise ValueError("expected entries beside rising, found none")
        if self.entries and not 1 <= self.entries[0] <= self.entries[1] <= _MOST_ENTRIES:
            raise ValueError(
                f"expected the fewest and the most entries, 1 to {_MOST_ENTRIES}, found "
                f"{self.entries[0]} and {self.entries[1]}"
            )
        return self

    def at(self, share: float) -> float | int:
        """The value at a share of the range, 0 to 1.

        Each whole number has an equal part; by the logarithm, that which is rounded to it.
        """
        if self.log:
            value = self.low * (self.high / self.low) ** share
        elif self.whole:
            value = self.low - 0.5 + share * (self.high - self.low + 1.0)
        else:
            value = self.low + share * (self.high - self.low)
        if self.whole:
            return min(max(math.floor(value + 0.5), int(self.low)), int(self.high))
        return min(max(value, self.low), self.high)


def _form(axis: Any) -> str | None:
    """Whether an axis is a range or a list of choices, None if it is neither."""
    if isinstance(axis, Mapping):
        return "range" if "low" in axis or "high" in axis else None
    if isinstance(axis, Range):
        return "range"
    return None if axis is None or isinstance(axis, str | int | float) else "choices"


RANGE_OR_CHOICES = Discriminator(
    _form,
    custom_error_type="axis",
    custom_error_message="a list of values, or a table with low and high (names with dots need "
    "quotes)",
)
"""Tells pydantic which of two an axis is, by its tag, `range` or `choices`."""
Axes = Mapping[str, Sequence[Any] | Range]
"""By dotted name: the values of a parameter, or its range."""


def make_points(kind: Kind, axes: Axes, count: int, seed: int) -> list[Point]:
    """All points, in a fixed order.

    Args:
        kind: grid takes every combination of lists, list their first values, their second and so
            on. random and sobol draw points from ranges; of a list they draw one value. morris
            makes trajectories for elementary effects. Points of optuna follow from results.
        axes: What varies.
        count: Points of random and sobol, trajectories of morris.
        seed: Seed of what is drawn.
    """
    require_values(kind, axes)
    if kind in ("grid", "list"):
        return _of_lists(kind, axes)
    rng = np.random.default_rng(seed)
    if kind == "morris":
        shares = trajectories(len(axes), count, rng)
    elif kind == "sobol":
        from scipy.stats import qmc  # slow to import

        sampler = qmc.Sobol(len(axes), scramble=False)
        regular = sampler.random_base2(math.ceil(math.log2(count)))[:count]
        shares = (regular + rng.random(len(axes))) % 1.0  # a shift keeps them spread evenly
    else:
        shares = rng.random((count, len(axes)))
    return [
        {name: _value(axis, share) for (name, axis), share in zip(axes.items(), row, strict=True)}
        for row in shares.tolist()
    ]


def require_values(kind: Kind, axes: Axes) -> None:
    """Check that something varies, over finite values, and over lists of ranges only in optuna."""
    if not axes or not all(axes.values()):
        empty = [f"vary.{name}" for name, axis in axes.items() if not axis] or ["vary"]
        raise ConfigError(f"{empty[0]}: expected values, found none: the {kind} is empty")
    for name, axis in axes.items():
        _require_finite(name, axis)
        if kind != "optuna" and isinstance(axis, Range) and axis.entries:
            raise ConfigError(f"vary.{name}: expected plan optuna beside entries, found {kind}")


def _of_lists(kind: Kind, axes: Axes) -> list[Point]:
    lists: list[Sequence[Any]] = []
    for name, axis in axes.items():
        if isinstance(axis, Range):
            raise ConfigError(
                f"vary.{name}: expected a list of values for a {kind}, found a range, which is for "
                "random, sobol and morris"
            )
        lists.append(axis)
    if kind == "grid":
        if (count := math.prod(map(len, lists))) > MOST_POINTS:
            raise ConfigError(f"vary: expected at most {MOST_POINTS} points, found {count}")
        for name, values in zip(axes, lists, strict=True):
            _require_each_once(f"vary.{name}: expected each value", values)
        return [dict(zip(axes, values, strict=True)) for values in itertools.product(*lists)]
    if len(lengths := {len(values) for values in lists}) > 1:
        counts = ", ".join(map(str, sorted(lengths)))
        raise ConfigError(f"vary: expected lists of one length, found lengths {counts}")
    _require_each_once("vary: expected each point", list(zip(*lists, strict=True)))
    return [dict(zip(axes, values, strict=True)) for values in zip(*lists, strict=True)]


def _require_finite(name: str, axis: Sequence[Any] | Range) -> None:
    for value in () if isinstance(axis, Range) else axis:
        try:
            json.dumps(value, allow_nan=False, default=str)
        except ValueError:
            raise ConfigError(f"vary.{name}: expected finite numbers, found {value}") from None


def _require_each_once(expected: str, values: Sequence[Any]) -> None:
    """Check that none comes twice: its trials would be counted twice."""
    texts: set[str] = set()
    for value in values:
        if (text := json.dumps(value, default=str)) in texts:
            raise ConfigError(f"{expected} once, found {text} twice")
        texts.add(text)


def _value(axis: Sequence[Any] | Range, share: float) -> Any:
    if isinstance(axis, Range):
        return axis.at(share)
    return axis[min(int(share * len(axis)), len(axis) - 1)]


def trajectories(dimensions: int, count: int, rng: np.random.Generator) -> Floats:
    """Morris's trajectories: in each, one parameter after the other moves once, in random order.

    Source: Morris, Technometrics 33 (1991) 161.

    Returns:
        Shares of the ranges, 0 to 1, shape (count · (dimensions + 1), dimensions).
    """
    shares = []
    starts = np.arange(LEVELS // 2) / (LEVELS - 1)
    for _ in range(count):
        share = rng.choice(starts, dimensions)
        up = rng.random(dimensions) < 0.5
        share = np.where(up, share, share + STEP)
        shares.append(share.copy())
        for moved in rng.permutation(dimensions):
            share[moved] += STEP if up[moved] else -STEP
            shares.append(share.copy())
    return np.clip(np.array(shares), 0.0, 1.0)


def elementary_effects(
    dimensions: int, count: int, seed: int, response: Floats | Sequence[float]
) -> Floats:
    """The effects of each parameter: how the response changes over its whole range.

    Args:
        dimensions: Parameters.
        count: Trajectories.
        seed: Seed of the plan.
        response: One value for each point of the plan, shape (..., points).

    Returns:
        An effect for each parameter and trajectory, shape (..., dimensions, count); NaN where one
        of its two values is not finite.
    """
    order, moves = _moves(dimensions, count, seed)
    values = np.asarray(response, float)
    values = np.where(np.isfinite(values), values, np.nan)
    values = values.reshape(*values.shape[:-1], count, dimensions + 1)
    effects = np.diff(values, axis=-1) / moves
    ordered = np.take_along_axis(effects, np.broadcast_to(order, effects.shape), axis=-1)
    return np.swapaxes(ordered, -1, -2)


@functools.lru_cache(maxsize=1)
def _moves(dimensions: int, count: int, seed: int) -> tuple[Ints, Floats]:
    """When each parameter moves in each trajectory, how far each move goes: (count, dimensions)."""
    shares = trajectories(dimensions, count, np.random.default_rng(seed))
    steps = np.diff(shares.reshape(count, dimensions + 1, dimensions), axis=1)
    moved = np.argmax(np.abs(steps), axis=2)
    return np.argsort(moved, axis=1), np.take_along_axis(steps, moved[..., None], axis=2)[..., 0]
