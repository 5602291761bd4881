"""A rival of `entries/apprentice` at its gait frequency: `docs/science/one_hertz.py:geometric`.

A robot that walks so has faster legs than ours: `robot.legs.fastest` of 6.29 rad/s.
"""

from antennate.control.registry import make_controller
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import Controller


def geometric(control: ControlParams, robot: RobotSpec, batch: int) -> Controller:
    """`geometric` at 1 Hz, by which the entry was taught."""
    gait = control.gait.model_copy(update={"frequency": 1.0})
    return make_controller("geometric", control.model_copy(update={"gait": gait}), robot, batch)
