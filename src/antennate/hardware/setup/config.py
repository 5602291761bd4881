"""What `setup`, `zero` and `jog` take of robot.toml."""

from __future__ import annotations

from typing import ClassVar

from antennate.control.readers import SIMULATION_ALONE
from antennate.params.base import Params
from antennate.params.hardware import JogParams, SetupParams
from antennate.robots.spec import RobotSpec

_UNREAD = (*SIMULATION_ALONE, "robot.release")


class SetupConfig(Params):
    """The robot, and how it is set up."""

    shared: ClassVar[bool] = True
    unread: ClassVar[tuple[str, ...]] = (
        *_UNREAD,
        *(f"robot.{name}.directions" for name in ("yaw", "legs", "antennae", "pitch")),
        *(f"setup.{name}" for name in ("hold", "still", "turn", "horn_teeth")),
    )
    robot: RobotSpec = RobotSpec()
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
    jog: JogParams = JogParams()
