"""Hands and a hook on the twin while its physics runs."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim.engine import mujoco
from antennate.sim.world import PREFIX, World
from antennate.twin.board import Press
from antennate.types import Floats

_PRESSING = 0.05
"""Time constant with which a hand presses [s] (assumed); it lets go at once."""
_LIFT = 0.1
"""Height to which the robot is raised [m]: its legs are free (assumed)."""
_LIFTING = 0.1
"""Speed of raising and lowering it [m/s] (assumed)."""
_HOOK = 3000.0, 40.0
"""Stiffness [N/m] and damping [N·s/m] of the hook: 2 kg give by 7 mm (assumed)."""
_TWIST = 100.0, 0.3
"""Likewise of its turning [N·m/rad, N·m·s/rad] (assumed)."""


class Hands:
    """Hands that press antennae, and a hook that holds the middle link, level, by a spring.

    Args:
        world: The world; its forces are set before each physics step.

    Attributes:
        hanging: Whether the robot is to hang; else it stands, or is lowered to where it stood.
        presses: What presses the left and the right antenna, None for nothing.
    """

    def __init__(self, world: World) -> None:
        self._world, self._forces = world, world.data.xfrc_applied
        self._link = int(world.places.links[world.robot.links // 2])
        self.hanging = False
        self.presses: list[Press | None] = [None, None]
        self._force = [0.0, 0.0]
        self._place: Floats = np.zeros(3)
        self._level: Floats = np.eye(3)
        self._height = 0.0
        world.forces = self._apply

    def clear(self) -> None:
        """Let go of all."""
        self.hanging, self._height, self._force = False, 0.0, [0.0, 0.0]

    def _apply(self) -> None:
        """Set the forces of a physics step."""
        if not (self.hanging or self._height or any(self._force) or any(self.presses)):
            return
        self._forces[:] = 0.0
        for side, press in enumerate(self.presses):
            self._press(side, press)
        if self.hanging or self._height:
            self._hold()

    def _press(self, side: int, press: Press | None) -> None:
        """Press an antenna normal to its link."""
        world, step = self._world, self._world.model.opt.timestep
        goal = 0.0 if press is None else press.force
        self._force[side] += (goal - self._force[side]) * (step / _PRESSING if goal else 1.0)
        if press is None or not goal:
            return
        length = world.robot.antenna.link_length
        link = min(int(press.mark / length), world.robot.antenna.hinges - 1)
        name = f"{PREFIX}{ANTENNA_PREFIXES[side]}{world.robot.antenna.hinge_names[link]}"
        body = int(world.model.body(name).id)
        turn = world.data.xmat[body].reshape(3, 3)
        axis = world.model.jnt_axis[world.model.body_jntadr[body]]
        force = turn @ np.cross(axis, [1.0, 0.0, 0.0]) * self._force[side]
        arm = turn[:, 0] * (press.mark - link * length) + world.data.xpos[body]
        self._forces[body] = [*force, *np.cross(arm - world.data.xipos[body], force)]

    def _hold(self) -> None:
        """Hold the middle link level, at a height that goes to where it is wanted."""
        data, body = self._world.data, self._link
        turn = data.xmat[body].reshape(3, 3)
        if not self._height:  # it stands
            self._place = data.xpos[body].copy()
            ahead = turn[:2, 0] / np.hypot(*turn[:2, 0])
            self._level[:2, :2] = np.array([ahead, [-ahead[1], ahead[0]]]).T
        way = _LIFTING * self._world.model.opt.timestep
        goal = _LIFT if self.hanging else 0.0
        self._height += float(np.clip(goal - self._height, -way, way))
        speed = np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectVelocity(self._world.model, data, kind, body, speed, 0)
        away = self._place - data.xpos[body]
        away[2] += self._height
        force = _HOOK[0] * away - _HOOK[1] * speed[3:]
        twist = 0.5 * np.cross(turn.T, self._level.T).sum(axis=0)
        torque = _TWIST[0] * twist - _TWIST[1] * speed[:3]
        torque += np.cross(data.xpos[body] - data.xipos[body], force)
        self._forces[body] = [*force, *torque] if self._height else 0.0
