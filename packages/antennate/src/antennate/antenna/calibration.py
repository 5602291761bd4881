"""A calibration, the curve from readings [counts] to the flex level, and its file."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from antennate import checks
from antennate.antenna.sensor import FULL_SCALE
from antennate.control.conditioning import bending_level
from antennate.errors import BadInputError, CalibrationError
from antennate.files import read_limited, write_whole
from antennate.params.base import Strict
from antennate.params.control import ConditioningParams, CurveParams
from antennate.params.faults import describe
from antennate.types import Floats

SCHEMA = 1
Kind = Literal["sigmoid", "line", "isotonic"]
"""Curves that a calibration may be."""
REACH = 0.8
"""How far sensors of the robot bend beyond a calibration up to a right angle [spans]: 0.70 in
simulation (measured), and a tenth for drift."""
FEWEST = 20
"""Fewest readings."""
NARROWEST_SPAN = 20.0
"""Fewest counts between straight and bent that can be told from noise."""
NARROWEST_RISE = 10.0
"""Fewest counts over which the level may rise from 0.1 to 0.9: four times a reading's noise."""
_RISE = 2.0 * math.log(9.0)
"""Rise of a sigmoid from 0.1 to 0.9 in units of 1 / slope."""
_LARGEST_FILE = 1_000_000


class SpeedFit(Strict):
    """How well the curve fits the pushes of one speed [m/s]; None where the speed is unknown."""

    speed_m_s: float | None
    samples: int = Field(ge=1)
    r2: float
    rmse: float = Field(ge=0)


