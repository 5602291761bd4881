"""The experiment `calibrate`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna.calibration import Calibration
from antennate.antenna.curves import Plateau, Samples
from antennate.antenna.fitting import FEWEST_PUSHES
from antennate.antenna.next_push import RECORDED, Pushes, branches
from antennate.experiments.calibrate import recording
from antennate.experiments.calibrate import run as calibrate
from antennate.experiments.calibrate.readings import conversion_sentence
from antennate.experiments.calibrate.run import CalibrateOutcome
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_95 = "  95 %"
_MUCH = 0.1
"""Hysteresis over the span beyond which a poor fit is partly its work."""
SIGMOID = (
    Measure("slope", "slope", form=".3f"),
    Measure("slope_95", _95, form=".3f"),
    Measure("midpoint", "midpoint", form=".4f"),
    Measure("midpoint_95", _95, form=".4f"),
)
CURVE = (
    Measure("polarity", "polarity", form="+d"),
    Measure("counts_low", "reading at x = 0", "counts", form=".0f"),
    Measure("counts_high", "reading at x = 1", "counts", form=".0f"),
    Measure("threshold", "theta"),
    Measure("r2", "R²", form=".3f"),
    Measure("rmse", "RMSE of b", form=".4f"),
    Measure("misfit", "  alike in all pushes", form=".4f"),
    Measure("noise_counts", "noise", "counts", form=".1f"),
    Measure("valid_counts", "valid for", "counts", form=".0f"),
    Measure("valid_bend", "valid for levels"),
)
SPEED = (
    Measure("samples", "readings", form="d"),
    Measure("r2", "R²", form=".3f"),
    Measure("rmse", "RMSE of b", form=".4f"),
)
NEXT = (
    Measure("curve_95", "error of the curve at b = 0.5, 95 %", form="+.3f"),
    Measure("new_push.error_95", "error of b in a new push, 95 %", form="+.3f"),
    Measure("new_push.rmse", "RMSE of b, pushes left out", form=".4f"),
    Measure("new_push.worst_rmse", "  of the worst", form=".4f"),
    Measure("hysteresis.mean", "hysteresis, mean gap", "% of the span", form="+.1f", scale=100.0),
    Measure("hysteresis.mean_95", _95, form="+.1f", scale=100.0),
    Measure("hysteresis.largest", "  largest gap", "% of the span", form="+.1f", scale=100.0),
    Measure("hysteresis.at_bend", "  at a bend of"),
    Measure("hysteresis.level", "  largest gap in b", form="+.3f"),
    Measure("relaxation.mean", "relaxation in a hold", "% of the span", form="+.1f", scale=100.0),
    Measure("relaxation.mean_95", _95, form="+.1f", scale=100.0),
    Measure("relaxation.time", "  length of a hold", "s", form=".2g"),
)
_BINS = 12


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The curve, how it serves each speed, and what is known about the next push."""
    curve = result["calibration"]
    way = "rise" if curve["polarity"] > 0 else "fall"
    speeds = {
        "all" if row["speed_m_s"] is None else f"{100 * row['speed_m_s']:g} cm/s": row
        for row in curve["speeds"]
    }
    over = _no_interval(curve).capitalize() or f"Intervals are over {_pushes(curve)}"
    if (kind := curve.get("kind", "sigmoid")) != "sigmoid":
        ends = zip(curve["knots"], curve["knot_levels"], strict=True)
        first, *_, last = (f"{level:.2f} at {counts:.0f} counts" for counts, level in ends)
        many = len(curve["knots"])
        over = f"Curve: {kind}, straight between {many} knots, from b = {first} to {last}"
        over += f";\n{_missed(curve)}" if curve["misfit"] else ""
    withheld = {"slope_95": None, "midpoint_95": None} if _no_interval(curve) else {}
    return (
        Table.of(
            "Calibration",
            {curve["sensor_id"]: {**curve, **withheld}},
            (*(SIGMOID if kind == "sigmoid" else ()), *CURVE),
            f"Readings {way} with flex. Readings: {curve['samples']}, pushes: {curve['trials']}.\n"
            f"{over}.\n{_file(result)}".rstrip(),
        ),
        Table.of("The one curve at each speed", speeds, SPEED),
        _next_push(result),
    )


