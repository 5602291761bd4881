"""A controller whose goals come from another program, under the same supervisor.

It says FORWARD, whichever way goals lead. It holds where a reading cannot be used, as other
controllers do, and when no goals have come for a while. Before the first ones it stands as the gait
begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from antennate.control.rule_controller import RuleController
from antennate.hardware.driving.teleop import KeyRule
from antennate.params.control import ControlParams
from antennate.params.hardware import GoalsParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Floats, JointCommand, Maneuver, joint_command


class GoalController(RuleController):
    """The controller of one robot by goals of its joints.

    Args:
        control: Numbers of the control.
        robot: The robot.
        params: How long goals last.
        goals: The newest goals since the last call, in the order of the robot's joints [rad], and
            their age [s]; None without any.
        clock: The host's time [s].
    """

    def __init__(
        self,
        control: ControlParams,
        robot: RobotSpec,
        params: GoalsParams,
        goals: Callable[[], tuple[Sequence[float], float] | None],
        clock: Callable[[], float],
    ) -> None:
        self._by_goals = KeyRule(control)
        super().__init__(self._by_goals, control, robot, 1)
        self._params, self._goals, self._clock = params, goals, clock
        self._shapes, self._came = robot.command_shapes(), -math.inf
        self._newest: Sequence[float] | None = None
        self._command: JointCommand | None = None

    @property
    def phase(self) -> Floats:
        """Gait phase: none is known."""
        return np.full(1, math.nan)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame; HOLD keeps the last goals walked."""
        now = self._clock()
        if (found := self._goals()) is not None:
            self._newest, age = found
            self._came = now - age
        fresh = now - self._came <= self._params.release
        self._by_goals.wanted = Maneuver.FORWARD if fresh else Maneuver.HOLD
        stand = super().step(frame)
        if self._newest is not None and self.maneuver[0] != Maneuver.HOLD:
            self._command = joint_command(np.array(self._newest, float), self._shapes)
        self._command = self._command or stand
        return self._command
