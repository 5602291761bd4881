"""What `setup`, `zero` and `jog` take of robot.toml."""

from __future__ import annotations

from antennate.params.base import Params
from antennate.params.setup import JogParams, SetupParams
from antennate.robots.spec import RobotSpec


class SetupConfig(Params):
    """The robot, and how it is set up."""

    robot: RobotSpec = RobotSpec()
    setup: SetupParams = SetupParams()


class JogConfig(Params):
    """The robot, and how a joint of it is moved by keys."""

    robot: RobotSpec = RobotSpec()
    jog: JogParams = JogParams()
