"""What a drive is told: the robot, its controller, and how long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import field_validator, model_validator

from antennate.control.readers import UNDRIVEN, unread_by_all, unused
from antennate.control.registry import BUILT_IN, check_for_robots
from antennate.hardware.robot import RobotConfig
from antennate.hardware.safety import deadlines
from antennate.params.base import number
from antennate.params.hardware import DeadManParams
from antennate.params.safety import DriftParams, TouchCheckParams


class DriveConfig(RobotConfig):
    """The robot, its controller, and how long it runs."""

    unread: ClassVar[tuple[str, ...]] = UNDRIVEN

    controller: str = number("closed", "1", "assumed: our best", examples=[*BUILT_IN])
    """Open, timed, paper, closed, closed-1, schedule, zigzag, random, or MODULE:NAME or
    FILE.py:NAME of your own."""
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
        return self.controller

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what its controller does not read."""
        return unused(self.robot) | unread_by_all([self.reader], self.control, self.robot)
