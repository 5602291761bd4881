"""A controller under supervision: its exceptions become causes, and its time can be stopped.

A failing one floods nothing, and its exceptions may themselves be broken.
"""

from __future__ import annotations

import math
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from antennate.control.decision import Decision, decision_of, no_command
from antennate.errors import in_one_line, reason
from antennate.hardware.joints import CommandError
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Controller, JointCommand, Maneuver

EVERY = 1.0
"""Shortest time between two tracebacks that are kept [s], so that one a tick floods nothing
(assumed)."""
_KEPT = 16
_LONGEST_TEXT = 20_000
"""Characters of a traceback; an exception may quote anything."""


class Tracebacks:
    """The newest tracebacks, at most one a second.

    Attributes:
        kept: Their texts, oldest first.
        left_out: Failures whose traceback was not kept.
    """

    def __init__(self) -> None:
        self.kept: deque[str] = deque(maxlen=_KEPT)
        self.left_out = 0
        self._last = -math.inf

    def keep(self, now: float, error: BaseException) -> None:
        """Keep that of an error at a time [s], unless there was one just now."""
        if now - self._last < EVERY:
            self.left_out += 1
            return
        self._last = now
        try:
            text = "".join(traceback.format_exception(error))
        except KeyboardInterrupt:
            raise
        except BaseException:  # noqa: BLE001 it asks the error for its notes, which may raise too
            text = in_one_line(error)
        self.kept.append(text[-_LONGEST_TEXT:])


@dataclass(slots=True)
class StepResult:
    """The result of a controller's step in one tick.

    Attributes:
        asked: Whether it was asked at all.
        decided_at: When its step ended [s], -inf if it failed.
        bad_command: Why its command cannot be used, empty if it can.
        failure: The exception that it raised, empty if it raised none.
    """

    asked: bool = True
    decided_at: float = -math.inf
    bad_command: str = ""
    failure: str = ""


class SupervisedController:
    """Asks a controller for a command, and keeps what the supervisor has to know about it.

    While the robot stands still for its actuators, the controller is not asked and its time stands
    still. At a `rate` below 1 it is left out in single ticks, but never in the one after a failure.

    Args:
        controller: Any controller, made for one robot.
        robot: That robot.
        check: Returns a copy of a command that can be sent; otherwise raises CommandError.
        now: The host's time [s].

    Attributes:
        standing: Whether the robot has to stand still.
        rate: How fast the controller's time goes, 1 as the clock.
        command: Its last command.
        decision: Its decision in the last step that did not fail.
        result: The result of the last tick.
        sound: Whether the last command asked for could be sent.
        refused: Commands that could not be sent.
        tracebacks: Of its failures.
    """

    def __init__(
        self,
        controller: Controller,
        robot: RobotSpec,
        check: Callable[[JointCommand], JointCommand],
        now: Callable[[], float],
    ) -> None:
        self.controller, self.robot = controller, robot
        self.standing, self.rate = False, 1.0
        self.command = no_command(self.robot)
        self.decision = Decision()
        self.result = StepResult()
        self.refused = 0
        self.tracebacks = Tracebacks()
        self.now, self._check = now, check
        self._sound_command: JointCommand | None = None
        self.sound = False
        self._owed = self._seen = self._stood = 0.0

    def time(self, t: float) -> float:
        """The controller's time [s] at the time t [s] of a reading; call once a tick."""
        if self.standing or self.rate < 1.0:
            self._stood += (t - self._seen) * (1.0 if self.standing else 1.0 - self.rate)
        self._seen = t
        return t - self._stood

    def step(self, frame: AntennaFrame) -> JointCommand:
        """The command of this tick; of one that failed, NaN for every joint."""
        self.command = self._step(frame)
        return self.command

    def hold(self) -> None:
        """Decide to stand still, without asking the controller."""
        self.result = StepResult(asked=False, decided_at=self.now())

    def _step(self, frame: AntennaFrame) -> JointCommand:
        due = self._due() or not self.sound
        result = self.result = StepResult()
        if self._sound_command is not None and (self.standing or not due):
            self.hold()
            return self._sound_command
        self.sound = False
        try:
            command = self.controller.step(frame.copy())  # which it may change
            self.decision = decision_of(self.controller)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 a plugged-in controller may raise anything
            result.failure = in_one_line(error)
            self.tracebacks.keep(self.now(), error)
            return no_command(self.robot)
        result.decided_at = self.now()
        try:
            command = self._sound_command = self._check(command)
        except CommandError as error:
            result.bad_command = reason(error)
            self.refused += 1
        else:
            self.sound = self.decision.maneuver in set(Maneuver)
        return command

    def _due(self) -> bool:
        """Whether a period of the controller's own time has passed; call once a tick."""
        self._owed += self.rate
        if self._owed < 1.0:
            return False
        self._owed -= 1.0
        return True
