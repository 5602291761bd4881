"""Somebody's table of trials, run again: which rows differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING as NO_DEFAULT
from dataclasses import fields
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from antennate.control.registry import CONTROLLERS
from antennate.csv_files import MISSING, csv_rows, wrong_count
from antennate.errors import ConfigError
from antennate.experiments.compete.config import LARGEST_TABLE, require_free
from antennate.experiments.compete.episodes import Episode, restricted
from antennate.files import read_limited
from antennate.jackknife import ENOUGH
from antennate.messages import nearest
from antennate.params.base import LARGEST_SEED
from antennate.params.faults import describe
from antennate.sim.trial import require_times
from antennate.studies.statistics import sign_flips

CLOSE = 5e-7
"""Times [s] and ways [m] that differ by less are the same: tables have six decimals."""
BIAS, ERRORS, CHANCE = 0.01, 3.0, 0.01
"""What another processor may change: mean times by a share of the limit (0.94 of 100 s in 200
draws, docs/performance.md) and so many standard errors, and successes by as much as has this p."""
_ROW = TypeAdapter(Episode)
_WORDS = ("given", "reason")
"""Columns that are mostly empty, for which some programs write NA."""


def read_rows(path: Path) -> list[Episode]:
    """The rows of such a table.

    Raises:
        ConfigError: It cannot be read, is no such table, or holds a row twice.
    """
    if path.is_dir():
        raise ConfigError(
            f"{path}: expected a table of trials, found a folder; name its trials.csv"
        )
    data = read_limited(path, LARGEST_TABLE, ConfigError)
    lines = csv_rows(path, data, ["controller"], ConfigError)
    _, names = next(lines)
    _require_columns(path, names)
    rows, places = list[Episode](), dict[tuple[str, str, int, int], int]()
    for number, cells in lines:
        if why := wrong_count(names, cells, ""):
            raise ConfigError(f"{path}: line {number}: {why}")
        row = _row(path, number, dict(zip(names, cells, strict=True)))
        key = (row.controller, row.scene, row.seed, row.trial)
        if (first := places.setdefault(key, number)) != number:
            raise ConfigError(
                f"{path}: line {number}: expected each draw once a controller, found that of line "
                f"{first} again"
            )
        rows.append(row)
    if not rows:
        raise ConfigError(f"{path}: expected a table of trials, found no row")
    return rows


def _require_columns(path: Path, names: Sequence[str]) -> None:
    """Check the head of a table.

    Raises:
        ConfigError: A column is missing, or is none of `antennate compete`.
    """
    known = [field.name for field in fields(Episode)]
    needed = [field.name for field in fields(Episode) if field.default is NO_DEFAULT]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise ConfigError(f"{path}: expected each column once, found {name!r} twice")
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


def _row(path: Path, number: int, line: dict[str, str]) -> Episode:
    if lacking := [name for name in ("controller", "scene", "outcome") if not line[name]]:
        raise ConfigError(f"{path}: line {number}: expected {lacking[0]}, found none")
    none = {name: "" for name in _WORDS if line.get(name, "").lower() in MISSING}
    try:
        row = _ROW.validate_python(line | none)
        require_free(row.seed)
        _require_sound(row)
    except ValidationError as error:
        raise ConfigError(f"{path}: line {number}: {describe(error, Episode)}") from None
    except (ValueError, ConfigError) as error:
        raise ConfigError(f"{path}: line {number}: {error}") from None
    return row


def _require_sound(row: Episode) -> None:
    """Check that there may be such a controller, and that numbers can be such.

    They are finite, no time is above its limit, and none that counts is below 0.

    Raises:
        ConfigError: There is no controller of that name.
        ValueError: A number is not.
    """
    CONTROLLERS.check(row.controller)
    for name in ("seed", "trial"):
        if not 0 <= (value := getattr(row, name)) <= LARGEST_SEED:
            raise ValueError(f"{name}: expected 0 to {LARGEST_SEED}, found {value}")
    require_times(row.time_s, row.limit_s)
    if not isfinite(row.progress_m):
        raise ValueError(f"progress_m: expected a finite number, found {row.progress_m:g}")


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
        "elsewhere": sum(not _in_one_place(row, again) for row, again in pairs),
        **_elsewhere(pairs),
        **places,
        "differ": [_compared_row(row, again) for row, again in differ],
    }


def refusal(check: Mapping[str, Any]) -> str:
    """Why a table does not repeat; empty if it does.

    It has a row that differs and must not; or, as on another processor, its successes differ by
    more than chance makes them, or its mean time.
    """
    if check["broken"]:
        return (
            f"Expected no difference in {check['broken']} of them: on one version, engine and "
            "processor every row repeats, and limits and what is given are the same everywhere."
        )
    if (p := check["successes_p"]) < CHANCE:
        return (
            f"Expected as many successes as here but for chance, found {check['more_successes']:+d}"
            f" (p {p:.1g}, at least {CHANCE:g} is chance)."
        )
    far, most = check["mean_share_difference"], check["largest_share_difference"]
    if most is not None and abs(far) > most:
        return (
            f"Expected mean times that differ by at most {100 * most:.1f} % of the limit, "
            f"found {100 * far:+.1f} %."
        )
    return ""


def _alike(row: Episode, again: Episode) -> bool:
    numbers = [(getattr(row, n), getattr(again, n)) for n in ("time_s", "progress_m", "limit_s")]
    exact = all(getattr(row, n) == getattr(again, n) for n in ("outcome", "overturned", "given"))
    return exact and all(abs(one - other) <= CLOSE for one, other in numbers)


def _in_one_place(row: Episode, again: Episode) -> bool:
    """Whether both are of one version, engine and processor."""
    alike = (row.version, row.engine) == (again.version, again.engine)
    named = again.processor.startswith(f"{row.processor} (")  # by former tables, without numbers
    return alike and (named or row.processor == again.processor)


def _must_repeat(row: Episode, again: Episode) -> bool:
    """Whether rows that differ are of one place, or differ in a rule."""
    if _in_one_place(row, again):
        return True
    ran = "invalid" not in (row.outcome, again.outcome)
    return row.given != again.given or (ran and abs(row.limit_s - again.limit_s) > CLOSE)


def _elsewhere(pairs: Sequence[tuple[Episode, Episode]]) -> dict[str, Any]:
    """How successes and restricted times differ in sum, and by how much both may by chance.

    Conditions of a scene are often the same walk, so a draw of it counts once.
    """
    walks: dict[tuple[str, str, int, int], list[tuple[float, float]]] = {}
    for row, again in pairs:
        won = (row.outcome == "success") - (again.outcome == "success")
        theirs, ours = restricted([row, again])
        key = (row.controller, row.scene.partition("+")[0], row.seed, row.trial)
        walks.setdefault(key, []).append((won, theirs - ours))
    won = np.array([sum(won for won, _ in walk) for walk in walks.values()], int)
    far = np.array([np.mean([far for _, far in walk]) for walk in walks.values()])
    mean, most = float(far.mean()) if len(far) else 0.0, None
    if len(far) >= ENOUGH:
        most = BIAS + ERRORS * float(far.std(ddof=1)) / sqrt(len(far))
    return {
        "more_successes": int(won.sum()),
        "successes_p": sign_flips(won),
        "mean_share_difference": mean,
        "largest_share_difference": most,
    }


def _compared_row(row: Episode, again: Episode) -> dict[str, Any]:
    columns = {name: getattr(row, name) for name in ("controller", "scene", "seed", "trial")}
    for name in _SHOWN:
        repeated = f"{name[:-2]}_here{name[-2:]}" if name[-2:] in ("_s", "_m") else f"{name}_here"
        columns |= {name: getattr(row, name), repeated: getattr(again, name)}
    return columns
