"""The best gait of a robot by its quasi-static model, within joint limits, clearance and torque."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Literal

import numpy as np

from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams
from antennate.robots.mechanics import cycles, require_wave, wave_of
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats
from geometric_locomotion.twist import Wave

if TYPE_CHECKING:
    from geometric_locomotion.legged import Cycle

Goal = Literal["speed", "cost", "turning"]
_WAVES = (0.4, 1.5)
"""Wave numbers that are tried; the model was not compared with the engine outside."""
_OFFSET = 0.35
"""Largest offset, likewise [rad]."""
_SPARE = 0.003
"""What joints keep from their limit [rad]."""
_PHASES = 24
_ROUNDS = 3
"""How often the best is sought again on a grid half as wide."""


@lru_cache
def optimise(robot: RobotSpec, gait: GaitParams, goal: Goal) -> GaitParams:
    """The best gait at the frequency of a gait: amplitude, wave number, lead, offset for turning.

    Where wave and offset together would bend a joint too far, the gait cuts it, and so does the
    model. `speed` walks farthest a cycle. `cost` has the least work against friction for its weight
    and distance among gaits that are as fast as the configured one. `turning` turns most a cycle.

    Args:
        robot: The robot.
        gait: Where the search starts; its frequency and the step of lifting legs stay.
        goal: What is best.
    """
    require_wave(robot, gait)
    turning = goal == "turning"
    before = cycles(robot, gait, wave_of(gait, -gait.turn_offset if turning else 0.0), _PHASES)
    largest = _largest(robot, gait)
    low = np.array([0.0, _WAVES[0], 0.0, -_OFFSET if turning else 0.0])
    high = np.array([largest, _WAVES[1], 11 / 6 * math.pi, 0.0])
    sizes = (5, 7, 12, 4 if turning else 1)
    grids = [np.linspace(a, b, n) for a, b, n in zip(low, high, sizes, strict=True)]
    widths = np.array([g[1] - g[0] if len(g) > 1 else 0.0 for g in grids])
    best = _best(robot, gait, goal, before, grids)
    for _ in range(_ROUNDS):
        widths = widths / 2.0
        grids = [np.unique([x - w, x, x + w]) for x, w in zip(best, widths, strict=True)]
        for k in (0, 1, 3):
            grids[k] = np.unique(np.clip(grids[k], low[k], high[k]))
        best = _best(robot, gait, goal, before, grids)
    amplitude, number, lead, offset = best.tolist()
    values = {
        **gait.model_dump(),
        "amplitude": amplitude,
        "wave_number": number,
        "body_phase": lead % (2.0 * math.pi),
    }
    if turning:
        values["turn_offset"] = -offset
    return GaitParams(**values)


def _largest(robot: RobotSpec, gait: GaitParams) -> float:
    """Largest amplitude [rad]: legs stay apart, joints keep their speed, lifting feet their way."""
    speed = robot.yaw.fastest / (2.0 * math.pi * gait.frequency)
    clear = robot.yaw_limit - _SPARE if robot.legs.kind == "rolling" else gait.amplitude
    return min(speed, clear)


def _best(
    robot: RobotSpec, gait: GaitParams, goal: Goal, before: Cycle, grids: list[Floats]
) -> Floats:
    """The best point of a grid, shape (4,)."""
    points = np.array(list(product(*grids)))
    walked = cycles(robot, gait, Wave(*points.T), _PHASES)
    able = _able(robot, gait, points, walked)
    if goal == "cost":
        able &= walked.step >= before.step[0]
    worth = {"speed": walked.step, "cost": -walked.cost, "turning": walked.yaw}[goal]
    if not able.any():
        raise ConfigError(
            f"optimise: expected a gait within the torque of the servos at {gait.frequency:g} Hz "
            f"and, for cost, as fast as the given one, found none"
        )
    return points[np.where(able, worth, -np.inf).argmax()]


def _able(robot: RobotSpec, gait: GaitParams, points: Floats, walked: Cycle) -> Bools:
    """Whether the yaw servos have the torque, on their line at the fastest moment."""
    servo = robot.servo_of(robot.yaw)
    speed = 2.0 * math.pi * gait.frequency * points[:, 0]
    return walked.torque <= servo.stall_torque * (1.0 - speed / servo.no_load_speed)
