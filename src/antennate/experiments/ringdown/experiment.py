"""One ring-down of the compiled antenna, and what is compared with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from antennate import figures as style
from antennate.antenna.dynamics import LinearChain, Mode, cone_ratio, fitted_mode, least_damping
from antennate.experiments.bench import bench_films
from antennate.params.base import Params, number, paths_of, read_file
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import MOST_HINGES, AntennaSpec, SensorParams
from antennate.robots.spec import RobotSpec
from antennate.sim.bench import Bench, Watch, compile_bench, unwatched
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.measures import Measure, Table, shown
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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


MODE = (
    Measure("natural_hz", "frequency without damping", "Hz", form=".3f"),
    Measure("swing_hz", "frequency of the swing", "Hz", form=".3f"),
    Measure("damping", "damping ratio", form=".3f"),
    Measure("cycle_s", "one cycle", "ms", form=".0f", scale=1e3),
    Measure("rejected", "rejected in the first cycle", "%", form=".1f", scale=100.0),
)
ANIMAL = (
    Measure("natural_hz", "frequency", "Hz", form=".0f"),
    Measure("damping", "damping ratio"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The first mode twice, chains beside a cone, and animals."""
    difference = result["difference"]
    swings = {"engine": result["engine"], "chain": result["chain"]}
    swings |= {f"chain of {row['name']}": row for row in result.get("beside", ())}
    note = (
        f"Engine over chain: frequency {100 * difference['natural_hz']:+.2f} %, damping "
        f"{100 * difference['damping']:+.2f} %.\nRejected within the {1e3 * ANIMAL_CYCLE:.0f} ms "
        f"of a cockroach's cycle: {100 * result['rejected_in_animal_cycle']:.0f} %."
    )
    cones = Table(
        "First frequency of a cone as a chain",
        ["over the closed form"],
        [(f"{row['hinges']} hinges", [shown(row["ratio"], ".4f")]) for row in result["cones"]],
    )
    animals = {row["name"]: _without_equal_ends(row) for row in result["animals"]}
    findings = "\n".join(
        f"{row['name']}: {row['finding']} ({row['source']})" for row in animals.values()
    )
    return (
        Table.of("First mode", swings, MODE, note),
        cones,
        Table.of("What animals do", animals, ANIMAL, findings),
    )


def _without_equal_ends(row: Mapping[str, Any]) -> dict[str, Any]:
    """An animal with one number in place of an interval whose ends are equal."""
    keys = ("natural_hz", "damping")
    single = {key: row[key][0] for key in keys if row[key] and row[key][0] == row[key][1]}
    return {**row, **single}


def sentence(result: Mapping[str, Any]) -> str:
    """How the antenna recovers, beside an animal."""
    engine = result["engine"]
    enough = engine["rejected"] > REJECTED and engine["cycle_s"] <= 1.2 * ANIMAL_CYCLE
    times = engine["cycle_s"] / ANIMAL_CYCLE
    beside = "as fast as a cockroach's" if enough else f"{times:.1f} times a cockroach's"
    if engine["rejected"] <= REJECTED:
        beside += f", which rejects over {100 * REJECTED:.0f} %"
    return (
        f"The tip rejects {100 * engine['rejected']:.0f} % of a deflection in its first cycle of "
        f"{1e3 * engine['cycle_s']:.0f} ms, {beside}; simulated, not measured."
    )


@style.styled
def figures(outcome: RingdownOutcome) -> dict[str, Figure]:
    """Three panels of one antenna."""
    figure, result = style.canvas(style.WIDTH, 9.6), outcome.result()
    swing, beside, cones = figure.subplots(3, 1)
    _draw_swing(swing, result, outcome.t, outcome.tip)
    _draw_animals(beside, result)
    _draw_cones(cones, result)
    return {"ringdown": figure}


def _draw_swing(panel: Axes, result: Mapping[str, Any], t: Floats, tip: Floats) -> None:
    first, second, _ = style.series(3)
    cycle, chain = 1e3 * result["engine"]["cycle_s"], result["chain"]
    decay = np.exp(-chain["damping"] * 2 * np.pi * chain["natural_hz"] * t)
    panel.axhspan(REJECTED - 1, 1 - REJECTED, color=style.FAINT, zorder=0, linewidth=0)
    panel.plot(1e3 * t, tip, color=first, label="tip in the engine")
    panel.plot(1e3 * t, decay, color=second, linestyle=(0, (4, 1.5)), label="decay of the chain")
    panel.axvline(cycle, color=style.MUTED, linewidth=0.8)
    panel.axvline(1e3 * ANIMAL_CYCLE, color=style.MUTED, linewidth=0.8, linestyle=":")
    panel.set(xlabel="time [ms]", ylabel="deflection, 1 at the start")
    panel.set_title(
        f"Let go: {100 * result['engine']['rejected']:.0f} % rejected in {cycle:.0f} ms (line);\n"
        f"cockroach {1e3 * ANIMAL_CYCLE:.0f} ms (dots), grey: 90 % rejected"
    )
    panel.legend()


def _draw_animals(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = [row for row in result["animals"] if row["natural_hz"]]
    for row, colour in zip(rows, style.series(len(rows)), strict=True):
        (left, right), (low, high) = row["natural_hz"], row["damping"]
        middle, centre = (low + high) / 2, (left * right) ** 0.5
        bars: dict[str, Any] = {"color": colour, "linewidth": 3.0, "solid_capstyle": "butt"}
        panel.plot([left, right], [middle, middle], **bars)
        panel.plot([centre, centre], [low, high], **bars)
        panel.text(right * 1.15, middle, row["name"].split()[0], va="center", fontsize=8)
    engine = result["engine"]
    for row in [{"name": "this antenna", **engine}, *result["beside"]]:
        at = row["natural_hz"], row["damping"]
        panel.scatter(*at, color=style.INK, zorder=3)
        panel.annotate(row["name"], at, (6, -1), textcoords="offset points", va="top", fontsize=8)
    panel.axhline(result["animal_damping"], color=style.MUTED, linewidth=0.8)
    panel.set_xscale("log")
    panel.set_xlim(min(1.0, engine["natural_hz"] / 2), 1000)
    panel.set_ylim(0, 1.05)
    panel.set(xlabel="frequency [Hz]", ylabel="damping ratio")
    panel.set_title("Animals; above the line 90 % are\nrejected in one cycle")


def _draw_cones(panel: Axes, result: Mapping[str, Any]) -> None:
    rows = result["cones"]
    hinges, error = [r["hinges"] for r in rows], [100 * abs(1 - r["ratio"]) for r in rows]
    panel.plot(hinges, error, color=style.series(1)[0], marker="o")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xticks(hinges, [str(n) for n in hinges])
    panel.minorticks_off()
    panel.set(xlabel="hinges", ylabel="frequency below the closed form [%]")
    panel.set_title("A cone as a chain")


_SPEED = 0.2
"""Speed of the film over that of the antenna: the robot's swings 3 times in 1.2 s."""


def _film(config: RingdownConfig, condition: str, trial: int, watch: Watch) -> str:
    run(config, watch)
    return f"let go, {1 / _SPEED:g} times slower"


EXPERIMENT = Experiment.of_folder(
    *(__name__, RingdownConfig, lambda config, *_: run(config), tables, sentence),
    figures=figures,
    films=bench_films(lambda config: ["antenna"], _film, None, _SPEED, ".1f"),
    captions={
        "ringdown": "The swing of the antenna after it is let go, animals beside it, and a "
        "cone as a chain.",
    },
    explained="docs/results.md",
    on_workers=False,
)
