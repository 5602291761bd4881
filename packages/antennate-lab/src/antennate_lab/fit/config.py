"""Everything that decides the outcome of `antennate fit`."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from antennate.errors import ConfigError, in_one_line
from antennate.files import decoded, read_limited
from antennate.params.base import (
    LARGEST_FILE,
    Params,
    from_values,
    number,
    require_default,
    with_bases,
)
from antennate.robots.servos import ServoName
from antennate.robots.spec import ROBOTS, RobotSpec

NO_POSES = "none"
"""Stands for the table of a log without motion capture."""


class FitConfig(Params):
    """Everything that decides the outcome of `antennate fit`."""

    log: tuple[str, ...] = Field(
        (),
        json_schema_extra={
            "unit": "1",
            "source": "assumed: has to be named",
            "metavar": "RUN|LOG",
            "positional": True,
        },
    )
    """Logs of `drive --protocol` of one robot, or the folders of these drives; or recordings of one
    of its servos (JSON)."""
    robot: str = number(
        ROBOTS[0], "1", "assumed: the default robot", metavar="NAME|FILE", examples=list(ROBOTS)
    )
    """Robot that was driven: a name, or a TOML file of a robot, which may be a `robot.toml`."""
    servo: ServoName | None = number(
        None, "1", "assumed: has to be named with recordings", metavar="MODEL"
    )
    """Model of the servo that was recorded; logs name theirs."""
    poses: tuple[str, ...] = number((), "1", "assumed: most have no motion capture", metavar="FILE")
    """Tables of motion capture, CSV or TRC, one for each log in their order, `none` for a log
    without: speed and turn of walks count too."""
    markers: tuple[str, ...] = number(
        (),
        "1",
        "assumed: those whose names begin with head",
        metavar="NAME",
    )
    """Their markers at the rear of the head and in front, or one body."""
    unit: float | None = number(None, "m", "assumed: as the tables say, else 1", gt=0, le=1000)
    """Their unit of length, else as they say."""
    up: Literal["x", "y", "z"] | None = number(
        None, "1", "assumed: along which the head hardly moves"
    )
    """Their axis that points up, else found."""
    mirrored: bool = number(False, "1", "assumed: right-handed")
    """They are left-handed, or have y down as images."""
    leave_out: tuple[str, ...] = number(
        (), "1", "assumed: the walks at the middle one of the frequencies", metavar="STEP"
    )
    """Steps that are not fitted and judge the fit."""
    robots: int = number(
        120, "1", "measured: twice as many tell frictions 10 % better", ge=20, le=5000
    )
    """Robots of each of two rounds that walk in the simulation."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of draws."""

    @model_validator(mode="after")
    def _agree(self) -> FitConfig:
        if not self.poses:
            require_default(self, "there are no poses", "markers", "unit", "up", "mirrored")
        return self

    @property
    def described(self) -> RobotSpec:
        """The robot.

        Raises:
            ConfigError: There is none of that name, or the file cannot be used.
        """
        if self.robot in ROBOTS:
            return RobotSpec.named(self.robot)
        table = tomllib.loads(self.text)
        if "robot" not in table:
            return RobotSpec.named(self.robot)
        own = with_bases({"robot": table["robot"]}, _Holder, Path(self.robot).parent)
        robot = from_values(_Holder, own).robot
        robot.require_held(Path(self.robot))
        return robot

    @property
    def text(self) -> str:
        """Text of the robot's file."""
        if self.robot in ROBOTS:
            return (files("antennate.robots") / f"{self.robot}.toml").read_text(encoding="utf-8")
        path = Path(self.robot)
        if path.suffix != ".toml":
            RobotSpec.named(self.robot)  # says what was expected
        text = decoded(path, read_limited(path, LARGEST_FILE, ConfigError), ConfigError)
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(f"{path}: expected TOML, found: {in_one_line(error)}") from None
        return text


class _Holder(Params):
    """The table of a robot in its file."""

    robot: RobotSpec = RobotSpec()
