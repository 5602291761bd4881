"""Servo models, and their fits to recordings: many at once.

Each fit minimises a robust error of the positions (soft L1, 3°) by Levenberg-Marquardt, for its own
free parameters and its own weights of the pieces of the recordings. Sizes are searched on a
logarithmic scale, frictions on a linear one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from antennate.jackknife import jackknife95
from antennate.robots.servos import MODEL_NUMBERS, STEP, Course, replay, values_of
from antennate.types import Bools, Floats, Ints
from antennate_lab.servo.recording import GRAVITY, Recording, ServoConfig

EVERY = 5
"""Positions are compared at every so many steps of the model."""
PIECE = 1.0
"""Length of a piece of a recording [s]."""
MOST_STRETCHES = 30
"""Stretches of neighbouring pieces that are left out in turn where recordings are few."""
_ROBUST = 0.05
"""Errors beyond this count in proportion, not by their square [rad]."""
_LOG = np.array([name not in ("friction", "load_friction") for name in MODEL_NUMBERS])
_LOW = np.where(_LOG, np.log([10.0, 0.01, 0.5, 1e-6, 1.0, 1.0]), 0.0)
_HIGH = np.where(_LOG, np.log([3000.0, 20.0, 200.0, 0.2, 1.0, 1.0]), (0, 0, 0, 0, 2.0, 0.95))
_NUDGE = np.where(_LOG, 1e-3, (0, 0, 0, 0, 2e-4, 2e-3))
_ROUNDS = 100
_ENOUGH = 1e-6
"""A fit is done when a round that is hardly damped improves it by less than this share."""
_HARDLY = 0.1
"""A step of less damping is hardly shortened."""
_STUCK = 1e4
"""A fit is done, too, when no shorter step than that of this damping improves it."""
_CHUNK = 24
"""Fits that are simulated together; more would need more memory."""
_SMOOTHING = 0.05
"""Speeds are means over this time [s]."""
_MANUAL = 128.0
"""Divisor of the gain in the block diagram of the manual of X servos."""
_START = {"gain_divisor": 180.0, "armature": 0.001, "friction": 0.01, "load_friction": 0.2}
"""Where fits begin, whatever the parameters say; torque and speed begin at the data sheet's."""
_LINE = ("stall_torque", "no_load_speed")
_FRICTION = ("friction", "load_friction")


