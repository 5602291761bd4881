"""Maneuver and phase to joint targets.

The yaw joints j = 1 .. Y carry the serpenoid wave of the paper,
alpha_j = A sin(2 pi xi j / Y - P + delta) + offset, with P the gait phase: as P grows the crest
travels from head to tail and the robot advances. Leg i of L links turns with P - 2 pi xi i / L, the
right one half a turn later. The lead delta of the body over the legs decides the speed: it is best
where the feet are down on the side towards which the body bends. A lifting leg is in the air while
its own phase, P - begin - lag i, the right one half a turn later, is in the first share of a cycle.

A positive offset bends every joint to the right-hand turn: joint j rotates the rear link against
the front one, so the head points right of the tail.

The antenna bases sweep by themselves, both alike: theta0 + A sin S, with S growing by 2 pi f a
second in every maneuver but HOLD.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from antennate.params.gaits import GaitParams, LiftParams
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats, Ints, JointCommand

DIRECTION = np.array([1.0, 1.0, 1.0, -1.0, 0.0])
"""Sense in which the phase runs in each maneuver: REVERSE runs body and legs backwards."""
STEER = np.array([0.0, -1.0, 1.0, 0.0, 0.0])
"""Sign of the yaw offset in each maneuver."""
_STEERS = np.array([1.0, 1.0, 1.0, 1.0, 0.0])
"""Whether offset and antennae move in each maneuver."""
_SIDES = np.array([0.0, math.pi])


@lru_cache
def _lags(wave_number: float, body_phase: float, links: int) -> tuple[Floats, Floats]:
    """Phase of each yaw joint and lag of each link [rad], shapes (Y,) and (L,)."""
    lag = 2.0 * math.pi * wave_number
    yaws = links - 1
    joints = lag * np.arange(1, yaws + 1) / yaws + body_phase
    return joints, lag * np.arange(links) / links


def _lifting(lift: LiftParams, phase: Floats, links: int) -> Floats:
    """Angles of lifting legs at a gait phase [rad], shape (B, L, 2)."""
    own = phase[:, None] - lift.begin - lift.lag * np.arange(links)
    part = (own[:, :, None] - _SIDES) / (2.0 * math.pi) % 1.0
    return np.where(part < lift.share, lift.lifted, lift.stance)


def targets(
    params: GaitParams,
    robot: RobotSpec,
    phase: Floats,
    offset: Floats,
    sweep: Floats | None = None,
    lifting: bool = True,
    amplitude: Floats | None = None,
) -> JointCommand:
    """Joint targets at a gait phase. Pitch joints and elevations stay at 0.

    Args:
        params: Wave and timing of the gait.
        robot: The robot that walks.
        phase: Gait phase P [rad], shape (B,), unwrapped.
        offset: Yaw offset [rad], shape (B,); positive turns right.
        sweep: Phase S of the antenna bases [rad], shape (B,); 0 if absent.
        lifting: Whether lifting legs step; at 0 all of them stand.
        amplitude: Amplitude of the yaw joints [rad], shape (B,); that of the gait if absent.
    """
    joints, links = _lags(params.wave_number, params.body_phase, robot.links)
    size = params.amplitude if amplitude is None else amplitude[:, None]
    yaw = size * np.sin(joints - phase[:, None]) + offset[:, None]
    largest = robot.yaw_limit
    yaw = np.minimum(np.maximum(yaw, -largest), largest)
    if robot.legs.kind == "rolling":
        leg = (phase[:, None] - links)[:, :, None] + _SIDES
    elif lifting and robot.leg_count:
        leg = _lifting(params.lift, phase, robot.links)
    else:
        leg = np.zeros(robot.command_shapes(phase.shape[0])["leg"])
    antenna = np.full((phase.shape[0], robot.antenna_count), params.antenna_mean)
    if sweep is not None and params.antenna_amplitude:
        antenna += params.antenna_amplitude * np.sin(sweep)[:, None]
    command = JointCommand(yaw=yaw, leg=leg, antenna=antenna)
    vertical = {
        "pitch": np.zeros((len(phase), robot.pitch_count)),
        "elevation": np.zeros((len(phase), robot.elevation_count)),
    }
    parts = {name: angles for name, angles in vertical.items() if angles.shape[1]}
    return replace(command, **parts) if parts else command


class Gait:
    """Phases and offset of the gait. They are continuous when the maneuver changes.

    Args:
        params: Wave and timing.
        robot: The robot that walks; the shapes of all commands follow from it.
        batch: Number of robots B.
        period: Control period [s].
        legs: Whether it moves the legs. False leaves them at 0, for a controller that moves them
            itself and takes the wave of the yaw joints and the antennae alone.

    Attributes:
        phase: Gait phase [rad], shape (B,), unwrapped.
        offset: Yaw offset [rad], shape (B,).
        sweep: Phase of the antenna bases [rad], shape (B,).
        amplitude: Amplitude of the yaw joints [rad], shape (B,); that of the gait if None.
        frequency: Frequency [Hz], of all rows or shape (B,).
    """

    def __init__(
        self, params: GaitParams, robot: RobotSpec, batch: int, period: float, legs: bool = True
    ) -> None:
        self.params, self._legs = params, legs
        self._robot = robot
        self.phase: Floats = np.zeros(batch)
        self.offset: Floats = np.zeros(batch)
        self.sweep: Floats = np.zeros(batch)
        self.amplitude: Floats | None = None
        self.frequency: Floats | float = params.frequency
        self._period = period
        self._slew = params.offset_rate * period
        self._swing = 2.0 * math.pi * params.antenna_frequency * period

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at the given phase [rad], straight, antennae in the middle."""
        self.phase[rows] = phase
        self.sweep[rows] = 0.0
        self.offset[rows] = 0.0

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """Advance one control period and return the targets.

        Args:
            maneuver: One `Maneuver` a row, shape (B,). HOLD keeps the command.
            turn_offset: Yaw offset of the turns [rad], the gait's own if absent.
        """
        size = self.params.turn_offset if turn_offset is None else turn_offset
        return self.steer(maneuver, STEER[maneuver] * size)

    def steer(self, maneuver: Ints, goal: Floats) -> JointCommand:
        """Advance one control period while the offset goes to a goal, and return the targets.

        Args:
            maneuver: One `Maneuver` a row, shape (B,); it decides the sense of the phase alone.
            goal: Yaw offset to go to [rad], positive to the right, shape (B,).
        """
        moves = _STEERS[maneuver]
        change = goal - self.offset
        change = np.minimum(np.maximum(change, -self._slew), self._slew)
        self.offset += change * moves
        self.phase += DIRECTION[maneuver] * (2.0 * math.pi * self.frequency * self._period)
        self.sweep += moves * self._swing
        command = targets(
            self.params,
            self._robot,
            self.phase,
            self.offset,
            self.sweep,
            amplitude=self.amplitude,
        )
        return command if self._legs else replace(command, leg=np.zeros_like(command.leg))
