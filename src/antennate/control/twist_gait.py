"""A gait that is told where to go: forward speed and curvature in place of a maneuver.

Every tick the wave moves towards that of the twist map, no faster than its rates, so that no joint
target jumps when what is wanted does.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from antennate.control.gait import targets
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats, Ints, JointCommand

if TYPE_CHECKING:
    from geometric_locomotion.twist import TwistMap

AMPLITUDE_RATE = 0.5
"""Largest change of the amplitude [rad/s]; a second from legs alone to the largest wave."""
LEAD_RATE = 1.0
"""Largest change of the lead [rad/s]."""


class TwistGait:
    """Gaits of B robots that follow forward speeds and curvatures.

    Args:
        params: Frequency, rate of the offset, and antennae; the map gives the wave.
        robot: The robot that walks, with rolling legs.
        batch: Number of robots B.
        period: Control period [s].
        twists: The twist map of this robot at this frequency.

    Attributes:
        phase: Gait phase [rad], shape (B,).
        wave: Amplitude, lead and offset of the wave as it is now [rad], shape (B, 3).
    """

    def __init__(
        self, params: GaitParams, robot: RobotSpec, batch: int, period: float, twists: TwistMap
    ) -> None:
        self._robot, self._twists = robot, twists
        self._legs = params.model_copy(update={"wave_number": twists.wave_number, "amplitude": 0.0})
        self._advance = 2.0 * math.pi * params.frequency * period
        self._most = period * np.array([AMPLITUDE_RATE, LEAD_RATE, params.offset_rate])
        self._joint = 2.0 * math.pi * twists.wave_number * np.arange(1, robot.links)
        self._joint /= robot.yaw_count
        self.phase: Floats = np.zeros(batch)
        self.wave: Floats = np.tile([0.0, float(twists.lead[0]), 0.0], (batch, 1))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at a phase [rad], straight and without a wave."""
        self.phase[rows] = phase
        self.wave[rows] = 0.0, float(self._twists.lead[0]), 0.0

    def step(self, speed: Floats, curvature: Floats) -> JointCommand:
        """Advance one control period and return the targets.

        Args:
            speed: Forward speed [m/s], shape (B,); what the map does not reach is the nearest.
            curvature: Curvature [1/m], shape (B,), positive to the left.
        """
        wanted = [self._twists.gait(*pair) for pair in zip(speed, curvature, strict=True)]
        goal = np.array([(gait.amplitude, gait.lead, gait.offset) for gait in wanted])
        self.wave += np.clip(goal - self.wave, -self._most, self._most)
        self.phase += self._advance
        amplitude, lead, offset = self.wave.T[:, :, None]
        yaw = amplitude * np.sin(self._joint + lead - self.phase[:, None]) + offset
        limit = self._robot.yaw_limit
        command = targets(self._legs, self._robot, self.phase, self.wave[:, 2])
        return replace(command, yaw=np.clip(yaw, -limit, limit))
