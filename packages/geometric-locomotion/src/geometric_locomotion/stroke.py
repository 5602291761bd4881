"""Strokes: closed loops of shapes, the path that a body takes by them, and integrals over them.

A stroke is a function of the times (n,) in [0, 1], one period, that returns shapes and rates, both
(n, m), in rad and rad per period. A connection is a function from shapes (..., m) to the matrices
A (..., 3, m) of xi = -A rate. Integrals and paths are over one period.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from geometric_locomotion.arguments import alike, called, numbers, sampled, whole
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.lie import se2_bracket, se2_exp, se2_pose
from geometric_locomotion.types import Floats

Stroke = Callable[[Floats], tuple[Floats, Floats]]
Connection = Callable[[Floats], Floats]
Velocity = Callable[[Floats, Floats], Floats]
"""From shapes and rates (..., m) to body twists (..., 3)."""


@dataclass(frozen=True)
class FourierStroke:
    """Shapes as a Fourier series in time.

    Attributes:
        centre: Mean shape [rad], shape (m,).
        cosine: Coefficients of cos(2 pi k t), k = 1 to K [rad], shape (K, m).
        sine: Coefficients of sin(2 pi k t), k = 1 to K [rad], shape (K, m).
    """

    centre: Floats
    cosine: Floats
    sine: Floats

    def __post_init__(self) -> None:
        for name in ("centre", "cosine", "sine"):
            numbers(name, getattr(self, name))
        shapes = [np.shape(part) for part in (self.cosine, self.sine)]
        if shapes[0] != shapes[1] or shapes[0][1:] != np.shape(self.centre):
            raise BadInputError(
                f"a stroke needs a centre (m,) and coefficients (K, m) twice, found "
                f"{np.shape(self.centre)}, {shapes[0]} and {shapes[1]}"
            )

    def __call__(self, t: Floats) -> tuple[Floats, Floats]:
        """Shapes [rad] and rates [rad per period] at the times (n,), both (n, m)."""
        t = numbers("t", t)
        wave = 2 * np.pi * np.arange(1, len(self.cosine) + 1)
        cosine, sine = np.cos(np.multiply.outer(t, wave)), np.sin(np.multiply.outer(t, wave))
        shape = self.centre + cosine @ self.cosine + sine @ self.sine
        return shape, (cosine * wave) @ self.sine - (sine * wave) @ self.cosine


def ellipse(
    first: Floats | Sequence[float],
    second: Floats | Sequence[float],
    centre: Floats | float = 0.0,
) -> FourierStroke:
    """The stroke centre + first cos(2 pi t) + second sin(2 pi t), vectors (m,) [rad]."""
    cosine, sine = numbers("first", first, None), numbers("second", second, None)
    middle = alike("centre and first", numbers("centre", centre), cosine)[0]
    return FourierStroke(middle, cosine[None], sine[None])


def polygon(corners: Floats) -> Stroke:
    """The stroke along the sides between corners (n, m) [rad], equal time on each side."""
    corners = numbers("corners", corners, None, None)
    whole("number of corners", len(corners), 1)
    sides = np.roll(corners, -1, axis=0) - corners

    def stroke(t: Floats) -> tuple[Floats, Floats]:
        place = np.asarray(t) * len(corners)
        side = np.clip(np.floor(place).astype(int), 0, len(corners) - 1)
        shape = corners[side] + (place - side)[..., None] * sides[side]
        return shape, len(corners) * sides[side]

    return stroke


def path(velocity: Velocity, stroke: Stroke, steps: int = 120) -> Floats:
    """Poses (steps + 1, 3, 3) of the body frame along one stroke, from the identity.

    Fourth-order Magnus steps with two Gauss points each (Iserles et al., Acta Numerica 2000).
    A stroke with corners needs a multiple of their number as steps.
    """
    return se2_pose(*_places(velocity, stroke, steps).T)


def displacement(velocity: Velocity, stroke: Stroke, steps: int = 120) -> Floats:
    """Where one stroke takes the body frame: (x, y, turn), the turn not wrapped; as `path`."""
    return _places(velocity, stroke, steps)[-1]


def _places(velocity: Velocity, stroke: Stroke, steps: int) -> Floats:
    """Values (steps + 1, 3) of x, y and heading along a stroke."""
    offset = np.sqrt(3) / 6 * np.array([-1, 1])
    t = (np.arange(whole("steps", steps, 1))[:, None] + 0.5 + offset) / steps
    twist = called("velocity", velocity, *sampled(stroke, t.reshape(-1)))
    twist = numbers("velocity", twist, 2 * steps, 3).reshape(steps, 2, 3) / steps
    first, second = twist[:, 0], twist[:, 1]
    step = (first + second) / 2 + np.sqrt(3) / 12 * se2_bracket(first, second)
    heading = np.append(0.0, np.cumsum(step[:, 2]))
    local = (se2_pose(0.0, 0.0, heading[:-1]) @ se2_exp(step))[:, :2, 2]
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(local, axis=0)])
    return np.concatenate([place, heading[:, None]], axis=-1)
