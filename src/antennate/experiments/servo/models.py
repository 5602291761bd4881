"""Servo models that are compared, where their fits begin, and what fits leave out in turn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from antennate.experiments.servo.config import ServoConfig
from antennate.experiments.servo.recording import Recording
from antennate.robots.servos import MODEL_NUMBERS, values_of
from antennate.types import Bools, Floats

_MANUAL = 128.0
"""Divisor of the gain in the block diagram of the manual of X servos."""
_START = {"gain_divisor": 180.0, "armature": 0.001, "friction": 0.01, "load_friction": 0.2}
"""Where fits begin, whatever the parameters say; torque and speed begin at the data sheet's."""
_LINE = ("stall_torque", "no_load_speed")
_FRICTION = ("friction", "load_friction")


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
    fits = {
        "line fitted": line,
        "+ constant friction": (*line, "friction"),
        "data sheet + friction": (*gain, "armature", *_FRICTION),
        "whole model": (*line, *_FRICTION),
    }
    begun = [Model(name, _start(config, told, free), free) for name, free in fits.items()]
    return [*rows, Model("as given", given), *begun]


def _start(config: ServoConfig, told: float | None, free: tuple[str, ...]) -> Floats:
    """Where a fit begins, shape (6,); friction that is not fitted is none."""
    sheet = dict(zip(_LINE, config.given.datasheet, strict=True))
    known = {} if told is None else {"gain_divisor": told}
    none = {name: 0.0 for name in _FRICTION if name not in free}
    values = sheet | _START | known | none
    return np.array([values[name] for name in MODEL_NUMBERS])


def splits(recordings: list[Recording], parts: Bools) -> list[Held]:
    """What to leave out in turn: each gain, else each recording, else each half of the only one.

    Nothing if that lasts no longer than a piece.
    """
    gains = np.array([each.p_gain for each in recordings])
    if len(np.unique(gains)) > 1:
        return [(f"gain {gain:g}", parts & (gains == gain)[:, None]) for gain in np.unique(gains)]
    if len(recordings) > 1:
        own = np.eye(len(recordings), dtype=bool)
        return [(each.name, parts & own[i][:, None]) for i, each in enumerate(recordings)]
    if parts.sum() < 2:
        return []
    late = np.arange(parts.shape[1]) >= parts.sum() / 2
    return [("first half", parts & ~late), ("second half", parts & late)]


def with_told(row: Model, told: float | None) -> Model:
    """A model with the divisor that a part of the recordings tells."""
    if not row.free or told is None:
        return row
    return replace(row, values=np.array([told, *row.values[1:]]))
