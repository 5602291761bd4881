"""`geometric` told the side on which the way goes on, as a sense of a given AUC would tell it.

    antennate compete --controllers docs/science/told.py:told_77

A score is normal about d/2 on the side on which the way goes on, d = √2 Φ⁻¹(AUC); its sign is told,
so the right side with the probability Φ(d/2) (docs/science/sides.md). Each decision to turn has an
error of its own. Where the way goes straight on neither side is right: a coin is tossed. A
trial's chance follows from its first readings.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from scipy.special import ndtri

from antennate.control.knowledge import Knowledge
from antennate.control.registry import make_controller
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, Maneuver


class Told:
    """A search that is told a side with errors.

    Args:
        auc: AUC of the score that tells it.
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
    """

    knows = needs = ("side",)

    def __init__(self, auc: float, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        self._made: Any = make_controller("geometric", control, robot, batch)
        self._half = math.sqrt(0.5) * float(ndtri(auc))
        self._chance: dict[int, np.random.Generator] = {}
        self._error, self._coin = np.zeros(batch), np.ones(batch)
        self._backed = np.zeros(batch, bool)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._made, name)  # maneuver, contact and level

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew."""
        self._made.reset(rows, phase)
        self._backed[rows] = False
        for row in np.arange(len(self._backed))[rows].tolist():
            self._chance.pop(row, None)

    def know(self, knowledge: Knowledge) -> None:
        """Take the truth, and tell a side."""
        assert knowledge.side is not None
        right = self._half + self._error > 0.0
        told = np.where(right, knowledge.side, -knowledge.side)
        told = np.where(knowledge.side == 0, self._coin, told)
        self._made.know(Knowledge(side=told.astype(int)))

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period; a row that begins to back off has another error."""
        for row in range(len(self._backed)):
            if row not in self._chance:
                first = np.append(frame.counts[row], frame.positions[row]).tobytes()
                self._chance[row] = np.random.default_rng([*first])
        command = self._made.step(frame)
        held = self.maneuver == int(Maneuver.HOLD)
        backs = np.where(held, self._backed, self.maneuver == int(Maneuver.REVERSE))
        for row in np.flatnonzero(backs & ~self._backed).tolist():
            self._error[row], coin = self._chance[row].standard_normal(2)
            self._coin[row] = math.copysign(1.0, coin)
        self._backed = backs
        return command


told_65, told_77 = (partial(Told, auc) for auc in (0.65, 0.77))
"""The best antenna that was found, and the bound of the ten best (docs/science/sides.md)."""
