"""What the paper says of the antenna alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from antennate.antenna.springs import distance_decades
from antennate.experiments.reproduce.verdict import Bar, Finding, above, agrees, all_of, claim
from antennate.studies.measures import shown

_ROUNDING = 0.0005
"""Half of the last digit of the paper's stiffnesses [N·mm/deg]."""
_SLOPE, _SLOPE_NEAR = 18.3, 0.2 * 18.3
_MIDPOINT, _MIDPOINT_NEAR = 0.305, 0.05
"""The paper's sigmoid, and how near to it ours has to be."""
_NEARER = 0.5
"""A ladder follows a taper that is so much nearer to it than equal springs are."""
_FIT, _ALIKE = 0.95, 0.02
"""R² from which one curve serves, and how far those of the speeds may lie apart."""


@claim(
    "springs",
    "N·mm/deg",
    paper="0.274, 0.137, 0.091 N·mm/deg",
    criterion="All three agree within half of the last digit",
    rival="any law with one free number, of which 1 / coils is one",
    best="fitted",
    ceiling="the coil diameter was worked out from this table, for one of several wires",
)
def springs(result: Mapping[str, Any]) -> Finding:
    """Springs of 3, 6 and 9 coils have these stiffnesses."""
    springs = result["springs"]
    ours = [row["stiffness_n_mm_per_deg"] for row in springs]
    paper = [row["paper_n_mm_per_deg"] for row in springs]
    bars = [
        Bar(f"{whose}, {row['active_coils']:g} coils", value)
        for whose, values in (("paper", paper), ("ours", ours))
        for row, value in zip(springs, values, strict=True)
    ]
    return Finding(
        ", ".join(f"{value:.4f}" for value in ours),
        all(abs(a - b) <= _ROUNDING for a, b in zip(ours, paper, strict=True)),
        "The paper names neither wire nor coil. What is left to find is that stiffness goes with "
        "1 / coils.",
        tuple(bars),
    )


@claim(
    "taper",
    "stiffness of the base over the tip",
    paper="fourth power of a diameter from 1.5 to 0.2 mm",
    criterion="The ladder is at most half as far from the animal's taper as equal springs are "
    "(rms of decades of stiffness)",
    rival="springs that are all equal",
    best="reproduced",
)
def taper(result: Mapping[str, Any]) -> Finding:
    """The ladder of springs follows the animal's taper, stiff at the base and soft at the tip."""
    animal, ladder = result["base_over_tip"], result["ladder"]["base_over_tip"]
    course = np.array(result["stretches"])
    ours, equal = result["ladder"]["distance_decades"], distance_decades(course * 0 + 1, course)
    return Finding(
        f"animal {animal:.0f} : 1, ladder {ladder:g} : 1; {ours:.2f} decades from the taper, equal "
        f"springs {equal:.2f}",
        ours <= _NEARER * equal,
        "Both fall from base to tip, and that is all: springs of one wire span a factor of ten at "
        "most.",
        (
            Bar("animal, fourth power of diameter", animal),
            Bar("ladder of the robot", ladder),
            Bar("equal springs", 1.0),
        ),
    )


@claim(
    "calibrate",
    "R²",
    paper="one sigmoid for all three",
    criterion=f"R² is at least {_FIT:g} at each speed and differs by less than {_ALIKE:g}, with "
    "readings averaged as the paper's are (a running mean; its length is unpublished, ours is the "
    "controller's default)",
    rival="a sigmoid for each speed, with R² near 1 at each",
    ceiling="length of the mean, sensor and rig are ours",
)
def one_curve(result: Mapping[str, Any]) -> Finding:
    """One calibration curve serves pushes at 5, 10 and 15 cm/s."""
    speeds = result["calibration"]["speeds"]
    r2 = [row["r2"] for row in speeds]
    return Finding(
        "R² " + ", ".join(f"{value:.3f}" for value in r2),
        min(r2) >= _FIT and max(r2) - min(r2) < _ALIKE,
        "A running mean lags by half of its length, so that the same reading means more bend the "
        "faster the push. Without a mean (`--averaging-time 0`) one curve serves all three.",
        tuple(Bar(f"ours, {100 * s['speed_m_s']:g} cm/s", s["r2"]) for s in speeds),
    )


@claim(
    "calibrate",
    "error of b",
    paper="sigmoid, no rival named",
    criterion="No rival predicts pushes that were left out better",
    rival="a straight line, and any rising curve (isotonic)",
    best="reproduced",
)
def sigmoid(result: Mapping[str, Any]) -> Finding:
    """The curve is a sigmoid."""
    errors = result["calibration"]["cross_validated_rmse"]
    best = min(errors, key=errors.__getitem__)
    return Finding(
        "error of the level on pushes left out (rms): "
        + ", ".join(f"{name} {value:.3f}" for name, value in errors.items()),
        best == "sigmoid",
        f"Over pushes left out, the best of these curves is {best}: a sigmoid is one curve that "
        "serves, not the one that the readings ask for.",
        tuple(Bar(name, value) for name, value in errors.items()),
    )


