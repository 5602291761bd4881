"""Replay recordings through servo models, fit them, judge them on what they were not fitted on."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from antennate.errors import BadInputError
from antennate.experiments.servo import drive_log, fitting, stalls
from antennate.experiments.servo.checks import GRAVITY, check_load, check_supply, check_torque
from antennate.experiments.servo.config import ServoConfig
from antennate.experiments.servo.fitting import Data
from antennate.experiments.servo.models import Held, Model, models, splits, told_divisor, with_told
from antennate.experiments.servo.recording import Recording, data_of, read
from antennate.experiments.servo.stalls import RecordingRow
from antennate.robots import servos
from antennate.robots.servos import MODEL_NUMBERS
from antennate.studies.experiment import OnStep, Outcome, no_step
from antennate.types import Bools, Floats

_JUDGED = 2
"""The last models of a fit, with both frictions, get intervals; the first of them is shown."""
SHOWN = 10
"""A figure shows every so many times of the replay."""


@dataclass(frozen=True)
class ServoOutcome(Outcome):
    """What the models made of the recordings.

    Attributes:
        data: The same on one grid of times.
        models: Rows of the table, simple ones first; the last is the whole model.
        fitted: Parameters of each from all recordings, shape (M, 6).
        errors: Mean error of each on all [rad], shape (M,).
        held: What was left out in turn.
        held_errors: Error of each on what its fit did not see [rad], shape (M, H).
        interval: Ends of their 95 % intervals, shape (M, 2, 6); NaN where there is none.
        by_recording: The error of each recording, with the last model.
    """

    config: ServoConfig
    recordings: list[Recording]
    data: Data
    models: list[Model]
    fitted: Floats
    errors: Floats
    held: list[Held]
    held_errors: Floats
    interval: Floats
    by_recording: list[RecordingRow]

    @property
    def rows(self) -> list[RecordingRow]:
        """A row for each recording."""
        return self.by_recording

    @property
    def shown(self) -> int:
        """Place of the model of a figure: as given, or with the data sheet's line."""
        return len(self.models) - (_JUDGED if self.config.fit else 1)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "schema": 1,
            "command": "servo",
            "servo": self.config.servo,
            "fitted": self.config.fit,
            "recordings": [
                _recording(each) | asdict(row)
                for each, row in zip(self.recordings, self.rows, strict=True)
            ],
            "interval_over": self._interval_over(),
            "models": [
                {
                    "name": model.name,
                    "free": list(model.free),
                    **dict(zip(MODEL_NUMBERS, self.fitted[i].tolist(), strict=True)),
                    "error_deg": float(np.degrees(self.errors[i])),
                    "held_out_deg": dict(
                        zip(
                            [name for name, _ in self.held],
                            np.degrees(self.held_errors[i]).tolist(),
                            strict=True,
                        )
                    ),
                    "interval_95": {
                        name: self.interval[i, :, k].tolist()
                        for k, name in enumerate(MODEL_NUMBERS)
                        if name in model.free and np.isfinite(self.interval[i, :, k]).all()
                    },
                }
                for i, model in enumerate(self.models)
            ],
        }

    def _interval_over(self) -> str:
        by_file = _by_file(self.recordings)
        count = len(fitting.left_out(self.data.parts(), by_file))
        return f"{count} recordings" if by_file else f"{count} stretches of the recordings"

    def traces(self) -> Floats:
        """Positions that each model gives [rad], shape (T / 10, M, F)."""
        return servos.replay(self.fitted, self.data.course, SHOWN)


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
    """Whether there are enough recordings to leave out whole ones."""
    return len(recordings) >= 5


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
    if config.supply is not None and all(np.isfinite(each.supply).all() for each in recordings):
        raise BadInputError("--supply: expected a recording that tells none, found that all do")
    recordings = [_supplied(each, config) for each in recordings]
    data = data_of(recordings, config.given.voltage, config.inertia)
    parts, loaded = data.parts(), any(each.mass * each.length > 0 for each in recordings)
    rows = models(config, told_divisor(recordings), loaded)
    held = splits(recordings, parts) if config.fit else []
    seen = [parts, *(parts & ~out for _, out in held)]
    total = len(seen) + bool(held)
    fits: list[Floats] = []
    for done, part in enumerate(seen):
        on_step(done, total)
        known = [recordings[i] for i in np.flatnonzero(part.any(axis=1))]
        told = told_divisor(known)
        fits.append(_fitted(data, [with_told(row, told) for row in rows], part))
    interval = np.full((len(rows), 2, len(MODEL_NUMBERS)), np.nan)
    if config.fit:
        on_step(len(seen), total)
        last = slice(-_JUDGED, None)
        interval[last] = _intervals(recordings, data, fits[0][last], rows[last])
    on_step(total, total)
    judged = [
        fitting.errors(data, fits[i], _same(out, len(rows)))
        for i, (_, out) in enumerate(held, start=1)
    ]
    every = fitting.errors(data, fits[0], _same(parts, len(rows)))
    held_errors = np.array(judged).reshape(len(held), len(rows)).T
    last = servos.replay(fits[0][-1:], data.course, fitting.EVERY)[:, 0]
    return ServoOutcome(
        *(config, recordings, data, rows, fits[0], every, held, held_errors, interval),
        by_recording=stalls.rows(recordings, data, last),
    )


def _read(path: Path, config: ServoConfig) -> Recording:
    """A recording of either form that can serve."""
    if drive_log.is_log(path):
        found = drive_log.read(path, config)
    else:
        found = read(path, config.given, config.mass, config.length)
    check_load(path, found.p_gain, found.mass * GRAVITY * found.length, config.given)
    check_supply(f"{path}: input_volts", found.supply, config.given)
    check_torque(path, found.t, found.torque)
    return found


def _supplied(each: Recording, config: ServoConfig) -> Recording:
    """A recording with the supply that the configuration gives where it tells none."""
    unknown = ~np.isfinite(each.supply)
    if not unknown.any():
        return each
    if config.supply is None:
        if config.fit:
            raise BadInputError(
                f"{each.name}: a fit needs the supply, as torque and speed follow it: expected it "
                "in the recording or as --supply, found neither"
            )
        return each
    check_supply("--supply", np.array([config.supply]), config.given)
    return replace(each, supply=np.where(unknown, config.supply, each.supply))


def _same(parts: Bools, count: int) -> Floats:
    return np.repeat(parts[None].astype(float), count, axis=0)


def _fitted(data: Data, rows: list[Model], parts: Bools) -> Floats:
    """Parameters of all models from some pieces; those without free ones as they were."""
    start, free = np.array([row.values for row in rows]), np.array([row.mask for row in rows])
    found = start.copy()
    if (open_ := free.any(axis=1)).any():
        weight = _same(parts, int(open_.sum()))
        found[open_] = fitting.fit(data, start[open_], free[open_], weight)
    return found


def _intervals(recordings: list[Recording], data: Data, best: Floats, rows: list[Model]) -> Floats:
    """Ends of the 95 % intervals, shape (M, 2, 6); NaN for what is not fitted."""
    weights = fitting.left_out(data.parts(), _by_file(recordings))
    mask = np.array([row.mask for row in rows])
    start = np.repeat(best, len(weights), axis=0)
    free = np.repeat(mask, len(weights), axis=0)
    found = fitting.fit(data, start, free, np.concatenate([weights] * len(rows)))
    left = found.reshape(len(rows), len(weights), -1)
    ends = np.array([fitting.interval95(*each) for each in zip(best, left, strict=True)])
    return np.where(mask[:, None], ends, np.nan)
