"""Goals of joints that another program sends: only those of this robot are passed on."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

from antennate.errors import BadInputError, LogError
from antennate.messages import one_line, shortened
from antennate.robots.spec import RobotSpec
from antennate.telemetry.topics import JOINT_COMMANDS
from antennate.telemetry.view.channel import GOALS, Channel, read


class GoalTaker:
    """Passes goals of joints on to a drive.

    Args:
        newest: Messages that have come since the last call, oldest first.
        channel: To the drive.
        say: Told why the first message was refused.

    Attributes:
        robot: The robot, None while it is not known.
    """

    def __init__(
        self, newest: Callable[[], Sequence[bytes]], channel: Channel, say: Callable[[str], None]
    ) -> None:
        self._newest, self._channel, self._say = newest, channel, say
        self.robot: RobotSpec | None = None
        self._taken = self._refused = 0

    def look(self) -> None:
        """Pass the newest goals on, if some have come."""
        angles, messages = (), self._newest()
        for message in messages:
            try:
                angles = goals_of(message, self.robot)
                self._taken += 1
            except (BadInputError, LogError) as error:
                if not self._refused:
                    self._say(f"ros: goals were refused: {one_line(str(error))}")
                self._refused += 1
        if messages:
            counts = {"taken": self._taken, "refused": self._refused}
            self._channel.tell(GOALS, **counts, t=time.monotonic(), angles=angles)


class ReceivedGoals:
    """Goals as they come to a drive.

    Args:
        channel: To the process that takes them.

    Attributes:
        counts: Messages with goals for this robot so far, and others.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.counts = {"taken": 0, "refused": 0}

    def newest(self) -> tuple[Sequence[float], float] | None:
        """The newest goals since the last call [rad] and their age [s], None without any."""
        found = None
        for kind, content in self._channel.receive():
            if kind == GOALS:
                goals = read(content)
                self.counts = {name: goals[name] for name in self.counts}
                found = (goals["angles"], goals["t"]) if goals["angles"] else found
        return found and (found[0], time.monotonic() - found[1])


def goals_of(message: bytes, robot: RobotSpec | None) -> tuple[float, ...]:
    """Goals in the order of the robot's joints [rad].

    Args:
        message: Of the type of `/joint_states`: all joints by their names, in any order.
        robot: The robot, None while it is not known.

    Raises:
        BadInputError: They are not of this robot.
        LogError: They are no such message.
    """
    if robot is None:
        raise BadInputError("expected goals once the drive has begun, found some before")
    found = JOINT_COMMANDS.decode(message)
    names, angles = found["name"], found["position"]
    if len(names) != len(angles) or len(names) != len(robot.joint_names):
        raise BadInputError(
            f"expected names and positions of {len(robot.joint_names)} joints, found "
            f"{len(names)} names and {len(angles)} positions"
        )
    goals = dict(zip(names, angles, strict=True))
    if lacking := [name for name in robot.joint_names if name not in goals]:
        other = next((name for name in names if name not in robot.joint_names), names[0])
        raise BadInputError(f"expected a position of {lacking[0]}, found {shortened(other)}")
    for name, limit in zip(robot.joint_names, robot.limits, strict=True):
        if not (math.isfinite(goals[name]) and abs(goals[name]) <= limit):
            within = f"within {limit:.4g} rad" if math.isfinite(limit) else "that is a number"
            raise BadInputError(f"expected a position of {name} {within}, found {goals[name]}")
    return tuple(goals[name] for name in robot.joint_names)
