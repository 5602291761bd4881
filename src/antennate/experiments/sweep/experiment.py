"""Base sweeps beside walls: which shapes appear when, and how well touch measures distances."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal

import numpy as np

from antennate.antenna.statics import Profile, with_profile
from antennate.experiments.bench import bench_films
from antennate.experiments.sweep.estimates import CUES, Trial, plan, run_trial, summarise
from antennate.experiments.sweep.physics import (
    Outlines,
    Shape,
    SweepConfig,
    Wall,
    outlines_csv,
    outlines_of,
    record,
    shares,
)
from antennate.params.bench import SweepParams
from antennate.sim.bench import Watch
from antennate.studies.experiment import Experiment, OnRow, OnStep, no_row, no_step
from antennate.studies.measures import Table, shown
from antennate.studies.pool import Workers, gather
from antennate.studies.statistics import mean95

MOTIONS = ("fixed", "moving")
SHAPES = tuple(shape.name.lower() for shape in Shape)
_TASK = 12
"""Sweeps handed to a process at once."""


@dataclass(frozen=True, slots=True)
class SweepRow:
    """One sweep, a row of trials.csv: a cell of the map, or a trial of the estimates.

    Columns that do not apply are empty.
    """

    seed: int
    trial: int
    kind: Literal["map", "estimate"]
    profile: str
    condition: str
    side: str
    status: str
    distance_m: float
    centre_rad: float
    amplitude_rad: float
    forward: float | None = None
    backward: float | None = None
    straight: float | None = None
    transition: float | None = None
    free: float | None = None
    peak_flex_rad: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class SweepOutcome:
    """The map and the estimates.

    Attributes:
        cells: Rows of the map in the order of profile, motion, distance, centre and amplitude.
        trials: Sweeps of the estimates in the order of condition, split, trial and side.
        outlines: Points of the antenna in each cell of `profile`, if they were to be saved.
    """

    config: SweepConfig
    cells: list[SweepRow]
    trials: list[Trial]
    outlines: list[Outlines] = field(default_factory=list[Outlines])

    @property
    def rows(self) -> list[SweepRow]:
        """Every sweep."""
        return [*self.cells, *(_row(self.config, trial) for trial in self.trials)]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        return {
            "schema": 1,
            "command": "sweep",
            "seed": config.seed,
            "length_m": config.antenna.length,
            "frequency_hz": config.sweep.frequency,
            "profile": config.profile,
            "shapes": {
                profile: {motion: self._shapes(profile, motion) for motion in MOTIONS}
                for profile in config.profiles
            },
            "estimates": summarise(self.trials, config.antenna.base_spacing),
            "published_percent": {"base_to_tip": 7.75, "gap": 6.73},
        }

    def _shapes(self, profile: str, motion: str) -> dict[str, Any]:
        rows = [r for r in self.cells if (r.profile, r.condition) == (profile, motion)]
        valid = [row for row in rows if row.status == "valid"]
        names = [*SHAPES, "free"]
        return {
            "cells": len(rows),
            "invalid": len(rows) - len(valid),
            "share": {name: _spread([getattr(r, name) for r in valid]) for name in names},
            "map": [
                {
                    "distance": row.distance_m / self.config.antenna.length,
                    "centre_rad": row.centre_rad,
                    "amplitude_rad": row.amplitude_rad,
                    **{name: getattr(row, name) for name in names},
                }
                for row in valid
            ],
        }


def _spread(shares: Sequence[float]) -> tuple[float, float | None, float | None]:
    """Mean of shares over the cells of the map, and how far it spreads."""
    mean, ends = mean95(np.array(shares), 0.0, 1.0)
    low, high = ends or (None, None)
    return mean, low, high


def _row(config: SweepConfig, trial: Trial) -> SweepRow:
    felt = trial.noisy
    return SweepRow(
        seed=config.seed,
        kind="estimate",
        profile=config.profile,
        condition=trial.condition,
        trial=trial.number,
        side=f"{trial.split}-{trial.side}",
        status="invalid" if trial.reason else "missed" if felt is None else "valid",
        distance_m=trial.distance,
        centre_rad=trial.sweep.centre,
        amplitude_rad=trial.sweep.amplitude,
        peak_flex_rad=None if felt is None else felt.peak,
        reason=trial.reason,
    )


def map_cell(
    config: SweepConfig,
    profile: Profile,
    motion: str,
    number: int,
    distance: float,
    centre: float,
    amplitude: float,
    watch: Watch | None = None,
) -> tuple[SweepRow, Outlines | None]:
    """Sweep in one cell of the map and share out the time between the shapes."""
    sweep = SweepParams(centre=centre, amplitude=amplitude, frequency=config.sweep.frequency)
    wall = Wall(distance * config.antenna.length)
    trace = record(
        config.physics,
        with_profile(config.antenna, profile),
        sweep,
        wall,
        config.sweeps + 1,
        config.speed if motion == "moving" else 0.0,
        config.shape.gap,
        watch,
    )
    shape: dict[str, Any] = {}
    if not trace.reason:
        shape = shares(config.shape, trace, 1.0 / sweep.frequency)
        shape["peak_flex_rad"] = float(abs(trace.flex).max())
    saved = config.points and profile == config.profile and not trace.reason
    row = SweepRow(
        seed=config.seed,
        kind="map",
        profile=profile,
        condition=motion,
        trial=number,
        side="l",
        status="invalid" if trace.reason else "valid",
        distance_m=wall.distance,
        centre_rad=centre,
        amplitude_rad=amplitude,
        reason=trace.reason,
        **shape,
    )
    return row, outlines_of(f"{motion} {number}", trace, 1.0 / sweep.frequency) if saved else None


def _sweep(function: Callable[..., Any], *arguments: Any) -> Any:
    return function(*arguments)


def run(
    config: SweepConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> SweepOutcome:
    """Sweep in every cell of the map and in every trial of the estimates.

    Raises:
        WorkerError: A worker process died.
    """
    grid = list(product(config.distances, config.centres, config.amplitudes))
    cells = [
        (map_cell, config, profile, motion, number, *cell)
        for profile, motion in product(config.profiles, MOTIONS)
        for number, cell in enumerate(grid)
    ]
    trials = [(run_trial, *trial) for trial in plan(config)]

    def keep(item: Any) -> None:
        on_row(_row(config, item) if isinstance(item, Trial) else item[0])

    items: list[Any] = gather(_sweep, [*cells, *trials], workers, on_step, keep, _TASK)
    mapped, tried = items[: len(cells)], items[len(cells) :]
    outlines = [points for _, points in mapped if points is not None]
    return SweepOutcome(config, [row for row, _ in mapped], tried, outlines)


QUANTITIES = ("distance", "gap", "base_to_tip")


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The shares of the shapes, and the errors of the estimates."""
    columns = {
        f"{profile}, {motion}": row
        for profile, motions in result["shapes"].items()
        for motion, row in motions.items()
        if profile == result["profile"] or result["profile"] not in result["shapes"]
    }
    shapes = Table(
        "Share of time of each shape, mean over the map (spread over cells)",
        list(columns),
        [
            (name, [_with_interval(*row["share"][name]) for row in columns.values()])
            for name in (*SHAPES, "free")
        ],
        "The map is a grid that was chosen. The spread over its cells, Student's t of their mean, "
        "is no interval of chance.",
    )
    return shapes, *(_errors(name, noise) for name, noise in result["estimates"].items())


