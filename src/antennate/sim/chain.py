"""The chain solver of the bench: one antenna alone as a compiled planar chain, without the engine.

It takes what `bench` takes, solves the same equations with the same steps (see `chain_kernel`) and
runs a list of commands in one call. numba compiles it on first use, which takes some ten seconds,
and keeps what it compiled beside the package or in the user's cache.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from antennate.antenna.dynamics import link_inertia
from antennate.errors import MissingPackageError, OutputError, SimulationError, in_one_line
from antennate.messages import extra
from antennate.params.bench import Solver
from antennate.params.faults import Unread
from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import CARRIAGE_MASS, SLIDE_DAMPING, SLIDE_STIFFNESS, Ball, Bar
from antennate.sim.parts import STOPS
from antennate.sim.world import CONTACT_IMPEDANCE
from antennate.types import Bools, Floats

if TYPE_CHECKING:
    from types import ModuleType

    from antennate.sim.chain_kernel import Model

_STOP = (0.02, 0.9, 0.95, 0.001)
"""The engine's default for stops of joints: time constant [s], impedances, their width [rad]."""
_LEAST_FRICTION = 1e-5
"""The engine's least friction."""


def kernel() -> ModuleType:
    """The compiled part.

    Raises:
        MissingPackageError: numba is not installed.
        OutputError: What numba compiles cannot be kept.
    """
    try:
        return importlib.import_module("antennate.sim.chain_kernel")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("numba", "llvmlite"):
            raise
        raise MissingPackageError(
            "solver: expected the package numba for chain, found none; install it with "
            f"{extra('fast')}"
        ) from None
    except RuntimeError as error:
        if "cannot cache" not in str(error):
            raise
        raise OutputError(
            "solver: expected a folder to keep the compiled chain in, found none that can be "
            "written; name one in the variable NUMBA_CACHE_DIR"
        ) from None


class _Solved(Protocol):
    @property
    def solver(self) -> Solver: ...


def require_solver(config: _Solved) -> None:
    """Find out before a run whether its solver is there.

    Raises:
        MissingPackageError: numba is not installed.
        OutputError: What numba compiles cannot be kept.
    """
    if config.solver == "chain":
        kernel()


def require_read(solver: Solver, physics: PhysicsParams) -> None:
    """Check that a solver reads all numerics that were set.

    Raises:
        ValueError: It does not.
    """
    usual = type(physics).model_fields["sleep_tolerance"].default
    if solver == "chain" and physics.sleep_tolerance != usual:
        raise Unread(
            "physics.sleep_tolerance",
            "nothing sleeps with the solver chain",
            physics.sleep_tolerance,
        )


def warm_up(solver: Solver) -> None:
    """Compile the chain, or read it where it was kept, before several processes need it.

    Raises:
        MissingPackageError: numba is not installed.
        OutputError: What numba compiles cannot be kept, or what it kept cannot be read.
    """
    if solver != "chain":
        return
    bench = ChainBench(PhysicsParams(), AntennaSpec(), [Ball(1.0, 0.0, 0.1)])
    try:
        bench.drive(bench.commands(np.zeros((1, 2)), np.zeros(2), 0.0), 1)
    except SimulationError:
        raise
    except Exception as error:  # numba reads what it kept without care
        raise OutputError(
            f"solver: expected to keep the compiled chain in {kernel().drive.stats.cache_path}, "
            f"found {in_one_line(error)}; empty it, or name another in the variable NUMBA_CACHE_DIR"
        ) from error


