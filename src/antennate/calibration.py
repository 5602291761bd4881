"""A calibration and its file: the curve from readings to bend, and what is needed to trust it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from antennate.conditioning import bending_level
from antennate.errors import CalibrationError, OutputError
from antennate.params import ConditioningParams
from antennate.records import Floats

SCHEMA = 1
FEWEST = 20
"""Fewest readings."""
_LARGEST_FILE = 1_000_000


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class SpeedFit(_Strict):
    """How well the one curve serves one speed."""

    speed_m_s: float | None
    samples: int = Field(ge=1)
    r2: float
    rmse: float = Field(ge=0)


class Calibration(_Strict):
    """A curve with all that is needed to trust it; what a calibration file holds."""

    schema_version: Literal[1] = SCHEMA
    made_by: str = Field(max_length=64)
    sensor_id: str = Field(pattern=r"^[A-Za-z0-9._-]{1,64}$")
    data_sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    polarity: Literal[-1, 1]
    slope: float = Field(gt=0, le=1000)
    slope_95: tuple[float, float]
    midpoint: float = Field(gt=-1, lt=2)
    midpoint_95: tuple[float, float]
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
    cross_validated_rmse: dict[Literal["sigmoid", "line", "isotonic"], float]
    better_than_sigmoid: tuple[Literal["line", "isotonic"], ...]

    def conditioning(self, averaging_time: float = 0.1) -> ConditioningParams:
        """What the controller takes."""
        return ConditioningParams(
            averaging_time=averaging_time,
            midpoint=self.midpoint,
            slope=self.slope,
            polarity=self.polarity,
            counts_low=self.counts_low,
            counts_high=self.counts_high,
        )


def level(calibration: Calibration, counts: Floats) -> Floats:
    """Bending level of readings [counts], same shape."""
    return bending_level(calibration.conditioning(), counts)


def load(path: Path) -> Calibration:
    """Read a calibration file.

    Raises:
        CalibrationError: It cannot be read, or a field is missing, unknown or out of bounds.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise CalibrationError(f"{path}: expected a readable file: {error.strerror}") from None
    if len(data) > _LARGEST_FILE:
        raise CalibrationError(f"{path}: expected at most {_LARGEST_FILE} bytes, found more")
    try:
        found = Calibration.model_validate_json(data, strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"]) or "the file"
        raise CalibrationError(f"{path}: {field}: {first['msg']}") from None
    if found.counts_high - found.counts_low < 1:
        raise CalibrationError(
            f"{path}: counts_high: expected more than counts_low, found {found.counts_low} and "
            f"{found.counts_high}"
        )
    return found


def to_json(calibration: Calibration) -> str:
    """The content of a calibration file."""
    return json.dumps(calibration.model_dump(mode="json"), indent=2, allow_nan=False) + "\n"


def save(calibration: Calibration, path: Path, overwrite: bool = False) -> None:
    """Write a calibration file, whole or not at all.

    Raises:
        OutputError: There is a file already and it may not be replaced, or it cannot be written.
    """
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with fresh.open("x", encoding="utf-8") as file:
            file.write(to_json(calibration))
            file.flush()
            os.fsync(file.fileno())
        if overwrite:
            fresh.replace(path)
        else:
            os.link(fresh, path)  # fails if there is one, even if it came this moment
    except FileExistsError:
        raise OutputError(
            f"{path}: expected no such file, found one; choose another or give --overwrite"
        ) from None
    except OSError as error:
        raise OutputError(f"{path}: expected to write it, found: {error.strerror}") from None
    finally:
        fresh.unlink(missing_ok=True)