class Calibration(Strict):
    """The content of a calibration file: a curve from counts to level, and how well it fits.

        level = 1 / (1 + exp(-polarity slope (x - midpoint))),  x = (counts - low) / (high - low)

    or, where `kind` is no sigmoid, straight lines between `knots`.

    Attributes:
        schema_version: Version of this format.
        made_by: Program and version.
        sensor_id: Which flex sensor: letters, digits, dots, hyphens, underscores.
        data_sha256: Hash of the recording.
        polarity: 1 if readings rise with the flex, -1 if they fall.
        slope: Slope of the sigmoid over x; `slope_95` its 95 % interval, over pushes, of noise
            alone where there is a `misfit`. None with fewer than three pushes, or all alike.
        midpoint: x at which the level is 0.5; `midpoint_95` likewise.
        counts_low: Reading at x = 0 [counts]; `counts_high` at x = 1.
        threshold: Level from which on there is contact (theta of the paper).
        valid_counts: Lowest and highest reading of the recording [counts].
        valid_bend: Lowest and highest level of the recording.
        samples: Readings used, from `trials` pushes.
        r2: Share of the level's variance that the curve explains; `rmse` its error.
        speeds: The same for each pushing speed.
        cross_validated_rmse: Error on unseen pushes of the sigmoid and of two other models; with
            fewer than three pushes on unseen tenths of the recording.
        reach: How far beyond the bent end of this range readings are still those of the sensor
            [spans].
        kind: Which curve: the paper's sigmoid, a line, or isotonic.
        knots: Rising readings of a line or an isotonic curve [counts]; `knot_levels` its levels.
        misfit: What the curve errs by in the same way in all pushes: root mean square over readings
            and both ways [b]. None if nothing beyond noise, or not known.
        noise_counts: Standard deviation of single readings in the recording [counts]; None if it is
            not known.
        better_than_sigmoid: Models that were better on these readings beyond noise: the 95 %
            interval over pushes left out lies above 0. Empty with a single push.

    Raises:
        CalibrationError: A value is missing, unknown or out of bounds, or no flex sensor can have
            such a curve.
    """

    refusal: ClassVar[type[BadInputError]] = CalibrationError

    schema_version: Literal[1] = SCHEMA
    made_by: str = Field(max_length=64)
    sensor_id: str = Field(pattern=r"^[A-Za-z0-9._-]{1,64}$")
    data_sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    polarity: Literal[-1, 1]
    slope: float = Field(gt=0, le=1000)
    slope_95: tuple[float, float] | None
    midpoint: float = Field(ge=-3, le=3)
    midpoint_95: tuple[float, float] | None
    counts_low: float = Field(ge=0, le=4095)
    counts_high: float = Field(ge=0, le=4095)
    threshold: float = Field(gt=0, lt=1)
    valid_counts: tuple[float, float]
    valid_bend: tuple[float, float]
    samples: int = Field(ge=FEWEST)
    trials: int = Field(ge=1)
    r2: float = Field(le=1)
    rmse: float = Field(ge=0)
    speeds: tuple[SpeedFit, ...]
    cross_validated_rmse: dict[Kind, float]
    better_than_sigmoid: tuple[Literal["line", "isotonic"], ...]
    reach: float = Field(default=REACH, ge=0, le=200)
    noise_counts: float | None = Field(default=None, ge=0, le=4095)
    kind: Kind = "sigmoid"
    knots: tuple[float, ...] = ()
    knot_levels: tuple[float, ...] = ()
    misfit: float | None = Field(default=None, ge=0)

    @model_validator(mode="after")
    def _possible(self) -> Calibration:
        if why := _impossible(self):
            raise ValueError(why)
        return self

    def conditioning(self, averaging_time: float = 0.1) -> ConditioningParams:
        """The curve as parameters of a controller; `averaging_time` [s] is T_avg of the paper.

        Raises:
            ConfigError: That time is out of bounds.
        """
        return ConditioningParams(averaging_time=averaging_time, **self._of_curve())

    def curve(self) -> CurveParams:
        """The curve of one antenna alone, without the running mean."""
        return CurveParams(**self._of_curve())

    def _of_curve(self) -> dict[str, Any]:
        unread = ("midpoint", "slope") if self.knots else ("knots", "knot_levels")
        return {n: getattr(self, n) for n in CurveParams.model_fields if n not in unread}

    def level(self, counts: Floats) -> Floats:
        """Flex level, 0 to 1, of readings [counts], same shape; NaN stays NaN.

        Raises:
            CalibrationError: They are no numbers.
        """
        counts = checks.array("counts", counts, (), "counts", finite=False, error=CalibrationError)
        return bending_level(self.conditioning(), counts)

    def to_json(self) -> str:
        """The content of a calibration file."""
        return json.dumps(self.model_dump(mode="json"), indent=2, allow_nan=False) + "\n"

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write a calibration file, whole or not at all.

        Raises:
            ConfigError: The path is none.
            OutputError: There is such a file and it may not be replaced, or it cannot be written.
        """
        write_whole(checks.path("path", path), self.to_json().encode(), overwrite)

    @classmethod
    def load(cls, path: str | Path, sensor_id: str | None = None) -> Calibration:
        """Read a calibration file.

        Args:
            path: The file.
            sensor_id: The flex sensor it has to belong to, None for any.

        Raises:
            ConfigError: The path is none.
            CalibrationError: It cannot be read; a field is missing, doubled, unknown or out of
                bounds; or no flex sensor can have such a curve.
        """
        path = checks.path("path", path)
        data = read_limited(path, _LARGEST_FILE, CalibrationError)
        try:
            calibration = cls.model_validate_json(data, strict=True)
            json.loads(data, object_pairs_hook=_once)
        except ValidationError as error:
            raise CalibrationError(f"{path}: {describe(error, cls)}") from None
        except CalibrationError as error:
            raise CalibrationError(f"{path}: {error}") from None
        if sensor_id is not None and calibration.sensor_id != sensor_id:
            raise CalibrationError(
                f"{path}: sensor_id: expected {sensor_id}, found {calibration.sensor_id}: the "
                "calibration of another flex sensor"
            )
        return calibration


def _once(pairs: list[tuple[str, object]]) -> None:
    """Refuse what pydantic accepts: doubled keys, and booleans in place of numbers."""
    keys = [key for key, _ in pairs]
    if doubled := next((key for key in keys if keys.count(key) > 1), None):
        raise CalibrationError(f"{doubled}: expected once, found {keys.count(doubled)} times")
    if key := next((key for key, value in pairs if isinstance(value, bool)), None):
        raise CalibrationError(f"{key}: expected a number, found a boolean")


def _impossible(calibration: Calibration) -> str:
    """Why no flex sensor can have this curve, empty if one can; no file can widen these bounds."""
    span = calibration.counts_high - calibration.counts_low
    if span < NARROWEST_SPAN:
        return (
            f"counts_high: expected {NARROWEST_SPAN:g} counts more than counts_low or more, found "
            f"{calibration.counts_low:g} and {calibration.counts_high:g}"
        )
    for field in ("slope_95", "midpoint_95", "valid_counts", "valid_bend"):
        ends: tuple[float, float] | None = getattr(calibration, field)
        if ends is not None and not ends[0] <= ends[1]:
            return f"{field}: expected the lower end first, found {ends[0]:g} and {ends[1]:g}"
    low, high = calibration.valid_counts
    if not (0 <= low < high <= FULL_SCALE):
        return f"valid_counts: expected readings of 12 bits, found {low:g} to {high:g}"
    if (calibration.kind == "sigmoid") != (not calibration.knots):
        return f"kind: expected sigmoid without knots, or another with, found {calibration.kind}"
    if not calibration.knots and not -1 < calibration.midpoint < 2:
        return f"midpoint: expected a sigmoid's between -1 and 2, found {calibration.midpoint:g}"
    width, name = _RISE * span / calibration.slope, "slope"
    if calibration.knots:
        curve = calibration.curve()
        levels, counts = curve.knot_levels[:: curve.polarity], curve.knots[:: curve.polarity]
        width, name = float(np.ptp(np.interp([0.1, 0.9], levels, counts))), "knots"
    if width < NARROWEST_RISE:
        return (
            f"{name}: expected a level that rises from 0.1 to 0.9 over {NARROWEST_RISE:g} counts "
            f"or more, found {width:.3g}"
        )
    levels = calibration.level(np.array([calibration.counts_low, calibration.counts_high]))
    straight, bent = levels if calibration.polarity > 0 else levels[::-1]
    if not straight < calibration.threshold < bent:
        return (
            f"midpoint: expected a level below the threshold {calibration.threshold:g} at the "
            f"straight end and above it at the bent end, found {straight:.3g} and {bent:.3g}"
        )
    return ""