def _errors(condition: str, by_noise: Mapping[str, Any]) -> Table:
    noisy = by_noise["noisy"]
    return Table(
        f"Mean absolute error [%] (95 %), sweep {condition}, with sensor noise",
        QUANTITIES,
        [
            (cue.replace("_", " "), [_error(noisy[quantity], cue) for quantity in QUANTITIES])
            for cue in CUES
        ],
        f"{noisy['sweeps']} test sweeps, {noisy['missed']} felt nothing, "
        f"{noisy['invalid']} invalid.",
    )


def _error(cues: Mapping[str, Any], cue: str) -> str:
    if cue not in cues:
        return shown(None)
    return _with_interval(cues[cue]["mape_percent"], *(cues[cue]["mape_95"] or (None, None)))


def _with_interval(mean: float | None, low: float | None, high: float | None) -> str:
    return shown(mean) if low is None else f"{shown(mean)} ({shown(low)}–{shown(high)})"


def sentence(result: Mapping[str, Any]) -> str:
    """How well active touch tells distances, beside the published figures."""
    noisy = result["estimates"]["same"]["noisy"]
    published = result["published_percent"]
    return (
        "Flex and base angle together tell the distance of a wall with an error of "
        f"{_error(noisy['distance'], 'flex_and_base')} % (95 % interval), that of the tip "
        f"{_error(noisy['base_to_tip'], 'flex_and_base')} % and a gap "
        f"{_error(noisy['gap'], 'flex_and_base')} %; published for CITRAS: "
        f"{published['base_to_tip']:g} % and {published['gap']:g} %."
    )


def _files(outcome: SweepOutcome) -> Mapping[str, str]:
    return {"points.csv": outlines_csv(outcome.outlines)} if outcome.outlines else {}


def _film(config: SweepConfig, profile: Profile, trial: int, watch: Watch) -> str:
    """Sweep in the middle cell of the map, the base at rest, for a film; the title."""
    axes = (config.distances, config.centres, config.amplitudes)
    distance, centre, amplitude = (axis[len(axis) // 2] for axis in axes)
    row, _ = map_cell(config, profile, "fixed", trial, distance, centre, amplitude, watch)
    ends = [f"{math.degrees(centre + side * amplitude):.0f}" for side in (-1, 1)]
    invalid = f": {row.status}" if row.reason else ""
    return f"{profile}, {' to '.join(ends)} deg{invalid}"


EXPERIMENT = Experiment.of_folder(
    *(__name__, SweepConfig, run, tables, sentence),
    films=bench_films(lambda config: config.profiles, _film, "wall"),
    files=_files,
    parts="sweeps",
    captions={
        "sweep": "Shares of the time in each shape, with the base fixed and moving, and "
        "the errors of the estimates.",
    },
    explained="docs/results.md",
)
