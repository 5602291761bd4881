"""Somebody's table of trials, run again: which rows differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING as NO_DEFAULT
from dataclasses import fields
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from antennate.control.registry import CONTROLLERS
from antennate.csv_files import MISSING, csv_rows, wrong_count
from antennate.errors import ConfigError
from antennate.experiments.compete.config import LARGEST_TABLE, require_unreserved
from antennate.experiments.compete.episodes import Episode, restricted
from antennate.experiments.compete.scenes import tunnel_config
from antennate.files import read_limited
from antennate.messages import nearest, shown
from antennate.params.base import LARGEST_SEED
from antennate.params.faults import describe
from antennate.sim.judge import require_times
from antennate.studies.statistics import sign_flips, signed_rank
from antennate.types import Floats

CLOSE = 5e-7
"""Times [s] and ways [m] that differ by less are the same: tables have six decimals."""
BIAS, CHANCE = 0.01, 0.01
"""Times of a draw that differ by no more than this share of the limit are the same elsewhere (0.94
of 100 s in 200 draws, docs/performance.md); and the p below which a table does not repeat."""
ENOUGH = 4
"""Draws that can tell something if all are far off: 2 (1/4)^4 is below `CHANCE`, see `_far_p`."""
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
    scenes = set[str]()
    for number, cells in lines:
        if why := wrong_count(names, cells, ""):
            raise ConfigError(f"{path}: line {number}: {why}")
        row = _row(path, number, dict(zip(names, cells, strict=True)), scenes)
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


def _row(path: Path, number: int, line: dict[str, str], scenes: set[str]) -> Episode:
    """The row of a line. Its scene is looked up unless it is among `scenes`, and put there."""
    if lacking := [name for name in ("controller", "scene", "outcome") if not line[name]]:
        raise ConfigError(f"{path}: line {number}: expected {lacking[0]}, found none")
    none = {name: "" for name in _WORDS if line.get(name, "").lower() in MISSING}
    try:
        row = _ROW.validate_python(line | none)
        require_unreserved(row.seed)
        _require_sound(row, limited="limit_s" in line)
        if row.scene not in scenes:
            tunnel_config(row.scene, row.controller, row.seed)
            scenes.add(row.scene)
    except ValidationError as error:
        raise ConfigError(f"{path}: line {number}: {describe(error, Episode)}") from None
    except (ValueError, ConfigError) as error:
        raise ConfigError(f"{path}: line {number}: {error}") from None
    return row


def _require_sound(row: Episode, limited: bool) -> None:
    """Check that there may be such a controller, and such an episode whatever it is compared with.

    Args:
        row: The row.
        limited: Whether its table says the limit; the time of a failure is compared with no other.

    Raises:
        ConfigError: There is no controller of that name.
        ValueError: A value is none that an episode can end with.
    """
    CONTROLLERS.check(row.controller)
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

    It has a row that differs and must not; or, as on another processor, its successes or times
    differ by more than chance makes them.
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
    p = min(check["times_p"], check["far_p"])
    if p < CHANCE:
        return (
            "Expected times as here but for chance, found mean times that differ by "
            f"{100 * check['mean_share_difference']:+.1f} % of the limit (p {p:.1g}, at least "
            f"{CHANCE:g} is chance)."
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
    """How successes and restricted times differ, and with what chance on another processor.

    There a draw ends as if it were walked again, so either end is as likely in the table as here:
    each difference could as well have the other sign. No size counts but by its rank, so a row
    moves a test by no more than its place. Conditions of a scene are often the same walk, so a draw
    of it counts once.
    """
    walks: dict[tuple[str, str, int, int], list[tuple[float, float]]] = {}
    for row, again in pairs:
        won = (row.outcome == "success") - (again.outcome == "success")
        theirs, ours = restricted([row, again])
        key = (row.controller, row.scene.partition("+")[0], row.seed, row.trial)
        walks.setdefault(key, []).append((won, theirs - ours))
    won = np.array([sum(won for won, _ in walk) for walk in walks.values()], int)
    far: Floats = np.array([sum(far for _, far in walk) / len(walk) for walk in walks.values()])
    beyond: Floats = far - np.clip(far, -BIAS, BIAS)
    return {
        "draws": len(walks),
        "more_successes": int(won.sum()),
        "successes_p": sign_flips(won),
        "mean_share_difference": float(far.mean()) if len(far) else 0.0,
        "times_p": signed_rank(beyond),
        "far_p": _far_p(far),
    }


def _far_p(far: Floats) -> float:
    """Two-sided p of differences (n,) of which so many are above half of the limit to one side.

    Of such a draw one time is below half of the limit and the other above. If a time is below with
    chance q wherever the draw is run, it is so in the table alone with q (1 - q), at most 1/4. So
    the number of such draws is binomial at most, however a controller walks. It tells of few draws,
    of which signs alone say nothing.
    """
    from scipy.special import bdtrc  # scipy.stats takes half a second longer

    most = max(int((far < -0.5).sum()), int((far > 0.5).sum()))
    return min(1.0, 2.0 * float(bdtrc(most - 1, len(far), 0.25))) if most else 1.0


def _compared_row(row: Episode, again: Episode) -> dict[str, Any]:
    columns = {name: getattr(row, name) for name in ("controller", "scene", "seed", "trial")}
    for name in _SHOWN:
        repeated = f"{name[:-2]}_here{name[-2:]}" if name[-2:] in ("_s", "_m") else f"{name}_here"
        columns |= {name: getattr(row, name), repeated: getattr(again, name)}
    return columns
