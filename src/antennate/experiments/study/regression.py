"""How a response changes over the range of each parameter, over all points of a random plan."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.jackknife import student95
from antennate.studies.plan import Axes, Point, Range
from antennate.types import Floats

_DRAWS = 1000
"""How often signs are drawn."""
_AT_ONCE = 2_000_000
"""Signs drawn at once, to bound the memory."""
_ROUNDING = 1e-9


def slopes(
    axes: Axes, points: Sequence[Point], targets: Mapping[str, Floats], chance: float
) -> list[dict[str, Any]]:
    """Least squares over all parameters at once: the change of each target over a whole range.

    A choice is compared with the first one of its list. The interval holds also where the spread
    differs from point to point (HC3: MacKinnon and White, Journal of Econometrics 29 (1985) 305).
    `noise` is what the changes of a study stay below, all of them, if nothing has an effect: what
    the fit leaves over is given random signs, and the largest change that it makes is taken each
    time, each over its own standard error (wild bootstrap: Davidson and Flachaire, Journal of
    Econometrics 146 (2008) 162; maximum: Romano and Wolf, Econometrica 73 (2005) 1237). So a strong
    cause hides no weak one. What goes up and down within one range is not seen.

    Args:
        axes: What varies.
        points: Values of what varies.
        targets: A response of each point, by name; NaN where it is missing.
        chance: Share of studies without any effect in which one is found, over all targets.

    Returns:
        An entry for each target and parameter; numbers are None where the points do not tell them.
    """
    columns = dict(_columns(axes, points))
    found: list[dict[str, Any]] = []
    for target, response in targets.items():
        known = np.isfinite(response)
        design = np.column_stack([np.ones(len(points)), *columns.values()])[known]
        fit = _fit(design, response[known], chance / len(targets))
        for number, name in enumerate(columns):
            found.append({"of": target, "parameter": name, **fit[number]})
    return found


def _columns(axes: Axes, points: Sequence[Point]) -> Iterator[tuple[str, Floats]]:
    """Each parameter from 0 to 1 over its range, and each further choice as 0 or 1: (points,)."""
    for name, axis in axes.items():
        values = [point[name] for point in points]
        if isinstance(axis, Range):
            ends = np.array([axis.low, axis.high, *values], float)
            low, high, *spread = np.log(ends) if axis.log else ends
            yield name, (np.array(spread) - low) / (high - low)
            continue
        texts = [_text(value) for value in values]
        for choice in axis[1:]:
            yield f"{name} = {_text(choice)}", np.array([text == _text(choice) for text in texts])


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _fit(design: Floats, response: Floats, chance: float) -> list[dict[str, Any]]:
    """Slope, interval and noise of each column behind the constant one."""
    count, width = design.shape
    unknown = dict.fromkeys(("slope", "slope95", "noise", "above_noise"))
    if count <= width or np.linalg.matrix_rank(design) < width:
        return [unknown] * (width - 1)
    solve: Floats = np.linalg.pinv(design).astype(float)
    found = solve @ response
    leverage = np.einsum("ij,ji->i", design, solve)
    if (leverage > 1.0 - _ROUNDING).any():  # one point alone decides a slope: no spread is known
        return [unknown] * (width - 1)
    errors = (response - design @ found) / (1.0 - leverage)
    error = np.sqrt((solve**2) @ errors**2)
    half = student95(count - width) * error
    noise = _largest(solve[1:], errors, error[1:], chance) * error
    least = np.maximum(noise, np.abs(response).max() * _ROUNDING)
    return [
        {
            "slope": float(slope),
            "slope95": (float(slope - h), float(slope + h)),
            "noise": float(n),
            "above_noise": bool(abs(slope) > at_least),
        }
        for slope, h, n, at_least in zip(found[1:], half[1:], noise[1:], least[1:], strict=True)
    ]


def _largest(solve: Floats, errors: Floats, error: Floats, chance: float) -> float:
    """What the largest slope over its error stays below, errors with random signs; but a share."""
    if not error.any():
        return 0.0
    rng, largest = np.random.default_rng(0), list[float]()
    scale = np.where(error > 0.0, error, np.inf)[:, None]
    block = max(1, min(_DRAWS, _AT_ONCE // len(errors)))
    for first in range(0, _DRAWS, block):
        signs = rng.choice((-1.0, 1.0), (len(errors), min(block, _DRAWS - first)))
        found = np.abs(solve @ (signs * errors[:, None])) / scale
        largest += found.max(axis=0).tolist()
    return float(np.quantile(largest, 1.0 - chance, method="higher"))
