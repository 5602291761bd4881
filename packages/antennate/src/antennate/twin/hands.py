"""Hands and a hook on the twin while its physics runs."""

from __future__ import annotations

import numpy as np

from antennate.params.scene import HookParams
from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim.hook import Hook
from antennate.sim.world import PREFIX, World
from antennate.twin.board import Press

_PRESSING = 0.05
"""Time constant with which a hand presses [s] (assumed); it lets go at once."""
_LIFT = 0.1
"""Height to which the robot is raised [m]: its legs are free (assumed)."""
_LIFTING = 0.1
"""Speed of raising and lowering it [m/s] (assumed)."""


class Hands:
    """Hands that press antennae, and a hook that raises the robot by its middle link.

    Args:
        world: The world; its forces are set before each physics step.

    Attributes:
        hanging: Whether the robot is to hang; else it stands, or is lowered to where it stood.
        presses: What presses the left and the right antenna, None for nothing.
    """

    def __init__(self, world: World) -> None:
        self._world, self._forces = world, world.data.xfrc_applied
        self._hook = Hook(world, HookParams())
        self.hanging = False
        self.presses: list[Press | None] = [None, None]
        self._force = [0.0, 0.0]
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
        """Hold the middle link at a height that goes to where it is wanted."""
        if not self._height:  # it stands
            self._hook.grasp()
        way = _LIFTING * self._world.model.opt.timestep
        goal = _LIFT if self.hanging else 0.0
        self._height += float(np.clip(goal - self._height, -way, way))
        if self._height:
            self._hook.pull(self._height)
