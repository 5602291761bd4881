"""Base sweeps beside walls: which shapes appear when, and how well touch measures distances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from itertools import product
from typing import Any

import numpy as np

from antennate.antenna.statics import Profile, with_profile
from antennate.experiments.sweep.estimates import (
    CUES,
    Trial,
    errors_by_condition,
    plan,
    run_trial,
)
from antennate.experiments.sweep.physics import (
    Outlines,
    SweepConfig,
    Wall,
    outlines_csv,
    outlines_of,
    record,
    shares,
)
from antennate.experiments.sweep.result import (
    ERROR,
    Cell,
    CueErrors,
    Estimates,
    ShapeMap,
    Spread,
    SweepResult,
    SweepRow,
    Swept,
)
from antennate.params.bench import SweepParams
from antennate.studies.columns import columns, shown
from antennate.studies.experiment import Done, Experiment
from antennate.studies.pool import Workers, gather
from antennate.studies.statistics import mean95
from antennate.studies.tables import Table
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.studies.work import Together

MOTIONS = ("fixed", "moving")
_TASK = 12
"""Sweeps handed to a process at once."""


@dataclass(frozen=True)
class Sweeps(Done):
    """The sweeps of the map and of the estimates, and what they come to.

    Attributes:
        outlines: Points of the antenna in each cell of `profile`, if they were to be saved.
    """

    outlines: Sequence[Outlines]


def summarise(config: SweepConfig, cells: Sequence[SweepRow], trials: list[Trial]) -> SweepResult:
    """The result of the cells of the map, and of the trials of the estimates."""
    shapes: dict[str, dict[str, ShapeMap]] = {profile: {} for profile in config.profiles}
    for profile, motion in product(config.profiles, MOTIONS):
        rows = [row for row in cells if (row.profile, row.condition) == (profile, motion)]
        shapes[profile][motion] = _shape_map(rows, config.antenna.length)
    return SweepResult(
        seed=config.seed,
        length_m=config.antenna.length,
        frequency_hz=config.sweep.frequency,
        profile=config.profile,
        shapes=shapes,
        estimates=errors_by_condition(trials, config.antenna.base_spacing),
    )


def _shape_map(rows: Sequence[SweepRow], length: float) -> ShapeMap:
    valid = [row for row in rows if row.status == "valid"]
    names = [each.name for each in fields(Swept)]
    return ShapeMap(
        cells=len(rows),
        invalid=len(rows) - len(valid),
        share={c.name: _spread([c.value(row) for row in valid]) for c in columns(Swept)},
        map=[
            Cell(distance=row.distance_m / length, **{name: getattr(row, name) for name in names})
            for row in valid
        ],
    )


def _spread(shares: Sequence[float]) -> Spread:
    """Mean of shares over the cells of the map, and how far it spreads."""
    mean, ends = mean95(np.array(shares), 0.0, 1.0)
    low, high = ends or (None, None)
    return mean if shares else None, low, high


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


def _sweep(tasks: Sequence[tuple[Any, ...]], emit: Callable[[int, Any], None]) -> None:
    for i, (function, *arguments) in enumerate(tasks):
        emit(i, function(*arguments))


def _points(outcome: Sweeps) -> str | None:
    return outlines_csv(outcome.outlines) if outcome.outlines else None


def run(
    config: SweepConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> Sweeps:
    """Sweep in every cell of the map and in every trial of the estimates."""
    grid = list(product(config.distances, config.centres, config.amplitudes))
    cells = [
        (map_cell, config, profile, motion, number, *cell)
        for profile, motion in product(config.profiles, MOTIONS)
        for number, cell in enumerate(grid)
    ]
    trials = [(run_trial, *trial) for trial in plan(config)]

    def keep(item: Any) -> None:
        on_row(_row(config, item) if isinstance(item, Trial) else item[0])

    tasks = [*cells, *trials]
    items: list[Any] = gather(Together(_sweep, _TASK), tasks, workers, on_step, keep)
    mapped, tried = items[: len(cells)], items[len(cells) :]
    rows = [row for row, _ in mapped]
    return Sweeps(
        rows=[*rows, *(_row(config, trial) for trial in tried)],
        found=summarise(config, rows, tried),
        outlines=[points for _, points in mapped if points is not None],
    )


def tables(result: SweepResult) -> Sequence[Table]:
    """The shares of the shapes, and the errors of the estimates."""
    maps = {
        f"{profile}, {motion}": each
        for profile, motions in result.shapes.items()
        for motion, each in motions.items()
        if profile == result.profile or result.profile not in result.shapes
    }
    shapes = Table(
        "Share of time of each shape, mean over the map (spread over cells)",
        list(maps),
        [
            (shape.label, [_with_interval(*each.share[shape.name]) for each in maps.values()])
            for shape in columns(Swept)
        ],
        "The map is a grid that was chosen. The spread over its cells, Student's t of their mean, "
        "is no interval of chance.",
    )
    return shapes, *(_errors(name, each.noisy) for name, each in result.estimates.items())


def _errors(condition: str, noisy: Estimates) -> Table:
    quantities = {"distance": noisy.distance, "gap": noisy.gap, "base_to_tip": noisy.base_to_tip}
    return Table(
        f"{ERROR.title.capitalize()} (95 %), sweep {condition}, with sensor noise",
        list(quantities),
        [
            (cue.replace("_", " "), [_error(cues.get(cue)) for cues in quantities.values()])
            for cue in CUES
        ],
        f"{noisy.sweeps} test sweeps, {noisy.missed} felt nothing, {noisy.invalid} invalid.",
    )


def _error(found: CueErrors | None) -> str:
    if found is None:
        return shown(None)
    return _with_interval(found.mape_percent, *(found.mape_95 or (None, None)))


def _with_interval(mean: float | None, low: float | None, high: float | None) -> str:
    return shown(mean) if low is None else f"{shown(mean)} ({shown(low)}–{shown(high)})"


def sentence(result: SweepResult) -> str:
    """How well active touch tells distances, beside the published figures."""
    noisy, published = result.estimates["same"].noisy, result.published_percent
    distance, tip, gap = (
        _error(cues.get("flex_and_base")) for cues in (noisy.distance, noisy.base_to_tip, noisy.gap)
    )
    return (
        "Flex and base angle together tell the distance of a wall with an error of "
        f"{distance} % (95 % interval), that of the tip {tip} % and a gap {gap} %; published for "
        f"CITRAS: {published.base_to_tip:g} % and {published.gap:g} %."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    SweepConfig,
    run,
    tables,
    sentence,
    result=SweepResult,
    row=SweepRow,
    files=lambda config: {"points.csv": _points} if config.points else {},
    captions={
        "sweep": "Shares of the time in each shape, with the base fixed and moving, and "
        "the errors of the estimates.",
    },
)
