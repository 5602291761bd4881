"""Replay recordings through servo models, fit them, judge them on what they were not fitted on.

The model's motor pulls in proportion to drive and supply, so it does not stall where a real servo
did: at full drive with the shaft at rest. A recording in which that happens misses the model by far
more than the others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.robots import servos
from antennate.robots.servos import MODEL_NUMBERS, STEP
from antennate.studies.trials import OnStep, no_step
from antennate.types import Bools, Floats
from antennate_lab.servo import drive_log, fitting
from antennate_lab.servo.recording import (
    GRAVITY,
    SLOW,
    Recording,
    ServoConfig,
    check_load,
    check_supply,
    check_torque,
    read,
)
from antennate_lab.servo.result import (
    ModelSummary,
    RecordingRow,
    RecordingSummary,
    ServoResult,
)
from dynamixel_bus.model import FULL_DRIVE

_JUDGED = 2
"""The last models of a fit, with both frictions, get intervals; the first of them is shown."""
SHOWN = 10
"""A figure shows every so many times of the replay."""
_FULL = 0.99
"""Share of full drive from which it is full: registers are whole counts."""
_OVER = 0.1
"""Speeds are means over this time [s]: a tick of position is 0.0015 rad."""
_BELOW = 0.9
"""Share of full drive under which a weight is held with drive to spare."""
SEEN = 0.02
"""A recording that stalls for this share of its time with torque, or longer, is named."""


@dataclass(frozen=True)
class ServoOutcome:
    """What the models made of the recordings.

    Attributes:
        data: The same on one grid of times.
        models: Rows of the table, simple ones first; the last is the whole model.
        fitted: Parameters of each from all recordings, shape (M, 6).
        errors: Mean error of each on all [rad], shape (M,).
        held: What was left out in turn.
        held_errors: Error of each on what its fit did not see [rad], shape (M, H).
        interval: Ends of their 95 % intervals, shape (M, 2, 6); NaN where there is none.
        rows: A row for each recording: its error with the last model.
    """

    config: ServoConfig
    recordings: list[Recording]
    data: fitting.Data
    models: list[fitting.Model]
    fitted: Floats
    errors: Floats
    held: list[fitting.Held]
    held_errors: Floats
    interval: Floats
    rows: list[RecordingRow]

    @property
    def shown(self) -> int:
        """Place of the model of a figure: as given, or with the data sheet's line."""
        return len(self.models) - (_JUDGED if self.config.fit else 1)

    @property
    def groups(self) -> int:
        """How many parts are left out in turn for the intervals."""
        return len(fitting.left_out(self.data.parts(), _by_file(self.recordings)))

    def result(self) -> ServoResult:
        """What the run comes to."""
        stretches = "" if _by_file(self.recordings) else "stretches of the "
        return ServoResult(
            servo=self.config.servo,
            fitted=self.config.fit,
            recordings=list(map(_summary, self.recordings, self.rows)),
            interval_over=f"{self.groups} {stretches}recordings",
            models=[self._model(i, model) for i, model in enumerate(self.models)],
        )

    def _model(self, i: int, model: fitting.Model) -> ModelSummary:
        names = [name for name, _ in self.held]
        held = map(_known, np.degrees(self.held_errors[i]).tolist())
        ends = dict(zip(MODEL_NUMBERS, self.interval[i].T, strict=True))
        return ModelSummary(
            **dict(zip(MODEL_NUMBERS, self.fitted[i].tolist(), strict=True)),
            name=model.name,
            free=list(model.free),
            error_deg=_known(float(np.degrees(self.errors[i]))),
            held_out_deg=dict(zip(names, held, strict=True)),
            interval_95={
                name: (float(ends[name][0]), float(ends[name][1]))
                for name in model.free
                if np.isfinite(ends[name]).all()
            },
        )

    def traces(self) -> Floats:
        """Positions that each model gives [rad], shape (T / 10, M, F)."""
        return servos.replay(self.fitted, self.data.course, SHOWN)


def _summary(recording: Recording, row: RecordingRow) -> RecordingSummary:
    """A recording, and its row."""
    return RecordingSummary(
        **vars(row),
        sha256=recording.sha256,
        gain_divisor=recording.divisor(),
        seconds=float(recording.t[-1]),
        samples=len(recording.t),
        torque_share=float(recording.torque.mean()),
        supply_v=_known(float(np.mean(recording.supply))),
    )


