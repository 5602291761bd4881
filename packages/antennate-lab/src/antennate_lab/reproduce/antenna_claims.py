"""What the paper says of the antenna: springs, bench, and walls of boulders."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from antennate.antenna.springs import distance_decades
from antennate.studies.columns import shown
from antennate_lab.reproduce.verdict import (
    ENOUGH_TO_STAY,
    Bar,
    Finding,
    above,
    agrees,
    all_of,
    claim,
    counted,
    lead,
    share_of,
)

if TYPE_CHECKING:
    from antennate.experiments.antenna.result import AntennaResult
    from antennate.experiments.calibrate.result import CalibrateResult
    from antennate.experiments.force.result import ForceResult
    from antennate.experiments.sweep.result import SweepResult
    from antennate.experiments.touch.result import TouchResult
    from antennate.experiments.wall.experiment import WallResult

_ROUNDING = 0.0005
"""Half of the last digit of the paper's stiffnesses [N·mm/deg]."""
_SLOPE, _SLOPE_NEAR = 18.3, 0.2 * 18.3
_MIDPOINT, _MIDPOINT_NEAR = 0.305, 0.05
"""The paper's sigmoid, and how near to it ours has to be."""
_NEARER = 0.5
"""A ladder follows a taper that is so much nearer to it than equal springs are."""
_FIT, _ALIKE = 0.95, 0.02
"""R² from which one curve serves, and how far those of the speeds may lie apart."""
_LIMIT_DEG = 30.0
"""Deflection of a spring that the paper states [deg]."""
_CHOSEN = "the base angle of 53° was chosen on a map, where profiles differ most"
_WINDOW = (
    "The angle at which the tip meets the spheres decides, and the taper moves that border by two "
    "to three degrees; at the angle that was chosen these are fresh trials."
)
_OTHERS = "an antenna of other springs at the same angle, judged as a claim of its own"


@claim(
    "antenna",
    "N·mm/deg",
    paper="0.274, 0.137, 0.091 N·mm/deg",
    criterion="All three agree within half of the last digit",
    rival="any law with one free number, of which 1 / coils is one",
    best="fitted",
    ceiling="the coil diameter was worked out from this table, for one of several wires",
)
def springs(result: AntennaResult) -> Finding:
    """Springs of 3, 6 and 9 coils have these stiffnesses."""
    springs = result.springs.springs
    ours = [each.stiffness_n_mm_per_deg for each in springs]
    paper = [printed for each in springs if (printed := each.paper_n_mm_per_deg)]
    bars = [
        Bar(f"{whose}, {each.active_coils:g} coils", value)
        for whose, values in (("paper", paper), ("ours", ours))
        for each, value in zip(springs, values, strict=True)
    ]
    return Finding(
        ", ".join(f"{value:.4f}" for value in ours),
        all(abs(a - b) <= _ROUNDING for a, b in zip(ours, paper, strict=True)),
        "The paper names neither wire nor coil. What is left to find is that stiffness goes with "
        "1 / coils.",
        tuple(bars),
    )


@claim(
    "antenna",
    "stiffness of the base over the tip",
    paper="fourth power of a diameter from 1.5 to 0.2 mm",
    criterion="The ladder is at most half as far from the animal's taper as equal springs are "
    "(rms of decades of stiffness)",
    rival="springs that are all equal",
    best="reproduced",
)
def taper(result: AntennaResult) -> Finding:
    """The ladder of springs follows the animal's taper, stiff at the base and soft at the tip."""
    taper = result.taper
    animal, ladder = taper.base_over_tip, taper.ladder.base_over_tip
    course = np.array(taper.stretches)
    ours, equal = taper.ladder.distance_decades, distance_decades(course * 0 + 1, course)
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
def one_curve(result: CalibrateResult) -> Finding:
    """One calibration curve serves pushes at 5, 10 and 15 cm/s."""
    speeds = result.calibration.speeds
    r2 = [speed.r2 for speed in speeds]
    holds = min(r2) >= _FIT and max(r2) - min(r2) < _ALIKE
    return Finding(
        "R² " + ", ".join(f"{value:.3f}" for value in r2),
        holds,
        ""
        if holds
        else "A running mean lags by half of its length, so that the same reading means more bend "
        "the faster the push.",
        tuple(Bar(f"ours, {shown(s.speed_m_s, 'g', 100)} cm/s", s.r2) for s in speeds),
        "" if holds else "Without a mean (`--averaging-time 0`) one curve serves all three.",
    )


