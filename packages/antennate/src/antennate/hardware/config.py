"""What robot.toml may hold, and what each command that talks to a robot takes of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import field_validator, model_validator

from antennate.antenna.calibration import Calibration
from antennate.control.protocol import PROTOCOLS
from antennate.control.readers import SIMULATION_ALONE, UNDRIVEN, unused
from antennate.control.registry import (
    BUILT_IN,
    GOALS,
    PROTOCOL,
    TELEOP,
    check_for_robots,
    unread,
    unread_by_all,
)
from antennate.errors import ConfigError
from antennate.hardware.esp32.wire import names_board
from antennate.hardware.safety import deadlines
from antennate.messages import shown
from antennate.params.base import Config, Params, number, paths_of
from antennate.params.control import ConditioningParams, ControlParams
from antennate.params.hardware import (
    DeadManParams,
    DoctorParams,
    GoalsParams,
    JogParams,
    NetworkParams,
    PortsParams,
    RecordParams,
    SetupParams,
    TeleopParams,
    ZerosParams,
)
from antennate.params.safety import DriftParams, SupervisorParams, TouchCheckParams
from antennate.robots.imu import ImuParams
from antennate.robots.spec import RobotSpec


class RobotConfig(Params):
    """One robot: its servos, its flex sensors, its controller's numbers and its network."""

    shared: ClassVar[bool] = True
    unread: ClassVar[tuple[str, ...]] = SIMULATION_ALONE

    calibration: str | None = number(None, "1", "assumed: the numbers of control.conditioning")
    """File of `antennate calibrate`, for both antennae, in place of control.conditioning."""
    calibration_right: str | None = number(None, "1", "assumed: that of both antennae")
    """File of the right antenna, where it has its own; `calibration` is then of the left one."""
    sensor_id: str | None = number(None, "1", "assumed: that of the calibration file")
    """Name of the flex sensor; 16 hexadecimal digits name the board it is soldered to."""
    sensor_id_right: str | None = number(None, "1", "assumed: that of its calibration file")
    """Name of the flex sensor of the right antenna, where that has its own file."""
    reach: float | None = number(
        None, "1", "assumed: of the calibration file, or 0.8", ge=0, le=200
    )
    """How far beyond the bent end of its range a reading is believed, in calibrated spans."""
    reach_right: float | None = number(
        None, "1", "assumed: of its calibration file, or that of both", ge=0, le=200
    )
    """Reach of the right antenna in calibrated spans, where that has its own."""
    robot: RobotSpec = RobotSpec()
    zeros: ZerosParams = ZerosParams()
    control: ControlParams = ControlParams()
    limits: SupervisorParams = SupervisorParams()
    network: NetworkParams = NetworkParams()

    @model_validator(mode="after")
    def _right_antenna_is_there(self) -> Self:
        names = ("calibration_right", "sensor_id_right", "reach_right")
        given = next((name for name in names if getattr(self, name) is not None), None)
        if self.control.conditioning_right is not None:
            given = "control.conditioning_right"
        if self.robot.antenna_count == 1 and given is not None:
            raise ValueError(f"{given}: expected none for a robot with one antenna, found one")
        return self

    @property
    def reaches(self) -> tuple[float | None, float | None]:
        """`reach` of the left and the right antenna [spans], None for the default."""
        return self.reach, self.reach if self.reach_right is None else self.reach_right

    def calibrated(self) -> Self:
        """The configuration with curve and flex sensor of its calibration file."""
        self._require_files()
        if self.calibration is None and self.calibration_right is None:
            return self
        if self.calibration is None:
            raise ConfigError(
                "calibration_right: expected calibration = FILE of the left antenna beside it, "
                "found none"
            )
        own, averaging = self.control, self.control.conditioning.averaging_time
        left = self._load(self.calibration, self.sensor_id)
        curve = left.conditioning(averaging)
        known: dict[str, Any] = {"calibration": None, "sensor_id": left.sensor_id}
        own_reach, other = self.reach is not None, None
        known["reach"] = self.reach if own_reach else left.reach
        if self.calibration_right is not None:
            right = self._load(self.calibration_right, self.sensor_id_right)
            other = right.curve()
            known |= {"calibration_right": None, "sensor_id_right": right.sensor_id}
            if self.reach_right is None:
                known["reach_right"] = self.reach if own_reach else right.reach
        control = own.model_copy(update={"conditioning": curve, "conditioning_right": other})
        return self.model_copy(update=known | {"control": control})

    def _require_files(self) -> None:
        """Refuse the name of a flex sensor beside neither its file nor the curve of one."""
        own, plain = self.control, ConditioningParams()
        curve = own.conditioning.model_copy(update={"averaging_time": plain.averaging_time})
        sides = (
            ("", self.sensor_id, self.calibration, curve != plain),
            ("_right", self.sensor_id_right, self.calibration_right, own.conditioning_right),
        )
        for side, name, file, own_curve in sides:
            if name is not None and not names_board(name) and not file and not own_curve:
                raise ConfigError(
                    f"sensor_id{side}: expected calibration{side} = FILE beside it, or 16 "
                    f"hexadecimal digits of a board, found {shown(name)}"
                )

    def _load(self, path: str, sensor_id: str | None) -> Calibration:
        """A calibration file that nothing contradicts."""
        file, own = Calibration.load(Path(path), sensor_id), self.control
        plain = ConditioningParams(averaging_time=own.conditioning.averaging_time)
        if own.conditioning != plain or own.conditioning_right is not None:
            raise ConfigError(
                f"control.conditioning: expected no curve beside calibration file {path}, found "
                "one; give averaging_time alone"
            )
        if own.rule.threshold != file.threshold:
            raise ConfigError(
                f"control.rule.threshold: expected theta of {path}, {file.threshold:g}, found "
                f"{own.rule.threshold:g}; set it alike"
            )
        return file


