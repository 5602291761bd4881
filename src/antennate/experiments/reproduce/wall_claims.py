"""What the paper says of antennae at a wall of boulders."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import (
    Bar,
    Finding,
    above,
    claim,
    counted,
    judged,
    share_of,
)
from antennate.studies.measures import shown

_LIMIT_DEG = 30.0
"""Deflection of a spring that the paper states [deg]."""
_Z95 = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""
_NO_PAIR = {"trials": 0, "only_first": 0, "only_second": 0}
_WINDOW = (
    "The base angle of 53° was chosen on a map: the angle at which the tip meets the spheres "
    "decides, and the taper moves that border by two to three degrees."
)


def _lead(pair: Mapping[str, Any]) -> tuple[float, float]:
    """95 % interval of the difference of two shares on the same trials [points].

    Adjusted Wald: Bonett and Price, Journal of Educational and Behavioral Statistics 37 (2012) 479.
    """
    n = pair["trials"] + 2
    first, second = (pair["only_first"] + 1) / n, (pair["only_second"] + 1) / n
    half = _Z95 * math.sqrt((first + second - (first - second) ** 2) / n)
    return 100 * max(first - second - half, -1.0), 100 * min(first - second + half, 1.0)


@claim(
    "wall",
    "% of trials that jam",
    "jams",
    "Conditional if most trials jam; no more, as we chose the base angle. Undecided if the "
    "95 % interval of the share reaches to both sides of 50 %.",
)
def stiff_jams(result: Mapping[str, Any]) -> Finding:
    """A stiff antenna jams at a wall of boulders."""
    row = result["profiles"]["stiff"]
    share, interval = share_of(row, "jams")
    return Finding(
        counted(row, "jam", "jams"),
        above(interval, 50.0),
        _WINDOW,
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


@claim(
    "wall",
    "% of trials that slip",
    "slips",
    "Conditional if most trials slip; no more, as we chose the base angle. Undecided if the "
    "95 % interval of the share reaches to both sides of 50 %.",
)
def soft_slips(result: Mapping[str, Any]) -> Finding:
    """A soft antenna slips at a wall of boulders."""
    row = result["profiles"]["compliant"]
    share, interval = share_of(row, "slips")
    return Finding(
        f"{counted(row, 'slip', 'slips')}, {counted(row, 'jam', 'jams')}",
        above(interval, 50.0),
        _WINDOW
        if share > 50
        else "The soft antenna jams where the stiff one does. Moved, not pushed, a chain of equal "
        "springs takes the same shapes however stiff it is; the flex strip, which adds to five of "
        "the six, makes it a slight taper. To slip it needs weight and a tip that does not lead.",
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


@claim(
    "wall",
    "% of trials that pass",
    "passes",
    "Conditional if more than 80 % pass; no more, as we chose the base angle. Undecided if the "
    "95 % interval of the share reaches to both sides of 80 %.",
)
def descending_passes(result: Mapping[str, Any]) -> Finding:
    """An antenna stiff at the base and soft at the tip passes a wall of boulders."""
    row = result["profiles"]["descending"]
    share, interval = share_of(row)
    return Finding(
        counted(row, "pass"),
        above(interval, 80.0),
        _WINDOW,
        (Bar("paper", 100.0), Bar("ours", share, interval)),
    )


@claim(
    "wall",
    "% of trials that pass",
    "no controls",
    "Conditional if its share that passes is more than 50 points above that of each control; "
    "no more, as we chose the angle. Undecided if the 95 % interval of the smaller difference, "
    "of trials on the same walls, reaches to both sides of 50 points.",
)
def taper_decides(result: Mapping[str, Any]) -> Finding:
    """It is the descending stiffness that lets it pass."""
    names = ("descending", "matched_uniform", "ascending")
    ours, uniform, ascending = rows = [result["profiles"][name] for name in names]
    leads = [_lead(result["paired"].get(f"descending-{name}", _NO_PAIR)) for name in names[1:]]
    labels = ("descending", "uniform, same tip stiffness", "ascending")
    return Finding(
        f"descending {counted(ours)}, uniform {counted(uniform)}, ascending {counted(ascending)}",
        above((min(low for low, _ in leads), min(high for _, high in leads)), 50.0),
        f"Against two controls that the paper lacks. {_WINDOW}",
        tuple(Bar(label, *share_of(row)) for label, row in zip(labels, rows, strict=True)),
    )


@claim(
    "wall",
    "deg, one spring",
    "below 30°",
    "Conditional if no spring of the antenna that passes, the descending one, reaches 30° in "
    "any trial; no more, as we chose the base angle.",
)
def bend(result: Mapping[str, Any]) -> Finding:
    """Springs bend by less than 30° in use."""
    rows = result["profiles"]
    angles = {
        n: row["hinge_max_deg"] for n, row in rows.items() if row["hinge_max_deg"] is not None
    }
    ours = angles.get("descending")
    stays = ours is not None and ours < _LIMIT_DEG
    return Finding(
        f"largest angle of one spring {shown(ours, '.1f')}° in the antenna that passes, up to "
        f"{shown(max(angles.values(), default=None), '.1f')}° where antennae jam",
        "undecided" if ours is None else judged(False, stays),
        "The limit is held against the antenna that passes; one that jams is bent further."
        if stays
        else "The springs near the tip are the softest and bend furthest. Angle, overlap and "
        "length are unpublished; ours are assumed.",
        (Bar("paper", _LIMIT_DEG), *(Bar(f"ours, {n}", angle) for n, angle in angles.items())),
    )


WALL = (stiff_jams, soft_slips, descending_passes, taper_decides, bend)
