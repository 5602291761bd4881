"""Curvature of the motion on the torus of body phase and leg phase.

A gait is a loop on the torus: the body phase follows the leg phase with the lead of the gait. Rates
a of the body and b of the legs make the forward velocity F(a, b), which is homogeneous of degree
one as friction does not depend on the rate. Its slopes at (1, 1) are the two coefficients of a
local connection along gaits, F(1, 1) = A_body + A_leg, and by Stokes' theorem what a gait gains
with its lead is the curvature d A_leg / d body - d A_body / d leg along its loop. These are the
height functions of geometric mechanics, with a phase of the legs in place of a second joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from antennate.robots.mechanics import phase_twists
from antennate.robots.spec import RobotSpec
from antennate.types import Floats
from geometric_locomotion.twist import Wave

_NUDGE = 0.05
"""Change of a rate for its slope."""


@dataclass(frozen=True, slots=True)
class Torus:
    """Forward motion over n x n body and leg phases, joints that follow their goals.

    Attributes:
        phase: The phases, of both axes [rad], shape (n,).
        forward: Forward velocity of the middle in a gait [m/rad], shape (n, n), body phase first.
        curvature: Curvature of the connection there [m/rad²], shape (n, n).
    """

    phase: Floats
    forward: Floats
    curvature: Floats

    @classmethod
    def of(cls, robot: RobotSpec, wave: Wave, cells: int) -> Torus:
        """The torus of a body wave on a robot with rolling legs."""
        phase = 2.0 * math.pi * np.arange(cells) / cells
        body, leg = (part.ravel() for part in np.meshgrid(phase, phase, indexing="ij"))

        def forward(body_rate: float, leg_rate: float) -> Floats:
            twists = phase_twists(robot, wave, body, leg, body_rate, leg_rate)
            return twists[:, 0].reshape(cells, cells)

        by_body, by_leg = (
            (
                forward(1.0 + _NUDGE * a, 1.0 + _NUDGE * b)
                - forward(1.0 - _NUDGE * a, 1.0 - _NUDGE * b)
            )
            / (2.0 * _NUDGE)
            for a, b in ((1, 0), (0, 1))
        )
        return cls(phase, by_body + by_leg, _slope(by_leg, 0) - _slope(by_body, 1))

    @property
    def steps(self) -> Floats:
        """Step a cycle of each lead in `phase` [m], shape (n,): forward velocity along its loop."""
        return 2.0 * math.pi * _along(self.forward)

    @property
    def gains(self) -> Floats:
        """What a step gains with the lead, by the curvature along its loop [m/rad], shape (n,)."""
        return -2.0 * math.pi * _along(self.curvature)


def _slope(values: Floats, axis: int) -> Floats:
    """Slope along a periodic axis, by central differences."""
    width = 4.0 * math.pi / values.shape[axis]
    return (np.roll(values, -1, axis) - np.roll(values, 1, axis)) / width


def _along(values: Floats) -> Floats:
    """Mean along each loop body phase = leg phase - lead, shape (n,)."""
    cells = np.arange(len(values))
    return np.array([values[(cells - lead) % len(values), cells].mean() for lead in cells])
