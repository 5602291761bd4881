"""What public functions of this package ask of their arguments: each refusal is one line."""

from __future__ import annotations

from typing import Any

import numpy as np

from geometric_locomotion.errors import BadInputError
from geometric_locomotion.types import Floats


def numbers(name: str, value: Any, *last: int | None, above: float = -np.inf) -> Floats:
    """Finite numbers above a bound, whose last axes are so long; None is any length."""
    try:
        array = np.asarray(value)
    except (ValueError, TypeError):  # rows of different lengths
        array = np.array(None)
    own = array.shape[array.ndim - len(last) :] if array.ndim >= len(last) else ()
    fits = len(own) == len(last) and all(n in (None, m) for n, m in zip(last, own, strict=True))
    real = array.dtype.kind in "fiu"
    if not (real and fits and np.isfinite(array).all() and (array > above).all()):
        axes = f" of shape (..., {', '.join('any' if n is None else str(n) for n in last)})"
        bound = f" above {above:g}" if above > -np.inf else ""
        found = f"shape {array.shape}" if real and not fits else " ".join(repr(value).split())[:60]
        wanted = f"finite numbers{bound}{axes if last else ''}"
        raise BadInputError(f"{name}: expected {wanted}, found {found}")
    return array.astype(np.float64, copy=False)


def scalar(name: str, value: Any, above: float = -np.inf) -> float:
    """One finite number above a bound."""
    if np.ndim(value):
        raise BadInputError(f"{name}: expected one number, found shape {np.shape(value)}")
    return float(numbers(name, value, above=above))


def whole(name: str, value: Any, least: int, most: int | None = None) -> int:
    """A whole number from `least` to `most`."""
    fits = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not fits or value < least or (most is not None and value > most):
        bounds = f"from {least}" + ("" if most is None else f" to {most}")
        raise BadInputError(f"{name}: expected a whole number {bounds}, found {value!r:.60}")
    return int(value)


def alike(name: str, *arrays: Floats) -> list[Floats]:
    """Arrays of one shape, made of ones whose axes fit."""
    try:
        return list(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise BadInputError(f"{name}: expected axes that fit, found {shapes}") from None


def called(name: str, function: Any, *given: Floats) -> Any:
    """What a function of the caller's answers."""
    if not callable(function):
        raise BadInputError(f"{name}: expected a function, found {function!r:.60}")
    return function(*given)


def sampled(stroke: Any, t: Floats) -> tuple[Floats, Floats]:
    """Shapes and rates of a stroke at the times (n,), both (n, m)."""
    answer = called("stroke", stroke, t)
    if not isinstance(answer, tuple | list) or len(answer) != 2:
        raise BadInputError(f"stroke: expected shapes and rates, found {answer!r:.60}")
    shape = numbers("shapes of the stroke", answer[0], len(t), None)
    return shape, numbers("rates of the stroke", answer[1], *shape.shape)
