"""Bounds that the state of a sound world keeps."""

from __future__ import annotations

import numpy as np

from antennate.types import Bools, Floats

SPEED_LIMIT = 1e3
"""No coordinate of a sound world moves faster [m/s or rad/s]."""
DISTANCE_LIMIT = 100.0
"""A head farther than this from the origin left the world [m]."""
ANGLE_LIMIT = 6.3
"""Yaw, pitch and antenna joints cannot turn farther [rad]; legs turn without end."""
HEIGHT_LIMIT = 0.3
"""A head above or below this left the world [m]."""


def sound(heads: Floats, bounded: Floats, speeds: Floats) -> Bools:
    """Which of B states are within all bounds, shape (B,); arguments as `broken` has them, by row.

    Not a number is beyond every bound.
    """
    with np.errstate(invalid="ignore"):
        return (
            (abs(heads[:, :2]).max(axis=1) < DISTANCE_LIMIT)
            & (heads[:, 2] > 0.0)
            & (heads[:, 2] < HEIGHT_LIMIT)
            & (abs(bounded).max(axis=1, initial=0.0) < ANGLE_LIMIT)
            & (abs(speeds).max(axis=1) < SPEED_LIMIT)
        )


def broken(head: Floats, bounded: Floats, speeds: Floats) -> str:
    """What is beyond its bound in a state; empty if nothing is.

    Args:
        head: Position of the head [m], shape (3,).
        bounded: Joints that do not turn without end [rad], shape (n,).
        speeds: All coordinates [m/s or rad/s], shape (nv,).
    """
    far, height = float(abs(head[:2]).max()), float(head[2])
    angle, speed = float(abs(bounded).max(initial=0.0)), float(abs(speeds).max())
    checks = (
        (far < DISTANCE_LIMIT, f"the head is {far:.3g} m away"),
        (angle < ANGLE_LIMIT, f"a joint is at {angle:.3g} rad"),
        (speed < SPEED_LIMIT, f"a coordinate moves at {speed:.3g} m/s or rad/s"),
        (0.0 < height < HEIGHT_LIMIT, f"the head is at a height of {height:.3g} m"),
    )
    return next((found for sound, found in checks if not sound), "")