def _by_file(recordings: list[Recording]) -> bool:
    """Whether there are enough recordings to leave out whole ones."""
    return len(recordings) >= 5


def run(config: ServoConfig, on_step: OnStep = no_step) -> ServoOutcome:
    """Replay, and fit if asked."""
    if not config.recording:
        raise BadInputError("--recording: expected one file or more, found none")
    recordings = [_read(Path(name), config) for name in config.recording]
    if config.joint is not None and not any(drive_log.is_log(Path(n)) for n in config.recording):
        raise BadInputError("--joint: expected a log among the recordings, found none")
    if config.supply is not None and all(np.isfinite(r.supply).all() for r in recordings):
        raise BadInputError("--supply: expected a recording that tells none, found that all do")
    recordings = [_supplied(recording, config) for recording in recordings]
    data = fitting.data_of(recordings, config.given.voltage, config.inertia)
    parts, loaded = data.parts(), any(r.mass * r.length > 0 for r in recordings)
    rows = fitting.models(config, fitting.measured_divisor(recordings), loaded)
    held = fitting.splits(recordings, parts) if config.fit else []
    seen = [parts, *(parts & ~out for _, out in held)]
    total = len(seen) + bool(held)
    fits: list[Floats] = []
    for done, part in enumerate(seen):
        on_step(done, total)
        divisor = fitting.measured_divisor(
            [recordings[i] for i in np.flatnonzero(part.any(axis=1))]
        )
        fits.append(_fitted(data, [fitting.with_divisor(row, divisor) for row in rows], part))
    interval = np.full((len(rows), 2, len(MODEL_NUMBERS)), np.nan)
    if config.fit:
        on_step(len(seen), total)
        last = slice(-_JUDGED, None)
        interval[last] = _intervals(recordings, data, fits[0][last], rows[last])
        if not loaded and fitting.measured_divisor(recordings) is None:
            # only its ratio to the no-load speed shows
            interval[:, :, MODEL_NUMBERS.index("gain_divisor")] = np.nan
    on_step(total, total)
    judged = [
        fitting.errors(data, fits[i], _same(out, len(rows)))
        for i, (_, out) in enumerate(held, start=1)
    ]
    errors = fitting.errors(data, fits[0], _same(parts, len(rows)))
    held_errors = np.array(judged).reshape(len(held), len(rows)).T
    replayed = servos.replay(fits[0][-1:], data.course, fitting.EVERY)[:, 0]
    return ServoOutcome(
        config,
        recordings,
        data,
        models=rows,
        fitted=fits[0],
        errors=errors,
        held=held,
        held_errors=held_errors,
        interval=interval,
        rows=_recording_rows(recordings, data, replayed),
    )


def _read(path: Path, config: ServoConfig) -> Recording:
    """A recording of either form that can serve."""
    if drive_log.is_log(path):
        recording = drive_log.read(path, config)
    else:
        recording = read(path, config.given, config.mass, config.length)
    weight = recording.mass * GRAVITY * recording.length
    check_load(path, recording.p_gain, weight, config.given)
    check_supply(f"{path}: input_volts", recording.supply, config.given)
    check_torque(path, recording.t, recording.torque)
    return recording


def _supplied(recording: Recording, config: ServoConfig) -> Recording:
    """A recording with the supply that the configuration gives where it tells none."""
    unknown = ~np.isfinite(recording.supply)
    if not unknown.any() or (config.supply is None and not config.fit):
        return recording
    if config.supply is None:
        raise BadInputError(
            f"{recording.name}: a fit needs the supply, as torque and speed follow it: expected it "
            "in the recording or as --supply of `antennate servo`, found neither"
        )
    check_supply("--supply", np.array([config.supply]), config.given)
    return replace(recording, supply=np.where(unknown, config.supply, recording.supply))


def _same(parts: Bools, count: int) -> Floats:
    """Pieces as weights, the same for each of so many fits."""
    return np.repeat(parts[None].astype(float), count, axis=0)


