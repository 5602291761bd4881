"""`antennate calibrate`: one curve from readings to bend, from a recording or the simulated rig."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Keep, Step, Study
from antennate.cli.tables import Cell, number, show, span
from antennate.experiments.calibrate import recording
from antennate.experiments.calibrate import run as calibrate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Calibrate an antenna from a CSV recording whose columns and units you declare, or from a simulated
rig that pushes one at several speeds. Fits one sigmoid, compares it with a line and an isotonic
curve, and refuses data that cannot be calibrated. `calibration.json` in the run directory is the
file to keep; `conditioning.toml` holds the same curve for `antennate tunnel --config`."""


def show_result(result: Mapping[str, Any]) -> None:
    """Print the curve, its rivals and how it serves each speed."""
    found = result["calibration"]
    way = "rise" if found["polarity"] > 0 else "fall"
    show(
        "Calibration",
        {found["sensor_id"]: found},
        _CURVE_ROWS,
        f"Readings {way} with bending. Readings: {found['samples']}, pushes: {found['trials']}; "
        "intervals are bootstrapped\nover whole pushes.\n",
    )
    speeds = {
        "all" if row["speed_m_s"] is None else f"{100 * row['speed_m_s']:g} cm/s": row
        for row in found["speeds"]
    }
    show("The one curve at each speed", speeds, _SPEED_ROWS, _verdict(found, result["poor"]))


def _verdict(found: Mapping[str, Any], poor: bool) -> str:
    errors = found["cross_validated_rmse"]
    said = ", ".join(f"{model} {errors[model]:.4f}" for model in ("sigmoid", "line", "isotonic"))
    better = " and ".join(found["better_than_sigmoid"])
    word = (
        f"The data prefer: {better}."
        if better
        else "None is better than the sigmoid by more than a standard error."
    )
    warning = (
        f"\nR² is only {found['r2']:.2f}: look at the figure; perhaps marks and readings do not\n"
        "match, or the film slipped. Record again before a robot relies on it.\n"
        if poor
        else ""
    )
    return f"Cross-validated error of b: {said}.\n{word}\n{warning}"


_CURVE_ROWS: list[tuple[str, Cell]] = [
    ("slope", lambda row: number(row["slope"], ".3f")),
    ("  95 %", lambda row: span(row["slope_95"], ".3f")),
    ("midpoint", lambda row: number(row["midpoint"], ".4f")),
    ("  95 %", lambda row: span(row["midpoint_95"], ".4f")),
    ("polarity", lambda row: f"{row['polarity']:+d}"),
    ("0 and 1 at [counts]", lambda row: f"{row['counts_low']:.0f}, {row['counts_high']:.0f}"),
    ("theta", lambda row: number(row["threshold"], ".2f")),
    ("R²", lambda row: number(row["r2"], ".3f")),
    ("RMSE of b", lambda row: number(row["rmse"], ".4f")),
    ("valid for [counts]", lambda row: span(row["valid_counts"], ".0f")),
    ("valid for bends", lambda row: span(row["valid_bend"], ".2f")),
]

_SPEED_ROWS: list[tuple[str, Cell]] = [
    ("readings", lambda row: str(row["samples"])),
    ("R²", lambda row: number(row["r2"], ".3f")),
    ("RMSE of b", lambda row: number(row["rmse"], ".4f")),
]


def _run(
    config: calibrate.CalibrateConfig, workers: int, on_step: Step, on_row: Keep
) -> calibrate.CalibrateOutcome:
    return calibrate.run(config, workers, on_step)


def _files(outcome: calibrate.CalibrateOutcome) -> Mapping[str, str]:
    return {
        "calibration.json": outcome.calibration.to_json(),
        "conditioning.toml": outcome.conditioning_toml(),
        "recording.csv": recording.write(outcome.raw),
    }


def _draw(outcome: calibrate.CalibrateOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.calibrate.figure import calibrate as draw

    s = outcome.recording.samples
    level = calibrate.levels(outcome)
    return {"calibrate": draw(outcome.result(), s.counts, s.bend, s.speed, level)}


STUDY = Study(
    name="calibrate",
    description=DESCRIPTION,
    model=calibrate.CalibrateConfig,
    run=_run,
    result=calibrate.CalibrateOutcome.result,
    show=show_result,
    draw=_draw,
    files=_files,
    parts="pushes",
)
command = STUDY.command
