"""`geometric` told the side on which the way goes on, as a sense of a given AUC would tell it.

    antennate compete --controllers docs/science/told.py:told_77

A score is normal about d/2 on the side on which the way goes on, d = √2 Φ⁻¹(AUC); its sign is told,
so the right side with the probability Φ(d/2) (docs/science/sides.md). Each decision to turn has an
error of its own. Where the way goes straight on neither side is right: a coin is tossed.
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
    """A controller that is told a side with errors.

    A trial's chance follows from its first readings.

    Args:
        made: The controller.
        auc: AUC of the score that tells the side.
        batch: Number of robots B.
    """

    knows = needs = ("side",)

    def __init__(self, made: Any, auc: float, batch: int) -> None:
        self._made, self._half = made, math.sqrt(0.5) * float(ndtri(auc))
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
        self._made.know(Knowledge(side=self.told(knowledge.side)))

    def told(self, side: Ints) -> Ints:
        """What is told: 1 is left, -1 right, shape (B,).

        Args:
            side: The truth; 0 if the way goes straight on.
        """
        right = self._half + self._error > 0.0
        return np.where(side == 0, self._coin, np.where(right, side, -side)).astype(int)

    def drawn(self, row: int) -> tuple[float, float]:
        """Error of a row's score, of the standard normal distribution, and a coin, -1 or 1."""
        error, coin = self._chance[row].standard_normal(2)
        return float(error), math.copysign(1.0, coin)

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
            self._error[row], self._coin[row] = self.drawn(row)
        self._backed = backs
        return command


def geometric(auc: float, control: ControlParams, robot: RobotSpec, batch: int) -> Told:
    """`geometric`, told a side by a sense of an AUC."""
    return Told(make_controller("geometric", control, robot, batch), auc, batch)


told_65, told_77 = (partial(geometric, auc) for auc in (0.65, 0.77))
"""The best antenna that was found, and the bound of the ten best (docs/science/sides.md)."""