def _fitted(data: fitting.Data, rows: list[fitting.Model], parts: Bools) -> Floats:
    """Parameters of all models from some pieces; those without free ones as they were."""
    start, free = np.array([row.values for row in rows]), np.array([row.mask for row in rows])
    values = start.copy()
    if (open_ := free.any(axis=1)).any():
        weight = _same(parts, int(open_.sum()))
        values[open_] = fitting.fit(data, start[open_], free[open_], weight)
    return values


def _intervals(
    recordings: list[Recording], data: fitting.Data, best: Floats, rows: list[fitting.Model]
) -> Floats:
    """Ends of the 95 % intervals, shape (M, 2, 6); NaN for what is not fitted."""
    weights = fitting.left_out(data.parts(), _by_file(recordings))
    mask = np.array([row.mask for row in rows])
    start = np.repeat(best, len(weights), axis=0)
    free = np.repeat(mask, len(weights), axis=0)
    left = fitting.fit(data, start, free, np.concatenate([weights] * len(rows)))
    pairs = zip(best, left.reshape(len(rows), len(weights), -1), strict=True)
    ends = np.array([fitting.interval95(*pair) for pair in pairs])
    return np.where(mask[:, None], ends, np.nan)


def _recording_rows(
    recordings: list[Recording], data: fitting.Data, positions: Floats
) -> list[RecordingRow]:
    """A row for each recording.

    Args:
        recordings: F recordings.
        data: The same on one grid of times.
        positions: What the model gives at every `EVERY`-th of them [rad], shape (S, F).
    """
    away = np.degrees(abs(positions - data.course.position[:: fitting.EVERY]))
    counts = (data.known & data.course.torque)[:: fitting.EVERY]
    lifted = 0.0  # largest torque of a weight that was held at rest with drive to spare
    for recording in recordings:
        spare = abs(recording.drive) < _BELOW * FULL_DRIVE
        held = recording.torque & spare & _rests(recording)
        lifted = max(lifted, float(abs(_weight(recording))[held].max(initial=0.0)))
    return [
        _row(recording, away[:, i], counts[:, i], lifted, STEP * fitting.EVERY)
        for i, recording in enumerate(recordings)
    ]


def _row(
    recording: Recording, away: Floats, counts: Bools, lifted: float, step: float
) -> RecordingRow:
    """The row of one recording, with errors (S,) [deg] that count at some times, `step` [s]."""
    held = np.searchsorted(recording.t, step * np.arange(len(away)) + STEP / 2, "right") - 1
    full, stalls = _full_drive(recording)[held] & counts, stalled(recording)[held] & counts
    has_drive = bool(np.isfinite(recording.drive).all())
    time = counts.sum()
    weight = abs(_weight(recording))
    return RecordingRow(
        name=recording.name,
        p_gain=recording.p_gain,
        error_deg=_mean(away[counts]),
        error_max_deg=float(away[counts].max()) if time else None,
        full_drive=float(full.sum() / time) if has_drive and time else None,
        stalled=float(stalls.sum() / time) if has_drive and time else None,
        error_stalled_deg=_mean(away[stalls]),
        error_else_deg=_mean(away[counts & ~stalls]),
        supply_stalled_v=_mean(recording.supply[held][stalls]),
        weight_stalled_n_m=_mean(weight[held][stalls]),
        lifted_n_m=lifted,
    )


def _full_drive(recording: Recording) -> Bools:
    """Whether the drive is full, shape (n,); nowhere where it is not known."""
    return recording.torque & (abs(recording.drive) >= _FULL * FULL_DRIVE)


def stalled(recording: Recording) -> Bools:
    """Whether the drive is full and the shaft rests, shape (n,)."""
    return _full_drive(recording) & _rests(recording)


def _rests(recording: Recording) -> Bools:
    """Whether the shaft rests, shape (n,)."""
    t, position = recording.t, recording.position
    before, after = (np.interp(t + way, t, position) for way in (-_OVER / 2, _OVER / 2))
    return abs(after - before) / _OVER < SLOW


def _weight(recording: Recording) -> Floats:
    """Torque of the weight at the shaft [N·m], shape (n,)."""
    return recording.mass * GRAVITY * recording.length * np.sin(recording.position)


def _mean(values: Floats) -> float | None:
    """Mean; None of nothing, and of what is not known."""
    return _known(float(values.mean())) if len(values) else None


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
