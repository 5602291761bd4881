"""The gait on a flat floor: how far each maneuver goes, what the lead of the body wave is worth.

The gait is its own mirror image half a cycle later, so over whole cycles FORWARD neither yaws nor
drifts. FORWARD is walked again for numbers that are not known, drawn from their ranges.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from antennate.figures import called
from antennate.params.control import GaitParams
from antennate.sim.world import World
from antennate.studies.experiment import Done, Experiment, checked
from antennate.studies.pool import Workers, gather
from antennate.studies.tables import Table
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.telemetry.header import log_name
from antennate.types import AntennaFrame, Maneuver
from antennate_lab.gait.config import GaitStudyConfig, drawn
from antennate_lab.gait.optimise import optimise
from antennate_lab.gait.physics import Walk, walk_flat
from antennate_lab.gait.result import (
    MANEUVERS,
    OPTIMISED,
    WAVE_OFF,
    GaitResult,
    Optimised,
    summarise,
)

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class Walks(Done):
    """All walks of a run, and what they come to.

    Attributes:
        walks: Each walk by its name, the maneuvers first.
    """

    walks: dict[str, Walk]


def check(config: GaitStudyConfig) -> None:
    """Find draws that make no robot or gait, or one too fast, before anything is run."""
    _tasks(config)


_Task = tuple[GaitStudyConfig, str, GaitParams, Maneuver]


def log_names(config: GaitStudyConfig) -> list[str]:
    """Names of the logs of all walks."""
    return [log_name(name) for _, name, _, _ in _tasks(config)]


def _tasks(config: GaitStudyConfig) -> list[_Task]:
    gait = config.gait
    forward = {WAVE_OFF: _changed(gait, amplitude=0.0)}
    for i in range(config.sweep_points):
        lead = 2.0 * math.pi * i / config.sweep_points
        forward[f"sweep{i}"] = _changed(gait, body_phase=lead)
    unknown = _unknown(config)
    for one in (config, *unknown.values()):
        one.robot.require_pace("gait.frequency", one.gait.frequency)
    return [
        *((config, m.name.lower(), gait, m) for m in MANEUVERS),
        *((config, name, one, Maneuver.FORWARD) for name, one in forward.items()),
        *((one, name, one.gait, Maneuver.FORWARD) for name, one in unknown.items()),
        *_optimum(config),
    ]


def _optimum(config: GaitStudyConfig) -> Iterator[_Task]:
    """The walk of the gait that is best by the model, if one is asked for."""
    if config.optimise != "none":
        robot, gait = config.robot, config.gait
        # frozen models have a hash, which the checker does not see
        best = optimise(robot, gait, config.optimise)  # pyright: ignore[reportArgumentType]
        turning = config.optimise == "turning"
        yield config, OPTIMISED, best, Maneuver.TURN_L if turning else Maneuver.FORWARD


def _unknown(config: GaitStudyConfig) -> dict[str, GaitStudyConfig]:
    """What is walked for the unknown numbers: each draw, then each number at its ends."""
    unknowns, configs = config.unknowns, dict[str, GaitStudyConfig]()
    if not unknowns:
        return configs
    names = [one.name for one in unknowns]
    for i, values in enumerate(drawn(unknowns, config.draws, config.seed).tolist()):
        configs[f"draw{i}"] = config.at(dict(zip(names, values, strict=True)))
    for one in unknowns:
        configs[f"{one.name}:low"] = config.at({one.name: one.low})
        configs[f"{one.name}:high"] = config.at({one.name: one.high})
    return configs


def _changed(gait: GaitParams, **values: float) -> GaitParams:
    return GaitParams(**{**gait.model_dump(), **values})


def _walk(task: _Task, logs: Path | None) -> Walk:
    """One walk, with its log if there is a folder."""
    return walk_flat(*task, logs=logs)


def _show(
    tasks: Sequence[_Task], on_step: OnStep, view: SimulationView, logs: Path | None
) -> Iterator[Walk]:
    """All walks on a page, one after the other."""
    names = {each.name.lower(): called(each) for each in MANEUVERS}
    for done, (config, name, gait, maneuver) in enumerate(tasks, start=1):

        def watch(world: World, frame: AntennaFrame, maneuver: Maneuver = maneuver) -> None:
            view.tick(world.model, world.data, frame, maneuver=int(maneuver))

        view.begin(names.get(name, name.replace("_", " ")))
        yield walk_flat(config, name, gait, maneuver, watch, logs)
        on_step(done, len(tasks))


def run(
    config: GaitStudyConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    view: SimulationView | None = None,
    logs: Path | None = None,
) -> Walks:
    """Walk all maneuvers, the one without body wave, the sweep, and the unknown numbers.

    With a view they run in this process, one after the other, and give the same. The log of each
    goes to a folder if one is given.
    """
    tasks = _tasks(config)
    if view is None:
        walks = gather(_walk, [(task, logs) for task in tasks], workers, on_step)
    else:
        walks = list(_show(tasks, on_step, view, logs))
    by_name = {walk.name: walk for walk in walks}
    return Walks(rows=(), found=summarise(config, by_name), walks=by_name)


def tables(result: GaitResult) -> Sequence[Table]:
    """The maneuvers, and what the lead of the body wave is worth."""
    cost, off = result.cost_of_phase, result.wave_off
    chosen, best = map(math.degrees, (result.chosen_body_phase_rad, result.best_body_phase_rad))
    share = "" if off.ratio is None else f", {100 * off.ratio:.0f} % of legs that roll without slip"
    maneuvers = Table.of(
        "Maneuvers",
        {name.upper(): pace for name, pace in result.maneuvers.items()},
        note=f"Body length {result.body_length_m:g} m, {result.frequency_hz:g} cycles a second.\n"
        f"Without the body wave {off.speed_m_s:z.3f} m/s{share}.\n"
        f"The fastest lead tried is {best:.0f} deg. The chosen lead of {chosen:.0f} deg "
        f"gives {100 * cost.chosen_over_best:.0f} % of its speed;\n"
        f"the slowest one gives {100 * cost.worst_over_best:.0f} %.",
    )
    return (maneuvers, *_optimised_tables(result.optimised), *_unknown_tables(result))


def _optimised_tables(found: Optimised | None) -> Sequence[Table]:
    """The gait that is best at something by the model, beside the given one."""
    if found is None:
        return ()
    note = "Chosen by the quasi-static model, walked in the engine; see docs/science/geometry.md."
    return (Table.of(f"Best {found.goal}", found.gaits, note=note),)


def _unknown_tables(result: GaitResult) -> Sequence[Table]:
    """FORWARD with each unknown number at both ends of its range, and with all of them drawn."""
    if (unknown := result.unknown) is None:
        return ()
    rows = [
        (
            name,
            [
                *(f"{end:g}" for end in each.range),
                *(f"{end:.2f}" for end in each.body_lengths_per_cycle),
            ],
        )
        for name, each in unknown.parameters.items()
    ]
    one = Table(
        "FORWARD with one number changed, body lengths a cycle",
        ("lower end", "upper end", "at the lower", "at the upper"),
        rows,
        f"As configured {result.maneuvers['forward'].body_lengths_per_cycle:.2f}.",
    )
    every = Table.of("All of them drawn", {"body lengths a cycle": unknown})
    if (measured := result.measured_body_lengths_per_cycle) is not None:
        below = sum(value < measured for value in unknown.body_lengths_per_cycle)
        more = [
            ("measured on a robot", [f"{measured:.2f}"]),
            ("draws below that", [f"{below} of {unknown.draws}"]),
        ]
        every = replace(every, rows=[*every.rows, *more])
    return one, every


def sentence(result: GaitResult) -> str:
    """Speed and turn of the gait."""
    forward, left = result.maneuvers["forward"], result.maneuvers["turn_l"]
    if (unknown := result.unknown) is not None:
        measured = result.measured_body_lengths_per_cycle
        low, high = unknown.interval95
        place = ""
        if measured is not None:
            where = "inside" if low <= measured <= high else "outside"
            place = f"; the measured {measured:.2f} is {where}"
        return (
            f"FORWARD walks {low:.2f} to {high:.2f} body lengths a cycle in 95 % of "
            f"{unknown.draws} draws of {len(unknown.parameters)} unknown numbers{place}."
        )
    return (
        f"FORWARD walks at {forward.speed_m_s:.3f} m/s and TURN_L turns by "
        f"{left.yaw_deg_per_cycle:.0f} deg a cycle in simulation{_best(result.optimised)}. "
        "A walk has no random part: a second run gives the same."
    )


def _best(found: Optimised | None) -> str:
    """What the optimised gait does, for the sentence; empty without one."""
    if found is None:
        return ""
    best = found.gaits[OPTIMISED]
    if found.goal == "turning":
        return f"; optimised, {best.yaw_deg_per_cycle:.1f} deg"
    cost = best.cost_of_transport
    at = "" if cost is None else f" at a cost of transport of {cost:.3f}"
    return f"; optimised for {found.goal}, {best.speed_m_s:.3f} m/s{at}"


EXPERIMENT = Experiment.of_folder(
    __name__,
    GaitStudyConfig,
    run,
    tables,
    sentence,
    result=GaitResult,
    settled=checked(check),
    logs=log_names,
    captions={
        "gait": "The sweep over the lead of the body wave, and the maneuvers from above.",
        "unknown": "FORWARD over all draws of the unknown numbers, and over each of them alone.",
    },
)
