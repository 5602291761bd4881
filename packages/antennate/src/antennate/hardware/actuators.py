"""What moves the joints of one robot, whatever bus they are on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

from antennate.errors import AntennateError
from antennate.hardware.safety.controller import Tracebacks
from antennate.robots.spec import RobotSpec
from antennate.types import JointCommand
from dynamixel_bus.bus import Tally


class ActuatorError(AntennateError):
    """Actuators are not fit to be moved, or did not do what they were told; says which and why."""


@dataclass(slots=True)
class JointFaults:
    """What joints do wrong since torque came on, in words by the id of their servo.

    Attributes:
        behind: Joints that do not follow their goals.
        outside: Joints that are beyond their limits.
        leaps: Joints that have moved faster than they can.
    """

    behind: dict[int, str] = field(default_factory=dict[int, str])
    outside: dict[int, str] = field(default_factory=dict[int, str])
    leaps: dict[int, str] = field(default_factory=dict[int, str])


@dataclass(slots=True)
class Margins:
    """How near joints have come to each bound in a drive, as a share of it.

    Attributes:
        behind: Time in a row for which a joint that is behind drove too little.
        stuck: Time of moving goals for which a joint that is behind did not move.
        outside: The same for a joint beyond its limit and the error of full drive.
        speed: Way of a joint from one reading to the next.
    """

    behind: float = 0.0
    stuck: float = 0.0
    outside: float = 0.0
    speed: float = 0.0


@dataclass(kw_only=True)
class ActuatorState:
    """What is known of the actuators; ids are those of the robot's description.

    What the supervisor decides on has no default: what a bus cannot tell has to be said.

    Attributes:
        missed: Answers missed in a row, by id.
        errors: Hardware errors in words, by id.
        watchdogs: Ids stopped by their watchdog.
        disarmed: Ids that have lost their torque or their watchdog while they were to have it.
        modes: Wrong operating modes in words, by id.
        joints: What joints do wrong.
        margins: How near they have come to that.
        supply: Voltage [V], NaN if it is not known.
        angles: Measured joint angles [rad] in the order of the robot's joints, NaN for one that did
            not answer in the last `look`; empty if they are not read.
        bus_error: What is wrong with the bus as a whole, empty if nothing is.
        tracebacks: Of errors that nobody expected while torque was taken off.
    """

    missed: dict[int, int]
    errors: dict[int, str]
    watchdogs: tuple[int, ...]
    disarmed: tuple[int, ...]
    modes: dict[int, str]
    joints: JointFaults
    supply: float
    bus_error: str
    margins: Margins = field(default_factory=Margins)
    angles: tuple[float, ...] = ()
    tracebacks: Tracebacks = field(default_factory=Tracebacks)

    def silent(self, missed: int) -> bool:
        """Whether none has answered so many times, or the bus is gone."""
        return bool(self.bus_error) or min(self.missed.values(), default=0) >= missed


class Actuators(Protocol):
    """The actuators of one robot.

    Calls raise PortError if the bus is gone, and ActuatorError if an actuator does not obey. Only
    `look` and `disable` without `again` never raise.

    Attributes:
        left_on: Ids that were told to let go and did not confirm it.
    """

    left_on: list[int]

    @property
    def robot(self) -> RobotSpec:
        """The robot whose joints they move."""
        ...

    @property
    def state(self) -> ActuatorState:
        """What is known of them, as of the last `look`."""
        ...

    @property
    def tally(self) -> Tally:
        """What became of their answers."""
        ...

    @property
    def enabled(self) -> bool:
        """Whether they were given torque, and were not told since to let go."""
        ...

    @property
    def resting(self) -> bool:
        """Whether the robot has to stand still for them for a while."""
        ...

    def check(self, command: JointCommand) -> JointCommand:
        """A copy of a command of one robot, which may have been anything."""
        ...

    def enable(self, command: JointCommand) -> None:
        """Torque on, every joint where it stands, or for none; `command` is what will follow."""
        ...

    def disable(self, again: bool = False) -> list[int]:
        """Torque off, whatever the bus does: ids that did not confirm it.

        With `again` one short try at those that did not confirm it before.
        """
        ...

    def command(self, command: JointCommand | None, time: float = math.inf) -> int:
        """Move goals towards a command [rad], as far as joints may go in a time [s].

        Without a command the goals are sent again as they are. Returns how many joints the time
        was too short for.
        """
        ...

    def away(self, command: JointCommand, time: float) -> int:
        """Number of joints that a time [s] is too short for, on their way to a command [rad]."""
        ...

    def maintain(self, may_begin: bool) -> None:
        """Upkeep of one tick, as clearing leg turns; it may begin only while the robot walks."""
        ...

    def look(self) -> None:
        """Bring `state` up to date; a bus that fails is noted there."""
        ...
