"""What the paper says of antennae at a wall of boulders."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import (
    Bar,
    Claim,
    Finding,
    above,
    counted,
    judged,
    share_of,
)

_LIMIT_DEG = 30.0
"""Deflection of a spring that the paper states [deg]."""
_WINDOW = (
    "The base angle of 53° was chosen on a map: the angle at which the tip meets the spheres "
    "decides, and the taper moves that border by two to three degrees."
)


def _lead(ours: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[float, float]:
    """95 % interval of the difference of two shares [points].

    Newcombe, Statistics in Medicine 17 (1998) 873, method 10.
    """
    (p, (p_low, p_high)), (q, (q_low, q_high)) = share_of(ours), share_of(other)
    return (
        p - q - math.hypot(p - p_low, q_high - q),
        p - q + math.hypot(p_high - p, q - q_low),
    )


def _stiff(result: Mapping[str, Any]) -> Finding:
    row = result["profiles"]["stiff"]
    share, interval = share_of(row, "jams")
    return Finding(
        counted(row, "jam", "jams"),
        above(interval, 50.0),
        _WINDOW,
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


def _soft(result: Mapping[str, Any]) -> Finding:
    row = result["profiles"]["compliant"]
    share, interval = share_of(row, "slips")
    return Finding(
        f"{counted(row, 'slip', 'slips')}, {counted(row, 'jam', 'jams')}",
        above(interval, 50.0),
        _WINDOW
        if share > 50
        else "The soft antenna does not slip: without a second force beside its springs, such as "
        "weight, a soft chain takes the same shapes as a stiff one.",
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


def _descending(result: Mapping[str, Any]) -> Finding:
    row = result["profiles"]["descending"]
    share, interval = share_of(row)
    return Finding(
        counted(row, "pass"),
        above(interval, 80.0),
        _WINDOW,
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


def _taper(result: Mapping[str, Any]) -> Finding:
    ours, *controls = (
        result["profiles"][n] for n in ("descending", "matched_uniform", "ascending")
    )
    share, interval = share_of(ours)
    bars = [Bar("descending", share, interval)]
    leads = [_lead(ours, row) for row in controls]
    for name, row in zip(("uniform, same tip stiffness", "ascending"), controls, strict=True):
        bars.append(Bar(name, *share_of(row)))
    return Finding(
        f"descending {counted(ours)}, uniform {counted(controls[0])}, "
        f"ascending {counted(controls[1])}",
        above((min(low for low, _ in leads), min(high for _, high in leads)), 50.0),
        f"Against two controls that the paper lacks. {_WINDOW}",
        tuple(bars),
    )


def _bend(result: Mapping[str, Any]) -> Finding:
    flex = {name: row["flex_max_deg"] for name, row in result["profiles"].items()}
    fits = flex["descending"] < _LIMIT_DEG
    return Finding(
        f"sum over the sensor {flex['descending']:.0f}° where it passes, up to "
        f"{max(flex.values()):.0f}° where antennae jam",
        judged(False, fits),
        "The limit is held against the antenna that passes; one that jams is bent further.",
        (
            Bar("paper, a spring", _LIMIT_DEG),
            *(Bar(f"ours, {n}, all springs", v) for n, v in flex.items()),
        ),
    )


WALL = (
    Claim(
        "stiff_jams",
        "A stiff antenna jams at a wall of boulders",
        "jams",
        "Conditional if most trials jam; no more, as we chose the base angle. Undecided if the "
        "95 % interval of the share reaches to both sides of 50 %.",
        "wall",
        "% of trials that jam",
        _stiff,
    ),
    Claim(
        "soft_slips",
        "A soft antenna slips at a wall of boulders",
        "slips",
        "Conditional if most trials slip; no more, as we chose the base angle. Undecided if the "
        "95 % interval of the share reaches to both sides of 50 %.",
        "wall",
        "% of trials that slip",
        _soft,
    ),
    Claim(
        "descending_passes",
        "An antenna stiff at the base and soft at the tip passes a wall of boulders",
        "passes",
        "Conditional if more than 80 % pass; no more, as we chose the base angle. Undecided if the "
        "95 % interval of the share reaches to both sides of 80 %.",
        "wall",
        "% of trials that pass",
        _descending,
    ),
    Claim(
        "taper_decides",
        "It is the descending stiffness that lets it pass",
        "no controls",
        "Conditional if its share that passes is more than 50 points above that of each control; "
        "no more, as we chose the angle. Undecided if the 95 % interval of the smaller difference "
        "reaches to both sides of 50 points.",
        "wall",
        "% of trials that pass",
        _taper,
    ),
    Claim(
        "bend",
        "Springs bend by less than 30° in use",
        "below 30°",
        "Conditional if the antenna that passes stays below it, the sum over its springs included.",
        "wall",
        "deg",
        _bend,
    ),
)