def _file(result: Mapping[str, Any]) -> str:
    """What was done to the file of a recording, in lines."""
    handled = result.get("recording")
    if not handled:
        return ""
    lines = [*handled.get("units", ())]  # results of older versions have none
    lines += [conversion_sentence(handled["conversion"])] if handled["conversion"] else []
    lines += [f"{w['clock'].capitalize()} wrapped in row {w['row']}." for w in handled["wraps"]]
    if handled["damaged"]:
        row, why = handled["damages"][0]
        lines.append(f"Row {row} is damaged: {why}.")
    if handled["outliers"]:
        far = handled["outliers"][0]
        lines.append(
            f"Row {far['row']} is an outlier: {far['counts']:.4g} counts where others at its bend "
            f"are {far['usual']:.4g}."
        )
    return "\n".join(lines)


def _handled(result: Mapping[str, Any]) -> str:
    """What was left out of the file of a recording, or mended, as a sentence."""
    handled = result.get("recording")
    if not handled:
        return ""
    rows, far = handled["rows"], len(handled["outliers"])
    fate = "kept, as they are many" if handled["outliers_kept"] else "left out"
    counted = (
        (handled["damaged"], f"{handled['damaged']} damaged left out"),
        (far, f"{far} outlier{'s' * (far > 1)} {fate}"),
        (len(handled["wraps"]), "a clock that wraps unwrapped"),
    )
    said = ", ".join(text for number, text in counted if number)
    unit = handled["conversion"]["unit"] if handled["conversion"] else ""
    become = f" Readings in {unit} became counts: see the table." if unit else ""
    return (f" Of {rows} rows: {said}." if said else "") + become


def _no_interval(curve: Mapping[str, Any]) -> str:
    """Why slope or midpoint has none that says how sure it is, empty if both have.

    Where the curve itself misses the readings, the interval of the file is that of noise alone.
    """
    if curve["trials"] < FEWEST_PUSHES:
        return f"no interval: {_pushes(curve)}; it takes {FEWEST_PUSHES} or more"
    if curve.get("misfit"):
        return f"no interval: {_missed(curve)}"
    both = curve["slope_95"] and curve["midpoint_95"]
    return "" if both else f"no interval: {_pushes(curve)} all alike"


def _missed(curve: Mapping[str, Any]) -> str:
    """By how much the curve misses the readings, in words; empty if by no more than noise."""
    if not curve.get("misfit"):  # results of older versions have none
        return ""
    return f"the curve errs by {curve['misfit']:.3f} in b alike in all pushes, which is no noise"


def _pushes(curve: Mapping[str, Any]) -> str:
    return "one push" if curve["trials"] == 1 else f"{curve['trials']} pushes"


def _next_push(result: Mapping[str, Any]) -> Table:
    """What a user meets: a push that served no fit."""
    curve, known = result["calibration"], result["assessment"]
    ends = None
    if curve.get("kind", "sigmoid") == "sigmoid" and not _no_interval(curve):
        ends = sorted(
            -curve["slope"] * curve["polarity"] * (end - curve["midpoint"]) / 4
            for end in curve["midpoint_95"]
        )
    notes = []
    if known["new_push"] is None:
        notes.append("One push only: nothing is known about the next one; record more pushes.")
    elif known["new_push"]["error_95"] is None:
        notes.append("Two pushes say too little for an interval of the next one; record three.")
    if known["hysteresis"] is None:
        notes.append("No push was bent and released: nothing is known about hysteresis.")
    notes += [_rival(name, checks) for name, checks in known["rivals"].items() if checks]
    columns = {f"{known['pushes']} pushes": {**known, "curve_95": ends}}
    return Table.of("The next push", columns, NEXT, "\n".join(notes))


def _rival(name: str, checks: Mapping[str, Any]) -> str:
    """Whether a rival of the sigmoid is better beyond noise, and under which checks."""
    first = checks[RECORDED]
    by = f"{first['mean']:+.4f} ({shown(first['interval_95'], '+.4f')})"
    lost = [check for check, gain in checks.items() if gain["interval_95"][0] <= 0]
    if RECORDED in lost:
        return f"{name}: not better than the sigmoid beyond noise; gain {by} in b."
    if lost:
        return f"{name}: better here by {by} in b, but not with: {', '.join(lost)}."
    others = ", ".join(check for check in checks if check != RECORDED)
    return (
        f"{name}: better than the sigmoid by {by} in b; also with {others}. "
        f"--curve {name} saves that curve."
    )


