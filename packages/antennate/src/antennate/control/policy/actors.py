"""From the answer of a policy to joint targets: a maneuver, a gait or the joints themselves.

An answer that is not a number is HOLD until the next one, and so is a reading that cannot be used.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from antennate.control.gait import DIRECTION, Gait, targets
from antennate.control.policy.interface import CHOICES, LARGEST_FREQUENCY, PolicyInterface, actions
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats, Ints, JointCommand, Maneuver

_HOLD = int(Maneuver.HOLD)
_CHOICES = np.array([int(Maneuver[name]) for name in CHOICES])
_STRAIGHT = 0.1
"""Share of the largest offset up to which a gait is told as FORWARD, not as a turn."""


class Actor(Protocol):
    """Carries out the answers of a policy for B robots.

    Attributes:
        phase: Gait phase [rad], shape (B,).
        pace: Gait cycles a second, negative backwards [Hz], shape (B,).
        offset: Yaw offset, positive to the right [rad], shape (B,).
        amplitude: Amplitude of the body wave [rad], shape (B,).
        maneuver: The `Maneuver` that comes nearest to what is done, shape (B,).
    """

    phase: Floats
    pace: Floats
    offset: Floats
    amplitude: Floats
    maneuver: Ints

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew at a gait phase [rad], straight."""
        ...

    def decide(self, answers: Floats, rows: Bools) -> None:
        """Take the answers for some rows: shape (B, n), of the table of actions."""
        ...

    def step(self, hold: Bools) -> JointCommand:
        """One control period; rows that hold keep their targets."""
        ...

    def goals(self) -> Floats | None:
        """Goals of all joints as a policy is given them, shape (B, n); None if it is not."""
        ...


def make_actor(
    interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
) -> Actor:
    """What carries out the answers of a policy."""
    kinds = {"maneuver": ManeuverActor, "gait": GaitActor, "joints": JointActor}
    return kinds[interface.action](interface, control, robot, batch)


