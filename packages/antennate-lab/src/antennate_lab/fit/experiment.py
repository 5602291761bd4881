"""The experiment `fit`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from antennate.messages import typed
from antennate.studies.columns import Column, column_of, columns
from antennate.studies.experiment import Experiment
from antennate.studies.tables import Table
from antennate_lab.fit import robot_file, servo_recordings
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.result import FitResult, ParameterRow, StepRow
from antennate_lab.fit.run import FitOutcome, run
from antennate_lab.fit.servo_recordings import ServoFit

_STEP_COLUMNS = ("error_before_deg", "error_deg", "lag_ms", "lag_after_ms", "turn_deg")
ROBOT = "robot.toml"
"""File of the fitted robot in the folder of a run."""


def tables(result: FitResult) -> Sequence[Table]:
    """What was found, what was not, and how well steps are predicted that the fit did not see."""
    measures = [each for each in columns(ParameterRow) if each.name != "by"]
    told = [row for row in result.parameters if row.told]
    rows = [(_named(row), [each.cell(row) for each in measures]) for row in told]
    found = Table("What the logs tell", [each.title for each in measures], rows, _note(result))
    return found, _untold(result), _steps(result)


def _named(row: ParameterRow) -> str:
    return row.name if row.unit == "1" else f"{row.name} [{row.unit}]"


def _note(result: FitResult) -> str:
    pairs = [f"{p.one} and {p.other} ({p.correlation:+.2f})" for p in result.correlations[:3]]
    return f"Errors that go together most: {'; '.join(pairs)}." if pairs else ""


def _untold(result: FitResult) -> Table:
    """Numbers that stay as they were, and what to record."""
    rows = [(_named(row), [row.record]) for row in result.parameters if not row.told]
    note = "They stay as the robot's file has them." if rows else ""
    return Table("What the logs do not tell", ["to record"], rows or [("nothing", [""])], note)


def _steps(result: FitResult) -> Table:
    """Steps that the fit did not see; all of them where it saw all."""
    held = [step for step in result.steps if not step.fitted] or result.steps
    names = (*_STEP_COLUMNS, "turn_after_deg", "speed_mm", "speed_before_mm", "speed_after_mm")
    held_by = [name for name in names if any(getattr(step, name) is not None for step in held)]
    shown: list[Column] = [column_of(StepRow, name) for name in held_by]
    rows = [(f"{step.log} {step.step}", [each.cell(step) for each in shown]) for step in held]
    seen = "" if held is not result.steps else ", which the fit has seen"
    return Table(f"Steps as predicted{seen}", [each.title for each in shown], rows)


def sentence(result: FitResult) -> str:
    """How many numbers are told, how well unseen steps are predicted, and what is wrong."""
    told = sum(row.told for row in result.parameters)
    held = [step for step in result.steps if not step.fitted] or result.steps
    before, after = (
        float(np.mean([getattr(step, name) for step in held]))
        for name in ("error_before_deg", "error_deg")
    )
    unseen = "that the fit did not see " if not held[0].fitted else ""
    wrong = "".join(f" Beware: {warning}." for warning in result.warnings)
    return (
        f"The logs tell {told} of {len(result.parameters)} numbers. On steps {unseen}joints are "
        f"predicted within {after:.2f}° in place of {before:.2f}°.{wrong} "
        f"To simulate the robot: {result.simulate}"
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    FitConfig,
    lambda config, workers, on_step, _: (
        servo_recordings.run(config, on_step)
        if servo_recordings.are_given(config)
        else run(config, workers, on_step)
    ),
    tables,
    sentence,
    result=FitResult,
    row=ParameterRow,
    files=lambda config: {ROBOT: _robot},
    placed=lambda found, folder: replace(
        found, simulate=typed("tunnel", "--robot", str(folder / ROBOT))
    ),
    captions={
        "steps": "Left: each step's error of angles with the robot before (open) and the fitted "
        "one (filled); steps that the fit did not see are red. Right: a walk that it did not see.",
        "servo": "Goals and measured positions of each recording of a servo, with those of two "
        "models; shaded: full drive while the shaft rests.",
        "intervals": "Each number over its value before, with its 90 % interval; grey: not told.",
    },
    workers="here",
)


def _robot(outcome: FitOutcome | ServoFit) -> str:
    """Text of the fitted robot's file."""
    names = [each.name for each in outcome.recordings]
    return robot_file.written(outcome.config.text, outcome.found, names)
