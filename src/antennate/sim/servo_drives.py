"""How the servos of a world drive their joints: gain and limits, which registers can change."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from antennate.sim.engine import mujoco
from antennate.types import Floats, Ints


class ServoDrives:
    """The actuators of driven joints, at first as the model has them.

    Args:
        model: The compiled model; its actuators are changed.
        names: Names of the actuators.
        stall_torques: Torque of each at full drive [N·m], shape (n,).
    """

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], stall_torques: Floats) -> None:
        self._model, self._stall = model, stall_torques
        self._at: Ints = np.array([model.actuator(name).id for name in names])
        self._stiffness: Floats = model.actuator_gainprm[self._at, 0]
        self._damping: Floats = model.actuator_biasprm[self._at, 2]
        self._range: Floats = model.actuator_forcerange[self._at]
        self._limited = model.actuator_forcelimited[self._at] != 0
        self._now: Floats = np.repeat([[1.0], [0.0], [0.0], [-1.0], [1.0]], len(names), axis=1)

    def set(self, drives: Floats) -> None:
        """Change gain and limits of all of them from now on.

        The drive is `gain` times that of the model, plus `push`, less `brake` times the speed of
        the joint, within `low` and `high`.

        Args:
            drives: Rows gain [1], push [full drives], brake [full drives·s/rad], low and high
                [full drives], shape (5, n). As the model has them: 1, 0, 0, -1, 1.
        """
        if np.array_equal(drives, self._now):
            return
        self._now = drives.copy()
        gain, push, brake, low, high = drives
        model, at = self._model, self._at
        model.actuator_gainprm[at, 0] = gain * self._stiffness
        model.actuator_biasprm[at, 0] = push * self._stall
        model.actuator_biasprm[at, 1] = -gain * self._stiffness
        model.actuator_biasprm[at, 2] = self._damping - brake * self._stall
        narrow = (low > -1.0) | (high < 1.0)
        most = np.where(self._limited, self._range[:, 1], np.inf)
        bounds = np.clip(np.stack([low, high]) * self._stall, -most, most).T
        model.actuator_forcerange[at] = np.where(narrow[:, None], bounds, self._range)
        model.actuator_forcelimited[at] = self._limited | narrow