def sentence(result: Mapping[str, Any]) -> str:
    """How well one curve serves all pushes."""
    curve = result["calibration"]
    following = result["assessment"]["new_push"]
    ahead = "nothing is known about the next push"
    if following:
        errors = Measure("error_95", form="+.2f").cell(following)
        ahead = f"in a new push b errs by {errors} (95 %)"
        if following["error_95"] is None:
            ahead = "two pushes say too little about the next one"
    kind, missed = curve.get("kind", "sigmoid"), _missed(curve)
    interval = _no_interval(curve) or f"95 % interval {shown(curve['slope_95'], '.1f')}"
    of = f", with a slope of {curve['slope']:.1f} ({interval})"
    if kind != "sigmoid":
        of = missed and f"; {missed}"
    plateau = result.get("plateau")
    saturated = f"; {Plateau(**plateau).text('the readings')}" if plateau else ""
    return (
        f"One {kind}{' curve' * (kind == 'isotonic')} explains R² {curve['r2']:.2f} of "
        f"{_pushes(curve)}{of}; {ahead}{saturated}{_poor(result)}.{_handled(result)}"
    )


def _poor(result: Mapping[str, Any]) -> str:
    """What a poor fit comes from, empty if it is good."""
    if not result["poor"]:
        return ""
    known = result["assessment"]
    loop = known["hysteresis"]
    if result.get("hysteretic"):
        there, back = loop["one_way_r2"]
        return (
            f"; the rest is hysteresis, {100 * abs(loop['mean']):.0f} % of the span: loading "
            f"alone fits with R² {there:.2f}, unloading alone with {back:.2f}, and one curve "
            f"cannot follow both{_relaxing(known)}"
        )
    ends = loop and loop["mean_95"]
    if ends and ends[0] * ends[1] > 0 and abs(loop["mean"]) > _MUCH:
        return (
            f"; hysteresis, {100 * abs(loop['mean']):.0f} % of the span, is a part of the rest; "
            f"the figure shows what else is: noise, or marks that do not match{_relaxing(known)}"
        )
    return (
        "; look at the figure: perhaps marks and readings do not match, or the flex sensor "
        f"slipped; record again before a robot relies on it{_relaxing(known)}"
    )


def _relaxing(known: Mapping[str, Any]) -> str:
    """How far readings move while the bend is held, if they do beyond noise."""
    creep = known.get("relaxation")
    if not creep or not creep["mean_95"] or creep["mean_95"][0] * creep["mean_95"][1] <= 0:
        return ""
    way = "on" if creep["mean"] > 0 else "back"
    return (
        f"; it relaxes, too: held for {creep['time']:.2g} s its readings move {way} by "
        f"{100 * abs(creep['mean']):.0f} % of the span"
    )


def _files(outcome: CalibrateOutcome) -> Mapping[str, str]:
    return {
        "calibration.json": outcome.calibration.to_json(),
        "conditioning.toml": outcome.conditioning_toml(),
        "recording.csv": recording.write(outcome.raw),
    }


@style.styled
def figures(outcome: CalibrateOutcome) -> dict[str, Figure]:
    """Readings against bends with the curve, residuals, both directions, and rival curves."""
    result, samples = outcome.result(), outcome.recording.samples
    known = result["assessment"]
    drawn = [part for part in ("hysteresis", "rivals") if known[part] and any(known[part].values())]
    heights = (5.2, 2.6 * len(drawn))[: 1 + bool(drawn)]
    figure = style.canvas(style.WIDTH, sum(heights))
    upper, *lower = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    above, below = upper.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _draw_speeds(above, below, samples, outcome.levels())
    _draw_curve(above, outcome.calibration)
    if known["new_push"] is not None and known["new_push"]["error_95"] is not None:
        ends = known["new_push"]["error_95"]
        below.axhspan(*ends, color=style.FAINT, alpha=0.6, linewidth=0, zorder=0)
        below.set_title("grey: 95 % of the readings of a new push")
    below.axhline(0, color=style.MUTED, linewidth=0.8)
    below.set(xlabel="reading [counts]", ylabel="level − bend")
    if drawn:
        panels = lower[0].subplots(len(drawn), 1, squeeze=False)[:, 0]
        for panel, part in zip(panels, drawn, strict=True):
            if part == "hysteresis":
                _draw_loop(panel, known[part], samples)
            else:
                _draw_rivals(panel, known)
    return {"calibrate": figure}


