"""Statics of a chain of torsion springs under one point load, at any angle, bent as far as it goes.

Hinge j turns by q_j against its spring k_j; link i points along u_i = (cos, sin) of the sum of the
hinge angles up to it. A load F at distance s from the base acts on a point p(q), and at rest

    k_j q_j = F . dp/dq_j,    dp/dq_j = sum over i >= j of d_i (-sin, cos)_i,

where d_i is how much of link i lies before the load. Both this and its derivative are closed forms;
Newton's method with a load that grows in steps follows the branch that begins straight. Loads are
solved side by side over a leading batch axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from antennate import checks
from antennate.errors import ConfigError
from antennate.robots.antenna import AntennaSpec
from antennate.types import Bools, Floats, Ints

Profile = Literal["stiff", "descending", "compliant", "matched_uniform", "ascending"]
PROFILES: tuple[Profile, ...] = get_args(Profile)
"""Names of profiles, all made of an antenna's own springs.

`descending` is the antenna as it is, by default with 3, 6, 6, 9, 9, 9 coils from base to tip.
`stiff` and `compliant` have its fewest and its most coils in every spring, `ascending` its springs
the other way round, and `matched_uniform` equal springs with the tip compliance of `descending`.
The last two are controls that the paper lacks.
"""

ABOUT: dict[str, str] = {
    "stiff": "its fewest coils in every spring",
    "descending": "the antenna as it is, by default stiffest at its base",
    "compliant": "its most coils in every spring",
    "matched_uniform": "equal springs that give as much at the tip as the antenna; a control",
    "ascending": "its springs the other way round, softest at the base; a control",
}
"""What each profile is, for who meets them for the first time."""

_LOAD_STEPS = 24
_ITERATIONS = 40
_TOLERANCE = 1e-10
"""Residual torque over stiffness at which a load counts as solved [rad]."""
_FORCES = 100
"""Forces among which the first that is too large is looked for, before bisection."""
_LARGEST_STEP = 0.3
"""Most that one Newton step turns a hinge [rad]."""


@dataclass(frozen=True, slots=True)
class Chain:
    """A chain of links on hinges with torsion springs, straight along +x when unloaded.

    Attributes:
        lengths: Link lengths, base to tip [m], shape (n,).
        stiffness: Spring of the hinge at the base of each link [N·m/rad], shape (n,).

    Raises:
        ConfigError: One is no finite number above 0, there are none, or their numbers differ.
    """

    lengths: Floats
    stiffness: Floats

    def __post_init__(self) -> None:
        lengths = checks.array("lengths", self.lengths, ("n",), "m")
        stiffness = checks.array("stiffness", self.stiffness, (len(lengths),), "N·m/rad")
        for name, values in (("lengths", lengths), ("stiffness", stiffness)):
            if not len(values) or values.min() <= 0.0:
                found = f"{values.min():g}" if len(values) else "none"
                raise ConfigError(f"{name}: expected numbers above 0, found {found}")
            object.__setattr__(self, name, values)

    @classmethod
    def of(cls, antenna: AntennaSpec) -> Chain:
        """The springs of an antenna, stiffened by the flex sensor where it lies."""
        checks.instance("antenna", antenna, AntennaSpec)
        stiffness = antenna.hinge_stiffness()
        return cls(np.full(len(stiffness), antenna.link_length), np.array(stiffness))

    @property
    def starts(self) -> Floats:
        """Distance of each hinge from the base along the straight chain [m], shape (n,)."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(self.lengths.sum())


@dataclass(frozen=True, slots=True)
class Rest:
    """A batch of loaded chains at rest.

    Attributes:
        angles: Hinge angles [rad], shape (m, n).
        force: The load in the frame of the base [N], shape (m, 2); it turned with its link if it
            was a follower.
        solved: Whether equilibrium was found on the branch that begins straight, shape (m,).
        stable: Whether that equilibrium is a minimum of the potential energy, shape (m,); a
            follower load has no potential, and is tested by the same matrix.
    """

    angles: Floats
    force: Floats
    solved: Bools
    stable: Bools


