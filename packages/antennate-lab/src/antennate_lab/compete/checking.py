"""Somebody's table of trials: read and found sound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING as NO_DEFAULT
from dataclasses import fields
from math import isfinite
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from antennate.control.registry import CONTROLLERS
from antennate.csv_files import MISSING, csv_rows, wrong_count
from antennate.errors import ConfigError
from antennate.files import read_limited
from antennate.messages import nearest, shown
from antennate.params.base import LARGEST_SEED
from antennate.params.faults import describe
from antennate.sim.episode import require_times
from antennate_lab.compete.config import LARGEST_TABLE, plain, require_unreserved
from antennate_lab.compete.episodes import EpisodeRow
from antennate_lab.compete.scenes import tunnel_config

CLOSE = 5e-7
"""Times [s] and ways [m] that differ by less are the same: tables have six decimals."""
_ROW = TypeAdapter(EpisodeRow)
_WORDS = ("given", "reason")
"""Columns that are mostly empty, for which some programs write NA."""


def read_rows(path: Path) -> list[EpisodeRow]:
    """The rows of such a table."""
    if path.is_dir():
        raise ConfigError(
            f"{path}: expected a table of trials, found a folder; name its trials.csv"
        )
    data = read_limited(path, LARGEST_TABLE, ConfigError)
    lines = csv_rows(path, data, ["controller"], ConfigError)
    _, names = next(lines)
    _require_columns(path, names)
    rows, places = list[EpisodeRow](), dict[tuple[str, str, int, int], int]()
    known = set[tuple[str, str]]()
    for number, cells in lines:
        if why := wrong_count(names, cells, ""):
            raise ConfigError(f"{path}: line {number}: {why}")
        row = _row(path, number, dict(zip(names, cells, strict=True)), known)
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
    """Check the head of a table."""
    known = [field.name for field in fields(EpisodeRow)]
    needed = [field.name for field in fields(EpisodeRow) if field.default is NO_DEFAULT]
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


def _row(path: Path, number: int, line: dict[str, str], known: set[tuple[str, str]]) -> EpisodeRow:
    """The row of a line; controller and scene are looked up unless among `known`, and put there."""
    if lacking := [name for name in ("controller", "scene", "outcome") if not line[name]]:
        raise ConfigError(f"{path}: line {number}: expected {lacking[0]}, found none")
    none = {name: "" for name in _WORDS if line.get(name, "").lower() in MISSING}
    try:
        row = _ROW.validate_python(line | none)
        require_unreserved(row.seed)
        _require_sound(row, limited="limit_s" in line)
        if (both := (row.controller, row.scene)) not in known:
            tunnel_config(row.scene, row.controller, row.seed)
            known.add(both)
    except ValidationError as error:
        raise ConfigError(f"{path}: line {number}: {describe(error, EpisodeRow)}") from None
    except (ValueError, ConfigError) as error:
        raise ConfigError(f"{path}: line {number}: {error}") from None
    return row


def _require_sound(row: EpisodeRow, limited: bool) -> None:
    """Check that there may be such a controller, and such an episode whatever it is compared with.

    Args:
        row: The row.
        limited: Whether its table says the limit; the time of a failure is compared with no other.
    """
    CONTROLLERS.check(plain(row.controller))
    require_times(row.time_s, row.limit_s, CLOSE)
    limit, free = row.limit_s, row.outcome == "success" or not limited
    rules = (
        ("seed", 0 <= row.seed <= LARGEST_SEED, f"0 to {LARGEST_SEED}"),
        ("trial", 0 <= row.trial <= LARGEST_SEED, f"0 to {LARGEST_SEED}"),
        ("time_s", free or row.time_s >= limit - CLOSE, f"limit_s, {limit:g}, as it is no success"),
        ("progress_m", isfinite(row.progress_m), "a finite number"),
        ("overturned", row.overturned or row.outcome != "overturned", "True, as it ended so"),
        ("reason", not row.reason or row.outcome == "invalid", "none, as it is not invalid"),
    )
    for name, sound, wanted in rules:
        if not sound:
            raise ValueError(f"{name}: expected {wanted}, found {shown(getattr(row, name))}")
