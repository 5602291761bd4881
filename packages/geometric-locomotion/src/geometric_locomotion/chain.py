"""Planar chain of rigid links in a viscous medium: kinematics, local connection, metric.

Links go head first: x of each link's frame points forward, the next link hangs behind it, and a
joint angle is the heading of the link behind less that of the link before. Drag per length is 1
along a link and the drag ratio across it (resistive force theory: Gray and Hancock 1955). With no
mass, forces sum to zero, and the body twist is linear in the joint rates: xi = -A(alpha) rate.

Shapes (..., m) are the m = N - 1 joint angles [rad]; twists (..., 3) are in the frame of one link.
Lengths are in any unit; the unit of drag is that of one unit of length along a link.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometric_locomotion.arguments import alike, numbers, scalar, whole
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.types import Floats


@dataclass(frozen=True)
class PlanarChain:
    """Chain of N links, joined end to end.

    Attributes:
        lengths: Length of each link, head first.
        drag_ratio: Drag across a link over drag along it: 2 for a slender rod in a viscous fluid,
            1 for none preferred.

    Raises:
        BadInputError: Fewer than two links, or a length or ratio that is not positive.
    """

    lengths: tuple[float, ...]
    drag_ratio: float = 2.0

    def __post_init__(self) -> None:
        if np.ndim(self.lengths) == 1 and len(self.lengths) < 2:
            raise BadInputError(f"a chain needs 2 links or more, found {len(self.lengths)}")
        numbers("each length of a chain", self.lengths, None, above=0.0)
        scalar("the drag ratio of a chain", self.drag_ratio, above=0.0)

    @classmethod
    def equal(cls, links: int, length: float = 1.0, drag_ratio: float = 2.0) -> PlanarChain:
        """A chain of links that are equally long and `length` together."""
        whole("links", links, 2)
        return cls((scalar("length", length, above=0.0) / links,) * links, drag_ratio)

    @property
    def links(self) -> int:
        """Number of links N."""
        return len(self.lengths)

    @property
    def joints(self) -> int:
        """Number of joints m = N - 1."""
        return self.links - 1

    @property
    def length(self) -> float:
        """Length of the whole chain."""
        return float(sum(self.lengths))

    def poses(self, shape: Floats) -> Floats:
        """Centre and heading (x, y, heading) of each link in the first one's frame, (..., N, 3)."""
        shape = numbers("shape", shape, self.joints)
        heading = np.concatenate([np.zeros_like(shape[..., :1]), np.cumsum(shape, -1)], axis=-1)
        half = np.array(self.lengths) / 2
        ends = half[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        steps = ends[..., :-1, :] + ends[..., 1:, :]
        centre = -np.cumsum(np.concatenate([0 * ends[..., :1, :], steps], axis=-2), axis=-2)
        return np.concatenate([centre, heading[..., None]], axis=-1)

    def jacobians(self, shape: Floats) -> Floats:
        """Matrices (..., N, 3, 3 + m): each link's twist in its own frame.

        They act on the first link's twist, then the joint rates.
        """
        poses = self.poses(shape)
        centre, heading = poses[..., :2], poses[..., 2]
        forward = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        joint = (centre - np.array(self.lengths)[:, None] / 2 * forward)[..., :-1, :]
        arm = centre[..., :, None, :] - joint[..., None, :, :]
        behind = np.tri(self.links, self.joints, -1)
        one, zero = np.ones((*heading.shape, 1)), np.zeros((*heading.shape, 1))
        x = np.concatenate([one, zero, -centre[..., 1:], -arm[..., 1] * behind], axis=-1)
        y = np.concatenate([zero, one, centre[..., :1], arm[..., 0] * behind], axis=-1)
        turn = np.broadcast_to(
            np.concatenate([np.tile([0.0, 0.0, 1.0], (self.links, 1)), behind], axis=1), x.shape
        )
        cosine, sine = forward[..., :1], forward[..., 1:]
        return np.stack([cosine * x + sine * y, cosine * y - sine * x, turn], axis=-2)

    def drag(self) -> Floats:
        """Drag of each link against (along, across, turning), shape (N, 3)."""
        length = np.array(self.lengths)
        across = self.drag_ratio * length
        return np.stack([length, across, across * length**2 / 12], axis=-1)

    def resistance(self, shape: Floats) -> Floats:
        """Matrices (..., 3 + m, 3 + m): power is quadratic in the first twist and joint rates."""
        jacobians = self.jacobians(shape)
        stacked = jacobians.reshape(*jacobians.shape[:-3], -1, 3 + self.joints)
        return np.swapaxes(stacked, -1, -2) @ (self.drag().reshape(-1, 1) * stacked)

    def connection(self, shape: Floats, link: int = 0) -> Floats:
        """Local connection A (..., 3, m): a link's twist is -A rate (Hatton and Choset 2011)."""
        whole("link", link, -self.links, self.links - 1)
        resistance = self.resistance(shape)
        first: Floats = np.asarray(
            np.linalg.solve(resistance[..., :3, :3], resistance[..., :3, 3:]), dtype=np.float64
        )
        if link == 0:
            return first
        jacobian = self.jacobians(shape)[..., link, :, :]
        return jacobian[..., :3] @ first - jacobian[..., 3:]

    def metric(self, shape: Floats) -> Floats:
        """Dissipation metric (..., m, m): power is rate^T metric rate while the chain swims."""
        resistance = self.resistance(shape)
        across = resistance[..., :3, 3:]
        moved = np.linalg.solve(resistance[..., :3, :3], across)
        return resistance[..., 3:, 3:] - np.swapaxes(across, -1, -2) @ moved

    def twist(self, shape: Floats, rate: Floats, link: int = 0) -> Floats:
        """Twists (..., 3) of a link while the shape changes at the rates (..., m) [rad/s]."""
        given = numbers("shape", shape, self.joints), numbers("rate", rate, self.joints)
        alike("shape and rate", *given)
        return -(self.connection(shape, link) @ given[1][..., None])[..., 0]


def purcell(
    drag_ratio: float = 2.0, lengths: Sequence[float] = (1 / 3, 1 / 3, 1 / 3)
) -> PlanarChain:
    """Purcell's swimmer: three links, by default equal and 1 long together (Purcell 1977)."""
    return PlanarChain(tuple(lengths), drag_ratio)
