"""What the paper says of the antenna alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.experiments.reproduce.verdict import Bar, Finding, Verdict, agrees, claim, judged
from antennate.studies.measures import shown

_ROUNDING = 0.0005
"""Half of the last digit of the paper's stiffnesses [N·mm/deg]."""
_SLOPE, _SLOPE_NEAR = 18.3, 0.2 * 18.3
_MIDPOINT, _MIDPOINT_NEAR = 0.305, 0.05
"""The paper's sigmoid, and how near to it ours has to be."""


@claim(
    "springs",
    "N·mm/deg",
    "0.274, 0.137, 0.091 N·mm/deg",
    "Conditional if all three agree within half of the last digit; no more, as we chose wire "
    "and coil.",
)
def springs(result: Mapping[str, Any]) -> Finding:
    """Springs of 3, 6 and 9 coils have these stiffnesses."""
    springs = result["springs"]
    ours = [row["stiffness_n_mm_per_deg"] for row in springs]
    paper = [row["paper_n_mm_per_deg"] for row in springs]
    close = all(abs(a - b) <= _ROUNDING for a, b in zip(ours, paper, strict=True))
    bars = [
        Bar(f"{whose}, {row['active_coils']:g} coils", value)
        for whose, values in (("paper", paper), ("ours", ours))
        for row, value in zip(springs, values, strict=True)
    ]
    return Finding(
        ", ".join(f"{value:.4f}" for value in ours),
        judged(False, close),
        "With a coil diameter that we worked out from the table, for one of several wires, as the "
        "paper names none. What is left to find is that stiffness goes with 1 / coils.",
        tuple(bars),
    )


@claim(
    "taper",
    "stiffness of the base over the tip",
    "fourth power of a diameter from 1.5 to 0.2 mm",
    "Conditional if the ladder falls; reproduced if it spans what the animal spans.",
)
def taper(result: Mapping[str, Any]) -> Finding:
    """The ladder of springs follows the animal's taper, stiff at the base and soft at the tip."""
    animal, ladder = result["base_over_tip"], result["ladder"]["base_over_tip"]
    return Finding(
        f"animal {animal:.0f} : 1, ladder {ladder:g} : 1",
        judged(ladder >= animal, ladder > 1),
        "In direction alone: both fall from base to tip, but springs of one wire span a factor of "
        "ten at most.",
        (Bar("animal, fourth power of diameter", animal), Bar("ladder of the robot", ladder)),
    )


@claim(
    "calibrate",
    "R²",
    "one sigmoid for all three",
    "Conditional if R² is at least 0.95 at each speed and differs by less than 0.02; no more, "
    "as we chose to fit without a mean over readings.",
)
def one_curve(result: Mapping[str, Any]) -> Finding:
    """One calibration curve serves pushes at 5, 10 and 15 cm/s."""
    speeds = result["calibration"]["speeds"]
    r2 = [row["r2"] for row in speeds]
    return Finding(
        "R² " + ", ".join(f"{value:.3f}" for value in r2),
        judged(False, min(r2) >= 0.95 and max(r2) - min(r2) < 0.02),
        "Without a mean over readings before the fit, which the paper leaves open: a mean over "
        "0.1 s spoils the fit at the highest speed.",
        tuple(Bar(f"ours, {100 * s['speed_m_s']:g} cm/s", s["r2"]) for s in speeds),
    )


@claim(
    "calibrate",
    "error of b",
    "sigmoid, no rival named",
    "Reproduced if no rival predicts pushes that were left out better.",
)
def sigmoid(result: Mapping[str, Any]) -> Finding:
    """The curve is a sigmoid."""
    errors = result["calibration"]["cross_validated_rmse"]
    best = min(errors, key=errors.__getitem__)
    return Finding(
        "error of the level on pushes left out (rms): "
        + ", ".join(f"{name} {value:.3f}" for name, value in errors.items()),
        judged(best == "sigmoid"),
        f"Over pushes left out, the best of these curves is {best}: a sigmoid is one curve that "
        "serves, not the one that the readings ask for.",
        tuple(Bar(name, value) for name, value in errors.items()),
    )