def _draw_speeds(above: Axes, below: Axes, s: Samples, level: Floats) -> None:
    keys = np.where(np.isnan(s.speed), -1.0, s.speed)
    known = np.unique(keys).tolist()
    for key, colour in zip(known, style.series(len(known)), strict=True):
        rows = keys == key
        name = "all" if key < 0 else f"{100 * key:g} cm/s"
        label = f"{name}, {rows.sum()} readings"
        _draw_bins(above, s.counts[rows], s.level[rows], colour, label)
        _draw_bins(below, s.counts[rows], (level - s.level)[rows], colour, "")


def _draw_curve(panel: Axes, curve: Calibration) -> None:
    axis = np.linspace(*curve.valid_counts, 300)
    label = f"one {curve.kind}, R² {curve.r2:.3f}"
    panel.plot(axis, curve.level(axis), color=style.INK, label=label, zorder=3)
    panel.set_ylabel("bend, 0 straight, 1 full")
    panel.set_title(
        f"{curve.sensor_id}: {curve.trials} pushes;\nmean ± standard deviation of each bin"
    )
    panel.legend(fontsize=8)


def _draw_loop(panel: Axes, loop: Mapping[str, Any], samples: Samples) -> None:
    bend, *ways = branches(samples, Pushes.of(samples))
    for name, counts, colour in zip(("loading", "unloading"), ways, style.series(2), strict=True):
        known = np.isfinite(counts).any(axis=0)
        panel.plot(bend[known], np.nanmean(counts[:, known], axis=0), color=colour, label=name)
    panel.axvline(loop["at_bend"], color=style.MUTED, linewidth=0.8)
    panel.set(xlabel="bend", ylabel="mean reading [counts]")
    panel.set_title(
        f"Hysteresis: mean {100 * abs(loop['mean']):.1f} %,\nlargest "
        f"{100 * abs(loop['largest']):.1f} % of the span"
    )
    panel.legend()


def _draw_rivals(panel: Axes, known: Mapping[str, Any]) -> None:
    rivals = known["rivals"]
    checks = list(next(iter(rivals.values())))
    for i, (name, colour) in enumerate(zip(rivals, style.series(len(rivals)), strict=True)):
        rows = [rivals[name][check] for check in checks]
        middle = np.array([row["mean"] for row in rows])
        ends = np.array([row["interval_95"] for row in rows]).T
        panel.errorbar(
            middle,
            -np.arange(len(checks)) - 0.2 * i,
            xerr=abs(ends - middle),
            color=colour,
            label=name,
            marker="o",
            markersize=4,
            linestyle="",
            capsize=2.5,
        )
    panel.axvline(0, color=style.MUTED, linewidth=0.8)
    panel.set_yticks(-np.arange(len(checks)) - 0.1, checks)
    panel.set_xlabel("gain: error of the sigmoid minus the rival's")
    named = " and ".join(known["named"]) or "none"
    panel.set_title(f"Beats the sigmoid under every check:\n{named}")
    panel.set_ylim(-len(checks) + 0.4, 0.4)
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.35), ncols=2)


def _draw_bins(panel: Axes, x: Floats, y: Floats, colour: str, label: str) -> None:
    edges = np.linspace(x.min(), x.max(), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    bins = [b for b in range(_BINS) if (place == b).sum() >= 2]
    panel.errorbar(
        [float(x[place == b].mean()) for b in bins],
        [float(y[place == b].mean()) for b in bins],
        [float(y[place == b].std()) for b in bins],
        color=colour,
        marker="o",
        markersize=4,
        linewidth=0.0,
        elinewidth=1.2,
        capsize=2,
        label=label,
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    calibrate.CalibrateConfig,
    lambda config, workers, on_step, _: calibrate.run(config, workers, on_step),
    tables,
    sentence,
    films=calibrate.films,
    files=_files,
    parts="pushes",
    figures=figures,
    captions={
        "calibrate": "Readings against bends with the fitted curve, what it leaves, loading "
        "against unloading, and rival curves.",
    },
    explained="docs/results.md",
)
