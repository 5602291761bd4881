"""Hook by which a robot hangs: a spring that holds its middle link level."""

from __future__ import annotations

import math

import numpy as np

from antennate.params.scene import HookParams
from antennate.sim.engine import mujoco
from antennate.sim.world import World

_BODY = mujoco.mjtObj.mjOBJ_XBODY


class Hook:
    """Spring and damper between the middle link and the place where it was taken hold of.

    It works with plain numbers, which for one body is several times faster than with arrays.

    Args:
        world: The world; `pull` sets an external force of it before a physics step.
        params: Stiffness and damping.
    """

    def __init__(self, world: World, params: HookParams) -> None:
        self._world, self._params = world, params
        self._body = int(world.places.links[world.robot.links // 2])
        self._place, self._ahead = [0.0, 0.0, 0.0], [1.0, 0.0]
        self._speed = np.zeros(6)

    def grasp(self) -> None:
        """Take hold of the link where it is; it is to be level, with its heading of now."""
        data = self._world.data
        self._place = data.xpos[self._body].tolist()
        x, y = data.xmat[self._body, [0, 3]].tolist()
        self._ahead = [x / math.hypot(x, y), y / math.hypot(x, y)]

    def pull(self, height: float = 0.0) -> None:
        """Set the force of a physics step, the hook raised by a height [m]."""
        data, body, params = self._world.data, self._body, self._params
        mujoco.mj_objectVelocity(self._world.model, data, _BODY, body, self._speed, 0)
        turn_x, turn_y, turn_z, vx, vy, vz = self._speed.tolist()
        x, y, z = data.xpos[body].tolist()
        to_x, to_y, to_z = self._place
        fx = params.stiffness * (to_x - x) - params.damping * vx
        fy = params.stiffness * (to_y - y) - params.damping * vy
        fz = params.stiffness * (to_z + height - z) - params.damping * vz
        xx, xy, xz, yx, yy, yz, zx, zy, _ = data.xmat[body].tolist()
        c, s = self._ahead
        half, slow = 0.5 * params.twist_stiffness, params.twist_damping
        mx, my, mz = data.xipos[body].tolist()
        ax, ay, az = x - mx, y - my, z - mz
        data.xfrc_applied[body] = (
            fx,
            fy,
            fz,
            half * (yz - s * zx - c * zy) - slow * turn_x + ay * fz - az * fy,
            half * (c * zx - s * zy - xz) - slow * turn_y + az * fx - ax * fz,
            half * (s * xx + c * xy - c * yx + s * yy) - slow * turn_z + ax * fy - ay * fx,
        )