class _GaitRows:
    """What all actors have: the state of a gait in rows, and answers that are not numbers."""

    def __init__(
        self, interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        self._interface, self._control, self._robot = interface, control, robot
        self._answers: Floats = np.zeros((batch, len(actions(interface, robot))))
        self._void: Bools = np.zeros(batch, dtype=bool)
        self.phase: Floats = np.zeros(batch)
        self.pace: Floats = np.zeros(batch)
        self.offset: Floats = np.zeros(batch)
        self.amplitude: Floats = np.full(batch, control.gait.amplitude)
        self.maneuver: Ints = np.full(batch, int(Maneuver.FORWARD))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew at a gait phase [rad], straight, with no answer yet."""
        self._answers[rows], self._void[rows] = 0.0, False
        self.phase[rows] = phase
        self.pace[rows] = self.offset[rows] = 0.0
        self.amplitude[rows] = self._control.gait.amplitude
        self.maneuver[rows] = int(Maneuver.FORWARD)

    def decide(self, answers: Floats, rows: Bools) -> None:
        """Take answers for some rows, shape (B, n); one that is not finite is void."""
        void: Bools = np.logical_not(np.isfinite(answers).all(axis=1))
        self._void = np.where(rows, void, self._void)
        finite = np.where(void[:, None], 0.0, answers)
        self._answers = np.where(rows[:, None], finite, self._answers)

    def goals(self) -> Floats | None:
        """None: only a policy of joints is given their goals."""
        return None

    def _toward(self, name: str, goal: Floats, moves: Bools) -> None:
        """Let offset or amplitude of rows that move go to a goal [rad], as fast as a gait may."""
        slew = self._control.gait.offset_rate * self._control.period
        now: Floats = getattr(self, name)
        setattr(self, name, now + np.clip(goal - now, -slew, slew) * moves)


class ManeuverActor(_GaitRows):
    """One of four maneuvers with the gait of our controllers."""

    def __init__(
        self, interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        super().__init__(interface, control, robot, batch)
        self._gait = Gait(control.gait, robot, batch, control.period)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows and their gait anew at a phase [rad]."""
        super().reset(rows, phase)
        self._gait.reset(rows, phase)

    def step(self, hold: Bools) -> JointCommand:
        """Joint targets of the chosen maneuvers; a row that holds, or has a void answer, stays."""
        chosen = _CHOICES[np.argmax(self._answers, axis=1)]
        self.maneuver = np.where(self._void | hold, _HOLD, chosen)
        command = self._gait.step(self.maneuver, self._interface.turn_offset)
        self.phase, self.offset = self._gait.phase.copy(), self._gait.offset.copy()
        self.pace = DIRECTION[self.maneuver] * self._control.gait.frequency
        return command


class GaitActor(_GaitRows):
    """Amplitude, yaw offset, frequency and direction of the serpenoid gait."""

    def __init__(
        self, interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        super().__init__(interface, control, robot, batch)
        self._sweep: Floats = np.zeros(batch)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew at a gait phase [rad], straight, the antennae in the middle."""
        super().reset(rows, phase)
        self._sweep[rows] = 0.0

    def step(self, hold: Bools) -> JointCommand:
        """Joint targets of the gait asked for; a row that holds, or has a void answer, stays."""
        gait, period = self._control.gait, self._control.period
        amplitude, offset, frequency, direction = np.clip(self._answers, -1.0, 1.0).T
        moves = ~(self._void | hold)
        low, high = self._interface.frequency
        cycles = low + 0.5 * (frequency + 1.0) * (high - low)
        self.pace = np.where(direction < 0.0, -cycles, cycles) * moves
        self._toward("amplitude", 0.5 * (amplitude + 1.0) * self._robot.yaw_limit, moves)
        self._toward("offset", offset * self._interface.turn_offset, moves)
        self.phase = self.phase + 2.0 * math.pi * period * self.pace
        self._sweep = self._sweep + 2.0 * math.pi * period * gait.antenna_frequency * moves
        turn = np.where(offset > 0.0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
        ahead = np.where(np.abs(offset) > _STRAIGHT, turn, int(Maneuver.FORWARD))
        back = np.where(direction < 0.0, int(Maneuver.REVERSE), ahead)
        self.maneuver = np.where(moves, back, _HOLD)
        state = self.phase, self.offset, self._sweep
        return targets(gait, self._robot, *state, amplitude=self.amplitude)


class JointActor(_GaitRows):
    """Goals of all joints; the gait phase runs as a clock."""

    def __init__(
        self, interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        super().__init__(interface, control, robot, batch)
        self._limits = np.array(robot.limits)
        self._turns = np.isinf(self._limits)
        self._most = np.array(robot.fastest) * control.period
        self._turn = 2.0 * math.pi * LARGEST_FREQUENCY * control.period
        self._goals: Floats = np.zeros((batch, len(self._limits)))
        self._parts = robot.command_shapes(batch)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew at a gait phase [rad]; the goals are the pose of the gait."""
        super().reset(rows, phase)
        batch = len(self.phase)
        pose = targets(self._control.gait, self._robot, self.phase, np.zeros(batch), lifting=False)
        parts = [getattr(pose, name).reshape(batch, -1) for name in self._parts]
        self._goals[rows] = np.concatenate(parts, axis=1)[rows]

    def step(self, hold: Bools) -> JointCommand:
        """Joint targets moved by the answers; a row that holds, or has a void answer, stays."""
        answers = np.clip(self._answers, -1.0, 1.0)
        moves = ~(self._void | hold)
        reach = np.where(self._turns, 0.0, self._limits)
        change = np.where(self._turns, answers * self._turn, answers * reach - self._goals)
        change = np.clip(change, -self._most, self._most)
        self._goals = self._goals + change * moves[:, None]
        gait = self._control.gait
        self.pace = gait.frequency * moves.astype(float)
        self.phase = self.phase + 2.0 * math.pi * self._control.period * self.pace
        self.offset = self._goals[:, : self._robot.yaw_count].mean(axis=1)
        self.maneuver = np.where(moves, int(Maneuver.FORWARD), _HOLD)
        sizes = np.cumsum([math.prod(shape[1:]) for shape in self._parts.values()])[:-1]
        parts = zip(self._parts.items(), np.split(self._goals.copy(), sizes, axis=1), strict=True)
        return JointCommand(**{name: part.reshape(shape) for (name, shape), part in parts})

    def goals(self) -> Floats | None:
        """Goals of all joints, shape (B, n); rolling legs have a sine and a cosine."""
        columns = [
            column
            for turns, goal in zip(self._turns.tolist(), self._goals.T, strict=True)
            for column in ((np.sin(goal), np.cos(goal)) if turns else (goal,))
        ]
        return np.stack(columns, axis=1)
