"""Benches on a device: each an antenna on a carriage before obstacles, as `Bench` is."""

from __future__ import annotations

import numpy as np

from antennate.errors import SimulationError
from antennate.sim import layers
from antennate.sim.bench import Bench, broken
from antennate.sim.engine import mujoco
from antennate.sim.warp.worlds import Limits, WarpWorlds
from antennate.types import Floats, Ints


class WarpBenches(WarpWorlds):
    """B benches, one after the other put into rows, and then stepped at once.

    Args:
        first: A bench whose structure all have.
        batch: Number of rows B.
        limits: Sizes on the device.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.

    Attributes:
        failures: What ended simulations, by row.

    Raises:
        ConfigError: There is no such device, or Warp cannot hold that model.
        MissingPackageError: Warp is not installed.
    """

    def __init__(self, first: Bench, batch: int, limits: Limits, device: str | None = None) -> None:
        self._order, self._servos = first.order, first.servos
        self._controls: Floats = np.zeros((batch, first.model.nu))
        self._steps = 0
        self.failures = dict[int, SimulationError]()
        super().__init__(first.model, batch, limits, device)

    def _make(self, model: mujoco.MjModel) -> None:
        super()._make(model)
        self._antenna = self._ints(model.geom_contype == layers.ANTENNA)
        self._force = self._wp.zeros((self._batch, 2), dtype=float)
        self._touches = self._wp.zeros(self._batch, dtype=int)

    def drive(self, commands: Floats, steps: int) -> None:
        """Follow a command each for some physics steps.

        Args:
            commands: Target of the carriage [m], its speed there [m/s], and angle of the base
                [rad], shape (B, 5).
            steps: How many.
        """
        self._controls[:, self._servos] = commands
        self.command(self._controls)
        self.step(steps)
        self._steps += steps

    def seen(self, rows: Ints) -> tuple[Floats, Floats, Ints]:
        """Where some rows are: states as `Motion` has them, forces [N], and how many press.

        A row whose state is beyond all bounds, or which has lost contacts, is in `failures`.
        """
        from antennate.sim.warp.kernels import plane_forces

        positions, speeds = self.state()
        bent = positions[:, self._order[3:]]
        for row in rows.tolist():
            if trouble := broken(bent[row], speeds[row]):
                self._fail(row, trouble)
        for row, lost in self.overflows().items():
            self._fail(row, lost)
        data, contact = self._data, self._data.contact
        with self._wp.ScopedDevice(self._device):
            self._force.zero_()
            self._touches.zero_()
            self._wp.launch(
                plane_forces,
                dim=data.naconmax,
                inputs=[
                    *(data.nacon, contact.worldid, contact.geom, contact.frame),
                    *(contact.efc_address, data.efc.force, self._antenna),
                ],
                outputs=[self._force, self._touches],
            )
        states = np.zeros((len(rows), len(self._order) + 2))
        states[:, :-2] = positions[rows][:, self._order]
        states[:, 2:-2] = np.cumsum(states[:, 2:-2], axis=1)
        return states, self._force.numpy()[rows].astype(float), self._touches.numpy()[rows]

    def _fail(self, row: int, reason: str) -> None:
        self.failures.setdefault(row, SimulationError(self._steps, reason))