@claim(
    "calibrate",
    "slope",
    paper="18.3, 0.305",
    criterion="The slope is within 20 % and the midpoint within 0.05 of the paper's",
    rival="none: numbers of one sensor",
    ceiling="sensor and divider are ours",
)
def slope(result: Mapping[str, Any]) -> Finding:
    """The sigmoid has this slope and midpoint."""
    found = result["calibration"]
    slope_95, midpoint_95 = (
        ends and tuple(ends) for ends in (found["slope_95"], found["midpoint_95"])
    )
    return Finding(
        f"slope {found['slope']:.1f} ({shown(slope_95, '.1f')}), midpoint "
        f"{found['midpoint']:.2f} ({shown(midpoint_95)})",
        all_of(
            agrees(found["slope"], slope_95, _SLOPE, _SLOPE_NEAR),
            agrees(found["midpoint"], midpoint_95, _MIDPOINT, _MIDPOINT_NEAR),
        ),
        "Slope and midpoint belong to one sensor, one divider and one way to scale the counts, of "
        "which the paper names none.",
        (Bar("paper", _SLOPE), Bar("ours", found["slope"], slope_95)),
    )


@claim(
    "force",
    "R²",
    paper="no number",
    criterion="R² is above 0.9 where the place of contact is known",
    rival="the same without the place",
    ceiling="the place has to be known, which the robot does not feel",
)
def force(result: Mapping[str, Any]) -> Finding:
    """The curvature of the antenna tells the force of a contact."""
    statics = result["profiles"]["descending"]["statics"]["frictionless"]
    known, unknown = statics["known"]["flex"], statics["unknown"]["flex"]
    return Finding(
        f"R² {known['r2']:.2f} if the place of contact is known, {unknown['r2']:.2f} if not",
        above(tuple(known["r2_95"]), 0.9),
        "One flex cannot tell a small force far out from a large one near the base.",
        (
            Bar("place known", known["r2"], tuple(known["r2_95"])),
            Bar("place unknown", unknown["r2"], tuple(unknown["r2_95"])),
        ),
    )


@claim(
    "touch",
    "F1",
    paper="no number",
    criterion="F1 less that of the rival is above 0 beyond its 95 % interval (jackknife, a trial "
    "left out of both at once), over all walls",
    rival="a sensor that always says contact",
    ceiling="the threshold is ours",
)
def contact(result: Mapping[str, Any]) -> Finding:
    """A threshold on the bending level tells contact."""
    found = result["profiles"]["descending"]
    share = found["contact_share"] or 0.0
    always = 2 * share / (1 + share)
    f1, interval = found["f1"], found["f1_95"]
    ends = found["f1_over_always_contact_95"]
    rows = [row for row in result["by_wall"] if row["profile"] == "descending"]
    leads = {row["wall"]: row["f1_over_always_contact_95"] for row in rows}
    lost = [
        f"{row['wall']} ({shown(row['f1'])})" for row in rows if not above(leads[row["wall"]], 0.0)
    ]
    ours = () if f1 is None else (Bar("ours", f1, interval),)
    return Finding(
        f"F1 {shown(f1)} ({shown(interval)}); to say always contact {always:.2f}; difference "
        f"{shown(found['f1_over_always_contact'], '+.3f')} ({shown(ends, '+.3f')})",
        above(ends, 0.0),
        f"Taken alone, not surely above it at walls {', '.join(lost) or 'none'}. With "
        "a threshold of one half strong contacts are found and grazes are not: "
        f"{shown(found['precision'], '.0f', 100)} % of the time that is called contact is contact, "
        f"and {shown(found['recall'], '.0f', 100)} % of the time in contact is called so.",
        (Bar("always contact", always), *ours),
    )


@claim(
    "sweep",
    "% of time",
    paper="all four are seen",
    criterion="Each shape is seen; the grid of walls is no sample, so there is no interval",
    rival="none: any antenna that bends shows some",
    ceiling="limits and grid are ours",
)
def shapes(result: Mapping[str, Any]) -> Finding:
    """Sweeping beside a wall the antenna points forward, backward, lies straight, or changes."""
    motions = result["shapes"]["descending"].values()
    shares = {
        name: max(100 * (kind["share"][name][0] or 0.0) for kind in motions)
        for name in ("forward", "backward", "straight", "transition")
    }
    return Finding(
        ", ".join(f"{name} {share:.1f} %" for name, share in shares.items()),
        min(shares.values()) > 0,
        "With limits of straight and of bent that are ours. Shares of time beside a wall, a mean "
        "over a grid of walls and sweeps that we chose, the larger of those with the base fixed "
        "and moving, so they do not add up to 100 %.",
        tuple(Bar(name, share) for name, share in shares.items()),
    )


ANTENNA = (springs, taper, one_curve, sigmoid, slope, force, contact, shapes)