_EXAMINED = (
    *paths_of(ConditioningParams, "control.conditioning"),
    "control.conditioning_right",
    "control.rate",
    "control.rule.threshold",
    *(
        f"limits.{name}"
        for name in (
            "rate",
            "rate_error",
            "covered",
            "hum_time",
            "supply_warn",
            "supply_hold",
            "supply_off",
        )
    ),
)
"""What the doctor looks at of control and supervisor."""


class DoctorConfig(RobotConfig):
    """What `antennate doctor` has to know: the robot, and what is good."""

    unread: ClassVar[tuple[str, ...]] = (
        *SIMULATION_ALONE,
        "robot.release",
        *(path for path in paths_of(ControlParams, "control") if path not in _EXAMINED),
        *(path for path in paths_of(SupervisorParams, "limits") if path not in _EXAMINED),
        "control.conditioning.averaging_time",
    )
    doctor: DoctorParams = DoctorParams()

    def unread_here(self) -> Mapping[str, str]:
        """What is looked at of an inertial sensor, where there is none."""
        if self.robot.has_imu:
            return {}
        why = "the robot has no inertial sensor"
        return dict.fromkeys(("doctor.gravity_error", "doctor.turning"), why)

    def calibrated(self) -> Self:
        """The configuration with curve, flex sensor and noise of its calibration file."""
        names = {"calibrated_noise": self.calibration}
        names["calibrated_noise_right"] = self.calibration_right or self.calibration
        done = super().calibrated()
        known = {
            name: Calibration.load(Path(file)).noise_counts
            for name, file in names.items()
            if file is not None and getattr(self.doctor, name) is None
        }
        return done.model_copy(update={"doctor": self.doctor.model_copy(update=known)})


