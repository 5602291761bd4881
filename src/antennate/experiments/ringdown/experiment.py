"""One ring-down of the compiled antenna, and what is compared with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from antennate import figures as style
from antennate.antenna.dynamics import LinearChain, Mode, cone_ratio, fitted_mode, least_damping
from antennate.experiments.ringdown.result import (
    ANIMAL_CYCLE,
    ANIMALS,
    REJECTED,
    Animal,
    Cone,
    Difference,
    EngineSwing,
    OtherSwing,
    RingdownResult,
    Swing,
)
from antennate.params.base import Params, number, paths_of, read_file
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import MOST_HINGES, AntennaSpec, SensorParams
from antennate.robots.spec import RobotSpec
from antennate.sim.bench import Bench, compile_bench
from antennate.studies.columns import columns, content
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.tables import Table
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_Hinges = Annotated[int, Field(ge=2, le=1000)]
_OF_THE_SENSOR = tuple(
    path for path in paths_of(SensorParams, "antenna.sensor") if "active_length" not in path
)


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
        found: The result.
    """

    t: Floats
    tip: Floats
    found: RingdownResult

    def result(self) -> RingdownResult:
        """The modes, and what is compared with them."""
        return self.found


def run(config: RingdownConfig) -> RingdownOutcome:
    """Bend the compiled antenna as a load on its tip does, let it go and record it.

    Raises:
        ConfigError: A file of another antenna cannot be used.
        SimulationError: The physics became invalid.
    """
    others = {
        Path(name).stem.replace("_", " "): read_file(Path(name), RobotSpec).antenna
        for name in config.beside
    }
    chain = LinearChain.of(config.antenna)
    mode = chain.first_mode()
    t, tip, engine = _let_go(config, chain, mode)
    found = RingdownResult(
        engine=EngineSwing.of(engine, rejected=_rejected(t, tip, engine.cycle)),
        chain=Swing.of(mode),
        difference=Difference(
            natural_hz=engine.natural_hz / mode.natural_hz - 1,
            damping=engine.damping / mode.damping - 1,
        ),
        rejected_in_animal_cycle=_rejected(t, tip, ANIMAL_CYCLE),
        animal_damping=least_damping(1 - REJECTED),
        modes=[Swing.of(each) for each in chain.modes()],
        beside=[
            OtherSwing.of(LinearChain.of(other).first_mode(), name=name)
            for name, other in others.items()
        ],
        cones=[Cone(hinges=n, ratio=cone_ratio(n)) for n in config.cone_hinges],
        animals=list(ANIMALS),
    )
    return RingdownOutcome(t, tip, found)


def _let_go(config: RingdownConfig, chain: LinearChain, mode: Mode) -> tuple[Floats, Floats, Mode]:
    """Times [s], places of the tip, both shape (m,), and the first mode, all in the engine."""
    antenna, timestep = config.antenna, config.physics.timestep
    bench = Bench(compile_bench(config.physics, antenna), antenna)
    bench.place(0.0, 0.0, 0.0)
    bench.bend(config.deflection * chain.pushed_at_tip())
    ticks = math.ceil(max(config.cycles * mode.cycle, 1.2 * ANIMAL_CYCLE) / timestep)
    angles, speeds = np.empty((2, ticks + 1, antenna.hinges + 1))
    tip = np.empty(ticks + 1)
    for tick in range(ticks + 1):
        angles[tick], speeds[tick] = bench.chain()
        tip[tick] = bench.tip()[1]
        bench.step(1)
    t = np.linspace(0.0, ticks * timestep, ticks + 1)
    return t, tip / tip[0], fitted_mode(mode, t, angles, speeds)


def _rejected(t: Floats, tip: Floats, since: float) -> float:
    """Share of the deflection that the tip has lost for good after a time [s]."""
    return float(1.0 - abs(tip[t >= since]).max())


def tables(result: RingdownResult) -> Sequence[Table]:
    """The first mode twice, chains beside a cone, and animals."""
    swings = {"engine": result.engine, "chain": result.chain}
    swings |= {f"chain of {other.name}": other for other in result.beside}
    note = (
        f"Engine over chain: frequency {100 * result.difference.natural_hz:+.2f} %, damping "
        f"{100 * result.difference.damping:+.2f} %.\nRejected within the "
        f"{1e3 * ANIMAL_CYCLE:.0f} ms of a cockroach's cycle: "
        f"{100 * result.rejected_in_animal_cycle:.0f} %."
    )
    cones = {f"{cone.hinges} hinges": cone for cone in result.cones}
    animals = {animal.name: _without_equal_ends(animal) for animal in result.animals}
    findings = (f"{each.name}: {each.finding} ({each.source})" for each in result.animals)
    return (
        Table.of("First mode", swings, columns(EngineSwing), note),
        Table.lines("First frequency of a cone as a chain", cones),
        Table.of("What animals do", animals, columns(Animal), "\n".join(findings)),
    )


