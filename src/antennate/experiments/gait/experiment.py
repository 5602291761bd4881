"""The gait on a flat floor: how far each maneuver goes, what the lead of the body wave is worth.

The gait is its own mirror image half a cycle later, so over whole cycles FORWARD neither yaws nor
drifts. FORWARD is walked again for numbers that are not known, drawn from their ranges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.colours import called
from antennate.experiments.gait.config import GaitStudyConfig, drawn
from antennate.experiments.gait.optimise import optimise
from antennate.experiments.gait.physics import (
    Pace,
    Walk,
    measure,
    rolling_speed,
    walk_flat,
)
from antennate.params.control import GaitParams
from antennate.sim.world import World
from antennate.studies.experiment import Experiment, OnRow, OnStep, Outcome, no_row, no_step
from antennate.studies.measures import Measure, Table, shown
from antennate.studies.pool import Workers, gather
from antennate.telemetry.header import log_name
from antennate.types import AntennaFrame, Maneuver

if TYPE_CHECKING:
    from antennate.telemetry.film import Film
    from antennate.telemetry.view.simulation import SimulationView

MANEUVERS = (Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.TURN_R, Maneuver.REVERSE)
WAVE_OFF, OPTIMISED = "wave_off", "optimised"


@dataclass(frozen=True, slots=True)
class GaitOutcome(Outcome):
    """All walks: four maneuvers by name, one without body wave, and the sweep over its lead.

    Attributes:
        drawn: FORWARD for each draw of the unknown numbers.
        ends: FORWARD with each of them alone at its lower and its upper end.
        optimised: A gait that is best at something by the model, TURN_L where that is turning; None
            unless asked for.
    """

    config: GaitStudyConfig
    maneuvers: dict[str, Walk]
    wave_off: Walk
    sweep: list[Walk]
    drawn: list[Walk]
    ends: dict[str, tuple[Walk, Walk]]
    optimised: Walk | None

    def pace(self, walk: Walk) -> Pace:
        """What a walk of this study comes to."""
        return measure(walk, self.config.settling_cycles, self.config.cycles)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        rolling = None
        if config.robot.legs.kind == "rolling":
            rolling = rolling_speed(config.gait, config.robot)
        straight = self.pace(self.wave_off).speed
        chosen = self.pace(self.maneuvers["forward"]).speed
        swept = [self.pace(walk) for walk in self.sweep]
        speeds = [pace.speed for pace in swept]
        best = max(speeds)
        return {
            "schema": 1,
            "command": "gait",
            "body_length_m": config.length,
            "frequency_hz": config.gait.frequency,
            "maneuvers": {name: self._row(walk) for name, walk in self.maneuvers.items()},
            "wave_off": {
                "speed_m_s": straight,
                "expected_m_s": rolling,
                "ratio": None if rolling is None else straight / rolling,
            },
            "phase_sweep": [
                {
                    "body_phase_rad": walk.gait.body_phase,
                    "speed_m_s": pace.speed,
                    "body_lengths_per_cycle": pace.body_lengths,
                }
                for walk, pace in zip(self.sweep, swept, strict=True)
            ],
            "chosen_body_phase_rad": config.gait.body_phase,
            "best_body_phase_rad": self.sweep[speeds.index(best)].gait.body_phase,
            "cost_of_phase": {
                "chosen_over_best": chosen / best,
                "worst_over_best": min(speeds) / best,
            },
            "measured_body_lengths_per_cycle": config.measured,
            "unknown": self._unknown() if self.drawn else None,
            "optimised": None if self.optimised is None else self._optimised(self.optimised),
        }

    def _optimised(self, walk: Walk) -> dict[str, Any]:
        """The optimised gait beside the one it is compared with."""
        goal = self.config.optimise
        name = "turn_l" if goal == "turning" else "forward"
        rows = {name: self.maneuvers[name], OPTIMISED: walk}
        return {
            "goal": goal,
            "gaits": {
                name: {
                    "amplitude_rad": row.gait.amplitude,
                    "wave_number": row.gait.wave_number,
                    "body_phase_rad": row.gait.body_phase,
                    "turn_offset_rad": row.gait.turn_offset if goal == "turning" else None,
                    **self._row(row),
                }
                for name, row in rows.items()
            },
        }

    def _unknown(self) -> dict[str, Any]:
        """What the unknown numbers make of FORWARD, in body lengths a cycle."""
        lengths = np.array([self.pace(walk).body_lengths for walk in self.drawn])
        ends = {n: [self.pace(walk).body_lengths for walk in both] for n, both in self.ends.items()}
        low, median, high = np.percentile(lengths, [2.5, 50.0, 97.5]).tolist()
        return {
            "draws": len(lengths),
            "median": median,
            "interval95": [low, high],
            "range": [float(lengths.min()), float(lengths.max())],
            "body_lengths_per_cycle": lengths.tolist(),
            "parameters": {
                one.name: {
                    "range": [one.low, one.high],
                    "body_lengths_per_cycle": ends[one.name],
                    "change": ends[one.name][1] - ends[one.name][0],
                }
                for one in self.config.unknowns
            },
        }

    def _row(self, walk: Walk) -> dict[str, Any]:
        pace = self.pace(walk)
        return {
            "speed_m_s": pace.speed,
            "body_lengths_per_cycle": pace.body_lengths,
            "yaw_deg_per_cycle": math.degrees(pace.yaw),
            "cost_of_transport": pace.cost_of_transport,
        }


def check(config: GaitStudyConfig) -> None:
    """Find draws that make no robot or gait before anything is run.

    Raises:
        ConfigError: There is one.
    """
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
    return [
        *((config, m.name.lower(), gait, m) for m in MANEUVERS),
        *((config, name, one, Maneuver.FORWARD) for name, one in forward.items()),
        *((one, name, one.gait, Maneuver.FORWARD) for name, one in _unknown(config).items()),
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
) -> GaitOutcome:
    """Walk all maneuvers, the one without body wave, the sweep, and the unknown numbers.

    With a view they run in this process, one after the other, and give the same. The log of each
    goes to a folder if one is given.

    Raises:
        ConfigError: A draw of the unknown numbers makes no robot or gait.
        LogError: A log cannot be written.
        SimulationError: The physics became invalid; from a worker it comes as a WorkerError.
    """
    tasks = _tasks(config)
    if view is None:
        walks = gather(_walk, [(task, logs) for task in tasks], workers, on_step)
    else:
        walks = list(_show(tasks, on_step, view, logs))
    by_name = {walk.name: walk for walk in walks}
    return GaitOutcome(
        config=config,
        maneuvers={m.name.lower(): by_name[m.name.lower()] for m in MANEUVERS},
        wave_off=by_name[WAVE_OFF],
        sweep=[by_name[f"sweep{i}"] for i in range(config.sweep_points)],
        drawn=[by_name[f"draw{i}"] for i in range(config.draws) if config.unknown],
        ends={
            one.name: (by_name[f"{one.name}:low"], by_name[f"{one.name}:high"])
            for one in config.unknowns
        },
        optimised=by_name.get(OPTIMISED),
    )


MANEUVER = (
    Measure("speed_m_s", "speed", "m/s", form="+.3f"),
    Measure("body_lengths_per_cycle", "body lengths a cycle", form="+.2f"),
    Measure("yaw_deg_per_cycle", "yaw a cycle", "deg", form="+.1f"),
    Measure("cost_of_transport", "cost of transport", form=".3f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The maneuvers, and what the lead of the body wave is worth."""
    cost, off = result["cost_of_phase"], result["wave_off"]
    chosen, best = (math.degrees(result[f"{k}_body_phase_rad"]) for k in ("chosen", "best"))
    share = "" if off["ratio"] is None else f", {100 * off['ratio']:.0f} % of legs that roll"
    maneuvers = Table.of(
        "Maneuvers",
        {name.upper(): row for name, row in result["maneuvers"].items()},
        MANEUVER,
        f"Body length {result['body_length_m']:g} m, {result['frequency_hz']:g} cycles a second.\n"
        f"Without the body wave {off['speed_m_s']:z.3f} m/s{share and f'{share} without slip'}.\n"
        f"The fastest lead tried is {best:.0f} deg. The chosen lead of {chosen:.0f} deg "
        f"gives {100 * cost['chosen_over_best']:.0f} % of its speed;\n"
        f"the slowest one gives {100 * cost['worst_over_best']:.0f} %.",
    )
    return (maneuvers, *_optimised_tables(result), *_unknown_tables(result))


