"""What `antennate doctor` has to know: the robot that is expected, and what is good."""

from __future__ import annotations

from antennate.hardware.robot import RobotConfig
from antennate.params import DoctorParams


class DoctorConfig(RobotConfig):
    """The robot, and what is good."""

    doctor: DoctorParams = DoctorParams()
