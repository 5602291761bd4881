"""The observation of a policy, built tick by tick from what a robot has."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from antennate.control.conditioning import RunningMean, curves, level_and_fraction
from antennate.control.policy.interface import PolicyInterface, bounds, channels, observations
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, joint_angles

Vector = NDArray[np.float32]


class GaitState(Protocol):
    """What a robot knows of its own gait: rows of what it commanded last."""

    phase: Floats
    pace: Floats
    offset: Floats
    amplitude: Floats

    def goals(self) -> Floats | None:
        """Goals of all joints as a policy is given them, shape (B, n); None if it is not."""
        ...


def wrapped(angle: Floats) -> Floats:
    """An angle [rad] within half a turn either way, same shape."""
    return np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi


class Observer:
    """Observations of B robots. A reading that cannot be used counts as that of a free antenna.

    Args:
        interface: What a policy is given.
        control: Curves, averaging time and rate.
        robot: The robot.
        batch: Number of robots B.

    Attributes:
        unknown: Rows whose newest readings cannot be used, shape (B,); they hold.
        mean: Mean readings over T_avg [counts], shape (B, 2); NaN where they cannot be used.
        size: Numbers of an observation n.
    """

    def __init__(
        self, interface: PolicyInterface, control: ControlParams, robot: RobotSpec, batch: int
    ) -> None:
        self._interface, self._curves = interface, curves(control)
        self._average = RunningMean(control.conditioning, batch, control.period)
        each = channels(interface, robot)
        self._scale = np.array([c.scale for c in each])
        self._low, self._high = bounds(each)
        self._past: Floats = np.zeros((batch, len(each), interface.history))
        self._memory: Floats = np.zeros((batch, len(each)))
        decision = interface.ticks * control.period
        self._pace = -math.expm1(-decision / interface.memory_time)
        quantities = observations(interface, control, robot)
        self.size = len(quantities)
        self._bounds = tuple(b.astype(np.float32) for b in bounds(quantities))
        self._bend = np.asarray(self._curves.polarity) * np.ones(2)
        self._free = np.tile(self._felt(np.full((1, 2), np.nan))[0], 2) / self._scale[:4]
        self._most: Floats = np.full((batch, 2), np.nan)
        self._joints, self._parts = len(robot.joint_names), tuple(robot.command_shapes())
        self._goals: Floats = np.full((batch, self._joints), np.nan)
        self._angles: Floats = np.full((batch, self._joints), np.nan)
        self._lag: Floats = np.zeros((batch, self._joints))
        self.unknown: Bools = np.zeros(batch, dtype=bool)
        self.mean: Floats = np.zeros((batch, 2))

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows that have felt nothing yet and stood still."""
        self._average.reset(rows)
        self._past[rows] = 0.0
        self._past[rows, : len(self._free)] = self._free[:, None]
        self._memory[rows] = self._past[rows, :, 0]
        self._most[rows] = np.nan
        self._goals[rows], self._lag[rows] = np.nan, 0.0
        self.unknown[rows] = False

    def told(self, command: JointCommand) -> None:
        """Take the command of a tick, before the frame that shows what came of it."""
        if self._interface.servos:
            self._goals = joint_angles(command, self._parts, len(self.mean))

    def feel(self, frame: AntennaFrame, rows: Bools | None = None) -> None:
        """Take the frame of one tick.

        Args:
            frame: What was read.
            rows: Rows that begin with this frame, where the others had theirs, shape (B,).
        """
        counts = frame.counts
        if self._interface.servos and frame.positions.shape == self._angles.shape:
            angles = frame.positions
            self._angles = angles if rows is None else np.where(rows[:, None], angles, self._angles)
        mean = self._average.step(counts) if rows is None else self._average.begin(counts, rows)
        self.mean = mean if rows is None else np.where(rows[:, None], mean, self.mean)
        most = np.fmax(self._most, self.mean * self._bend)
        self._most = most if rows is None else np.where(rows[:, None], most, self._most)
        self.unknown = np.isnan(self.mean[:, 0] + self.mean[:, 1])

    def look(self, state: GaitState, rows: Bools | None = None) -> Vector:
        """Sample all channels; the observations, shape (B, n). Rows not meant do not go on."""
        sample = self._sample(state)
        past, memory, lag = self._past.copy(), self._memory.copy(), self._lag.copy()
        past[:, :, 1:] = self._past[:, :, :-1]
        past[:, :, 0] = sample
        memory += self._pace * (sample - memory)
        behind = np.zeros_like(lag)
        if self._interface.servos:
            behind = np.nan_to_num(wrapped(self._angles - self._goals))
            lag += self._pace * (behind - lag)
        most = np.full_like(self._most, np.nan)
        if rows is not None:
            past[~rows], memory[~rows] = self._past[~rows], self._memory[~rows]
            most[~rows], lag[~rows] = self._most[~rows], self._lag[~rows]
        self._past, self._memory, self._most, self._lag = past, memory, most, lag
        phase = np.stack([np.sin(state.phase), np.cos(state.phase)], axis=1)
        parts = [past.reshape(len(past), -1), memory, phase]
        if (goals := state.goals()) is not None:
            parts.append(goals)
        if self._interface.servos:
            parts += [behind, lag]
        vector = np.concatenate(parts, axis=1).astype(np.float32)
        return np.clip(vector, *self._bounds)

    def _sample(self, state: GaitState) -> Floats:
        """All channels now, scaled and clipped, shape (B, C)."""
        gait = [state.pace, state.offset]
        if self._interface.action == "gait":
            gait.append(state.amplitude)
        felt = [self._felt(self.mean), self._felt(self._most * self._bend)]
        sample = np.concatenate([*felt, np.stack(gait, axis=1)], axis=1) / self._scale
        return np.clip(sample, self._low, self._high)

    def _felt(self, mean: Floats) -> Floats:
        """What is given of mean readings (B, 2); of NaN what a free antenna gives."""
        if self._interface.felt == "counts":
            return np.where(np.isnan(mean), self._straight(), mean)
        level, flex = level_and_fraction(
            self._curves, np.where(np.isnan(mean), self._straight(), mean)
        )
        return flex if self._interface.felt == "flex" else level

    def _straight(self) -> Floats:
        """Readings of straight antennae by the curves of the control [counts], shape (2,)."""
        c = self._curves
        return np.where(np.asarray(c.polarity) > 0, c.counts_low, c.counts_high) * np.ones(2)
