"""How an antenna swings: a chain of springs, at small angles.

Around the straight chain M q" + C q' + K q = 0, where q are the angles of the base and of each
hinge. Its eigenvalues tell how fast each mode swings and how soon it stops. Links are capsules of
uniform density, as in the physics engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from antennate.robots.antenna import AntennaSpec
from antennate.types import Floats

Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class LinearChain:
    """A chain near its straight shape; the first coordinate is the base joint, n hinges follow.

    Attributes:
        mass: Mass matrix [kg·m²], shape (n + 1, n + 1).
        damping: Damping of each joint [N·m·s/rad], shape (n + 1,).
        stiffness: Stiffness of each joint [N·m/rad], shape (n + 1,).
        lever: Sideways way of the tip for one radian of each joint [m], shape (n + 1,).
    """

    mass: Floats
    damping: Floats
    stiffness: Floats
    lever: Floats

    @classmethod
    def of(cls, antenna: AntennaSpec) -> LinearChain:
        """An antenna on its base servo, which holds still at its target."""
        length, count = antenna.link_length, antenna.hinges
        starts = np.linspace(0.0, antenna.length - length, count)
        joints = np.concatenate([[0.0], starts])
        mass = _rods(
            joints,
            starts,
            np.full(count, length),
            np.full(count, antenna.link_mass),
            link_inertia(antenna),
        )
        drive = antenna.base()
        base = drive.armature + antenna.base_mass * 0.4 * antenna.radius**2
        springs = np.array(antenna.hinge_stiffness())
        return cls(
            mass + np.diag([base, *[antenna.armature] * count]),
            np.array([drive.damping, *(antenna.damping_time * springs)]),
            np.array([drive.stiffness, *springs]),
            antenna.length - joints,
        )

    def pushed_at_tip(self) -> Floats:
        """Angles under a sideways load on the tip [rad], shape (n + 1,), for a sum of one."""
        angles = self.lever / self.stiffness
        return angles / angles.sum()

    def first_mode(self) -> Mode:
        """The mode that carries most of the tip's way when a load on the tip is taken off."""
        return max(self.modes(), key=lambda mode: mode.share)

    def modes(self) -> list[Mode]:
        """Modes of the chain, slowest first; two real eigenvalues are two without a swing."""
        from scipy.linalg import eig  # takes long; only where it is needed

        inverse, n = np.linalg.inv(self.mass), len(self.mass)
        zero, one = np.zeros_like(inverse), np.eye(n)
        system = np.block([[zero, one], [-inverse * self.stiffness, -inverse * self.damping]])
        roots, left, right = eig(system, left=True, right=True)  # pyright: ignore[reportAssignmentType]
        modes = []
        for root, row, column in zip(roots, left.T.conj(), right.T, strict=True):
            way = (row[:n] @ self.pushed_at_tip()) / (row @ column) * (self.lever @ column[:n])
            if root.imag >= 0:
                modes.append(Mode(complex(root), row, abs(way) * (2 if root.imag > 0 else 1)))
        return sorted(modes, key=lambda mode: abs(mode.root))


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode of a chain of n hinges.

    Attributes:
        root: Its eigenvalue, -ζw + iw√(1 - ζ²) [rad/s].
        left: Its left eigenvector, shape (2 n + 2,): left · (angles, speeds) moves as exp(root t),
            whatever the other modes do.
        share: Its part of the tip's way for a pushed tip's sum of angles of one radian [m].
    """

    root: complex
    left: Complex
    share: float

    @property
    def swing_hz(self) -> float:
        """Frequency at which it swings [Hz], 0 if it creeps back."""
        return self.root.imag / (2 * math.pi)

    @property
    def natural_hz(self) -> float:
        """Frequency without damping [Hz]."""
        return abs(self.root) / (2 * math.pi)

    @property
    def damping(self) -> float:
        """Damping ratio ζ; 1 if it creeps back."""
        return -self.root.real / abs(self.root)

    @property
    def cycle(self) -> float:
        """Time of one cycle [s]: of the swing, or of the undamped one if it creeps back."""
        return 1.0 / (self.swing_hz or self.natural_hz)


def least_damping(left: float) -> float:
    """Damping ratio at which a share `left` of the amplitude is left after one cycle."""
    loss = -math.log(left)
    return loss / math.hypot(loss, 2 * math.pi)


def fitted_mode(mode: Mode, t: Floats, angles: Floats, speeds: Floats) -> Mode:
    """A mode with the eigenvalue that a recorded ring-down has; one that creeps back has no swing.

    Args:
        mode: The mode of the chain.
        t: Times [s], shape (m,).
        angles: Angles of the base and the n hinges then [rad], shape (m, n + 1).
        speeds: Their speeds [rad/s], same shape.
    """
    size = np.concatenate([angles, speeds], axis=1) @ mode.left
    weight = abs(size) / abs(size).max()
    grown = np.log(abs(size)) + 1j * np.unwrap(np.angle(size))
    decay, swing = (np.polyfit(t, part, 1, w=weight)[0] for part in (grown.real, grown.imag))
    return Mode(complex(decay, swing if mode.swing_hz else 0.0), mode.left, mode.share)


def _rods(joints: Floats, starts: Floats, lengths: Floats, mass: Floats, inertia: Floats) -> Floats:
    """Mass matrix of rods in a row over joint angles, shape (joints, joints).

    Args:
        joints: Places of the joints along the chain [m]; a rod moves with the joints before it.
        starts: Where each rod begins [m].
        lengths: Length of each rod [m].
        mass: Mass of each rod [kg].
        inertia: Moment of inertia of each about its middle [kg·m²].
    """
    moves = (joints[:, None] <= starts + 1e-12).astype(float)
    arms = moves * (starts + lengths / 2 - joints[:, None])
    return (arms * mass) @ arms.T + (moves * inertia) @ moves.T


def link_inertia(antenna: AntennaSpec) -> Floats:
    """Moment of inertia of each link about an axis across its middle [kg·m²], shape (n,)."""
    r, length = antenna.radius, antenna.link_length
    ends = antenna.link_mass * (4 * r / 3) / (length + 4 * r / 3)
    rod = antenna.link_mass - ends
    one = rod * (r * r / 4 + length**2 / 12)
    one += ends * (0.4 * r * r + length**2 / 4 + 3 * length * r / 8)
    return np.full(antenna.hinges, one)
