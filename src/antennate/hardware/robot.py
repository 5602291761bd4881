"""What every command must know of a robot before it talks to it."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from antennate.hardware.esp32.film import calibrated
from antennate.params import (
    ControlParams,
    NetworkParams,
    Params,
    SupervisorParams,
    number,
)
from antennate.robots.spec import RobotSpec


class RobotConfig(Params):
    """One robot: its servos, its flex sensors, its controller's numbers and its network."""

    calibration: str | None = number(None, "1", "assumed: the numbers of control.conditioning")
    """File of `antennate calibrate`, for both antennae, in place of control.conditioning."""
    sensor_id: str | None = number(None, "1", "assumed: that of the calibration file")
    """Name of the flex sensor; 16 hexadecimal digits name the board it is soldered to."""
    robot: RobotSpec = RobotSpec()
    control: ControlParams = ControlParams()
    limits: SupervisorParams = SupervisorParams()
    network: NetworkParams = NetworkParams()

    def calibrated(self) -> Self:
        """The same with the curve and the flex sensor of the calibration file in place of its name.

        Raises:
            CalibrationError: The file cannot be used.
            ConfigError: There is another curve beside it.
        """
        if self.calibration is None:
            return self
        control, sensor = calibrated(self.control, Path(self.calibration), self.sensor_id)
        known = {"control": control, "sensor_id": sensor.sensor_id, "calibration": None}
        return self.model_copy(update=known)
