"""Which flex sensor is on the robot, and its calibration file in place of numbers typed by hand."""

from __future__ import annotations

import re
from pathlib import Path

from antennate.antenna.calibration import Calibration
from antennate.errors import CalibrationError, ConfigError
from antennate.hardware.esp32.wire import Hello
from antennate.params import ConditioningParams, ControlParams

_SERIAL = re.compile("[0-9a-f]{16}")
"""A sensor id of this form is the serial number of a board."""


def calibrated(
    control: ControlParams, path: Path, sensor_id: str | None = None
) -> tuple[ControlParams, Calibration]:
    """The controller's numbers with the curve of a calibration file.

    Args:
        control: Its numbers, without a curve of their own.
        path: The file; one curve serves both antennae.
        sensor_id: The flex sensor it has to belong to, None for any.

    Raises:
        CalibrationError: The file cannot be used.
        ConfigError: There is another curve, or another theta, beside it.
    """
    found = Calibration.load(path, sensor_id)
    plain = ConditioningParams(averaging_time=control.conditioning.averaging_time)
    if control.conditioning != plain:
        raise ConfigError(
            f"control.conditioning: expected no curve beside calibration file {path}, found one; "
            "give averaging_time alone"
        )
    if control.rule.threshold != found.threshold:
        raise ConfigError(
            f"control.rule.threshold: expected theta of {path}, {found.threshold:g}, found "
            f"{control.rule.threshold:g}; set it alike"
        )
    curve = found.conditioning(control.conditioning.averaging_time)
    return control.model_copy(update={"conditioning": curve}), found


def require_film(hello: Hello | None, sensor_id: str | None) -> None:
    """Refuse a board to which the calibrated sensor is not soldered, where its id names a board.

    Args:
        hello: What the board has said of itself.
        sensor_id: That of the calibration.

    Raises:
        CalibrationError: Says both serial numbers.
    """
    if sensor_id is None or not _SERIAL.fullmatch(sensor_id) or hello is None:
        return
    if hello.device_id != sensor_id:
        raise CalibrationError(
            f"--calibration: expected the board {sensor_id} of its sensor_id, found board "
            f"{hello.device_id}; calibrate the flex sensors of this board"
        )