class DriveConfig(RobotConfig):
    """The robot, its controller, and how long it runs."""

    unread: ClassVar[tuple[str, ...]] = (*UNDRIVEN, "zeros.measured")
    offered: ClassVar[Mapping[str, Collection[str]]] = {
        "controller": BUILT_IN,
        "protocol": PROTOCOLS,
    }

    controller: str = number("closed", "1", "assumed: our best")
    """{offered}, MODULE:NAME or FILE.py:NAME of your own, or FILE.onnx, a learned policy."""
    protocol: str = number("", "1", "assumed: a controller walks", metavar="NAME|FILE")
    """Recordings in place of a controller: {offered} or a TOML file."""
    dry_run: float = number(10.0, "s", "assumed: long enough to touch both antennae", ge=0, le=600)
    """Time before torque."""
    duration: float | None = number(None, "s", "assumed: until it is stopped", gt=0)
    """Time from torque on to off."""
    record_required: bool = number(
        False, "1", "assumed: a robot that walks matters more than its log"
    )
    """Whether the robot holds while no log of it is kept."""
    touch_check: bool = number(
        True, "1", "assumed: swapped channels turn the robot towards what it touches"
    )
    """The touch check in the dry run, in which both antennae are bent by hand."""
    touch: TouchCheckParams = TouchCheckParams()
    hold_to_run: bool = number(False, "1", "assumed: a script has no keys")
    """Walk only while a key of the terminal is held."""
    dead_man: DeadManParams = DeadManParams()
    drift: DriftParams = DriftParams()
    goals: GoalsParams = GoalsParams()
    fault_time: float = number(
        10.0, "s", "assumed: long enough to take hold of the robot", ge=0, le=600
    )
    """Time that it stands with torque after a fault."""
    bus_return: float = number(30.0, "s", "assumed: long enough to put a plug back", ge=0, le=600)
    """Time that a lost servo bus is waited for, to take the torque off."""
    stand: float = number(
        0.3, "s", "assumed: a step at half a hertz comes to rest", ge=0, le=deadlines.STAND
    )
    """Time that the robot holds its command before the torque goes off."""
    swapped: float = number(
        1.5, "s", "assumed: half the wait for a greeting, and no servo speaks unasked", gt=0, le=60
    )
    """Silence of the board, while the bus speaks unasked, that shows the two ports swapped."""

    @field_validator("controller")
    @classmethod
    def _known(cls, name: str) -> str:
        return check_for_robots(name)

    @model_validator(mode="after")
    def _in_order(self) -> DriveConfig:
        deadlines.require_order(self.limits, self.control.period)
        return self

    @property
    def reader(self) -> str:
        """What reads the numbers of the control."""
        return PROTOCOL if self.protocol else self.controller

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what its controller does not read."""
        more = {"controller": "a protocol takes its place"} if self.protocol else {}
        return unused(self.robot) | unread_by_all([self.reader], self.control, self.robot) | more


_IMU = paths_of(ImuParams, "robot.imu")
_UNREAD = tuple(dict.fromkeys((*SIMULATION_ALONE, "robot.release", "zeros.measured", *_IMU)))


class SetupConfig(Params):
    """The robot, and how it is set up."""

    shared: ClassVar[bool] = True
    unread: ClassVar[tuple[str, ...]] = (
        *_UNREAD,
        *(f"robot.{name}.directions" for name in ("yaw", "legs", "antennae", "pitch", "elevation")),
        *(f"setup.{name}" for name in ("hold", "still", "turn", "horn_teeth")),
    )
    robot: RobotSpec = RobotSpec()
    zeros: ZerosParams = ZerosParams()
    setup: SetupParams = SetupParams()


class ZeroConfig(SetupConfig):
    """The robot, and how its zeros are measured."""

    unread: ClassVar[tuple[str, ...]] = (
        *_UNREAD,
        *(f"setup.{name}" for name in ("done", "scan", "port_time")),
    )


class JogConfig(Params):
    """The robot, and how a joint of it is moved by keys."""

    shared: ClassVar[bool] = True
    unread: ClassVar[tuple[str, ...]] = _UNREAD
    robot: RobotSpec = RobotSpec()
    zeros: ZerosParams = ZerosParams()
    jog: JogParams = JogParams()


class RecordConfig(RecordParams):
    """What is recorded, and how the board is reached."""

    network: NetworkParams = NetworkParams()


class TeleopConfig(DriveConfig):
    """The configuration of `drive`, and the numbers of teleoperation; `controller` is not used."""

    unread: ClassVar[tuple[str, ...]] = (
        *DriveConfig.unread,
        "controller",
        "goals.release",
        "protocol",
        *paths_of(DeadManParams, "dead_man"),
        *(f"control.{path}" for path in sorted(unread(TELEOP, ControlParams()))),
    )
    teleop: TeleopParams = TeleopParams()

    @property
    def reader(self) -> str:
        """What reads the numbers of the control."""
        return TELEOP


class GoalsConfig(DriveConfig):
    """The configuration of `drive --accept`; `controller` is not used."""

    unread: ClassVar[tuple[str, ...]] = (
        *DriveConfig.unread,
        "controller",
        "protocol",
        *(f"control.{path}" for path in sorted(unread(GOALS, ControlParams()))),
    )

    @property
    def reader(self) -> str:
        """What reads the numbers of the control."""
        return GOALS


class RobotFile(DriveConfig):
    """What robot.toml may hold: what `drive` takes, and tables for other commands."""

    doctor: DoctorParams = DoctorParams()
    record: RecordParams = RecordParams()
    ports: PortsParams = PortsParams()
    setup: SetupParams = SetupParams()
    jog: JogParams = JogParams()
    teleop: TeleopParams = TeleopParams()

    def for_record(self) -> RecordConfig:
        """What `antennate record` takes: its own table, and the network."""
        return RecordConfig(**dict(self.record), network=self.network)

    def part(self, model: type[Config]) -> Config:
        """The configuration of one command: what the file holds of it."""
        return model(**{name: getattr(self, name) for name in model.model_fields})