@claim(
    "calibrate",
    "error of b",
    paper="sigmoid, no rival named",
    criterion="No rival predicts pushes that were left out better",
    rival="a straight line, and any rising curve (isotonic)",
    best="reproduced",
)
def sigmoid(result: CalibrateResult) -> Finding:
    """The curve is a sigmoid."""
    errors = result.calibration.cross_validated_rmse
    best = min(errors, key=errors.__getitem__)
    serves = ": a sigmoid is one curve that serves, not the one that the readings ask for"
    serves = "" if best == "sigmoid" else serves
    return Finding(
        "error of the level on pushes left out (rms): "
        + ", ".join(f"{name} {value:.3f}" for name, value in errors.items()),
        best == "sigmoid",
        f"Over pushes left out, the best of these curves is {best}{serves}.",
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
def slope(result: CalibrateResult) -> Finding:
    """The sigmoid has this slope and midpoint."""
    curve = result.calibration
    return Finding(
        f"slope {curve.slope:.1f} ({shown(curve.slope_95, '.1f')}), midpoint "
        f"{curve.midpoint:.2f} ({shown(curve.midpoint_95)})"
        + ("; by noise alone, the curve itself misses the readings" if curve.misfit else ""),
        all_of(
            agrees(curve.slope, curve.slope_95, _SLOPE, _SLOPE_NEAR),
            agrees(curve.midpoint, curve.midpoint_95, _MIDPOINT, _MIDPOINT_NEAR),
        ),
        "Slope and midpoint belong to one sensor, one divider and one way to scale the counts, of "
        "which the paper names none.",
        (Bar("paper", _SLOPE), Bar("ours", curve.slope, curve.slope_95)),
    )


@claim(
    "force",
    "R²",
    paper="no number",
    criterion="R² is above 0.9 where the place of contact is known",
    rival="the same without the place",
    ceiling="the place has to be known, which the robot does not feel",
)
def force(result: ForceResult) -> Finding:
    """The curvature of the antenna tells the force of a contact."""
    loads = result.profiles["descending"].statics.frictionless
    known, unknown = loads.known.flex, loads.unknown.flex
    return Finding(
        f"R² {known.r2:.2f} if the place of contact is known, {unknown.r2:.2f} if not",
        above(known.r2_95, 0.9),
        "One flex cannot tell a small force far out from a large one near the base.",
        (
            Bar("place known", known.r2, known.r2_95),
            Bar("place unknown", unknown.r2, unknown.r2_95),
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
def contact(result: TouchResult) -> Finding:
    """A threshold on the bending level tells contact."""
    row = result.profiles["descending"]
    share = row.contact_share or 0.0
    always = 2 * share / (1 + share)
    ends = row.f1_over_always_contact_95
    walls = [wall for wall in result.by_wall if wall.profile == "descending"]
    behind = [wall for wall in walls if not above(wall.f1_over_always_contact_95, 0.0)]
    lost = [f"{wall.wall} ({shown(wall.f1)})" for wall in behind]
    ours = () if row.f1 is None else (Bar("ours", row.f1, row.f1_95),)
    return Finding(
        f"F1 {shown(row.f1)} ({shown(row.f1_95)}); to say always contact {always:.2f}; difference "
        f"{shown(row.f1_over_always_contact, '+.3f')} ({shown(ends, '+.3f')})",
        above(ends, 0.0),
        f"Taken alone, not surely above it at walls {', '.join(lost) or 'none'}. With "
        "a threshold of one half strong contacts are found and grazes are not: "
        f"{shown(row.precision, '.0f', 100)} % of the time that is called contact is contact, "
        f"and {shown(row.recall, '.0f', 100)} % of the time in contact is called so.",
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
def shapes(result: SweepResult) -> Finding:
    """Sweeping beside a wall the antenna points forward, backward, lies straight, or changes."""
    motions = result.shapes["descending"].values()
    shares = {
        name: max(100 * (motion.share[name][0] or 0.0) for motion in motions)
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


@claim(
    "wall",
    "% of trials that jam",
    paper="jams",
    criterion="Over half of the trials jam",
    rival=_OTHERS,
    best="fitted",
    ceiling=_CHOSEN,
)
def stiff_jams(result: WallResult) -> Finding:
    """A stiff antenna jams at a wall of boulders."""
    row = result.profiles["stiff"]
    share, interval = share_of(row, row.jams)
    return Finding(
        counted(row, "jam", row.jams),
        above(interval, 50.0),
        "",
        (Bar("paper", 100.0), Bar("ours", share, interval)),
        _WINDOW,
    )


@claim(
    "wall",
    "% of trials that slip",
    paper="slips",
    criterion="Over half of the trials slip",
    rival=_OTHERS,
    ceiling="we chose the base angle, for another claim",
)
def soft_slips(result: WallResult) -> Finding:
    """A soft antenna slips at a wall of boulders."""
    row = result.profiles["compliant"]
    share, interval = share_of(row, row.slips)
    return Finding(
        f"{counted(row, 'slip', row.slips)}, {counted(row, 'jam', row.jams)}",
        above(interval, 50.0),
        "",
        (Bar("paper", 100.0), Bar("ours", share, interval)),
        _WINDOW
        if share > 50
        else "The soft antenna jams where the stiff one does. Moved, not pushed, a chain of equal "
        "springs takes the same shapes however stiff it is; the flex strip, which adds to five of "
        "the six, makes it a slight taper. To slip it needs weight and a tip that does not lead.",
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
def descending_passes(result: WallResult) -> Finding:
    """An antenna stiff at the base and soft at the tip passes a wall of boulders."""
    row = result.profiles["descending"]
    share, interval = share_of(row)
    return Finding(
        counted(row, "pass"),
        above(interval, 80.0),
        "",
        (Bar("paper", 100.0), Bar("ours", share, interval)),
        _WINDOW,
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
def taper_decides(result: WallResult) -> Finding:
    """It is the descending stiffness that lets it pass."""
    names = ("descending", "matched_uniform", "ascending")
    ours, uniform, ascending = rows = [result.profiles[name] for name in names]
    leads = [lead(result.paired.get(f"descending-{name}")) for name in names[1:]]
    labels = ("descending", "uniform, same tip stiffness", "ascending")
    return Finding(
        f"descending {counted(ours)}, uniform {counted(uniform)}, ascending {counted(ascending)}",
        above((min(low for low, _ in leads), min(high for _, high in leads)), 50.0),
        "Against two controls that the paper lacks.",
        tuple(Bar(label, *share_of(row)) for label, row in zip(labels, rows, strict=True)),
        _WINDOW,
    )


@claim(
    "wall",
    "deg, one spring",
    paper="below 30°",
    criterion=f"No spring of the descending antenna reaches 30° in {ENOUGH_TO_STAY} trials or more",
    rival="the other antennae, which jam",
    ceiling="we chose angle and overlap",
)
def bend(result: WallResult) -> Finding:
    """Springs bend by less than 30° in use."""
    rows = result.profiles
    angles = {n: row.hinge_max_deg for n, row in rows.items() if row.hinge_max_deg is not None}
    ours = angles.get("descending")
    stays = ours is not None and ours < _LIMIT_DEG
    few = ours is None or rows["descending"].trials < ENOUGH_TO_STAY
    return Finding(
        f"largest angle of one spring {shown(ours, '.1f')}° in the antenna that passes, up to "
        f"{shown(max(angles.values(), default=None), '.1f')}° where antennae jam",
        None if ours is None or (stays and few) else stays,
        "The limit is held against the antenna that passes; one that jams is bent further."
        if stays
        else "The springs near the tip are the softest and bend furthest.",
        (Bar("paper", _LIMIT_DEG), *(Bar(f"ours, {n}", angle) for n, angle in angles.items())),
        "" if stays else "Angle, overlap and length are unpublished; ours are assumed.",
    )


ANTENNA = (
    *(springs, taper, one_curve, sigmoid, slope, force, contact, shapes),
    *(stiff_jams, soft_slips, descending_passes, taper_decides, bend),
)
