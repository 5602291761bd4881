"""A world that measures the work of its servos."""

from __future__ import annotations

import numpy as np

from antennate.sim.world import World


class MeteredWorld(World):
    """A world that adds up what its servos do.

    Attributes:
        work: Positive mechanical work of all servos so far [J].
    """

    work = 0.0

    def advance(self, count: int) -> None:
        """Advance by `count` physics steps; every one of them counts with its own power."""
        for _ in range(count):
            super().advance(1)
            self.work += self._positive_power() * self.model.opt.timestep

    def _positive_power(self) -> float:
        """Summed power of the servos that push, as the last step began [W].

        Torque falls with speed by the damping of the joint.
        """
        model, data = self.model, self.data
        slope = model.dof_damping[model.jnt_dofadr[model.actuator_trnid[:, 0]]]
        speed = data.actuator_velocity
        return float(np.maximum((data.actuator_force - slope * speed) * speed, 0.0).sum())