def equilibrium(chain: Chain, place: Floats, force: Floats, follower: bool = False) -> Rest:
    """Bend a chain by point loads, however far.

    At rest k_j q_j = F . dp/dq_j for each hinge j, with p the loaded point: Newton's method on the
    branch that begins straight.

    Args:
        chain: The chain.
        place: Distance of each load from the base along the chain [m], shape (m,).
        force: Loads [N], shape (m, 2), x along the straight chain. Fixed in direction, or, for a
            follower, given in the frame of the loaded link: (0, f) is normal to it.
        follower: Whether loads turn with their links.

    Returns:
        A `Rest`: `angles` of the hinges [rad], base to tip, shape (m, n); `force` [N] in the frame
        of the base, shape (m, 2); whether each load is `solved` and `stable`, shapes (m,).

    Raises:
        ConfigError: A place lies off the chain, a load is not finite, or the shapes do not fit.
    """
    checks.instance("chain", chain, Chain)
    place = checks.array("place", place, ("m",), "m", finite=False)
    force = checks.array("force", force, (len(place), 2), "N")
    off = ~((place > 0) & (place <= chain.length * (1 + 1e-12)))
    if off.any():
        raise ConfigError(
            f"place: expected places above 0 and up to {chain.length:g} m, found {place[off][0]:g}"
        )
    arms = np.clip(place[:, None] - chain.starts, 0.0, chain.lengths)
    loaded: Ints = np.count_nonzero(arms, axis=1) - 1
    angles = np.zeros((len(place), len(chain.lengths)))
    residual = angles
    for share in np.arange(1, _LOAD_STEPS + 1) / _LOAD_STEPS:
        for _ in range(_ITERATIONS):
            residual, slope = _balance(chain, arms, loaded, share * force, angles, follower)
            step = np.linalg.solve(slope, residual[..., None])[..., 0]
            largest = abs(step).max(axis=1, keepdims=True)
            angles = angles - step * np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, 1e-300))
            if (abs(residual) < _TOLERANCE * chain.stiffness).all():
                break
    residual, slope = _balance(chain, arms, loaded, force, angles, follower)
    solved = np.all(abs(residual) < 100 * _TOLERANCE * chain.stiffness, axis=1)
    symmetric = (slope + slope.swapaxes(1, 2)) / 2
    stable = np.linalg.eigvalsh(symmetric)[:, 0] > 0
    return Rest(angles, _turned(force, angles, loaded) if follower else force, solved, stable)


def _balance(
    chain: Chain, arms: Floats, loaded: Ints, force: Floats, angles: Floats, follower: bool
) -> tuple[Floats, Floats]:
    """Residual k q - F.dp/dq, shape (m, n), and its derivative, shape (m, n, n)."""
    world = _turned(force, angles, loaded) if follower else force
    along, across = _reach(arms, angles, world)
    residual = chain.stiffness * angles - across
    n = len(chain.lengths)
    later = np.maximum.outer(np.arange(n), np.arange(n))
    slope = np.diag(chain.stiffness) + along[:, later]
    if follower:
        normal = np.stack([-world[:, 1], world[:, 0]], axis=1)
        turning = _reach(arms, angles, normal)[1]
        before = np.arange(n) <= loaded[:, None]
        slope = slope - turning[:, :, None] * before[:, None, :]
    return residual, slope


