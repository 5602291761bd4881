"""A controller whose goals come from another program, under the same supervisor.

It says FORWARD, whichever way goals lead. It holds where a reading cannot be used, as other
controllers do, and when no goals have come for a while. Before the first ones it stands as the gait
begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from antennate.control.gait import Gait
from antennate.control.rule_controller import RuleController
from antennate.hardware.driving.teleop import KeyRule
from antennate.params.control import ControlParams
from antennate.params.hardware import GoalsParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, Maneuver


class GoalMoves:
    """Joint targets that are the goals; HOLD keeps the last ones that were walked.

    Args:
        control: Numbers of the control, whose gait stands at first.
        robot: The robot.

    Attributes:
        phase: Gait phase, which is not known, shape (1,).
        newest: The newest goals in the order of the robot's joints [rad], None before the first.
    """

    def __init__(self, control: ControlParams, robot: RobotSpec) -> None:
        self._shapes = robot.command_shapes()
        stand = Gait(control.gait, robot, 1, control.period)
        self._command = stand.step(np.full(1, int(Maneuver.HOLD)))
        self.phase: Floats = np.full(1, math.nan)
        self.newest: Sequence[float] | None = None

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Do nothing: goals say where each joint is to be."""

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """The targets, shape (1,)."""
        if self.newest is not None and maneuver[0] != Maneuver.HOLD:
            ends = np.cumsum([math.prod(shape) for shape in self._shapes.values()])
            parts = np.split(np.array(self.newest, float), ends[:-1])
            named = zip(self._shapes.items(), parts, strict=True)
            self._command = JointCommand(**{n: part.reshape(shape) for (n, shape), part in named})
        return self._command


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
        self._by_goals, self._moves = KeyRule(control), GoalMoves(control, robot)
        super().__init__(self._by_goals, control, robot, 1, self._moves)
        self._params, self._goals, self._clock = params, goals, clock
        self._came = -math.inf

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame."""
        now = self._clock()
        if (found := self._goals()) is not None:
            self._moves.newest, age = found
            self._came = now - age
        fresh = now - self._came <= self._params.release
        self._by_goals.wanted = Maneuver.FORWARD if fresh else Maneuver.HOLD
        return super().step(frame)
