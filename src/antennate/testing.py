"""Checks for the tests of whoever writes a scene of their own."""

from antennate.sim.check_scene import check_scene

__all__ = ["check_scene"]