@dataclass(frozen=True, slots=True)
class Motion:
    """What the antenna did, a row after each of k commands; `motion[rows]` keeps some of them.

    Attributes:
        lengths: Of the links [m], shape (n,).
        states: Place of the carriage [m], angles from the x axis of base and links [rad], place of
            the rod [m], shape (k, n + 5).
        force: Force of all obstacles on the antenna in the last physics step [N], shape (k, 2).
        touching: Whether any of them pressed then, shape (k,).
    """

    lengths: Floats
    states: Floats
    force: Floats
    touching: Bools

    def __getitem__(self, rows: slice | Sequence[int]) -> Motion:
        return Motion(self.lengths, self.states[rows], self.force[rows], self.touching[rows])

    @property
    def base(self) -> Floats:
        """Angle of the base [rad], shape (k,)."""
        return self.states[:, 2]

    @property
    def hinges(self) -> Floats:
        """Angles of the hinges [rad], shape (k, n)."""
        return np.diff(self.states[:, 2:-2], axis=1)

    @property
    def joints(self) -> Floats:
        """Positions of the n hinges and the tip [m], shape (k, n + 1, 2)."""
        angles, start = self.states[:, 3:-2], self.states[:, None, :2]
        ways = self.lengths[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return np.concatenate([start, start + np.cumsum(ways, axis=1)], axis=1)

    @property
    def probe(self) -> Floats:
        """Place of the rod [m], shape (k, 2); of no meaning without one."""
        return self.states[:, -2:]


class ChainBench:
    """One antenna on a carriage before obstacles, at the start along +x, straight and at rest.

    Args:
        physics: Numerics; contacts take `contact_time`. Nothing sleeps here.
        antenna: The antenna; its friction holds against every obstacle.
        obstacles: What stands there.
        gravity: Gravity in the plane [m/s²].
        probe_radius: Radius of a rod that moves on slides of its own [m]; none without.
        factors: What each spring's stiffness is multiplied with, shape (n,).

    Raises:
        MissingPackageError: numba is not installed.
    """

    def __init__(
        self,
        physics: PhysicsParams,
        antenna: AntennaSpec,
        obstacles: Sequence[Ball | Bar] = (),
        gravity: tuple[float, float] = (0.0, 0.0),
        probe_radius: float | None = None,
        factors: Floats | None = None,
    ) -> None:
        self._kernel = kernel()
        ends = [_capsule(obstacle) for obstacle in obstacles]
        if probe_radius is not None:
            ends.append((0.0, 0.0, 0.0, 0.0, probe_radius))
        self._model: Model = self._kernel.Model(
            **_bodies(antenna, np.ones(antenna.hinges) if factors is None else factors),
            timestep=physics.timestep,
            gravity=np.array(gravity, float),
            servo=np.array([SLIDE_STIFFNESS, SLIDE_DAMPING]),
            radius=antenna.radius,
            friction=max(antenna.friction, _LEAST_FRICTION),
            impratio=physics.impratio,
            touch=_softness(physics, physics.contact_time, *CONTACT_IMPEDANCE),
            stopping=_softness(physics, *_STOP),
            obstacles=np.array(ends, float).reshape(-1, 5),
            rod=-1 if probe_radius is None else len(ends) - 1,
        )
        self._q, self._v = np.zeros(antenna.hinges + 5), np.zeros(antenna.hinges + 5)
        self._steps = 0

    def place(self, x: float, y: float, base: float, hinges: Floats | float = 0.0) -> None:
        """Put the carriage at x, y [m], the base and the hinges at angles [rad], all at rest."""
        self._q[:2], self._q[2:-2] = (x, y), base
        self._q[3:-2] += np.cumsum(np.broadcast_to(hinges, len(self._q) - 5))
        self._v[:-2] = 0.0

    def place_probe(self, x: float, y: float) -> None:
        """Put the rod at x, y [m], at rest."""
        self._q[-2:], self._v[-2:] = (x, y), 0.0

    def commands(
        self,
        places: Floats,
        speeds: Floats,
        base: Floats | float,
        probe: Floats | None = None,
        probe_speeds: Floats | None = None,
    ) -> Floats:
        """Commands to carriage, base and rod, shape (k, 9).

        Args:
            places: Targets of the carriage [m], shape (k, 2).
            speeds: Its speeds there [m/s], shape (k, 2).
            base: Angles of the base [rad], shape (k,).
            probe: Targets of the rod [m], shape (k, 2); without, it stays where it was put.
            probe_speeds: Its speeds there [m/s], shape (k, 2).
        """
        commands = np.zeros((len(places), 9))
        commands[:, :2], commands[:, 2:4], commands[:, 4] = places, speeds, base
        commands[:, 5:7] = self._q[-2:] if probe is None else probe
        commands[:, 7:] = 0.0 if probe_speeds is None else probe_speeds
        return commands

    def drive(self, commands: Floats, steps: int) -> Motion:
        """Follow commands, `steps` physics steps each.

        Args:
            commands: As from `commands`, shape (k, 9).
            steps: Physics steps of a command.

        Raises:
            SimulationError: A command is not finite, the state left all bounds, or more touches at
                once than there is room for.
        """
        if not np.isfinite(commands).all():
            raise SimulationError(self._steps, "a command of the bench is not finite")
        count = len(commands)
        states, force = np.zeros((count, len(self._q))), np.zeros((count, 2))
        touching = np.zeros(count, bool)
        trouble, done = self._kernel.drive(
            *(self._model, self._q, self._v, commands, steps, states, force, touching)
        )
        self._steps += done * steps
        if trouble == self._kernel.CROWDED:
            most = self._kernel.MOST_TOUCHES
            raise SimulationError(self._steps, f"more than {most} contacts at once")
        if trouble:
            raise SimulationError(self._steps, "a hinge or a speed left all bounds")
        return Motion(self._model.length[1:], states, force, touching)


def _capsule(obstacle: Ball | Bar) -> tuple[float, float, float, float, float]:
    if isinstance(obstacle, Ball):
        return obstacle.x, obstacle.y, obstacle.x, obstacle.y, obstacle.radius
    return obstacle.x0, obstacle.y0, obstacle.x1, obstacle.y1, obstacle.radius


def _softness(
    physics: PhysicsParams, time: float, least: float, most: float, depth: float
) -> Floats:
    """A contact's impedances and its critically damped spring, as the engine takes them.

    Args:
        physics: Numerics.
        time: Time constant [s]; below two timesteps the engine takes two.
        least: Impedance of a touch.
        most: Impedance at `depth` [m or rad].
        depth: How deep that is.
    """
    rate = 1.0 / (most * max(time, 2.0 * physics.timestep))
    return np.array([least, most - least, 1.0 / depth, rate**2, 2.0 * rate])


def _bodies(antenna: AntennaSpec, factors: Floats) -> dict[str, float | Floats]:
    """What `Model` holds of the bodies; the base is one without length."""
    drive, n, link = antenna.base(), antenna.hinges, antenna.link_length
    length = np.array([0.0, *[link] * n])
    mass = np.array([antenna.base_mass, *[antenna.link_mass] * n])
    inertia = np.array([0.4 * antenna.base_mass * antenna.radius**2, *link_inertia(antenna)])
    inertia += mass * length**2 / 4
    armature = np.array([drive.armature, *[antenna.armature] * n])
    springs = np.array(antenna.hinge_stiffness())
    return {
        "length": length,
        "link_mass": mass,
        "inertia": inertia,
        "armature": armature,
        "stiffness": np.array([drive.stiffness, *(springs * factors)]),
        "damping": np.array([drive.damping, *(antenna.damping_time * springs)]),
        "stop": np.array([STOPS["range"][1], *[antenna.range] * n]),
        "mass": CARRIAGE_MASS,
        "torque": drive.torque,
        **_weights(length, mass, inertia, armature),
    }


def _weights(length: Floats, mass: Floats, inertia: Floats, armature: Floats) -> dict[str, Floats]:
    """Inverse inertias of the straight chain, from which the engine takes how soft contacts are.

    That of a joint belongs to its angle; that of a link is the mean over three directions at its
    middle, the one out of the plane being 0.
    """
    joints = np.cumsum(length) - length
    size = len(length)
    moves = np.tril(np.ones((size, size)))  # a link turns with the joints up to its own
    middles = moves * (joints + length / 2 - joints[:, None]).T
    rows = np.concatenate([np.ones((size, 1)), middles], axis=1)  # y of the carriage, then joints
    whole = (rows.T * mass) @ rows
    whole[0, 0] += CARRIAGE_MASS
    whole[1:, 1:] += (moves.T * (inertia - mass * length**2 / 4)) @ moves + np.diag(armature)
    inverse = np.asarray(np.linalg.inv(whole), np.float64)
    across = np.einsum("ij,jk,ik->i", rows, inverse, rows)
    return {
        "stop_weight": np.diag(inverse)[1:].copy(),
        "touch_weight": (across + 1.0 / float(whole[0, 0])) / 3.0,
    }