@claim(
    "calibrate",
    "slope",
    "18.3, 0.305",
    "Conditional if our slope is within 20 % and our midpoint within 0.05 of the paper's; no "
    "more, as we chose sensor and divider. Undecided if an interval is wider than that to "
    "both sides and reaches it.",
)
def slope(result: Mapping[str, Any]) -> Finding:
    """The sigmoid has this slope and midpoint."""
    found = result["calibration"]
    slope_95, midpoint_95 = (
        ends and tuple(ends) for ends in (found["slope_95"], found["midpoint_95"])
    )
    both: set[Verdict] = {
        agrees(found["slope"], slope_95, _SLOPE, _SLOPE_NEAR),
        agrees(found["midpoint"], midpoint_95, _MIDPOINT, _MIDPOINT_NEAR),
    }
    worst: tuple[Verdict, ...] = ("not_reproduced", "undecided", "conditional")
    return Finding(
        f"slope {found['slope']:.1f} ({shown(slope_95, '.1f')}), midpoint "
        f"{found['midpoint']:.2f} ({shown(midpoint_95)})",
        next(verdict for verdict in worst if verdict in both),
        "Slope and midpoint belong to one sensor, one divider and one way to scale the counts, of "
        "which the paper names none.",
        (Bar("paper", _SLOPE), Bar("ours", found["slope"], slope_95)),
    )


@claim(
    "force",
    "R²",
    "no number",
    "Reproduced if R² is above 0.9 wherever it is, conditional where the place is known.",
)
def force(result: Mapping[str, Any]) -> Finding:
    """The curvature of the antenna tells the force of a contact."""
    statics = result["profiles"]["descending"]["statics"]["frictionless"]
    known, unknown = statics["known"]["flex"], statics["unknown"]["flex"]
    return Finding(
        f"R² {known['r2']:.2f} if the place of contact is known, {unknown['r2']:.2f} if not",
        judged(min(known["r2"], unknown["r2"]) > 0.9, known["r2"] > 0.9),
        "Only if the place of the contact is known: one flex cannot tell a small force far out "
        "from a large one near the base.",
        (
            Bar("place known", known["r2"], tuple(known["r2_95"])),
            Bar("place unknown", unknown["r2"], tuple(unknown["r2_95"])),
        ),
    )


@claim(
    "touch",
    "F1",
    "no number",
    "Conditional if F1 is surely above that of a sensor which always says contact; no more, as "
    "the threshold is ours. Undecided if F1 has no interval, as with one trial.",
)
def contact(result: Mapping[str, Any]) -> Finding:
    """A threshold on the bending level tells contact."""
    found = result["profiles"]["descending"]
    share = found["contact_share"] or 0.0
    always = 2 * share / (1 + share)
    f1, interval = found["f1"], found["f1_95"]
    ours = () if f1 is None else (Bar("ours", f1, interval),)
    return Finding(
        f"F1 {shown(f1)} ({shown(interval)}); to say always contact {always:.2f}",
        "undecided" if interval is None else judged(False, interval[0] > always),
        "With a threshold of one half strong contacts are found and grazes are not: "
        f"{shown(found['precision'], '.0f', 100)} % of the time that is called contact is contact, "
        f"and {shown(found['recall'], '.0f', 100)} % of the time in contact is called so.",
        (Bar("always contact", always), *ours),
    )


@claim(
    "sweep",
    "% of time",
    "all four are seen",
    "Conditional if each shape is seen; no more, as the limits and the grid are ours. Never "
    "undecided: the grid is no sample, so an interval over its cells would say nothing of "
    "chance.",
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
        judged(False, min(shares.values()) > 0),
        "With limits of straight and of bent that are ours. Shares of time beside a wall, a mean "
        "over a grid of walls and sweeps that we chose, the larger of those with the base fixed "
        "and moving, so they do not add up to 100 %.",
        tuple(Bar(name, share) for name, share in shares.items()),
    )


ANTENNA = (springs, taper, one_curve, sigmoid, slope, force, contact, shapes)
