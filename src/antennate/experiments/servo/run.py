"""Replay recordings through servo models, fit them, judge them on what they were not fitted on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from antennate.errors import BadInputError
from antennate.experiments.servo import drive_log, fitting
from antennate.experiments.servo.config import ServoConfig
from antennate.experiments.servo.fitting import Data
from antennate.experiments.servo.recording import Recording, data_of, read
from antennate.robots import servo_model
from antennate.robots.servo_model import NAMES, values_of
from antennate.studies.experiment import OnStep, Outcome, no_step
from antennate.types import Bools, Floats

_MANUAL = 128.0
"""Divisor of the gain in the block diagram of the manual of X servos."""
_LINE = ("stall_torque", "no_load_speed")
_FRICTION = ("friction", "load_friction")
SHOWN = 10
"""A figure shows every so many times of the replay."""


@dataclass(frozen=True)
class Model:
    """A servo model: where its parameters begin, and which of them are fitted.

    Attributes:
        name: What it is called.
        values: Parameters, shape (6,).
        free: Names of those that are fitted.
    """

    name: str
    values: Floats
    free: tuple[str, ...] = ()

    @property
    def mask(self) -> Bools:
        """Which parameters are fitted, shape (6,)."""
        return np.array([name in self.free for name in NAMES])


@dataclass(frozen=True)
class Held:
    """A part that a fit did not see.

    Attributes:
        name: What was left out.
        parts: Its pieces, shape (F, K).
    """

    name: str
    parts: Bools


@dataclass(frozen=True)
class ServoOutcome(Outcome):
    """What the models made of the recordings.

    Attributes:
        config: What was asked.
        recordings: The recordings.
        data: The same on one grid of times.
        models: Rows of the table, simple ones first; the last is the whole model.
        fitted: Parameters of each from all recordings, shape (M, 6).
        errors: Mean error of each on all [rad], shape (M,).
        held: What was left out in turn.
        held_errors: Error of each on what its fit did not see [rad], shape (M, H).
        interval: Ends of the 95 % intervals of the whole model, shape (2, 6); NaN without a fit.
    """

    config: ServoConfig
    recordings: list[Recording]
    data: Data
    models: list[Model]
    fitted: Floats
    errors: Floats
    held: list[Held]
    held_errors: Floats
    interval: Floats = field(default_factory=lambda: np.full((2, len(NAMES)), np.nan))

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "schema": 1,
            "command": "servo",
            "seed": self.config.seed,
            "servo": self.config.servo,
            "fitted": self.config.fit,
            "recordings": [_recording(each) for each in self.recordings],
            "interval_over": "recordings" if _by_file(self.recordings) else "pieces of 1 s",
            "models": [
                {
                    "name": model.name,
                    "free": list(model.free),
                    **dict(zip(NAMES, self.fitted[i].tolist(), strict=True)),
                    "error_deg": float(np.degrees(self.errors[i])),
                    "held_out_deg": dict(
                        zip(
                            [held.name for held in self.held],
                            np.degrees(self.held_errors[i]).tolist(),
                            strict=True,
                        )
                    ),
                }
                for i, model in enumerate(self.models)
            ],
            "interval_95": {
                name: self.interval[:, i].tolist()
                for i, name in enumerate(NAMES)
                if np.isfinite(self.interval[:, i]).all()
            },
        }

    def traces(self) -> Floats:
        """Positions that each model gives [rad], shape (T / 10, M, F)."""
        return servo_model.replay(self.fitted, self.data.course, SHOWN)


def _recording(each: Recording) -> dict[str, Any]:
    return {
        "name": each.name,
        "sha256": each.sha256,
        "p_gain": each.p_gain,
        "gain_divisor": each.divisor(),
        "seconds": float(each.t[-1]),
        "samples": len(each.t),
        "torque_share": float(each.torque.mean()),
        "supply_v": float(np.mean(each.supply)) if np.isfinite(each.supply).all() else None,
    }


def _by_file(recordings: list[Recording]) -> bool:
    """Whether there are enough recordings to draw whole ones."""
    return len(recordings) >= 5


def told_divisor(recordings: list[Recording]) -> float | None:
    """Divisor of the gain as the drive of recordings tells it; None if none does."""
    found = [d for each in recordings if (d := each.divisor()) is not None]
    return float(np.median(found)) if found else None


def models(config: ServoConfig, told: float | None, loaded: bool) -> list[Model]:
    """Models of a table, simple ones first; the last is the whole one.

    Args:
        config: What was asked.
        told: Divisor of the gain as the recordings tell it; if they do not, it is fitted.
        loaded: Whether a known weight hangs on the servo. Without one only the inertia in
            proportion to the stall torque shows, so that this stays as in the data sheet.
    """
    given = values_of(config.given)
    divisor = told if config.fit and told is not None else config.given.gain_divisor
    sheet = np.array([divisor, *config.given.datasheet, config.given.armature, 0.0, 0.0])
    manual = np.array([_MANUAL, *sheet[1:]])
    rows = [Model("data sheet, /128", manual)] if abs(divisor / _MANUAL - 1.0) > 0.02 else []
    rows.append(Model(f"data sheet, /{divisor:.0f}", sheet))
    if not config.fit:
        bare = np.array([*given[:4], 0.0, 0.0])
        return [*rows, Model("as given, no friction", bare), Model("as given", given)]
    gain = ("gain_divisor",) if told is None else ()
    line = (*gain, *(_LINE if loaded else _LINE[1:]), "armature")
    dry, whole = np.array([*sheet[:4], 0.01, 0.0]), np.array([*sheet[:4], 0.01, 0.2])
    return [
        *rows,
        Model("line fitted", sheet, line),
        Model("+ constant friction", dry, (*line, "friction")),
        Model("data sheet + friction", whole, (*gain, "armature", *_FRICTION)),
        Model("whole model", whole, (*line, *_FRICTION)),
    ]


def splits(recordings: list[Recording], parts: Bools) -> list[Held]:
    """What to leave out in turn: each gain, else each recording, else each half of the only one.

    Nothing if that lasts no longer than a piece.
    """
    gains = np.array([each.p_gain for each in recordings])
    if len(np.unique(gains)) > 1:
        return [
            Held(f"gain {gain:g}", parts & (gains == gain)[:, None]) for gain in np.unique(gains)
        ]
    if len(recordings) > 1:
        own = np.eye(len(recordings), dtype=bool)
        return [Held(each.name, parts & own[i][:, None]) for i, each in enumerate(recordings)]
    if parts.sum() < 2:
        return []
    late = np.arange(parts.shape[1]) >= parts.sum() / 2
    return [Held("first half", parts & ~late), Held("second half", parts & late)]


def run(config: ServoConfig, on_step: OnStep = no_step) -> ServoOutcome:
    """Replay, and fit if asked.

    Raises:
        BadInputError: A recording cannot be used, or none is named.
    """
    if not config.recording:
        raise BadInputError("--recording: expected one file or more, found none")
    recordings = [_read(Path(name), config) for name in config.recording]
    if config.joint is not None and not any(drive_log.is_log(Path(n)) for n in config.recording):
        raise BadInputError("--joint: expected a log among the recordings, found none")
    data = data_of(recordings, config.given.voltage, config.inertia)
    parts, loaded = data.parts(), any(each.mass * each.length > 0 for each in recordings)
    rows = models(config, told_divisor(recordings), loaded)
    held = splits(recordings, parts) if config.fit else []
    seen = [parts, *(parts & ~each.parts for each in held)]
    total = len(seen) + bool(held)
    fits: list[Floats] = []
    for done, part in enumerate(seen):
        on_step(done, total)
        known = [recordings[i] for i in np.flatnonzero(part.any(axis=1))]
        told = told_divisor(known)
        fits.append(_fitted(data, [_with(row, told) for row in rows], part))
    interval = np.full((2, len(NAMES)), np.nan)
    if config.fit:
        on_step(len(seen), total)
        interval = _interval(config, recordings, data, fits[0][-1], rows[-1])
    on_step(total, total)
    judged = [
        fitting.errors(data, fits[i + 1], _same(each.parts, len(rows)))
        for i, each in enumerate(held)
    ]
    every = fitting.errors(data, fits[0], _same(parts, len(rows)))
    held_errors = np.array(judged).reshape(len(held), len(rows)).T
    return ServoOutcome(config, recordings, data, rows, fits[0], every, held, held_errors, interval)


def _read(path: Path, config: ServoConfig) -> Recording:
    """A recording of either form."""
    if drive_log.is_log(path):
        return drive_log.read(path, config)
    return read(path, config.mass, config.length)


def _same(parts: Bools, count: int) -> Floats:
    return np.repeat(parts[None].astype(float), count, axis=0)


def _with(row: Model, told: float | None) -> Model:
    """A model with the divisor that a part of the recordings tells."""
    if not row.free or told is None:
        return row
    return replace(row, values=np.array([told, *row.values[1:]]))


def _fitted(data: Data, rows: list[Model], parts: Bools) -> Floats:
    """Parameters of all models from some pieces; those without free ones as they were."""
    start, free = np.array([row.values for row in rows]), np.array([row.mask for row in rows])
    found = start.copy()
    if (open_ := free.any(axis=1)).any():
        weight = _same(parts, int(open_.sum()))
        found[open_] = fitting.fit(data, start[open_], free[open_], weight)
    return found


def _interval(
    config: ServoConfig, recordings: list[Recording], data: Data, best: Floats, model: Model
) -> Floats:
    """Ends of the 95 % bootstrap intervals, shape (2, 6); NaN for what is not fitted."""
    rng = np.random.default_rng(config.seed)
    weights = fitting.draws(data.parts(), config.draws, rng, _by_file(recordings))
    start = np.repeat(best[None], config.draws, axis=0)
    found = fitting.fit(data, start, np.repeat(model.mask[None], config.draws, axis=0), weights)
    ends = np.percentile(found, [2.5, 97.5], axis=0)
    return np.where(model.mask, ends, np.nan)
