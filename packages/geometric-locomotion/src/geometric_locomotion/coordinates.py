"""Minimum-perturbation coordinates: the body frame in which the local connection is smallest.

A frame that is placed at beta(alpha) in the old body frame has the connection
A' = Ad(beta^-1) A - beta^-1 d(beta). Its mean square over a region of shapes is least for the
heading that solves one linear least-squares problem and the place that solves another (the Hodge
decomposition of Hatton and Choset 2011, here by polynomials and so for any number of joints).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from geometric_locomotion.arguments import called, numbers, scalar, whole
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.lie import se2_adjoint, se2_inverse, se2_pose
from geometric_locomotion.stroke import Connection
from geometric_locomotion.types import Floats, Ints


@dataclass(frozen=True)
class BodyFrame:
    """A body frame whose place in the old one is a polynomial of the shape.

    Attributes:
        reach: Half-width of the region of shapes about zero [rad].
        powers: Degrees of the Legendre polynomials in each joint, shape (P, m).
        coefficients: Those of x, y and heading, shape (3, P).
    """

    reach: float
    powers: Ints
    coefficients: Floats

    def pose(self, shape: Floats) -> Floats:
        """Poses (..., 3, 3) of this frame in the old one at shapes (..., m)."""
        values, _ = _polynomials(shape, self.reach, self.powers)
        return se2_pose(*np.moveaxis(values @ self.coefficients.T, -1, 0))

    def change(self, connection: Connection) -> Connection:
        """The connection in this frame, of one in the old frame."""

        def changed(shape: Floats) -> Floats:
            pose = self.pose(shape)
            _, slopes = _polynomials(shape, self.reach, self.powers)
            motion = self.coefficients @ slopes
            motion[..., :2, :] = np.swapaxes(pose[..., :2, :2], -1, -2) @ motion[..., :2, :]
            return se2_adjoint(se2_inverse(pose)) @ connection(shape) - motion

        return changed


def minimum_perturbation(connection: Connection, shapes: Floats, degree: int = 8) -> BodyFrame:
    """The body frame in which the sum of squares of A over the shapes (n, m) is least.

    Args:
        connection: Local connection in any body frame.
        shapes: Shapes [rad] that fill the region of interest, shape (n, m).
        degree: Highest total degree of the polynomials.

    Raises:
        BadInputError: Fewer equations than coefficients.
    """
    whole("degree", degree, 0)
    shapes = numbers("shapes", shapes, None, None)
    numbers("shapes", shapes[None], 1, *shapes.shape[-2:])
    count, joints = shapes.shape
    reach = scalar("largest shape", np.abs(shapes).max(initial=0.0), above=0.0)
    degrees = itertools.product(range(degree + 1), repeat=joints)
    powers = np.array([power for power in degrees if sum(power) <= degree])
    if count * joints < len(powers):
        raise BadInputError(
            f"{count} shapes of {joints} joints cannot fix {len(powers)} coefficients of "
            f"degree {degree}: give more shapes or a lower degree"
        )
    values, slopes = _polynomials(shapes, reach, powers)
    matrices = numbers("connection", called("connection", connection, shapes), count, 3, joints)
    turning = np.swapaxes(slopes, -1, -2)  # (n, m, P): what each coefficient adds to the rows of A
    swing = matrices[:, 2, :, None] * values[:, None, :]
    moving = np.block([[turning, swing], [-swing, turning]])  # x' = dx + A_theta y, y' = dy - ...
    heading = _least_squares(turning, matrices[:, 2])
    place = _least_squares(moving, matrices[:, :2].reshape(count, -1))
    return BodyFrame(reach, powers, np.stack([*np.split(place, 2), heading]))


def _least_squares(rows: Floats, wanted: Floats) -> Floats:
    solution = np.linalg.lstsq(rows.reshape(-1, rows.shape[-1]), wanted.reshape(-1), rcond=None)
    return np.asarray(solution[0], dtype=np.float64)


def square(reach: float, count: int = 24) -> Floats:
    """Shapes (count^2, 2) [rad]: cell centres of the square from -reach to reach."""
    whole("count", count, 1)
    line = scalar("reach", reach, above=0.0) * ((np.arange(count) + 0.5) * 2 / count - 1)
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)


def _polynomials(shape: Floats, reach: float, powers: Ints) -> tuple[Floats, Floats]:
    """Products of Legendre polynomials (..., P) and their slopes (..., P, m) [per rad]."""
    degree = int(powers.max())
    shape = numbers("shape", shape, powers.shape[1])
    values = legendre.legvander(shape / reach, degree)
    slopes = values[..., :degree] @ legendre.legder(np.eye(degree + 1)) / reach
    joints = np.arange(powers.shape[1])
    factors, rates = values[..., joints, powers], slopes[..., joints, powers]
    columns = [np.where(joints == joint, rates, factors).prod(axis=-1) for joint in joints]
    return factors.prod(axis=-1), np.stack(columns, axis=-1)
