"""What the paper says of antennae at a wall of boulders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import (
    ENOUGH_TO_STAY,
    Bar,
    Finding,
    above,
    claim,
    counted,
    lead,
    share_of,
)
from antennate.studies.measures import shown

_LIMIT_DEG = 30.0
"""Deflection of a spring that the paper states [deg]."""
_NO_PAIR = {"trials": 0, "only_first": 0, "only_second": 0}
_CHOSEN = "the base angle of 53° was chosen on a map, where profiles differ most"
_WINDOW = (
    "The angle at which the tip meets the spheres decides, and the taper moves that border by two "
    "to three degrees; at the angle that was chosen these are fresh trials."
)
_OTHERS = "an antenna of other springs at the same angle, judged as a claim of its own"


@claim(
    "wall",
    "% of trials that jam",
    paper="jams",
    criterion="Over half of the trials jam",
    rival=_OTHERS,
    best="fitted",
    ceiling=_CHOSEN,
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
    paper="slips",
    criterion="Over half of the trials slip",
    rival=_OTHERS,
    ceiling="we chose the base angle, for another claim",
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
    paper="passes",
    criterion="Over 80 % of the trials pass",
    rival=_OTHERS,
    best="fitted",
    ceiling=_CHOSEN,
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
    paper="no controls",
    criterion="On the same walls its share that passes is over 50 points above that of each rival",
    rival="uniform springs with the same tip, and the ladder turned round",
    best="fitted",
    ceiling=_CHOSEN,
)
def taper_decides(result: Mapping[str, Any]) -> Finding:
    """It is the descending stiffness that lets it pass."""
    names = ("descending", "matched_uniform", "ascending")
    ours, uniform, ascending = rows = [result["profiles"][name] for name in names]
    leads = [lead(result["paired"].get(f"descending-{name}", _NO_PAIR)) for name in names[1:]]
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
    paper="below 30°",
    criterion=f"No spring of the descending antenna reaches 30° in {ENOUGH_TO_STAY} trials or more",
    rival="the other antennae, which jam",
    ceiling="we chose angle and overlap",
)
def bend(result: Mapping[str, Any]) -> Finding:
    """Springs bend by less than 30° in use."""
    rows = result["profiles"]
    angles = {
        n: row["hinge_max_deg"] for n, row in rows.items() if row["hinge_max_deg"] is not None
    }
    ours = angles.get("descending")
    stays = ours is not None and ours < _LIMIT_DEG
    few = ours is None or rows["descending"]["trials"] < ENOUGH_TO_STAY
    return Finding(
        f"largest angle of one spring {shown(ours, '.1f')}° in the antenna that passes, up to "
        f"{shown(max(angles.values(), default=None), '.1f')}° where antennae jam",
        None if ours is None or (stays and few) else stays,
        "The limit is held against the antenna that passes; one that jams is bent further."
        if stays
        else "The springs near the tip are the softest and bend furthest. Angle, overlap and "
        "length are unpublished; ours are assumed.",
        (Bar("paper", _LIMIT_DEG), *(Bar(f"ours, {n}", angle) for n, angle in angles.items())),
    )


WALL = (stiff_jams, soft_slips, descending_passes, taper_decides, bend)
