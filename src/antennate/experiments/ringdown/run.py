"""One ring-down of the compiled antenna, and what is compared with it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from antennate.antenna.dynamics import LinearChain, Mode, cone_ratio, fitted_mode, least_damping
from antennate.params.base import Params, number, paths_of, read_file
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import MOST_HINGES, AntennaSpec, SensorParams
from antennate.robots.spec import RobotSpec
from antennate.sim.bench import Bench, Watch, compile_bench, unwatched
from antennate.studies.experiment import Outcome
from antennate.types import Floats

REJECTED = 0.9
"""Share of a deflection that a cockroach's antenna has lost after one cycle (Mongeau 2014)."""
ANIMAL_CYCLE = 0.05
"""How long that cycle takes [s]; same source."""
_Hinges = Annotated[int, Field(ge=2, le=1000)]
_OF_THE_SENSOR = tuple(
    path for path in paths_of(SensorParams, "antenna.sensor") if "active_length" not in path
)


@dataclass(frozen=True, slots=True)
class Animal:
    """What was measured on an animal's antenna or whisker.

    Attributes:
        source: Where it was read.
        natural_hz: Lowest and highest frequency [Hz], None where no number was published.
        damping: Lowest and highest damping ratio, None where no number was published.
        finding: What was found, in words.
    """

    name: str
    source: str
    natural_hz: tuple[float, float] | None
    damping: tuple[float, float] | None
    finding: str


ANIMALS = (
    Animal(
        "rat whisker",
        "Hartmann 2003, PMC6740620",
        (27.0, 260.0),
        (0.11, 0.17),
        "first mode, the faster the shorter",
    ),
    Animal(
        "cockroach antenna",
        "Mongeau 2014, J. Exp. Biol. 217:3333",
        (1 / ANIMAL_CYCLE, 1 / ANIMAL_CYCLE),
        (least_damping(1 - REJECTED), 1.0),
        "over 90 % rejected in the first cycle of about 50 ms; so damping is .34 or more",
    ),
    Animal(
        "cricket antenna",
        "J. Exp. Biol. 228(9), jeb249243",
        (11.0, 30.0),
        (1.0, 1.0),
        "about 11 Hz bent, resonance at 30 Hz, near critical damping",
    ),
    Animal(
        "stick insect antenna",
        "rian.ie/94390",
        None,
        None,
        "does not swing; slower at the base",
    ),
)
"""Facts of other people's measurements, from their abstracts."""


class RingdownConfig(Params):
    """An antenna that is bent at its tip and let go."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        "antenna.base_spacing",
        *_OF_THE_SENSOR,
    )
    deflection: float = number(
        math.radians(5.0), "rad", "assumed: small, so that the chain is linear", gt=1e-4, le=0.5
    )
    """Sum of all angles before it is let go."""
    cycles: float = number(3.0, "1", "assumed: little is left then", ge=1.5, le=50)
    """Cycles of the first mode that are recorded."""
    cone_hinges: tuple[_Hinges, ...] = number(
        (6, 14, 40, MOST_HINGES), "1", "assumed: the robot's, the animal model's, and more"
    )
    """Hinges of the chains that stand for a cone."""
    beside: tuple[str, ...] = number((), "1", "assumed: none", metavar="FILE")
    """Files of robots whose antennae stand beside this one, by the first mode of their chains."""
    antenna: AntennaSpec = AntennaSpec()
    physics: BenchPhysicsParams = BenchPhysicsParams()


@dataclass(frozen=True)
class RingdownOutcome(Outcome):
    """A ring-down and its modes.

    Attributes:
        t: Times [s], shape (m,).
        tip: Sideways place of the tip over that at the start, shape (m,).
        engine: First mode fitted to the engine's ring-down.
        first: The same of the chain.
        modes: All modes of the chain, the slowest first.
        beside: First modes of the chains of other antennae, by the names of their files.
    """

    config: RingdownConfig
    t: Floats
    tip: Floats
    engine: Mode
    first: Mode
    modes: list[Mode]
    beside: dict[str, Mode]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        chain, engine = self.first, self.engine
        return {
            "schema": 1,
            "command": "ringdown",
            "engine": _mode(engine) | {"rejected": self.rejected(engine.cycle)},
            "chain": _mode(chain),
            "difference": {
                "natural_hz": engine.natural_hz / chain.natural_hz - 1,
                "damping": engine.damping / chain.damping - 1,
            },
            "rejected_in_animal_cycle": self.rejected(ANIMAL_CYCLE),
            "animal_damping": least_damping(1 - REJECTED),
            "modes": [_mode(mode) for mode in self.modes],
            "beside": [{"name": name, **_mode(mode)} for name, mode in self.beside.items()],
            "cones": [{"hinges": n, "ratio": cone_ratio(n)} for n in self.config.cone_hinges],
            "animals": [asdict(animal) for animal in ANIMALS],
        }

    def rejected(self, since: float) -> float:
        """Share of the deflection that the tip has lost for good after a time [s]."""
        return float(1.0 - abs(self.tip[self.t >= since]).max())


def _mode(mode: Mode) -> dict[str, float]:
    return {
        "natural_hz": mode.natural_hz,
        "swing_hz": mode.swing_hz,
        "damping": mode.damping,
        "cycle_s": mode.cycle,
    }


def run(config: RingdownConfig, watch: Watch = unwatched) -> RingdownOutcome:
    """Bend the compiled antenna as a load on its tip does, let it go and record it.

    Raises:
        ConfigError: A file of another antenna cannot be used.
        SimulationError: The physics became invalid.
    """
    others = {
        Path(name).stem.replace("_", " "): read_file(Path(name), RobotSpec).antenna
        for name in config.beside
    }
    antenna, timestep = config.antenna, config.physics.timestep
    chain = LinearChain.of(antenna)
    mode = chain.first_mode()
    bench = Bench(compile_bench(config.physics, antenna), antenna)
    bench.place(0.0, 0.0, 0.0)
    bench.bend(config.deflection * chain.pushed_at_tip())
    ticks = math.ceil(max(config.cycles * mode.cycle, 1.2 * ANIMAL_CYCLE) / timestep)
    angles, speeds = np.empty((2, ticks + 1, antenna.hinges + 1))
    tip = np.empty(ticks + 1)
    for tick in range(ticks + 1):
        watch(bench)
        angles[tick], speeds[tick] = bench.chain()
        tip[tick] = bench.tip()[1]
        bench.step(1)
    beside = {name: LinearChain.of(other).first_mode() for name, other in others.items()}
    t = np.linspace(0.0, ticks * timestep, ticks + 1)
    engine = fitted_mode(mode, t, angles, speeds)
    return RingdownOutcome(config, t, tip / tip[0], engine, mode, chain.modes(), beside)
