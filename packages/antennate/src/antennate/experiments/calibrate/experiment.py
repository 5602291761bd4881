"""The experiment `calibrate`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from antennate.antenna.curves import Gain
from antennate.antenna.fitting import FEWEST_PUSHES
from antennate.experiments.calibrate import recording
from antennate.experiments.calibrate import run as calibrate
from antennate.experiments.calibrate.next_push import (
    RECORDED,
    Assessment,
    Hysteresis,
    NewPush,
    Relaxation,
)
from antennate.experiments.calibrate.readings import conversion_sentence
from antennate.experiments.calibrate.recording import Handled
from antennate.experiments.calibrate.result import CalibrateResult, Curve, Sigmoid
from antennate.studies.columns import Ends, columns, shown
from antennate.studies.experiment import Experiment, Files
from antennate.studies.tables import Table

_MUCH = 0.1
"""Hysteresis over the span beyond which a poor fit is partly its work."""


def tables(result: CalibrateResult) -> Sequence[Table]:
    """The curve, how it serves each speed, and what is known about the next push."""
    curve = result.calibration
    way = "rise" if curve.polarity > 0 else "fall"
    speeds = {
        "all" if row.speed_m_s is None else f"{100 * row.speed_m_s:g} cm/s": row
        for row in curve.speeds
    }
    over = _no_interval(curve).capitalize() or f"Intervals are over {_pushes(curve)}"
    measures = columns(Curve)
    if curve.kind != "sigmoid":
        measures = [each for each in measures if each not in columns(Sigmoid)]
        ends = zip(curve.knots, curve.knot_levels, strict=True)
        first, *_, last = (f"{level:.2f} at {counts:.0f} counts" for counts, level in ends)
        many = len(curve.knots)
        over = f"Curve: {curve.kind}, straight between {many} knots, from b = {first} to {last}"
        over += f";\n{_missed(curve)}" if curve.misfit else ""
    lines = [
        f"Readings {way} with flex. Readings: {curve.samples}, pushes: {curve.trials}.",
        f"{over}.",
        *(_file(result.recording) if result.recording else ()),
    ]
    if _no_interval(curve):
        curve = replace(curve, slope_95=None, midpoint_95=None)
    return (
        Table.of("Calibration", {curve.sensor_id: curve}, measures, "\n".join(lines)),
        Table.of("The one curve at each speed", speeds),
        _next_push(result),
    )


def _file(handled: Handled) -> list[str]:
    """What was done to the file of a recording, in lines."""
    lines = [*handled.units]
    lines += [conversion_sentence(handled.conversion)] if handled.conversion else []
    lines += [f"{wrap.clock.capitalize()} wrapped in row {wrap.row}." for wrap in handled.wraps]
    if handled.damaged:
        row, why = handled.damages[0]
        lines.append(f"Row {row} is damaged: {why}.")
    if handled.outliers:
        far = handled.outliers[0]
        lines.append(
            f"Row {far.row} is an outlier: {far.counts:.4g} counts where others at its bend are "
            f"{far.usual:.4g}."
        )
    return lines


def _handled(handled: Handled | None) -> str:
    """What was left out of the file of a recording, or mended, as a sentence."""
    if handled is None:
        return ""
    far = len(handled.outliers)
    fate = "kept, as they are many" if handled.outliers_kept else "left out"
    counted = (
        (handled.damaged, f"{handled.damaged} damaged left out"),
        (far, f"{far} outlier{'s' * (far > 1)} {fate}"),
        (len(handled.wraps), "a clock that wraps unwrapped"),
    )
    said = ", ".join(text for number, text in counted if number)
    become = ""
    if handled.conversion:
        become = f" Readings in {handled.conversion.unit} became counts: see the table."
    return (f" Of {handled.rows} rows: {said}." if said else "") + become


def _no_interval(curve: Curve) -> str:
    """Why slope or midpoint has none that says how sure it is, empty if both have.

    Where the curve itself misses the readings, the interval of the file is that of noise alone.
    """
    if curve.trials < FEWEST_PUSHES:
        return f"no interval: {_pushes(curve)}; it takes {FEWEST_PUSHES} or more"
    if curve.misfit:
        return f"no interval: {_missed(curve)}"
    both = curve.slope_95 and curve.midpoint_95
    return "" if both else f"no interval: {_pushes(curve)} all alike"


def _missed(curve: Curve) -> str:
    """By how much the curve misses the readings, in words; empty if by no more than noise."""
    if not curve.misfit:
        return ""
    return f"the curve errs by {curve.misfit:.3f} in b alike in all pushes, which is no noise"


def _pushes(curve: Curve) -> str:
    return "one push" if curve.trials == 1 else f"{curve.trials} pushes"


def _next_push(result: CalibrateResult) -> Table:
    """What a user meets: a push that served no fit."""
    known, notes = result.assessment, list[str]()
    if known.new_push is None:
        notes.append("One push only: nothing is known about the next one; record more pushes.")
    elif known.new_push.error_95 is None:
        notes.append("Two pushes say too little for an interval of the next one; record three.")
    if known.hysteresis is None:
        notes.append("No push was bent and released: nothing is known about hysteresis.")
    notes += [_rival(name, checks) for name, checks in known.rivals.items() if checks]
    head, half = f"{known.pushes} pushes", shown(_at_half(result.calibration), "+.3f")
    rows: list[tuple[str, Sequence[str]]] = [("error of the curve at b = 0.5, 95 %", [half])]
    parts = ((NewPush, known.new_push), (Hysteresis, known.hysteresis))
    for kind, part in (*parts, (Relaxation, known.relaxation)):
        rows.extend(Table.of("", {head: part}, columns(kind)).rows)
    return Table("The next push", [head], rows, "\n".join(notes))


def _at_half(curve: Curve) -> Ends | None:
    """The interval of the error of b where it is 0.5; None if the curve has none."""
    if curve.kind != "sigmoid" or _no_interval(curve) or curve.midpoint_95 is None:
        return None
    rise = curve.slope * curve.polarity / 4
    low, high = sorted(-rise * (end - curve.midpoint) for end in curve.midpoint_95)
    return low, high


def _rival(name: str, checks: Mapping[str, Gain]) -> str:
    """Whether a rival of the sigmoid is better beyond noise, and under which checks."""
    first = checks[RECORDED]
    by = f"{first.mean:+.4f} ({shown(first.interval_95, '+.4f')})"
    lost = [check for check, gain in checks.items() if not gain.wins]
    if RECORDED in lost:
        return f"{name}: not better than the sigmoid beyond noise; gain {by} in b."
    if lost:
        return f"{name}: better here by {by} in b, but not with: {', '.join(lost)}."
    others = ", ".join(check for check in checks if check != RECORDED)
    return (
        f"{name}: better than the sigmoid by {by} in b; also with {others}. "
        f"--curve {name} saves that curve."
    )


def sentence(result: CalibrateResult) -> str:
    """How well one curve serves all pushes."""
    curve, following = result.calibration, result.assessment.new_push
    ahead = "nothing is known about the next push"
    if following:
        ahead = f"in a new push b errs by {shown(following.error_95, '+.2f')} (95 %)"
        if following.error_95 is None:
            ahead = "two pushes say too little about the next one"
    missed = _missed(curve)
    interval = _no_interval(curve) or f"95 % interval {shown(curve.slope_95, '.1f')}"
    of = f", with a slope of {curve.slope:.1f} ({interval})"
    if curve.kind != "sigmoid":
        of = missed and f"; {missed}"
    saturated = f"; {result.plateau.text('the readings')}" if result.plateau else ""
    return (
        f"One {curve.kind}{' curve' * (curve.kind == 'isotonic')} explains R² {curve.r2:.2f} of "
        f"{_pushes(curve)}{of}; {ahead}{saturated}{_poor(result)}.{_handled(result.recording)}"
    )


def _poor(result: CalibrateResult) -> str:
    """What a poor fit comes from, empty if it is good."""
    if not result.poor:
        return ""
    loop, relaxing = result.assessment.hysteresis, _relaxing(result.assessment)
    if loop and result.hysteretic:
        there, back = loop.one_way_r2
        return (
            f"; the rest is hysteresis, {100 * abs(loop.mean):.0f} % of the span: loading "
            f"alone fits with R² {there:.2f}, unloading alone with {back:.2f}, and one curve "
            f"cannot follow both{relaxing}"
        )
    if loop and _beyond_noise(loop.mean_95) and abs(loop.mean) > _MUCH:
        return (
            f"; hysteresis, {100 * abs(loop.mean):.0f} % of the span, is a part of the rest; "
            f"the figure shows what else is: noise, or marks that do not match{relaxing}"
        )
    return (
        "; look at the figure: perhaps marks and readings do not match, or the flex sensor "
        f"slipped; record again before a robot relies on it{relaxing}"
    )


def _relaxing(known: Assessment) -> str:
    """How far readings move while the bend is held, if they do beyond noise."""
    creep = known.relaxation
    if not creep or not _beyond_noise(creep.mean_95):
        return ""
    way = "on" if creep.mean > 0 else "back"
    return (
        f"; it relaxes, too: held for {creep.time:.2g} s its readings move {way} by "
        f"{100 * abs(creep.mean):.0f} % of the span"
    )


def _beyond_noise(ends: Ends | None) -> bool:
    """Whether an interval does not hold 0."""
    return ends is not None and ends[0] * ends[1] > 0


FILES: Files = {
    "calibration.json": lambda outcome: outcome.calibration.to_json(),
    "conditioning.toml": lambda outcome: outcome.conditioning_toml(),
    "recording.csv": lambda outcome: recording.write(outcome.raw),
}


EXPERIMENT = Experiment.of_folder(
    __name__,
    calibrate.CalibrateConfig,
    lambda config, workers, on_step, _: calibrate.run(config, workers, on_step),
    tables,
    sentence,
    result=CalibrateResult,
    files=lambda config: FILES,
    captions={
        "calibrate": "Readings against bends with the fitted curve, what it leaves, loading "
        "against unloading, and rival curves.",
    },
)
