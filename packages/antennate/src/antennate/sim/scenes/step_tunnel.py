"""The tunnel with a step in it: from somewhere in the first piece on, everything stands higher."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from antennate.params.scene import GroundParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import FLOOR_BIT, GROUND_BIT, GROUND_FRICTION, OBSTACLE_BIT
from antennate.sim.scenes.ground import Edge
from antennate.sim.scenes.tunnel import Tunnel, TunnelScene
from antennate.types import Bools, Floats

FROM_START = (0.4, 0.6)
"""Distance of the step from the head at the start, nearest and farthest [m] (assumed: the antennae
do not touch it yet; the first piece is 1 m long)."""
CLEAR = 0.3
"""No strewn cylinder stands nearer to the step than this [m] (assumed: room to climb)."""
_SIZE = 10.0
"""Extent of the higher ground [m]: more than any tunnel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepTunnel(Tunnel):
    """One drawn tunnel with a step across its first piece.

    Attributes:
        step: Where the step is along x [m].
        rise: Its height [m]; walls are as much higher.
        ground: Height of the ground at the start [m].
    """

    step: float
    rise: float
    ground: float = 0.0

    @property
    def edges(self) -> tuple[Edge, ...]:
        """The step."""
        return (Edge(self.step, self.rise),)

    @property
    def top(self) -> float:
        """Height of the highest ground [m]."""
        return self.rise

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add the tunnel, and raise what is behind the step."""
        super(StepTunnel, self).build(spec)
        for geom in spec.worldbody.geoms:
            if geom.name.startswith("wall"):
                geom.size[2] += self.rise / 2
                geom.pos[2] += self.rise / 2
        spec.worldbody.add_geom(
            name="step",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[self.step + _SIZE, 0.0, self.rise / 2],
            size=[_SIZE, _SIZE, self.rise / 2],
            friction=[GROUND_FRICTION, 0, 0],
            contype=FLOOR_BIT | GROUND_BIT,
            conaffinity=OBSTACLE_BIT,
        )
        for i, (x, _) in enumerate(self.cylinders.tolist()):
            if x > self.step:
                spec.body(f"cylinder{i}").pos[2] = self.rise


class StepTunnelScene:
    """Draws tunnels with a step: the default tunnel, whose first piece goes up.

    Args:
        params: Sizes of the step; its height is read.
    """

    random = True

    def __init__(self, params: GroundParams | None = None) -> None:
        self._rise = (params or GroundParams()).height
        self._tunnel = TunnelParams()
        self._plain = TunnelScene(self._tunnel)

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> StepTunnel:
        """Draw one tunnel, and where the step is."""
        step = float(rng.uniform(*FROM_START))
        drawn = self._plain.draw(robot, rng)
        stays = ~self._in_the_way(drawn.cylinders, step)
        values = {field.name: getattr(drawn, field.name) for field in fields(drawn)}
        values["cylinders"] = drawn.cylinders[stays]
        return StepTunnel(**values, step=step, rise=self._rise)

    def _in_the_way(self, cylinders: Floats, step: float) -> Bools:
        """Cylinders on the edge, and strewn ones near it, shape (n,)."""
        off, radius = abs(cylinders[:, 0] - step), self._tunnel.cylinder.radius
        strewn = abs(cylinders[:, 1]) < self._tunnel.free_width / 2
        return (off < radius) | (strewn & (off < CLEAR))


SCENES = {"step_tunnel": StepTunnelScene}
"""Scenes of this module by name."""
