"""Chain of links on dry ground: the body twist of least Coulomb dissipation.

The friction of a piece of a link is the slope of R = sqrt(u^2 + (ratio v)^2), where it slides with
u along and v across: 1 along the link, the chain's drag ratio across it, an ellipse between (limit
curve of Goyal, Ruina and Papadopoulos, Wear 1991). Forces sum to zero where the dissipation, the
integral of R over all links, is least; that is convex in the twist. With u^2 + s^2 for u^2, s far
below the speed of the links, it has slopes everywhere. A link's friction is then like viscous drag
divided by R, which gives a step that never goes uphill; Newton's step is taken where it is better.
The twist grows in proportion to the joint rates but is not linear in them, so there is no local
connection.
"""

from __future__ import annotations

import numpy as np

from geometric_locomotion.arguments import alike, numbers, whole
from geometric_locomotion.chain import PlanarChain
from geometric_locomotion.types import Floats

_SMOOTHING = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Speeds s, one after the other, of the chain's length times its joint rates."""
_ROUNDS, _CHANGE = 20, 1e-9
"""Most steps with each of them, and the change of the twist, of that product, that ends them."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_EVEN = 0.3
"""Change of speed along a link, of its least R, below which 8 Gauss points are exact to 1e-9."""


def coulomb_twist(chain: PlanarChain, shape: Floats, rate: Floats, link: int = 0) -> Floats:
    """Twists (..., 3) of a link at shapes [rad] and joint rates [rad/s], both (..., m)."""
    whole("link", link, -chain.links, chain.links - 1)
    given = numbers("shape", shape, chain.joints), numbers("rate", rate, chain.joints)
    shape, rate = alike("shape and rate", *given)
    flat = shape.reshape(-1, chain.joints), rate.reshape(-1, chain.joints)
    jacobians = chain.jacobians(flat[0])
    motion = np.concatenate([_first_twist(chain, *flat, jacobians), flat[1]], axis=-1)
    twist = (jacobians[:, link] @ motion[..., None])[..., 0]
    return twist.reshape(*shape.shape[:-1], 3)


def coulomb_power(chain: PlanarChain, shape: Floats, rate: Floats, twist: Floats) -> Floats:
    """Dissipation (...) by friction, if the first link has the twists (..., 3)."""
    given = numbers("rate", rate, chain.joints), numbers("twist", twist, 3)
    alike("rate and twist", given[0][..., :1], given[1][..., :1])
    motion = np.concatenate(given[::-1], axis=-1)
    slip = (chain.jacobians(shape) @ motion[..., None, :, None])[..., 0]
    return _integrals(chain, slip, np.full(slip.shape[:-2], 1e-9))[0].sum(axis=-1)


def _first_twist(chain: PlanarChain, shape: Floats, rate: Floats, jacobians: Floats) -> Floats:
    """Twists (n, 3) of the first link, from those of the viscous chain on."""
    twist = chain.twist(shape, rate)
    speed = chain.length * np.linalg.norm(rate, axis=-1)
    scale = np.where(speed > 0, speed, 1.0)
    for smoothing in _SMOOTHING:
        rows = np.arange(len(twist))  # those that still move
        for _ in range(_ROUNDS):
            before = twist[rows]
            twist[rows] = _step(chain, jacobians[rows], before, rate[rows], smoothing * scale[rows])
            change = np.abs(twist[rows] - before).max(axis=-1)
            rows = rows[change > _CHANGE * scale[rows]]
            if not len(rows):
                break
    return twist


def _step(
    chain: PlanarChain, jacobians: Floats, twist: Floats, rate: Floats, speed: Floats
) -> Floats:
    """The better of two steps: to the twist of viscous drag over R, and Newton's."""
    _, force, drag = _resistance(chain, jacobians, twist, rate, speed)
    viscous = -np.linalg.solve(drag[..., :3], drag[..., 3:] @ rate[..., None])[..., 0]
    step = 1e-2 * speed[:, None]
    columns = [
        _resistance(chain, jacobians, twist + step * axis, rate, speed)[1] - force
        for axis in np.eye(3)
    ]
    slope = np.stack(columns, axis=-1) / step[..., None]
    floor = 1e-12 * np.trace(slope, axis1=-2, axis2=-1)[..., None, None]
    newton = twist - np.linalg.solve(slope + floor * np.eye(3), force[..., None])[..., 0]
    steps = [np.asarray(to, dtype=np.float64) for to in (viscous, newton)]
    power = [_resistance(chain, jacobians, to, rate, speed)[0] for to in steps]
    return np.where((power[1] < power[0])[:, None], steps[1], steps[0])


def _resistance(
    chain: PlanarChain, jacobians: Floats, twist: Floats, rate: Floats, speed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Dissipation (...), its slope by the twist (..., 3), and drag (..., 3, 3 + m) over R."""
    motion = np.concatenate([twist, rate], axis=-1)[..., None]
    slip = (jacobians @ motion[..., None, :, :])[..., 0]
    power, even, linear, square = _integrals(chain, slip, speed)
    ratio = chain.drag_ratio**2
    drag = np.zeros((*even.shape, 3, 3))
    drag[..., 0, 0], drag[..., 1, 1], drag[..., 2, 2] = even, ratio * even, ratio * square
    drag[..., 1, 2] = drag[..., 2, 1] = ratio * linear
    rows = np.swapaxes(jacobians[..., :3], -1, -2)
    matrix = (rows @ drag @ jacobians).sum(axis=-3)
    return power.sum(axis=-1), (matrix @ motion)[..., 0], matrix


def _integrals(
    chain: PlanarChain, slip: Floats, speed: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Integrals of R, 1/R, s/R and s^2/R over the place s on each link, shape (..., N).

    Closed forms in the speed across z = v + omega s; Gauss points where it hardly changes.
    """
    length, ratio = np.array(chain.lengths), chain.drag_ratio
    along, across, turn = slip[..., 0], slip[..., 1], slip[..., 2]
    least = along**2 + speed[..., None] ** 2
    place = length / 2 * _NODES.reshape(-1, *[1] * along.ndim)
    weight = length / 2 * _WEIGHTS.reshape(-1, *[1] * along.ndim)
    size = np.sqrt(least + (ratio * (across + turn * place)) ** 2)
    points = [(weight * f).sum(axis=0) for f in (size, 1 / size, place / size, place**2 / size)]
    even = ratio * np.abs(turn) * length < _EVEN * size.min(axis=0)
    turn = np.where(even, 1.0, turn)
    ends = across + turn * length / 2 * np.array([-1.0, 1.0]).reshape(-1, *[1] * along.ndim)
    sizes = np.sqrt(least + (ratio * ends) ** 2)
    angle = np.diff(np.arcsinh(ratio * ends / np.sqrt(least)), axis=0)[0] / ratio
    zeroth = angle / turn
    first = np.diff(sizes, axis=0)[0] / (ratio**2 * turn)
    second = (np.diff(ends * sizes, axis=0)[0] - least * angle) / (2 * ratio**2 * turn)
    closed = (
        least * zeroth + ratio**2 * second,
        zeroth,
        (first - across * zeroth) / turn,
        (second - 2 * across * first + across**2 * zeroth) / turn**2,
    )
    power, inverse, linear, square = (
        np.where(even, a, b) for a, b in zip(points, closed, strict=True)
    )
    return power, inverse, linear, square
