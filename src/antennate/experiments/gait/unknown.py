"""Numbers that nobody measured: drawn from a range, and each alone at both of its ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np

from antennate.errors import ConfigError
from antennate.messages import nearest, shown
from antennate.params.base import Params, from_values
from antennate.types import Floats

GROUPS = ("robot", "gait")
"""Groups of a configuration whose numbers may be unknown."""

Config = TypeVar("Config", bound=Params)


@dataclass(frozen=True)
class Unknown:
    """A number that lies somewhere in a range, each value of which is as likely.

    Attributes:
        name: The parameter, dotted.
    """

    name: str
    low: float
    high: float

    @classmethod
    def read(cls, text: str) -> Unknown:
        """From words such as `robot.leg_friction=0.18:0.25`.

        Raises:
            ValueError: They say something else.
        """
        name, _, span = text.partition("=")
        low, _, high = span.partition(":")
        try:
            found = cls(name.replace("-", "_"), float(low), float(high))
        except ValueError:
            found = cls("", 0.0, 0.0)
        if not found.name.startswith(tuple(f"{group}." for group in GROUPS)) or not (
            -math.inf < found.low < found.high < math.inf
        ):
            raise ValueError(
                "unknown: expected a number of robot or gait with its range, such as "
                f"robot.leg_friction=0.18:0.25, found {shown(text)}"
            )
        return found


def changed(config: Config, values: Mapping[str, float]) -> Config:
    """A configuration with other numbers in it, by their dotted names.

    Raises:
        ConfigError: There is no such number, or it cannot have this value.
    """
    table = config.model_dump()
    places = {name: place for group in GROUPS for name, place in _numbers(table[group], group)}
    for name, value in values.items():
        if name not in places:
            raise ConfigError(
                f"unknown: expected a number of robot or gait that need not be whole"
                f"{nearest(name, places)}, found {shown(name)}"
            )
        group, last = places[name]
        group[last] = value
    try:
        return from_values(type(config), table)
    except ConfigError as error:
        raise ConfigError(f"unknown: {error}") from None


def _numbers(table: dict[str, Any], path: str) -> Iterator[tuple[str, tuple[dict[str, Any], str]]]:
    """The dotted name of each number in nested tables, and the table and key that hold it."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _numbers(cast("dict[str, Any]", value), f"{path}.{key}")
        elif isinstance(value, float):
            yield f"{path}.{key}", (table, key)


def drawn(unknowns: Sequence[Unknown], draws: int, seed: int) -> Floats:
    """Values of the unknown numbers, each column stratified, shape (draws, unknowns)."""
    rng = np.random.default_rng(seed)
    strata = np.array([rng.permutation(draws) for _ in unknowns]).reshape(-1, draws).T
    share = (strata + rng.uniform(size=strata.shape)) / max(draws, 1)
    low, high = (np.array([getattr(one, end) for one in unknowns]) for end in ("low", "high"))
    return low + share * (high - low)
