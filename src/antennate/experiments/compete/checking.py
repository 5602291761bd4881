"""Somebody's table of trials, run again: which rows differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from antennate.control.registry import CONTROLLERS
from antennate.errors import BadInputError, ConfigError
from antennate.experiments.compete.config import require_free
from antennate.experiments.compete.episodes import Episode, restricted
from antennate.files import decoded, read_limited
from antennate.messages import nearest
from antennate.params.faults import describe
from antennate.studies.formats import from_csv

LARGEST = 100_000_000
"""Most bytes of such a table."""
CLOSE = 5e-7
"""Times [s] and ways [m] that differ by less are the same: tables have six decimals."""
BIAS, SPREAD = 0.01, 0.1
"""Shares of the limit by which times differ on another processor: the largest mean of 200 draws was
0.94 of 100 s, and the spread of a row 9.5 s (docs/performance.md)."""
_ROW = TypeAdapter(Episode)
_TEXTS = [field.name for field in fields(Episode) if field.type == "str"]


def read_rows(path: Path) -> list[Episode]:
    """The rows of such a table.

    Raises:
        ConfigError: It cannot be read, is no such table, or holds a row twice.
    """
    if path.is_dir():
        raise ConfigError(
            f"{path}: expected a table of trials, found a folder; name its trials.csv"
        )
    data = read_limited(path, LARGEST, ConfigError)
    try:
        lines = from_csv(decoded(path, data, ConfigError))
    except ConfigError:
        raise
    except (ValueError, BadInputError) as error:
        raise ConfigError(f"{path}: expected a table of trials, found {error}") from None
    _require_columns(path, list(lines[0]))
    rows, places = [], dict[tuple[str, str, int, int], int]()
    for number, line in enumerate(lines, start=2):
        row = _row(path, number, line)
        key = (row.controller, row.scene, row.seed, row.trial)
        if (first := places.setdefault(key, number)) != number:
            raise ConfigError(
                f"{path}: line {number}: expected each draw once a controller, found that of line "
                f"{first} again"
            )
        rows.append(row)
    return rows


def _require_columns(path: Path, names: Sequence[str]) -> None:
    """Check the head of a table.

    Raises:
        ConfigError: A column is missing, or is none of `antennate compete`.
    """
    known = [field.name for field in fields(Episode)]
    needed = [field.name for field in fields(Episode) if field.default is MISSING]
    for name in needed:
        if name not in names:
            raise ConfigError(
                f"{path}: expected a table of `antennate compete`, with the columns "
                f"{', '.join(needed)}, found none named {name}"
            )
    for name in names:
        if name not in known:
            raise ConfigError(
                f"{path}: expected a known column, found {name!r}{nearest(name, known)}"
            )


def _row(path: Path, number: int, line: Mapping[str, Any]) -> Episode:
    texts = {name: "" if line.get(name) is None else str(line[name]) for name in _TEXTS}
    values = {**line, **texts}
    if lacking := [name for name in ("controller", "scene", "outcome") if not values[name]]:
        raise ConfigError(f"{path}: line {number}: expected {lacking[0]}, found none")
    try:
        row = _ROW.validate_python(values)
        require_free(row.seed)
        _require_sound(row)
    except ValidationError as error:
        raise ConfigError(f"{path}: line {number}: {describe(error, Episode)}") from None
    except (ValueError, ConfigError) as error:
        raise ConfigError(f"{path}: line {number}: {error}") from None
    return row


def _require_sound(row: Episode) -> None:
    """Check that there may be such a controller, and that numbers can be such.

    They are finite, the limit is above 0 s, and none that counts is below 0.

    Raises:
        ConfigError: There is no controller of that name.
        ValueError: A number is not.
    """
    CONTROLLERS.check(row.controller)
    for name in ("seed", "trial"):
        if getattr(row, name) < 0:
            raise ValueError(f"{name}: expected at least 0, found {getattr(row, name)}")
    for name in ("time_s", "limit_s", "progress_m"):
        if not isfinite(value := getattr(row, name)) or (name == "limit_s" and value <= 0):
            least = " above 0" if name == "limit_s" else ""
            raise ValueError(f"{name}: expected a finite number{least}, found {value:g}")


_PLACE = ("version", "engine", "processor")
_SHOWN = ("outcome", "time_s", "progress_m", "overturned", "limit_s", "given")
"""What is compared."""


def compared(theirs: Sequence[Episode], ours: Sequence[Episode]) -> dict[str, Any]:
    """Which rows of a table differ from those that were run here.

    Rows that were not run are left out, as after an interruption.
    """
    run = {(row.controller, row.scene, row.seed, row.trial): row for row in ours}
    pairs = [
        (row, again)
        for row in theirs
        if (again := run.get((row.controller, row.scene, row.seed, row.trial))) is not None
    ]
    differ = [(row, again) for row, again in pairs if not _alike(row, again)]
    places = {f"{name}s": sorted({getattr(row, name) for row in theirs}) for name in _PLACE}
    return {
        "rows": len(pairs),
        "same": len(pairs) - len(differ),
        "other_outcome": sum(row.outcome != again.outcome for row, again in differ),
        "broken": sum(_must_repeat(row, again) for row, again in differ),
        "mean_share_difference": _mean_difference(pairs),
        **places,
        "differ": [_compared_row(row, again) for row, again in differ],
    }


def refused(check: Mapping[str, Any], tie: float) -> bool:
    """Whether a table does not repeat.

    It has a row that differs and must not, or, as on another processor, fewer than a share of
    1 - `tie` of its rows end alike, or the mean times are further apart than chance makes them.
    """
    rows = check["rows"]
    if not rows:
        return False
    far = abs(check["mean_share_difference"]) > BIAS + 2.0 * SPREAD / sqrt(rows)
    return check["broken"] > 0 or check["other_outcome"] > tie * rows or far


def _alike(row: Episode, again: Episode) -> bool:
    numbers = [(getattr(row, n), getattr(again, n)) for n in ("time_s", "progress_m", "limit_s")]
    exact = all(getattr(row, n) == getattr(again, n) for n in ("outcome", "overturned", "given"))
    return exact and all(abs(one - other) <= CLOSE for one, other in numbers)


def _must_repeat(row: Episode, again: Episode) -> bool:
    """Whether rows that differ are of one version, engine and processor, or differ in a rule."""
    alike = (row.version, row.engine) == (again.version, again.engine)
    named = again.processor.startswith(f"{row.processor} (")  # by former tables, without numbers
    if alike and (named or row.processor == again.processor):
        return True
    ran = "invalid" not in (row.outcome, again.outcome)
    return row.given != again.given or (ran and abs(row.limit_s - again.limit_s) > CLOSE)


def _mean_difference(pairs: Sequence[tuple[Episode, Episode]]) -> float:
    """Mean restricted time of the table less that of here, as a share of the limit; 0 of none."""
    theirs, ours = (sum(restricted(pair[k] for pair in pairs)) for k in (0, 1))
    return (theirs - ours) / max(len(pairs), 1)


def _compared_row(row: Episode, again: Episode) -> dict[str, Any]:
    columns = {name: getattr(row, name) for name in ("controller", "scene", "seed", "trial")}
    for name in _SHOWN:
        repeated = f"{name[:-2]}_here{name[-2:]}" if name[-2:] in ("_s", "_m") else f"{name}_here"
        columns |= {name: getattr(row, name), repeated: getattr(again, name)}
    return columns
