"""What a drive is told: the robot, its controller, and how long."""

from __future__ import annotations

from pydantic import field_validator

from antennate.control.registry import CONTROLLERS
from antennate.hardware.robot import RobotConfig
from antennate.params import DriftParams, TouchCheckParams, number
from antennate.params.dead_man import DeadManParams


class DriveConfig(RobotConfig):
    """The robot, its controller, and how long it runs."""

    controller: str = number(
        "closed",
        "1",
        "assumed: our best",
        "open, paper, closed, or MODULE:NAME or FILE.py:NAME of your own",
        examples=["open", "paper", "closed"],
    )
    dry_run: float = number(
        10.0, "s", "assumed: long enough to touch both antennae", "time before torque", ge=0, le=600
    )
    duration: float | None = number(
        None, "s", "assumed: until it is stopped", "time from torque on to off", gt=0
    )
    record_required: bool = number(
        False,
        "1",
        "assumed: a robot that walks matters more than its log",
        "whether the robot holds while no log of it is kept",
    )
    touch_check: bool = number(
        True,
        "1",
        "assumed: swapped channels turn the robot towards what it touches",
        "whether it is armed only after both antennae were bent by hand in the dry run",
    )
    touch: TouchCheckParams = TouchCheckParams()
    hold_to_run: bool = number(
        False,
        "1",
        "assumed: a script has no keys",
        "whether it walks only while a key of the terminal is held",
    )
    dead_man: DeadManParams = DeadManParams()
    drift: DriftParams = DriftParams()
    fault_time: float = number(
        10.0,
        "s",
        "assumed: long enough to take hold of the robot",
        "time that it stands with torque after a fault",
        ge=0,
        le=600,
    )
    bus_return: float = number(
        30.0,
        "s",
        "assumed: long enough to put a plug back",
        "time that a lost servo bus is waited for, to take the torque off",
        ge=0,
        le=600,
    )
    stand: float = number(
        0.3,
        "s",
        "assumed: a step at half a hertz comes to rest",
        "time that the robot holds its command before the torque goes off",
        ge=0,
        le=60,
    )
    swapped: float = number(
        1.5,
        "s",
        "assumed: half of the wait for a greeting, and no servo speaks unasked",
        "silence of the board, while the bus speaks unasked, that shows the two ports swapped",
        gt=0,
        le=60,
    )

    @field_validator("controller")
    @classmethod
    def _known(cls, name: str) -> str:
        return CONTROLLERS.check(name)