@dataclass(frozen=True)
class Data:
    """A course, and which of its times count.

    Attributes:
        course: What servos were told.
        known: Times at which there is a measurement, shape (T, F).
    """

    course: Course
    known: Bools

    @property
    def pieces(self) -> Ints:
        """Number of the piece of each compared time, shape (S,)."""
        count = -(-len(self.known) // EVERY)
        return np.arange(count) // round(PIECE / STEP / EVERY)

    def parts(self) -> Bools:
        """Pieces that hold a measurement, shape (F, K)."""
        piece = self.pieces
        return np.array(
            [self.known[::EVERY][piece == k].any(axis=0) for k in range(piece[-1] + 1)]
        ).T


def data_of(recordings: list[Recording], voltage: float, inertia: float) -> Data:
    """All recordings as one course, each ends in times that do not count.

    Args:
        recordings: F recordings.
        voltage: Nominal voltage of the servo [V]; taken where a supply is not known.
        inertia: Inertia of the loads beside that of their masses [kg·m²].
    """
    longest = max(r.t[-1] for r in recordings)
    grid = np.arange(math.floor(longest / STEP + 1e-9) + 1) * STEP
    indices = [
        np.clip(np.searchsorted(r.t, grid + STEP / 2, "right") - 1, 0, None) for r in recordings
    ]
    pairs = list(zip(recordings, indices, strict=True))
    position = np.array([np.interp(grid, r.t, r.position) for r in recordings]).T
    course = Course(
        goal=np.array([r.goal[i] for r, i in pairs]).T,
        torque=np.array([r.torque[i] for r, i in pairs]).T,
        supply=np.array([np.nan_to_num(r.supply[i] / voltage, nan=1.0) for r, i in pairs]).T,
        position=position,
        speed=_smoothed_speed(position),
        p_gain=np.array([r.p_gain for r in recordings]),
        inertia=np.array([r.mass * r.length**2 + inertia for r in recordings]),
        gravity=np.array([r.mass * GRAVITY * r.length for r in recordings]),
    )
    return Data(course, np.array([r.known[i] & (grid <= r.t[-1]) for r, i in pairs]).T)


def _smoothed_speed(position: Floats) -> Floats:
    """Speeds [rad/s] of positions (T, F), smoothed."""
    width = round(_SMOOTHING / STEP)
    kernel = np.ones(width) / width
    slopes = np.gradient(position, STEP, axis=0)
    return np.array([np.convolve(column, kernel, "same") for column in slopes.T]).T


@dataclass(frozen=True)
class Model:
    """A servo model: where its parameters begin, and which of them are fitted.

    Attributes:
        values: Parameters, shape (6,).
        free: Names of those that are fitted.
    """

    name: str
    values: Floats
    free: tuple[str, ...] = ()

    @property
    def mask(self) -> Bools:
        """Which parameters are fitted, shape (6,)."""
        return np.array([name in self.free for name in MODEL_NUMBERS])


Held = tuple[str, Bools]
"""A part that a fit did not see: what was left out, and its pieces, shape (F, K)."""


def measured_divisor(recordings: list[Recording]) -> float | None:
    """Divisor of the gain as the drive of recordings tells it; None if none does."""
    divisors = [d for recording in recordings if (d := recording.divisor()) is not None]
    return float(np.median(divisors)) if divisors else None


def models(config: ServoConfig, measured: float | None, loaded: bool) -> list[Model]:
    """Models of a table, simple ones first; the last is the whole one.

    Args:
        config: What was asked.
        measured: Divisor of the gain as the recordings tell it; if they do not, it is fitted.
        loaded: Whether a known weight hangs on the servo. Without one only the inertia in
            proportion to the stall torque shows, so that this stays as in the data sheet.
    """
    given = values_of(config.given)
    divisor = config.given.gain_divisor
    if config.fit and measured is not None:
        divisor = measured
    sheet = np.array([divisor, *config.given.datasheet, config.given.armature, 0.0, 0.0])
    manual = np.array([_MANUAL, *sheet[1:]])
    rows = [Model("data sheet, /128", manual)] if abs(divisor / _MANUAL - 1.0) > 0.02 else []
    rows.append(Model(f"data sheet, /{divisor:.0f}", sheet))
    if not config.fit:
        bare = np.array([*given[:4], 0.0, 0.0])
        return [*rows, Model("as given, no friction", bare), Model("as given", given)]
    gain = ("gain_divisor",) if measured is None else ()
    line = (*gain, *(_LINE if loaded else _LINE[1:]), "armature")
    fits = {
        "line fitted": line,
        "+ constant friction": (*line, "friction"),
        "data sheet + friction": (*gain, "armature", *_FRICTION),
        "whole model": (*line, *_FRICTION),
    }
    start = dict(zip(_LINE, config.given.datasheet, strict=True)) | _START
    start |= {} if measured is None else {"gain_divisor": measured}
    rows.append(Model("as given", given))
    for name, free in fits.items():  # friction that is not fitted is none
        values = start | {friction: 0.0 for friction in _FRICTION if friction not in free}
        rows.append(Model(name, np.array([values[parameter] for parameter in MODEL_NUMBERS]), free))
    return rows


def splits(recordings: list[Recording], parts: Bools) -> list[Held]:
    """What to leave out in turn: each gain, else each recording, else each half of the only one.

    Nothing if that lasts no longer than a piece.
    """
    gains = np.array([recording.p_gain for recording in recordings])
    if len(np.unique(gains)) > 1:
        return [(f"gain {gain:g}", parts & (gains == gain)[:, None]) for gain in np.unique(gains)]
    if len(recordings) > 1:
        own = np.eye(len(recordings), dtype=bool)
        return [(r.name, parts & own[i][:, None]) for i, r in enumerate(recordings)]
    if parts.sum() < 2:
        return []
    late = np.arange(parts.shape[1]) >= parts.sum() / 2
    return [("first half", parts & ~late), ("second half", parts & late)]


def with_divisor(model: Model, measured: float | None) -> Model:
    """A model with the divisor that a part of the recordings tells."""
    if not model.free or measured is None:
        return model
    return replace(model, values=np.array([measured, *model.values[1:]]))


def errors(data: Data, values: Floats, parts: Floats) -> Floats:
    """Mean error of position [rad] with torque on, over the recordings, shape (B,).

    Args:
        data: What was recorded.
        values: B models, shape (B, 6).
        parts: Pieces that count, by a number above 0, shape (B, F, K).
    """
    away = abs(replay(values, data.course, EVERY) - data.course.position[::EVERY, None])
    counts = (data.known & data.course.torque)[::EVERY]
    weight = (_spread(data, parts) > 0) & counts[:, None]
    time = weight.sum(axis=0)
    with np.errstate(invalid="ignore"):
        means = np.where(weight, away, 0.0).sum(axis=0) / time
    return np.asarray(np.nanmean(np.where(time > 0, means, np.nan), axis=1))


def fit(data: Data, start: Floats, free: Bools, parts: Floats) -> Floats:
    """Best parameters of B fits, shape (B, 6).

    Args:
        data: What was recorded.
        start: Where each begins; parameters that are not free stay there, shape (B, 6).
        free: Which parameters may change, shape (B, 6).
        parts: Weight of every piece in every fit, shape (B, F, K).
    """
    cuts = range(_CHUNK, len(start), _CHUNK)
    chunks = zip(*(np.split(array, cuts) for array in (start, free, parts)), strict=True)
    return np.concatenate([_fit(data, *chunk) for chunk in chunks])


def _fit(data: Data, start: Floats, free: Bools, parts: Floats) -> Floats:
    weight = _spread(data, parts) * data.known[::EVERY, None]
    x = np.where(_LOG, np.log(np.maximum(start, 1e-9)), start)
    x = np.where(free, np.clip(x, _LOW, _HIGH), x)
    damping = np.full(len(x), 1e-2)
    cost, slope, bend = _normal(data, x, free, weight)
    done = np.zeros(len(x), bool)
    for _ in range(_ROUNDS):
        on = np.flatnonzero(~done)
        if not len(on):
            break
        step = _step(x[on], slope[on], bend[on], damping[on])
        trial = np.where(free[on], np.clip(x[on] - step, _LOW, _HIGH), x[on])
        new_cost, new_slope, new_bend = _normal(data, trial, free[on], weight[:, on])
        better, small = new_cost < cost[on], cost[on] - new_cost < _ENOUGH * cost[on]
        done[on] = np.where(better, small & (damping[on] < _HARDLY), damping[on] > _STUCK)
        ahead = on[better]
        x[ahead], cost[ahead] = trial[better], new_cost[better]
        slope[ahead], bend[ahead] = new_slope[better], new_bend[better]
        damping[on] = np.clip(np.where(better, damping[on] / 5, damping[on] * 5), 1e-6, 1e6)
    # parameters that are not free stay to the last bit
    return np.where(free, _values(x), start)


def _step(x: Floats, slope: Floats, bend: Floats, damping: Floats) -> Floats:
    """How far to go against the slope, shape (B, 6); not through a bound that is reached."""
    stays = ((x <= _LOW) & (slope > 0.0)) | ((x >= _HIGH) & (slope < 0.0))
    moves = ~stays
    slope = np.where(moves, slope, 0.0)
    scale = np.einsum("bii->bi", bend)
    eye = np.eye(len(MODEL_NUMBERS))
    bend = np.where(moves[:, :, None] & moves[:, None], bend, eye * scale[:, None])
    damped = bend + damping[:, None, None] * (eye * scale[:, None])
    return np.asarray(np.linalg.solve(damped, slope[..., None])[..., 0])


def _values(x: Floats) -> Floats:
    """Parameters from where they are searched."""
    return np.where(_LOG, np.exp(np.where(_LOG, x, 0.0)), x)


def _normal(data: Data, x: Floats, free: Bools, weight: Floats) -> tuple[Floats, Floats, Floats]:
    """Cost (B,), its slope (B, 6) and its curvature after Gauss and Newton (B, 6, 6)."""
    size = len(MODEL_NUMBERS)
    tried = x[:, None] + np.vstack([np.zeros(size), np.diag(_NUDGE)])
    values = _values(tried).reshape(-1, size)
    positions = replay(values, data.course, EVERY)
    positions = positions.reshape(len(positions), len(x), size + 1, -1)
    away = positions[:, :, 0] - data.course.position[::EVERY, None]
    root = np.sqrt(1.0 + (away / _ROBUST) ** 2)
    cost = (weight * 2.0 * _ROBUST**2 * (root - 1.0)).sum(axis=(0, 2))
    grown = np.sqrt(weight / root)
    change = (positions[:, :, 1:] - positions[:, :, :1]) / _NUDGE[:, None] * grown[:, :, None]
    change = np.where(free[:, :, None], change, 0.0)
    flat = change.transpose(1, 2, 0, 3).reshape(len(x), size, -1)
    left = (away * grown).transpose(1, 0, 2).reshape(len(x), -1)
    bend = flat @ flat.transpose(0, 2, 1)
    # a parameter that is not free, or changes nothing, stays
    still = np.einsum("bii->bi", bend) <= 0.0
    bend = bend + np.eye(size) * still[:, None]
    return cost, (flat @ left[..., None])[..., 0], bend


def _spread(data: Data, parts: Floats) -> Floats:
    """Weights of pieces (B, F, K) as weights of times, shape (S, B, F)."""
    pieces = np.moveaxis(parts, 2, 0)
    return np.array([pieces[k] for k in data.pieces], np.float64)


def left_out(parts: Bools, by_file: bool) -> Floats:
    """Weights with each group left out in turn, shape (groups, F, K).

    Args:
        parts: Pieces that hold a measurement, shape (F, K).
        by_file: A group is a file, else one of MOST_STRETCHES stretches of neighbouring pieces.
    """
    number = np.repeat(np.arange(len(parts))[:, None], parts.shape[1], axis=1)
    if not by_file:
        order = np.cumsum(parts).reshape(parts.shape) - 1
        number = order * min(MOST_STRETCHES, int(parts.sum())) // max(1, int(parts.sum()))
    groups = np.unique(number[parts])
    return np.array([parts & (number != group) for group in groups], np.float64)


def interval95(best: Floats, left: Floats) -> Floats:
    """Ends of the 95 % interval of each parameter, by jackknife on the scale of the search.

    Args:
        best: Fitted to all, shape (6,).
        left: Fitted without each group, shape (groups, 6).

    Returns:
        Both ends within the bounds of the search, shape (2, 6).
    """
    x = np.where(_LOG, np.log(np.where(_LOG, [best, *left], 1.0)), [best, *left])
    return _values(np.clip(jackknife95(x[0], x[1:]), _LOW, _HIGH))
