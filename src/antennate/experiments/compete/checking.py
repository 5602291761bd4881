"""Somebody's table of trials, run again: which rows differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from antennate.errors import BadInputError, ConfigError
from antennate.experiments.compete.config import require_free
from antennate.experiments.compete.episodes import Episode
from antennate.files import read_limited
from antennate.params.faults import describe
from antennate.studies.formats import from_csv

LARGEST = 100_000_000
"""Most bytes of such a table."""
CLOSE = 1e-6
"""Times that differ by less are the same [s]: they are told to a microsecond."""
_ROW = TypeAdapter(Episode)
_TEXTS = [field.name for field in fields(Episode) if field.type == "str"]


def read_rows(path: Path) -> list[Episode]:
    """The rows of such a table.

    Raises:
        ConfigError: It cannot be read, is no such table, or holds a row twice.
    """
    data = read_limited(path, LARGEST, ConfigError)
    try:
        lines = from_csv(data.decode())
    except (UnicodeDecodeError, ValueError, BadInputError) as error:
        raise ConfigError(f"{path}: expected a table of trials, found {error}") from None
    rows = [_row(path, number, line) for number, line in enumerate(lines, start=2)]
    if not rows:
        raise ConfigError(f"{path}: expected a table of trials, found none")
    keys = [(row.controller, row.scene, row.seed, row.trial) for row in rows]
    if len(set(keys)) < len(keys):
        raise ConfigError(f"{path}: expected each draw once a controller, found one twice")
    return rows


def _row(path: Path, number: int, line: Mapping[str, Any]) -> Episode:
    texts = {name: "" if line.get(name) is None else str(line[name]) for name in _TEXTS}
    known = {field.name for field in fields(Episode)}
    values = {name: value for name, value in line.items() if name in known} | texts
    if lacking := [name for name in ("controller", "scene", "outcome") if not texts[name]]:
        raise ConfigError(f"{path}: line {number}: expected {lacking[0]}, found none")
    try:
        row = _ROW.validate_python(values)
        require_free(row.seed)
    except ValidationError as error:
        raise ConfigError(f"{path}: line {number}: {describe(error, Episode)}") from None
    except ValueError as error:
        raise ConfigError(f"{path}: line {number}: {error}") from None
    return row


def compared(theirs: Sequence[Episode], ours: Sequence[Episode]) -> dict[str, Any]:
    """Which rows of a table differ from those that were run here.

    Rows that were not run are left out, as after an interruption.
    """
    run = {(row.controller, row.scene, row.seed, row.trial): row for row in ours}
    differ, other, done = list[dict[str, Any]](), 0, 0
    for row in theirs:
        again = run.get((row.controller, row.scene, row.seed, row.trial))
        if again is None:
            continue
        done += 1
        same = again.outcome == row.outcome
        other += not same
        if not same or abs(again.time_s - row.time_s) > CLOSE:
            differ.append(
                {
                    "controller": row.controller,
                    "scene": row.scene,
                    "seed": row.seed,
                    "trial": row.trial,
                    "outcome": row.outcome,
                    "outcome_here": again.outcome,
                    "time_s": row.time_s,
                    "time_here_s": again.time_s,
                }
            )
    where = {name: sorted({getattr(row, name) for row in theirs}) for name in ("version", "engine")}
    return {
        "rows": done,
        "same": done - len(differ),
        "other_outcome": other,
        **{f"{name}s": values for name, values in where.items()},
        "processors": sorted({row.processor for row in theirs}),
        "differ": differ,
    }
