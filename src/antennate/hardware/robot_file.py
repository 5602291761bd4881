"""robot.toml: one file for every command that talks to a robot; each takes what it needs."""

from __future__ import annotations

from typing import TypeVar

from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.teleop import TeleopConfig
from antennate.hardware.esp32.recorder import RecordConfig
from antennate.hardware.robot import DoctorConfig, RobotConfig
from antennate.hardware.setup.config import JogConfig, SetupConfig, ZeroConfig
from antennate.params.doctor import DoctorParams
from antennate.params.record import RecordParams
from antennate.params.setup import JogParams, PortsParams, SetupParams, TeleopParams

_Config = TypeVar("_Config", bound=RobotConfig)


class RobotFile(DriveConfig):
    """What robot.toml may hold: what `drive` takes, and tables for other commands."""

    doctor: DoctorParams = DoctorParams()
    record: RecordParams = RecordParams()
    ports: PortsParams = PortsParams()
    setup: SetupParams = SetupParams()
    jog: JogParams = JogParams()
    teleop: TeleopParams = TeleopParams()

    def for_drive(self) -> DriveConfig:
        """What `drive` takes: all but the tables of others."""
        return self._part(DriveConfig)

    def for_teleop(self) -> TeleopConfig:
        """What `teleop` takes: what `drive` takes, and its own table."""
        return self._part(TeleopConfig)

    def for_doctor(self) -> DoctorConfig:
        """What `antennate doctor` takes: the robot, and its own table."""
        return self._part(DoctorConfig)

    def for_record(self) -> RecordConfig:
        """What `antennate record` takes: its own table, and the network."""
        return RecordConfig(**dict(self.record), network=self.network)

    def for_setup(self) -> SetupConfig:
        """What `antennate setup` takes: the robot, and its own table."""
        return SetupConfig(robot=self.robot, setup=self.setup)

    def for_zero(self) -> ZeroConfig:
        """What `antennate setup zero` takes: the same."""
        return ZeroConfig(robot=self.robot, setup=self.setup)

    def for_jog(self) -> JogConfig:
        """What `antennate setup jog` takes: the robot, and its own table."""
        return JogConfig(robot=self.robot, jog=self.jog)

    def _part(self, model: type[_Config]) -> _Config:
        return model(**{name: getattr(self, name) for name in model.model_fields})