def _without_equal_ends(animal: Animal) -> dict[str, Any]:
    """An animal with one number in place of an interval whose ends are equal."""
    return {
        key: value[0] if isinstance(value, tuple) and value[0] == value[1] else value
        for key, value in content(animal).items()
    }


def sentence(result: RingdownResult) -> str:
    """How the antenna recovers, beside an animal."""
    engine = result.engine
    enough = engine.rejected > REJECTED and engine.cycle_s <= 1.2 * ANIMAL_CYCLE
    times = engine.cycle_s / ANIMAL_CYCLE
    beside = "as fast as a cockroach's" if enough else f"{times:.1f} times a cockroach's"
    if engine.rejected <= REJECTED:
        beside += f", which rejects over {100 * REJECTED:.0f} %"
    return (
        f"The tip rejects {100 * engine.rejected:.0f} % of a deflection in its first cycle of "
        f"{1e3 * engine.cycle_s:.0f} ms, {beside}; simulated, not measured."
    )


@style.styled
def figures(outcome: RingdownOutcome) -> dict[str, Figure]:
    """Three panels of one antenna."""
    figure, result = style.canvas(style.WIDTH, 9.6), outcome.result()
    swing, beside, cones = figure.subplots(3, 1)
    _draw_swing(swing, result, outcome.t, outcome.tip)
    _draw_animals(beside, result)
    _draw_cones(cones, result.cones)
    return {"ringdown": figure}


def _draw_swing(panel: Axes, result: RingdownResult, t: Floats, tip: Floats) -> None:
    first, second, _ = style.series(3)
    cycle, chain = 1e3 * result.engine.cycle_s, result.chain
    decay = np.exp(-chain.damping * 2 * np.pi * chain.natural_hz * t)
    panel.axhspan(REJECTED - 1, 1 - REJECTED, color=style.FAINT, zorder=0, linewidth=0)
    panel.plot(1e3 * t, tip, color=first, label="tip in the engine")
    panel.plot(1e3 * t, decay, color=second, linestyle=(0, (4, 1.5)), label="decay of the chain")
    panel.axvline(cycle, color=style.MUTED, linewidth=0.8)
    panel.axvline(1e3 * ANIMAL_CYCLE, color=style.MUTED, linewidth=0.8, linestyle=":")
    panel.set(xlabel="time [ms]", ylabel="deflection, 1 at the start")
    panel.set_title(
        f"Let go: {100 * result.engine.rejected:.0f} % rejected in {cycle:.0f} ms (line);\n"
        f"cockroach {1e3 * ANIMAL_CYCLE:.0f} ms (dots), grey: 90 % rejected"
    )
    panel.legend()


def _draw_animals(panel: Axes, result: RingdownResult) -> None:
    animals = [
        (each.name, each.natural_hz, each.damping)
        for each in result.animals
        if each.natural_hz and each.damping
    ]
    colours = style.series(len(animals))
    for (name, (left, right), (low, high)), colour in zip(animals, colours, strict=True):
        middle, centre = (low + high) / 2, (left * right) ** 0.5
        bars: dict[str, Any] = {"color": colour, "linewidth": 3.0, "solid_capstyle": "butt"}
        panel.plot([left, right], [middle, middle], **bars)
        panel.plot([centre, centre], [low, high], **bars)
        panel.text(right * 1.15, middle, name.split()[0], va="center", fontsize=8)
    others = ((other.name, other) for other in result.beside)
    for name, swing in (("this antenna", result.engine), *others):
        at = swing.natural_hz, swing.damping
        panel.scatter(*at, color=style.INK, zorder=3)
        panel.annotate(name, at, (6, -1), textcoords="offset points", va="top", fontsize=8)
    panel.axhline(result.animal_damping, color=style.MUTED, linewidth=0.8)
    panel.set_xscale("log")
    panel.set_xlim(min(1.0, result.engine.natural_hz / 2), 1000)
    panel.set_ylim(0, 1.05)
    panel.set(xlabel="frequency [Hz]", ylabel="damping ratio")
    panel.set_title("Animals; above the line 90 % are\nrejected in one cycle")


def _draw_cones(panel: Axes, cones: Sequence[Cone]) -> None:
    hinges, error = [c.hinges for c in cones], [100 * abs(1 - c.ratio) for c in cones]
    panel.plot(hinges, error, color=style.series(1)[0], marker="o")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xticks(hinges, [str(n) for n in hinges])
    panel.minorticks_off()
    panel.set(xlabel="hinges", ylabel="frequency below the closed form [%]")
    panel.set_title("A cone as a chain")


EXPERIMENT = Experiment.of_folder(
    __name__,
    RingdownConfig,
    lambda config, *_: run(config),
    tables,
    sentence,
    result=RingdownResult,
    figures=figures,
    captions={
        "ringdown": "The swing of the antenna after it is let go, animals beside it, and a "
        "cone as a chain.",
    },
    workers="none",
)
