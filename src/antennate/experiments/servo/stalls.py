"""The error of each recording, and the time in which a real servo stands still at full drive.

The model's motor pulls in proportion to drive and supply, so it does not stall where a real servo
did. A recording in which that happens misses the model by far more than the others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.dxl.model import FULL_DRIVE
from antennate.experiments.servo.checks import GRAVITY
from antennate.experiments.servo.fitting import EVERY, Data
from antennate.experiments.servo.recording import Recording
from antennate.robots.servos import STEP
from antennate.types import Bools, Floats

_FULL = 0.99
"""Share of full drive from which it is full: registers are whole counts."""
_SLOW = 0.05
"""A slower shaft rests [rad/s]."""
_OVER = 0.1
"""Speeds are means over this time [s]: a tick of position is 0.0015 rad."""
_BELOW = 0.9
"""Share of full drive under which a weight is held with drive to spare."""
SEEN = 0.02
"""A recording that stalls for this share of its time with torque, or longer, is named."""


@dataclass(frozen=True, slots=True)
class RecordingRow:
    """One recording, a row of trials.csv.

    Attributes:
        name: Name of the recording.
        p_gain: Gain of the position loop.
        error_deg: Mean error of position of the last model while torque is on [deg].
        error_max_deg: The largest.
        full_drive: Share of that time at full drive; NaN where the recording tells no drive.
        stalled: Share of that time at full drive in which the shaft rests, likewise.
        error_stalled_deg: Mean error while it stalls [deg], NaN if it never does.
        error_else_deg: Mean error in the rest of the time [deg].
        supply_stalled_v: Mean supply while it stalls [V].
        weight_stalled_n_m: Mean torque of the weight while it stalls [N·m].
        lifted_n_m: Largest torque of the weight [N·m] that the servo held at rest with drive to
            spare, in any recording.
    """

    name: str
    p_gain: float
    error_deg: float
    error_max_deg: float
    full_drive: float
    stalled: float
    error_stalled_deg: float
    error_else_deg: float
    supply_stalled_v: float
    weight_stalled_n_m: float
    lifted_n_m: float


def rows(recordings: list[Recording], data: Data, positions: Floats) -> list[RecordingRow]:
    """A row for each recording.

    Args:
        recordings: F recordings.
        data: The same on one grid of times.
        positions: What the model gives at every `EVERY`-th of them [rad], shape (S, F).
    """
    away = np.degrees(abs(positions - data.course.position[::EVERY]))
    counts = (data.known & data.course.torque)[::EVERY]
    lifted = max(map(_lifted, recordings))
    return [
        _row(each, away[:, i], counts[:, i], lifted, STEP * EVERY)
        for i, each in enumerate(recordings)
    ]


def _row(
    recording: Recording, away: Floats, counts: Bools, lifted: float, step: float
) -> RecordingRow:
    """The row of one recording, with errors (S,) [deg] that count at some times, `step` [s]."""
    held = np.searchsorted(recording.t, step * np.arange(len(away)) + STEP / 2, "right") - 1
    full, stalls = full_drive(recording)[held] & counts, stalled(recording)[held] & counts
    has_drive = bool(np.isfinite(recording.drive).all())
    time = counts.sum()
    weight = abs(_weight(recording))
    return RecordingRow(
        name=recording.name,
        p_gain=recording.p_gain,
        error_deg=_mean(away[counts]),
        error_max_deg=float(away[counts].max()) if time else math.nan,
        full_drive=float(full.sum() / time) if has_drive and time else math.nan,
        stalled=float(stalls.sum() / time) if has_drive and time else math.nan,
        error_stalled_deg=_mean(away[stalls]),
        error_else_deg=_mean(away[counts & ~stalls]),
        supply_stalled_v=_mean(recording.supply[held][stalls]),
        weight_stalled_n_m=_mean(weight[held][stalls]),
        lifted_n_m=lifted,
    )


def full_drive(recording: Recording) -> Bools:
    """Whether the drive is full, shape (n,); nowhere where it is not known."""
    return recording.torque & (abs(recording.drive) >= _FULL * FULL_DRIVE)


def stalled(recording: Recording) -> Bools:
    """Whether the drive is full and the shaft rests, shape (n,)."""
    return full_drive(recording) & _rests(recording)


def _rests(recording: Recording) -> Bools:
    """Whether the shaft rests, shape (n,)."""
    t, position = recording.t, recording.position
    before, after = (np.interp(t + way, t, position) for way in (-_OVER / 2, _OVER / 2))
    return abs(after - before) / _OVER < _SLOW


def _weight(recording: Recording) -> Floats:
    """Torque of the weight at the shaft [N·m], shape (n,)."""
    return recording.mass * GRAVITY * recording.length * np.sin(recording.position)


def _lifted(recording: Recording) -> float:
    """Largest torque of the weight that is held at rest with drive to spare [N·m]."""
    spare = recording.torque & (abs(recording.drive) < _BELOW * FULL_DRIVE) & _rests(recording)
    return float(abs(_weight(recording))[spare].max(initial=0.0))


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else math.nan
