"""A scene of one's own: pillars on a floor, in other places in each trial.

uv run antennate tunnel --scene examples/own_scene.py:Pillars --trials 4
"""

import mujoco
import numpy as np

from antennate.sim.scenes.scene import Route

LENGTH, COUNT = 2.0, 14


class Pillars:
    """Draws the places; the robot starts at the origin and looks along x."""

    random = True

    def draw(self, robot, rng):
        return DrawnPillars(rng.uniform([0.35, -0.6], [LENGTH - 0.2, 0.6], (COUNT, 2)))


class DrawnPillars(Route):
    """Pillars around a straight route; `Route` tells progress, success and leaving."""

    def __init__(self, places):
        super().__init__(np.array([[0.0, 0.0], [LENGTH, 0.0]]), bounds=places)
        self.places = places

    def build(self, spec):
        super().build(spec)  # the floor
        for x, y in self.places:
            shape = mujoco.mjtGeom.mjGEOM_CYLINDER
            spec.worldbody.add_geom(type=shape, size=[0.05, 0.1, 0.0], pos=[x, y, 0.1])
