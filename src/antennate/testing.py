"""Checks for the tests of whoever writes a controller, a robot or a scene of their own."""

from antennate.control.check_controller import check_controller
from antennate.sim.check_robot import check_robot
from antennate.sim.check_scene import check_scene

__all__ = ["check_controller", "check_robot", "check_scene"]
