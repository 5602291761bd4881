"""Checks for the tests of a controller, a robot or a scene of your own."""

from antennate.control.check_controller import check_controller
from antennate.sim.check_robot import check_robot
from antennate.sim.check_scene import check_scene

__all__ = ["check_controller", "check_robot", "check_scene"]
