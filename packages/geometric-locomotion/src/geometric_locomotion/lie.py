"""SE(2) and SE(3): rigid poses as homogeneous matrices, twists in the body frame.

All functions work over leading axes. A pose is a matrix (..., 3, 3) in the plane, (..., 4, 4) in
space. A twist in the plane is (vx, vy, omega), shape (..., 3); in space it is
(vx, vy, vz, wx, wy, wz), shape (..., 6). A pose `g` that moves with the twist `xi` for the time t
ends at `g @ exp(t xi)`. Lengths in m, angles in rad, or any other unit of length throughout.

Source of the formulas: Murray, Li and Sastry, A Mathematical Introduction to Robotic
Manipulation (1994), chapter 2 and appendix A.
"""

from __future__ import annotations

import numpy as np

from geometric_locomotion.arguments import alike, numbers
from geometric_locomotion.types import Floats

_SERIES = 0.02
"""Below this angle [rad] a series is used where the closed form loses digits."""


def _sinc(angle: Floats) -> Floats:
    return np.sinc(angle / np.pi)


def se2_pose(x: Floats | float, y: Floats | float, heading: Floats | float) -> Floats:
    """Poses in the plane of positions and headings [rad], shape (..., 3, 3)."""
    given = {"x": x, "y": y, "heading": heading}
    x, y, heading = alike("x, y and heading", *(numbers(*each) for each in given.items()))
    pose = np.zeros((*x.shape, 3, 3))
    cosine, sine = np.cos(heading), np.sin(heading)
    pose[..., 0, 0], pose[..., 0, 1], pose[..., 0, 2] = cosine, -sine, x
    pose[..., 1, 0], pose[..., 1, 1], pose[..., 1, 2] = sine, cosine, y
    pose[..., 2, 2] = 1.0
    return pose


def se2_exp(twist: Floats) -> Floats:
    """Poses reached in unit time with constant twists (..., 3), shape (..., 3, 3)."""
    twist = numbers("twist", twist, 3)
    vx, vy, turn = twist[..., 0], twist[..., 1], twist[..., 2]
    ahead = _sinc(turn)
    aside = turn / 2 * _sinc(turn / 2) ** 2
    return se2_pose(ahead * vx - aside * vy, aside * vx + ahead * vy, turn)


def se2_log(pose: Floats) -> Floats:
    """Twists (..., 3) that reach the poses (..., 3, 3) in unit time; omega in (-pi, pi]."""
    pose = numbers("pose", pose, 3, 3)
    turn = np.arctan2(pose[..., 1, 0], pose[..., 0, 0])
    x, y = pose[..., 0, 2], pose[..., 1, 2]
    ahead = np.cos(turn / 2) / _sinc(turn / 2)
    aside = turn / 2
    return np.stack([ahead * x + aside * y, ahead * y - aside * x, turn], axis=-1)


def se2_inverse(pose: Floats) -> Floats:
    """Inverse poses, shape (..., 3, 3)."""
    return _inverse(pose, 2)


def se2_adjoint(pose: Floats) -> Floats:
    """Matrices Ad(g) (..., 3, 3): a twist in the frame of g, seen from the frame g is given in."""
    pose = numbers("pose", pose, 3, 3)
    adjoint = pose.copy()
    adjoint[..., 0, 2], adjoint[..., 1, 2] = pose[..., 1, 2], -pose[..., 0, 2]
    return adjoint


