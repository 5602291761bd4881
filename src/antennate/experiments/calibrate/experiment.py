"""The experiment `calibrate`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.calibrate import recording
from antennate.experiments.calibrate import run as calibrate
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table

_95 = "  95 %"
CURVE = (
    Measure("slope", "slope", form=".3f"),
    Measure("slope_95", _95, form=".3f"),
    Measure("midpoint", "midpoint", form=".4f"),
    Measure("midpoint_95", _95, form=".4f"),
    Measure("polarity", "polarity", form="+d"),
    Measure("counts_low", "0 at", "counts", form=".0f"),
    Measure("counts_high", "1 at", "counts", form=".0f"),
    Measure("threshold", "theta"),
    Measure("r2", "R²", form=".3f"),
    Measure("rmse", "RMSE of b", form=".4f"),
    Measure("valid_counts", "valid for", "counts", form=".0f"),
    Measure("valid_bend", "valid for levels"),
)
SPEED = (
    Measure("samples", "readings", form="d"),
    Measure("r2", "R²", form=".3f"),
    Measure("rmse", "RMSE of b", form=".4f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The curve, its rivals and how it serves each speed."""
    found = result["calibration"]
    way = "rise" if found["polarity"] > 0 else "fall"
    speeds = {
        "all" if row["speed_m_s"] is None else f"{100 * row['speed_m_s']:g} cm/s": row
        for row in found["speeds"]
    }
    return (
        Table.of(
            "Calibration",
            {found["sensor_id"]: found},
            CURVE,
            f"Readings {way} with flex. Readings: {found['samples']}, pushes: {found['trials']}; "
            "intervals are bootstrapped\nover whole pushes.",
        ),
        Table.of("The one curve at each speed", speeds, SPEED, _rivals(found)),
    )


def _rivals(found: Mapping[str, Any]) -> str:
    errors = found["cross_validated_rmse"]
    listed = ", ".join(f"{model} {errors[model]:.4f}" for model in ("sigmoid", "line", "isotonic"))
    better = " and ".join(found["better_than_sigmoid"])
    word = (
        f"The data prefer: {better}."
        if better
        else "None is better than the sigmoid by more than a standard error."
    )
    return f"Cross-validated error of b: {listed}.\n{word}"


def sentence(result: Mapping[str, Any]) -> str:
    """How well one curve serves all pushes."""
    found = result["calibration"]
    slope = Measure("slope_95", form=".1f").cell(found)
    warning = (
        "; look at the figure: perhaps marks and readings do not match, or the flex sensor "
        "slipped; record again before a robot relies on it"
        if result["poor"]
        else ""
    )
    return (
        f"One sigmoid explains R² {found['r2']:.2f} of {found['trials']} pushes, with a slope of "
        f"{found['slope']:.1f} (95 % interval {slope}){warning}."
    )


def _files(outcome: calibrate.CalibrateOutcome) -> Mapping[str, str]:
    return {
        "calibration.json": outcome.calibration.to_json(),
        "conditioning.toml": outcome.conditioning_toml(),
        "recording.csv": recording.write(outcome.raw),
    }


EXPERIMENT = Experiment.of_folder(
    __name__,
    calibrate.CalibrateConfig,
    lambda config, workers, on_step, _: calibrate.run(config, workers, on_step),
    tables,
    sentence,
    files=_files,
    parts="pushes",
)
