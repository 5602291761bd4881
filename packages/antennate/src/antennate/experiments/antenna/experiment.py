"""The experiment `antenna`: one run of its four parts, their tables, and what they come to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from antennate.experiments.antenna.config import AntennaConfig, read
from antennate.experiments.antenna.physics import (
    ANIMAL_CYCLE,
    Readings,
    Trace,
    bending_of,
    ringdown_of,
    sensor_of,
    springs_of,
    taper_of,
)
from antennate.experiments.antenna.result import (
    AntennaResult,
    Bending,
    Point,
    Pushed,
    Ringdown,
    Sensor,
    Springs,
    Swing,
    Taper,
    overlap,
)
from antennate.studies.columns import columns, shown
from antennate.studies.experiment import Experiment, RunOutcome
from antennate.studies.tables import Table

_SETS = 6
"""Most sets of springs in a table."""
_MODES = 3
"""Most modes in a table."""
_BENDS = 10
"""Most bends in a table."""


@dataclass(frozen=True)
class AntennaOutcome(RunOutcome):
    """An antenna, its readings, and the path of its tip."""

    config: AntennaConfig
    found: AntennaResult
    readings: Readings
    trace: Trace

    def result(self) -> AntennaResult:
        """Springs, taper, sensor, ring-down and bending."""
        return self.found


def run(config: AntennaConfig) -> AntennaOutcome:
    """Work out the springs and the taper, try the sensor, and let the antenna go."""
    springs, taper = springs_of(config), taper_of(config)
    sensor, readings = sensor_of(config)
    ringdown, trace = ringdown_of(config)
    found = AntennaResult(
        seed=config.seed,
        springs=springs,
        taper=taper,
        sensor=sensor,
        ringdown=ringdown,
        bending=bending_of(config),
    )
    return AntennaOutcome(config, found, readings, trace)


def tables(result: AntennaResult) -> Sequence[Table]:
    """Tables of springs, taper, sensor, bending, ring-down and modes."""
    return (
        *_of_springs(result.springs),
        _of_taper(result.taper),
        _of_sensor(result.sensor),
        _of_bending(result.bending),
        _of_ringdown(result.ringdown),
        _of_modes(result.ringdown.modes),
    )


def _of_bending(found: Bending) -> Table:
    step = -(-(len(found.curve) - 1) // (_BENDS - 1))
    _, *measures = columns(Pushed)
    return Table(
        "Pushed at its tip",
        [measure.title for measure in measures],
        [(f"{p.tip_mm:.0f} mm aside", [m.cell(p) for m in measures]) for p in found.curve[::step]],
        borne(found),
    )


def borne(found: Bending) -> str:
    """The largest forces that an antenna bears on its tip, in one sentence."""
    end = {
        "yield": f"the wire of spring {found.ends_at_hinge} yields",
        "stop": f"hinge {found.ends_at_hinge} is at its stop",
        "unstable": "its rest is not stable any more",
    }[found.ends_by]
    turned = f"before a hinge turns {found.angle_deg:g} deg"
    first = f"{1e3 * found.bearable_n:.0f} mN {turned}, and " if found.bearable_n else ""
    return (
        f"At the tip it bears {first}{1e3 * found.sound_n:.0f} mN before {end}"
        f"{'' if first else f', which is {turned}'}. The force turns with the last link."
    )


def _of_modes(modes: Sequence[Swing]) -> Table:
    return Table.of(
        "First modes of the chain with its servo",
        {f"mode {i + 1}": mode for i, mode in enumerate(modes[:_MODES])},
    )


def _of_springs(found: Springs) -> tuple[Table, Table]:
    asked = Table.of(
        "Springs",
        {f"{spring.active_coils:g} coils": spring for spring in found.springs},
        note=f"Spring index {found.spring_index:.1f}. Stiffness goes with 1 / coils; the paper "
        f"rounds its table.{overlap(found.coil_outer_mm, found.hinge_distance_mm)}",
    )
    wound = Table.of(
        "Sets to wind",
        {f"{each.wire_mm:.2f} mm": each for each in found.windings[:_SETS]},
        note=f"The best mandrel of each stock wire of {found.wire}, nearest first. For printed "
        "parts wind the springs of `antennate build` instead: its pins and stops are made for them."
        if found.windings
        else "",
    )
    return asked, wound


def _of_taper(found: Taper) -> Table:
    ladder, suggested = found.ladder, found.suggested
    springs = zip(found.stretches, ladder.proxy, suggested.proxy, strict=True)
    return Table(
        "Taper, over the first spring",
        ("animal", "ladder", "suggested"),
        [(f"spring {i + 1}", [shown(v, ".3g") for v in row]) for i, row in enumerate(springs)],
        f"Base over tip of the animal {found.base_over_tip:.0f} : 1. Its stretches fall "
        f"{found.stretch_ratio:.0f} : 1, the ladder ({ladder.name}) {ladder.base_over_tip:.3g} : "
        f"1, the suggested one ({suggested.name}) {suggested.base_over_tip:.3g} : 1; "
        f"{ladder.distance_decades:.2f} and {suggested.distance_decades:.2f} decades from the "
        "animal (root mean square).",
    )


def _of_sensor(found: Sensor) -> Table:
    step = -(-(len(found.curve) - 1) // (_BENDS - 1))
    way = "rise" if found.polarity > 0 else "fall"
    kind = "flex sensor" if found.kind == "flex" else "pressure strip"
    clipped = "\nThe range is clipped by the converter." if found.clipped else ""
    measures = columns(Point)
    return Table(
        "Sensor: static curve",
        [measure.title for measure in measures],
        [(f"{p.flex_deg:.0f} deg", [m.cell(p) for m in measures]) for p in found.curve[::step]],
        f"A {kind}: counts {way} with flex, over {found.counts_span:.0f} "
        f"counts.\nLoop: {100 * found.loop_width_share:.0f} % of the span wide. Creep: "
        f"{found.creep_counts:.0f} counts. Noise: {found.noise_sd_counts:.1f} counts.{clipped}",
    )


def _of_ringdown(found: Ringdown) -> Table:
    engine, chain = found.engine, found.chain
    swings = {"engine": engine, "chain": chain}
    swings |= {f"chain of {name}": other for name, other in found.beside.items()}
    return Table.of(
        "Ring-down: first mode",
        swings,
        note=f"Engine over chain: frequency {100 * (engine.natural_hz / chain.natural_hz - 1):+.2f}"
        f" %, damping {100 * (engine.damping / chain.damping - 1):+.2f} %.\nRejected in the first "
        f"cycle: {100 * found.rejected:.1f} %; within the {1e3 * ANIMAL_CYCLE:.0f} ms of a "
        f"cockroach's, which rejects over 90 %: {100 * found.rejected_in_animal_cycle:.0f} %.",
    )


def sentence(result: AntennaResult) -> str:
    """How near the springs come to what is wanted, what the sensor reads, and how it recovers."""
    springs, sensor, swing = result.springs, result.sensor, result.ringdown.engine
    wanted = f"{', '.join(f'{k:g}' for k in springs.wanted_n_mm_per_deg)} N·mm/deg"
    nearest = f"No stock wire of {springs.wire} gives {wanted} within the limits"
    if springs.windings:
        best = springs.windings[0]
        nearest = (
            f"Of {springs.wire}, stock wire of {best.wire_mm:.2f} mm on a mandrel of "
            f"{best.mandrel_mm:.1f} mm comes nearest, within {100 * best.largest_error:.1f} % of "
            f"{wanted} (for printed parts `antennate build` chooses)"
        )
    used, best_ohm = 1e-3 * sensor.divider_ohm, 1e-3 * sensor.best_divider_ohm
    return (
        f"{nearest}; a divider of {used:g} kOhm spreads readings over {sensor.counts_span:.0f} "
        f"counts, the best of E24, {best_ohm:g} kOhm, over {sensor.best_counts_span:.0f}; let go, "
        f"the tip rejects {100 * result.ringdown.rejected:.0f} % of a deflection in its first "
        f"cycle of {1e3 * swing.cycle_s:.0f} ms, {swing.cycle_s / ANIMAL_CYCLE:.1f} times a "
        "cockroach's; computed and simulated, not measured."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    AntennaConfig,
    lambda config, *_: run(config),
    tables,
    sentence,
    result=AntennaResult,
    captions={
        "drawing": "The antenna to scale, from the side and from above, with what is to be made.",
        "bending": "Force and reading over how far the tip is pushed aside.",
        "springs": "Torque of each spring up to its yield.",
        "taper": "Stiffness along the antenna of the animal, and along the springs of the robot.",
        "sensor": "Readings of one sensor over flex with the loop, a bend that is held, "
        "and the choice of the divider.",
        "ringdown": "The swing of the antenna after it is let go, and animals beside it.",
    },
    workers="none",
    of_file=read,
)
