"""Recordings of one servo on a bench as numbers of a robot, by the estimator of `servo --fit`.

Its whole model is taken if a known weight hung on the servo and the recordings tell all numbers,
else the data sheet's line with both frictions: without a weight, and short of full drive, only
ratios of torque, speed, gain and inertia show.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from antennate.errors import BadInputError
from antennate.files import open_regular
from antennate.jackknife import jackknife95
from antennate.params.base import changes
from antennate.robots.servos import MODEL_NUMBERS, ServosParams
from antennate.studies.trials import OnStep, no_step
from antennate.telemetry.chunks import MAGIC
from antennate.types import Floats
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.estimates import LEVEL, TOLD, Estimate
from antennate_lab.fit.parameters import Parameter, parameters
from antennate_lab.fit.result import FitResult, LogSummary, ParameterRow, StepRow
from antennate_lab.servo import run as servo
from antennate_lab.servo.experiment import stalls
from antennate_lab.servo.recording import Recording, ServoConfig
from antennate_lab.servo.result import ModelSummary

_OF_LOGS = ("poses", "markers", "unit", "up", "mirrored", "leave_out", "robots", "seed")
"""Settings that recordings of a servo do not read."""
_RECORD = "lift a known weight with this servo on a bench, at several gains"


def are_given(config: FitConfig) -> bool:
    """Whether the files are recordings of a servo, by their first bytes; False for logs.

    Raises:
        BadInputError: Some are, or one is neither, or a setting is of the other kind.
    """
    for name in config.log:
        if Path(name).suffix.lower() == ".csv":
            raise BadInputError(
                f"{name}: expected logs of `drive --protocol` or recordings of a servo (JSON), "
                "found a CSV table, which is not read here; if it holds readings of an antenna "
                "over bend, `antennate calibrate --recording FILE` fits their curve, and "
                "robot.toml names its file as `calibration`"
            )
        if config.servo is not None and Path(name).is_dir():
            raise BadInputError(
                f"{name}: expected recordings of a servo (JSON) beside --servo, found a folder; "
                "name its files"
            )
    kinds = [(name, _kind(Path(name))) for name in config.log]
    texts = [name for name, kind in kinds if kind == "recording"]
    for name, kind in kinds:
        json = texts or config.servo is not None or Path(name).suffix.lower() == ".json"
        if kind == "neither" and json:
            raise BadInputError(
                f"{name}: expected a recording of a servo (JSON), found neither that nor a log"
            )
    if texts and len(texts) < len(config.log):
        raise BadInputError(
            f"log: expected logs or recordings of a servo, found both, as {texts[0]}; fit one, "
            "then the other with --robot FOLDER/robot.toml of the first"
        )
    what, others = ("recordings", _OF_LOGS) if texts else ("logs", ("servo",))
    for name, _ in changes(config, others):
        raise BadInputError(
            f"{name}: expected the default, as {what} do not read it, found another"
        )
    return bool(texts)


def _kind(path: Path) -> Literal["log", "recording", "neither"]:
    """What a file is by its first bytes; by its name if its reader has to say why it cannot."""
    try:
        with open_regular(path) as file:
            first = file.read(64)
    except OSError:
        return "recording" if path.suffix.lower() == ".json" else "log"
    if first.startswith(MAGIC):
        return "log"
    return "recording" if first.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"[") else "neither"


@dataclass(frozen=True)
class ServoFit:
    """What a fit to recordings of a servo has found.

    Attributes:
        servo: What `servo` has found in them.
        found: What is known of each number of the servo.
        recordings: The recordings.
        steps: A row for each part that was left out in turn.
        warnings: What is wrong.
    """

    config: FitConfig
    servo: servo.ServoOutcome
    found: list[Estimate]
    recordings: list[Recording]
    steps: list[StepRow]
    warnings: list[str]

    @property
    def rows(self) -> list[ParameterRow]:
        """A row for each number."""
        rows = [each.row() for each in self.found]
        return [row if row.told else replace(row, record=_RECORD) for row in rows]

    def result(self) -> FitResult:
        """What the run comes to."""
        return FitResult(
            logs=[
                LogSummary(name=each.name, sha256=each.sha256, steps=[], left_out={}, warnings=[])
                for each in self.recordings
            ],
            parameters=self.rows,
            steps=self.steps,
            correlations=[],
            noise={},
            warnings=self.warnings,
            simulate="antennate tunnel --robot robot.toml",
        )


def run(config: FitConfig, on_step: OnStep = no_step) -> ServoFit:
    """Fit a servo of a robot to recordings.

    Raises:
        BadInputError: They cannot be of that servo, or are too few for an interval.
    """
    robot = config.described
    if config.servo is None or config.servo not in robot.servo_names:
        names = ", ".join(dict.fromkeys(robot.servo_names))
        raise BadInputError(
            f"servo: expected the model that was recorded, one of the robot's: {names}, found "
            f"{config.servo or 'none'}"
        )
    if len({Path(name).resolve() for name in config.log}) < 2:
        raise BadInputError(
            f"{config.log[0]}: expected two recordings or more, so that each can judge a fit to "
            "the others, found one; `antennate servo --fit` takes it"
        )
    given = robot.servos.of(config.servo)
    usual = type(given)().model_dump(include={"p_gain", "delay"})  # recordings have their own
    servos = ServosParams().model_copy(update={config.servo: given.model_copy(update=usual)})
    own = ServoConfig(recording=config.log, servo=config.servo, servos=servos, fit=True)
    outcome = servo.run(own, on_step)
    models = {each.name: each for each in outcome.result().models}
    chosen = parameters(robot, [(f"servos.{config.servo}.{name}", None) for name in MODEL_NUMBERS])
    model = models["whole model"]
    found = _estimates(outcome, model, chosen)
    if "stall_torque" not in model.free or not all(each.told for each in found):
        model = models["data sheet + friction"]
        found = _estimates(outcome, model, chosen)
    pairs = zip(models["as given"].held_out_deg.items(), model.held_out_deg.values(), strict=True)
    count = f"{len(config.log)} recordings"
    steps = [
        StepRow(log=count, step=part, fitted=False, error_before_deg=before, error_deg=after)
        for (part, before), after in pairs
        if before is not None and after is not None
    ]
    warnings = _beside(model, found) + [each.rstrip(".") for each in stalls(outcome.result())]
    return ServoFit(config, outcome, found, outcome.recordings, steps, warnings)


def _estimates(
    outcome: servo.ServoOutcome, model: ModelSummary, chosen: Sequence[Parameter]
) -> list[Estimate]:
    """Estimates of a model's numbers, by the half of their 90 % intervals on the search's scale."""
    divisors = [d for each in outcome.recordings if (d := each.divisor()) is not None]
    found = []
    for name, each in zip(MODEL_NUMBERS, chosen, strict=True):
        scale, value, groups = each.scale, getattr(model, name), outcome.groups
        ends: Floats = np.array(model.interval_95.get(name, (np.nan, np.nan)))
        if name == "gain_divisor" and name not in model.free:
            groups = len(divisors)
            left = [float(np.mean(divisors[:i] + divisors[i + 1 :])) for i in range(groups)]
            ends = value + jackknife95(0.0, np.array(left))
        if scale.log:
            value, ends = math.log(value), np.log(ends)
        narrower = stdtrit(groups - 1, 0.95) / stdtrit(groups - 1, 0.975)  # NaN of one group
        half = float(abs(ends - value).max() * narrower)  # one end may be at a bound
        known = LEVEL * scale.spread
        told = half < TOLD * known
        middle = value if told else each.searched(each.start)
        low, high = middle + np.array([-1.0, 1.0]) * (half if told else known)
        interval = (math.exp(low), math.exp(high)) if scale.log else (max(low, 0.0), float(high))
        value = getattr(model, name) if told else each.start
        found.append(Estimate(each, value, interval, told, "bench", np.zeros(1)))
    return found


def _beside(model: ModelSummary, found: Sequence[Estimate]) -> list[str]:
    """Numbers that stay as they were although the others were fitted with another value."""
    return [
        f"{each.parameter.name} stays {each.value:g}, though the others were found with {used:.4g}"
        for name, each in zip(MODEL_NUMBERS, found, strict=True)
        if not each.told and (used := getattr(model, name)) != each.value
    ]
