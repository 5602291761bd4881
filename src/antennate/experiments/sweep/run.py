"""Base sweeps beside walls: which shapes appear when, and what active touch tells of distances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np

from antennate.antenna.statics import with_profile
from antennate.experiments.sweep import estimates
from antennate.experiments.sweep import scan as sweeping
from antennate.experiments.sweep.config import SweepConfig
from antennate.experiments.sweep.estimates import Trial
from antennate.experiments.sweep.reach import CUES
from antennate.params import SweepParams
from antennate.studies.experiment import OnRow, OnStep, no_row, no_step
from antennate.studies.pool import gather
from antennate.studies.statistics import mean95

__all__ = ["CUES", "MOTIONS", "SHAPES", "SweepConfig", "SweepOutcome", "SweepRow", "run"]

SCHEMA = 1
MOTIONS = ("fixed", "moving")
SHAPES = tuple(shape.name.lower() for shape in sweeping.Shape)
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
    forward: float | None
    backward: float | None
    straight: float | None
    transition: float | None
    free: float | None
    peak_flex_rad: float | None
    reason: str


@dataclass(frozen=True, slots=True)
class SweepOutcome:
    """The map and the estimates.

    Attributes:
        config: What was run.
        cells: Rows of the map in the order of profile, motion, distance, centre and amplitude.
        trials: Sweeps of the estimates in the order of condition, split, trial and side.
    """

    config: SweepConfig
    cells: list[SweepRow]
    trials: list[Trial]

    @property
    def rows(self) -> list[SweepRow]:
        """Every sweep."""
        return [*self.cells, *(_row(self.config, trial) for trial in self.trials)]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        config = self.config
        return {
            "schema": SCHEMA,
            "command": "sweep",
            "seed": config.seed,
            "length_m": config.antenna.length,
            "frequency_hz": config.sweep.frequency,
            "profile": config.profile,
            "shapes": {
                profile: {motion: self._shapes(profile, motion) for motion in MOTIONS}
                for profile in config.profiles
            },
            "estimates": estimates.summarise(self.trials, config.antenna.base_spacing),
            "published_percent": {"base_to_tip": 7.75, "gap": 6.73},
        }

    def _shapes(self, profile: str, motion: str) -> dict[str, Any]:
        rows = [r for r in self.cells if (r.profile, r.condition) == (profile, motion)]
        valid = [row for row in rows if row.status == "valid"]
        names = [*SHAPES, "free"]
        return {
            "cells": len(rows),
            "invalid": len(rows) - len(valid),
            "share": {name: mean95(np.array([getattr(r, name) for r in valid])) for name in names},
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
        forward=None,
        backward=None,
        straight=None,
        transition=None,
        free=None,
        peak_flex_rad=None if felt is None else felt.peak,
        reason=trial.reason,
    )


@dataclass(frozen=True, slots=True)
class _Cell:
    profile: str
    motion: str
    number: int
    distance: float
    centre: float
    amplitude: float


def _cells(config: SweepConfig) -> list[_Cell]:
    grid = list(product(config.distances, config.centres, config.amplitudes))
    return [
        _Cell(profile, motion, number, *cell)
        for profile in config.profiles
        for motion in MOTIONS
        for number, cell in enumerate(grid)
    ]


def map_cell(config: SweepConfig, cell: _Cell) -> SweepRow:
    """Sweep in one cell of the map and share out the time between the shapes."""
    sweep = SweepParams(
        centre=cell.centre, amplitude=cell.amplitude, frequency=config.sweep.frequency
    )
    wall = sweeping.Wall(cell.distance * config.antenna.length)
    trace = sweeping.record(
        config.physics,
        with_profile(config.antenna, cell.profile),
        sweep,
        wall,
        config.sweeps + 1,
        config.speed if cell.motion == "moving" else 0.0,
        config.shape.gap,
    )
    found: dict[str, Any] = dict.fromkeys((*SHAPES, "free", "peak_flex_rad"))
    if not trace.reason:
        found = sweeping.shares(config.shape, trace, 1.0 / sweep.frequency)
        found["peak_flex_rad"] = float(abs(trace.flex).max())
    return SweepRow(
        seed=config.seed,
        kind="map",
        profile=cell.profile,
        condition=cell.motion,
        trial=cell.number,
        side="l",
        status="invalid" if trace.reason else "valid",
        distance_m=wall.distance,
        centre_rad=cell.centre,
        amplitude_rad=cell.amplitude,
        reason=trace.reason,
        **found,
    )


_Task = tuple[SweepConfig, list[tuple[int, Any]]]


def _run_task(task: _Task, emit: Callable[[Any], None]) -> None:
    config, parts = task
    for k, part in parts:
        if isinstance(part, _Cell):
            emit((k, map_cell(config, part)))
        else:
            emit((k, estimates.run_trial(config, *part)))


def run(
    config: SweepConfig,
    workers: int = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> SweepOutcome:
    """Sweep in every cell of the map and in every trial of the estimates.

    Raises:
        WorkerError: A worker process died.
    """
    cells = _cells(config)
    parts: list[tuple[int, Any]] = list(enumerate([*cells, *estimates.plan(config.estimate)]))
    tasks = [(config, parts[i : i + _TASK]) for i in range(0, len(parts), _TASK)]

    def keep(item: tuple[int, Any]) -> None:
        on_row(_row(config, item[1]) if isinstance(item[1], Trial) else item[1])

    found = dict(gather(_run_task, tasks, workers, on_step, keep, len(parts)))
    ordered = [found[k] for k in range(len(parts))]
    return SweepOutcome(config, ordered[: len(cells)], ordered[len(cells) :])
