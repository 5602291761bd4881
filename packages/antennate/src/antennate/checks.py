"""What public functions ask of their arguments: each refusal is one line, with expected and found.

Functions that are called at every tick do not ask.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from antennate.errors import BadInputError, ConfigError
from antennate.messages import shown
from antennate.types import Floats, Ints

T = TypeVar("T")


def real(
    name: str,
    value: Any,
    unit: str = "",
    above: float = -math.inf,
    error: type[BadInputError] = ConfigError,
) -> float:
    """A finite number.

    Args:
        name: The argument.
        value: What was given.
        unit: Its unit, empty if it has none.
        above: What it has to exceed.
        error: What is raised.
    """
    try:
        number = (
            float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
        )
    except OverflowError:  # a whole number of hundreds of digits
        number = math.inf
    if not (math.isfinite(number) and number > above):
        bound = f" above {above:g}" if math.isfinite(above) else ""
        raise _refusal(name, f"a finite number{bound}{_in(unit)}", value, error)
    return number


def whole(name: str, value: Any, least: int = 0, most: int | None = None) -> int:
    """A whole number from `least` to `most`."""
    number = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if number is None or number < least or (most is not None and number > most):
        bounds = f"of at least {least}" if most is None else f"of {least} to {most}"
        raise _refusal(name, f"a whole number {bounds}", value)
    return number


def array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...],
    unit: str = "",
    finite: bool = True,
    error: type[BadInputError] = ConfigError,
) -> Floats:
    """An array of numbers.

    Args:
        name: The argument.
        value: What was given: an array, a list or a tuple.
        shape: Its shape; text stands for any length. Empty for any shape.
        unit: Its unit, empty if it has none.
        finite: Whether NaN and infinities are refused.
        error: What is raised.
    """
    wanted = f"{'finite ' if finite else ''}numbers{_in(unit)}"
    if len(shape) == 1 and isinstance(shape[0], int):
        wanted = f"{shape[0]} {wanted}"
    elif shape:
        wanted += f" of shape ({', '.join(map(str, shape))}{',' * (len(shape) == 1)})"
    parts = value if isinstance(value, list | tuple) else (value,)
    if any(isinstance(part, np.ma.MaskedArray) for part in parts):
        raise error(f"{name}: expected {wanted}, found a masked array; leave masked values out")
    try:
        numbers = np.asarray(value)
    except (ValueError, TypeError):  # rows of different lengths
        raise _refusal(name, wanted, value, error) from None
    if numbers.dtype.kind not in "fiu":
        raise _refusal(name, wanted, value, error)
    same = len(numbers.shape) == len(shape) and all(
        isinstance(want, str) or length == want
        for length, want in zip(numbers.shape, shape, strict=True)
    )
    if shape and not same:
        raise error(f"{name}: expected {wanted}, found shape {numbers.shape}")
    if finite and not np.isfinite(numbers).all():
        bad = numbers[~np.isfinite(numbers)]
        raise error(f"{name}: expected {wanted}, found {len(bad)} that are not, such as {bad[0]}")
    return numbers.astype(np.float64, copy=False)


def whole_array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...],
    error: type[BadInputError] = ConfigError,
) -> Ints:
    """An array of whole numbers that have room in 64 bits, checked as `array` does."""
    numbers = array(name, value, shape, error=error)
    odd = (numbers != np.rint(numbers)) | (numbers < -(2.0**63)) | (numbers >= 2.0**63)
    if odd.any():
        raise error(f"{name}: expected whole numbers, found {numbers[odd][0]:g}")
    return numbers.astype(np.int64)


def path(name: str, value: Any) -> Path:
    """The path of a file or a folder."""
    try:
        place = Path(value)
    except TypeError:
        raise _refusal(name, "a path", value) from None
    if value == "" or "\0" in str(place):
        raise _refusal(name, "a path", value)
    return place


def text(name: str, value: Any) -> str:
    """Text of one printable character or more."""
    if not (isinstance(value, str) and value and value.isprintable()):
        raise _refusal(name, "text of printable characters", value)
    return value


def instance(name: str, value: Any, kind: type[T]) -> T:
    """An object of a class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise _refusal(name, f"{article} {kind.__name__}", value)
    return value


def mapping(name: str, value: Any) -> Mapping[Any, Any]:
    """A dictionary or the like."""
    if not isinstance(value, Mapping):
        raise _refusal(name, "a dictionary", value)
    return value


def function(name: str, value: Any) -> None:
    """Check that something can be called."""
    if not callable(value):
        raise _refusal(name, "a function", value)


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _refusal(
    name: str, wanted: str, value: Any, error: type[BadInputError] = ConfigError
) -> BadInputError:
    return error(f"{name}: expected {wanted}, found {shown(value)}")