def _reach(arms: Floats, angles: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Sums over i >= j of d_i F.u_i and of d_i F.(-sin, cos)_i, each of shape (m, n)."""
    heading = np.cumsum(angles, axis=1)
    cosine, sine = np.cos(heading), np.sin(heading)
    fx, fy = force[:, :1], force[:, 1:]
    along = arms * (fx * cosine + fy * sine)
    across = arms * (fy * cosine - fx * sine)
    return _from_here(along), _from_here(across)


def _from_here(values: Floats) -> Floats:
    return np.cumsum(values[:, ::-1], axis=1)[:, ::-1]


def _turned(force: Floats, angles: Floats, loaded: Ints) -> Floats:
    """Loads given in the frame of their links, in the frame of the base."""
    heading = np.cumsum(angles, axis=1)[np.arange(len(loaded)), loaded]
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([c * force[:, 0] - s * force[:, 1], s * force[:, 0] + c * force[:, 1]], axis=1)


def shape(chain: Chain, angles: Floats) -> Floats:
    """Positions of the hinges and the tip [m], shape (m, n + 1, 2), for angles (m, n) [rad]."""
    heading = np.cumsum(angles, axis=1)
    steps = chain.lengths[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    origin = np.zeros((len(angles), 1, 2))
    return np.concatenate([origin, np.cumsum(steps, axis=1)], axis=1)


def about(profiles: Iterable[str]) -> str:
    """What these profiles are, a line each."""
    return "\n".join(f"{name.replace('_', ' ')}: {ABOUT[name]}" for name in profiles)


def tip_compliance(chain: Chain) -> float:
    """Sideways give of the tip under a small load there [m/N]: sum of (L - s_i)^2 / k_i."""
    return float(((chain.length - chain.starts) ** 2 / chain.stiffness).sum())


def with_profile(antenna: AntennaSpec, profile: str) -> AntennaSpec:
    """The antenna with the springs of a named profile."""
    if profile not in PROFILES:
        raise ValueError(f"expected a profile of {', '.join(PROFILES)}, found {profile}")
    coils = antenna.active_coils
    if profile == "matched_uniform":
        coils = (_matched_coils(antenna),) * len(coils)
    elif profile == "ascending":
        coils = coils[::-1]
    elif profile != "descending":
        coils = (min(coils) if profile == "stiff" else max(coils),) * len(coils)
    return antenna.model_copy(update={"active_coils": coils})


def _matched_coils(antenna: AntennaSpec) -> float:
    """Coils of equal springs with the antenna's own tip compliance, by bisection."""
    wanted = tip_compliance(Chain.of(antenna))
    low, high = 0.1, 100.0
    while high - low > 1e-12 * high:
        middle = math.sqrt(low * high)
        uniform = antenna.model_copy(update={"active_coils": (middle,) * antenna.hinges})
        if tip_compliance(Chain.of(uniform)) < wanted:
            low = middle
        else:
            high = middle
    return low


def pushed_at_tip(chain: Chain, forces: Floats) -> Rest:
    """The one rest of a chain under each force on its tip that stays normal to the last link.

    Seen from the last link the force is fixed, so angles follow one another from tip to base:
    k_j q_j = f sum over i >= j of d_i cos(q_(i+1) + ... + q_n).

    Args:
        chain: The chain.
        forces: Forces [N], shape (m,).
    """
    angles = np.zeros((len(forces), len(chain.lengths)))
    lever, aside, turned = np.zeros((3, len(forces)))
    slope = np.zeros((*angles.shape, len(chain.lengths)))
    for j, (length, stiffness) in reversed(
        [*enumerate(zip(chain.lengths, chain.stiffness, strict=True))]
    ):
        lever = lever + length * np.cos(turned)
        aside = aside + length * np.sin(turned)
        angles[:, j] = forces * lever / stiffness
        turned = turned + angles[:, j]
        slope[:, j, :] += (forces * aside)[:, None]
        slope[:, :, j] -= (forces * aside)[:, None]
    slope = np.triu(slope) + np.diag(chain.stiffness)
    stable = np.linalg.eigvalsh((slope + slope.swapaxes(1, 2)) / 2)[:, 0] > 0
    force = np.stack([-forces * np.sin(turned), forces * np.cos(turned)], axis=1)
    return Rest(angles, force, np.ones(len(forces), bool), stable)


def largest_force(chain: Chain, limit: float | Floats) -> float:
    """Largest force on the tip, normal to the last link and turning with it [N].

    With any smaller one the chain is stable and no hinge turns beyond its limit.

    Args:
        chain: The chain.
        limit: Angle of all hinges, or of each, shape (n,) [rad].
    """
    stiffness, starts = chain.stiffness, chain.starts
    levers = (chain.length - starts) / (limit * stiffness)
    rows = abs(starts[:, None] - starts).sum(axis=1) / (2.0 * stiffness)
    low = 1.0 / float(max(levers.max(), rows.max()))  # no lever is longer; Gershgorin's circles
    high = float((limit * stiffness)[-1] / chain.lengths[-1])  # turns the last hinge by its limit
    many = _FORCES
    while high - low > 1e-12 * high:
        forces = np.geomspace(low, high, many)
        rest = pushed_at_tip(chain, forces)
        borne = rest.stable & (abs(rest.angles) < limit).all(axis=1)
        first = max(1, int(np.argmin(borne)))
        low, high, many = float(forces[first - 1]), float(forces[first]), 3
    return low