_OPTIMISED = (
    Measure("amplitude_rad", "amplitude", "deg", form=".1f", scale=math.degrees(1.0)),
    Measure("wave_number", "wave number"),
    Measure("body_phase_rad", "lead", "deg", form=".0f", scale=math.degrees(1.0)),
    Measure("turn_offset_rad", "yaw offset", "deg", form=".1f", scale=math.degrees(1.0)),
    *MANEUVER,
)


def _optimised_tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The gait that is best at something by the model, beside the given one."""
    if (found := result["optimised"]) is None:
        return ()
    note = "Chosen by the quasi-static model, walked in the engine; see docs/science/geometry.md."
    return (Table.of(f"Best {found['goal']}", found["gaits"], _OPTIMISED, note),)


def _unknown_tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """FORWARD with each unknown number at both ends of its range, and with all of them drawn."""
    if (unknown := result["unknown"]) is None:
        return ()
    rows = [
        (
            name,
            [
                *(f"{end:g}" for end in row["range"]),
                *(f"{end:.2f}" for end in row["body_lengths_per_cycle"]),
            ],
        )
        for name, row in unknown["parameters"].items()
    ]
    one = Table(
        "FORWARD with one number changed, body lengths a cycle",
        ("lower end", "upper end", "at the lower", "at the upper"),
        rows,
        f"As configured {result['maneuvers']['forward']['body_lengths_per_cycle']:.2f}.",
    )
    every = [
        ("median", [f"{unknown['median']:.2f}"]),
        ("95 % of the draws", [shown(unknown["interval95"])]),
        ("all draws", [shown(unknown["range"])]),
    ]
    if (measured := result["measured_body_lengths_per_cycle"]) is not None:
        every += [("measured on a robot", [f"{measured:.2f}"])]
        below = sum(value < measured for value in unknown["body_lengths_per_cycle"])
        every += [("draws below that", [f"{below} of {unknown['draws']}"])]
    return one, Table("All of them drawn", ("body lengths a cycle",), every)


def sentence(result: Mapping[str, Any]) -> str:
    """Speed and turn of the gait."""
    forward, left = result["maneuvers"]["forward"], result["maneuvers"]["turn_l"]
    if (unknown := result["unknown"]) is not None:
        measured = result["measured_body_lengths_per_cycle"]
        low, high = unknown["interval95"]
        place = ""
        if measured is not None:
            where = "inside" if low <= measured <= high else "outside"
            place = f"; the measured {measured:.2f} is {where}"
        return (
            f"FORWARD walks {low:.2f} to {high:.2f} body lengths a cycle in 95 % of "
            f"{unknown['draws']} draws of {len(unknown['parameters'])} unknown numbers{place}."
        )
    return (
        f"FORWARD walks at {forward['speed_m_s']:.3f} m/s and TURN_L turns by "
        f"{left['yaw_deg_per_cycle']:.0f} deg a cycle in simulation{_best(result['optimised'])}. "
        "A walk has no random part: a second run gives the same."
    )


def _best(optimised: Mapping[str, Any] | None) -> str:
    """What the optimised gait does, for the sentence; empty without one."""
    if optimised is None:
        return ""
    row = optimised["gaits"][OPTIMISED]
    if optimised["goal"] == "turning":
        return f"; optimised, {row['yaw_deg_per_cycle']:.1f} deg"
    cost = row["cost_of_transport"]
    at = "" if cost is None else f" at a cost of transport of {cost:.3f}"
    return f"; optimised for {optimised['goal']}, {row['speed_m_s']:.3f} m/s{at}"


def films(config: GaitStudyConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each maneuver; walks have no chance, so that `trial` says nothing."""
    return {m.name.lower(): partial(_record, config, m) for m in MANEUVERS}


def _record(config: GaitStudyConfig, maneuver: Maneuver) -> Film:
    """Walk one maneuver and record it.

    Raises:
        SimulationError: The physics became invalid.
    """
    from antennate.telemetry import film  # slow to import

    recorder = film.WalkRecorder(config.robot, width=2.2)

    def watch(world: World, frame: AntennaFrame) -> None:
        recorder.see(world, world.t, counts=frame.counts[0], centre=world.links().mean(axis=0))

    walk_flat(config, maneuver.name.lower(), config.gait, maneuver, watch)
    way = recorder.values("centre") - recorder.values("centre")[0]
    return recorder.walk(
        maneuver.name,
        [film.trace("way of the middle: x, y [m]", way)],
        [film.maneuver_band(np.full(len(recorder), int(maneuver)))],
    )


EXPERIMENT = Experiment.of_folder(
    *(__name__, GaitStudyConfig, run, tables, sentence),
    check=check,
    films=films,
    parts="walks",
    logs=log_names,
    shown=True,
    captions={
        "gait": "The sweep over the lead of the body wave, and the maneuvers from above.",
        "unknown": "FORWARD over all draws of the unknown numbers, and over each of them alone.",
    },
    explained="docs/results.md",
)
