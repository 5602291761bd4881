"""Constraint curvature of a local connection, and integrals of it over a stroke.

The displacement by a small loop is the integral of -DA over its area, where DA = dA - [A, A]: the
exterior derivative says that going and coming back differ, the local Lie bracket that motions do
not commute. Over larger loops the integral is the first order of the displacement's logarithm; how
good it is depends on the body frame (Hatton and Choset, IEEE T-RO 2011; EPJ ST 2015).
"""

from __future__ import annotations

import numpy as np

from geometric_locomotion.arguments import called, numbers, sampled, whole
from geometric_locomotion.lie import se2_bracket
from geometric_locomotion.stroke import Connection, Stroke
from geometric_locomotion.types import Floats

_STEP = 2e-3
"""Step [rad] of the differences; their error falls with its fourth power."""


def gradient(function: Connection, shape: Floats) -> Floats:
    """Derivatives (..., m) of a function's values (...) by the shape, last axis; central.

    The shape is (..., m), the function's value any array with the shape's leading axes.
    """
    shape = numbers("shape", shape, None)
    steps = _STEP * np.eye(shape.shape[-1])
    weights = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}
    columns = [
        sum(
            weight / _STEP * called("function", function, shape + at * step)
            for at, weight in weights.items()
        )
        for step in steps
    ]
    return np.stack(columns, axis=-1)


def exterior_derivative(connection: Connection, shape: Floats) -> Floats:
    """The 2-form dA (..., 3, m, m): dA_jk = d_j A_k - d_k A_j, per rad squared."""
    slope = gradient(connection, shape)
    return np.swapaxes(slope, -1, -2) - slope


def curvature(connection: Connection, shape: Floats) -> Floats:
    """The constraint curvature DA (..., 3, m, m) = dA - [A_j, A_k], per rad squared.

    A small loop from shape j towards shape k with the area a moves the body by -DA_jk a.
    """
    columns = np.swapaxes(called("connection", connection, numbers("shape", shape, None)), -1, -2)
    bracket = se2_bracket(columns[..., :, None, :], columns[..., None, :, :])
    return exterior_derivative(connection, shape) - np.moveaxis(bracket, -1, -3)


def velocity_integral(connection: Connection, stroke: Stroke, steps: int = 200) -> Floats:
    """Body velocity integral (3,) of a stroke: its twist summed as if motions commuted."""
    shape, rate = sampled(stroke, (np.arange(whole("steps", steps, 1)) + 0.5) / steps)
    return -(called("connection", connection, shape) @ rate[..., None])[..., 0].mean(axis=0)


def corrected_integral(connection: Connection, stroke: Stroke, steps: int = 200) -> Floats:
    """Corrected body velocity integral (3,): that of -DA over the cone from the mean shape.

    It is the plain integral and, over the cone, the local Lie bracket, with Gauss points along
    each ray. `exp` of it estimates the displacement.
    """
    shape, rate = sampled(stroke, (np.arange(whole("steps", steps, 1)) + 0.5) / steps)
    ray = shape - shape.mean(axis=0)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    along, weights = (nodes + 1) / 2, weights / 2
    shapes = shape.mean(axis=0) + along[:, None, None] * ray
    columns = called("connection", connection, shapes)
    outward, around = columns @ ray[..., None], columns @ rate[..., None]
    bracket = se2_bracket(outward[..., 0], around[..., 0])
    inside = ((weights * along)[:, None, None] * bracket).sum(axis=0).mean(axis=0)
    return velocity_integral(connection, stroke, steps) + inside