def se2_bracket(a: Floats, b: Floats) -> Floats:
    """Lie brackets [a, b] of twists (..., 3), shape (..., 3)."""
    a, b = alike("a and b", numbers("a", a, 3), numbers("b", b, 3))
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def hat(vector: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    vector = numbers("vector", vector, 3)
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def so3_exp(rotation: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad]."""
    rotation = numbers("rotation", rotation, 3)
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    cross = hat(rotation)
    return np.eye(3) + _sinc(angle) * cross + _sinc(angle / 2) ** 2 / 2 * (cross @ cross)


def so3_log(matrix: Floats) -> Floats:
    """Rotation vectors (..., 3) [rad] of rotation matrices (..., 3, 3), no longer than pi.

    By way of the quaternion, whose largest component is never small: exact up to pi.
    """
    m = numbers("matrix", matrix, 3, 3)
    trace = np.trace(m, axis1=-2, axis2=-1)[..., None, None]
    outer = m + np.swapaxes(m, -1, -2) + (1 - trace) * np.eye(3)  # 4 v v^T of a quaternion (v, s)
    odd = np.stack(
        [
            m[..., 2, 1] - m[..., 1, 2],
            m[..., 0, 2] - m[..., 2, 0],
            m[..., 1, 0] - m[..., 0, 1],
        ],
        axis=-1,
    )  # 4 s v
    rows = np.concatenate(
        [
            np.concatenate([outer, odd[..., :, None]], axis=-1),
            np.concatenate([odd[..., None, :], 1 + trace], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)[..., None, None]
    quaternion = np.take_along_axis(rows, largest, axis=-2)[..., 0, :]
    quaternion = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    quaternion = np.where(quaternion[..., 3:] < 0, -quaternion, quaternion)
    length = np.linalg.norm(quaternion[..., :3], axis=-1, keepdims=True)
    half = np.arctan2(length, quaternion[..., 3:])
    return 2 * quaternion[..., :3] / _sinc(half)


def se3_exp(twist: Floats) -> Floats:
    """Poses reached in unit time with constant twists (..., 6), shape (..., 4, 4)."""
    twist = numbers("twist", twist, 6)
    velocity, rotation = twist[..., :3], twist[..., 3:]
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    cross = hat(rotation)
    safe = np.maximum(angle, _SERIES)
    third = np.where(
        angle < _SERIES,
        1 / 6 - angle**2 / 120 + angle**4 / 5040,
        (1 - _sinc(safe)) / safe**2,
    )
    left = np.eye(3) + _sinc(angle / 2) ** 2 / 2 * cross + third * (cross @ cross)
    pose = np.zeros((*twist.shape[:-1], 4, 4))
    pose[..., :3, :3] = so3_exp(rotation)
    pose[..., :3, 3] = (left @ velocity[..., None])[..., 0]
    pose[..., 3, 3] = 1.0
    return pose


def se3_log(pose: Floats) -> Floats:
    """Twists (..., 6) that reach the poses (..., 4, 4) in unit time; they turn by pi at most."""
    pose = numbers("pose", pose, 4, 4)
    rotation = so3_log(pose[..., :3, :3])
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    cross = hat(rotation)
    safe = np.maximum(angle, _SERIES)
    second = np.where(
        angle < _SERIES,
        1 / 12 + angle**2 / 720 + angle**4 / 30240,
        (1 - np.cos(safe / 2) / _sinc(safe / 2)) / safe**2,
    )
    left = np.eye(3) - cross / 2 + second * (cross @ cross)
    velocity = (left @ pose[..., :3, 3:])[..., 0]
    return np.concatenate([velocity, rotation], axis=-1)


def se3_inverse(pose: Floats) -> Floats:
    """Inverse poses, shape (..., 4, 4)."""
    return _inverse(pose, 3)


def se3_adjoint(pose: Floats) -> Floats:
    """Matrices Ad(g) (..., 6, 6): a twist in the frame of g, seen from the frame g is given in."""
    pose = numbers("pose", pose, 4, 4)
    rotation = pose[..., :3, :3]
    adjoint = np.zeros((*pose.shape[:-2], 6, 6))
    adjoint[..., :3, :3] = adjoint[..., 3:, 3:] = rotation
    adjoint[..., :3, 3:] = hat(pose[..., :3, 3]) @ rotation
    return adjoint


def _inverse(pose: Floats, size: int) -> Floats:
    inverse = numbers("pose", pose, size + 1, size + 1).copy()
    back = np.swapaxes(inverse[..., :size, :size], -1, -2).copy()
    inverse[..., :size, :size] = back
    inverse[..., :size, size] = -(back @ inverse[..., :size, size, None])[..., 0]
    return inverse
