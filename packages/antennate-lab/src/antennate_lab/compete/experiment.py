"""The competition: who crosses which scene how often and how fast, and how sure a rank is."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from antennate.control.loop import CheckedController
from antennate.control.registry import make_controller
from antennate.errors import ConfigError, ControllerError, SceneError
from antennate.experiments.tunnel.batch import BATCH
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.sim.episode import time_limit_of
from antennate.sim.knowledge import require_route
from antennate.sim.trial import check_start, draw_scene, scene_of
from antennate.studies.experiment import Done, Experiment
from antennate.studies.pool import Workers, core_count, gather, places_of, workers_from
from antennate.studies.processes import Processes
from antennate.studies.run_files import span
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.studies.work import Failure, Together
from antennate.types import AntennaFrame, Controller
from antennate_lab.compete.apart import Apart
from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.comparison import compared
from antennate_lab.compete.config import DEVELOPMENT, CompeteConfig, plain, settled
from antennate_lab.compete.episodes import Draw, EpisodeRow, lost, run_episodes
from antennate_lab.compete.page import readme, sentence, tables
from antennate_lab.compete.result import CompeteResult
from antennate_lab.compete.scenes import require_different_scenes, tunnel_config
from antennate_lab.compete.standings import standing

_NOTE = logging.getLogger(__name__)
START, COSTS = 2.0, (0.01, 0.2)
"""Time to begin, and time of a core for each second of the limits [s]: where all cross early and
draws go in lockstep, and where most run into the limit, one by one (docs/performance.json)."""
PATIENCE = 120.0
"""Time in which a controller has to be made and to decide once, before anything is run [s]."""


def draws(config: CompeteConfig) -> list[Draw]:
    """All that is to be run, controller by controller, scene by scene and seed by seed."""
    if config.check is None:
        keys = [
            (name, scene, config.seed, trial)
            for name, scene, trial in product(
                config.controllers, config.scenes, range(config.trials)
            )
        ]
    else:
        rows = read_rows(Path(config.check))
        keys = [(row.controller, row.scene, row.seed, row.trial) for row in rows]
        names = list(dict.fromkeys(key[0] for key in keys))
        cells = {key[:3]: place for place, key in reversed([*enumerate(keys)])}
        keys.sort(key=lambda key: (names.index(key[0]), cells[key[:3]]))
    drawn = config.hidden and config.seed not in DEVELOPMENT
    return [Draw(*key, config.decision_limit, drawn) for key in keys]


def check(config: CompeteConfig) -> None:
    """Find a bad scene or controller before anything is run; each controller decides once.

    That is done in a process for each: what it does there ends or delays nobody else.
    """
    cells = dict.fromkeys((draw.controller, draw.scene, draw.seed) for draw in draws(config))
    require_different_scenes(dict.fromkeys(scene for _, scene, _ in cells), next(iter(cells))[0])
    started, asked = set[str](), dict[str, list[tuple[str, int]]]()
    for name, scene, seed in cells:
        if scene not in started:
            check_start(tunnel_config(scene, name, seed))
            started.add(scene)
        asked.setdefault(name, []).append((scene, seed))
    names = list(asked)

    def given_up(place: int, failure: Failure) -> str:
        return f"{names[place]!r}: {failure.reason}"

    troubles = gather(
        _trouble_of,
        [(name, cells, config.decision_limit) for name, cells in asked.items()],
        Workers(min(len(names), core_count()), Processes(), timeout=PATIENCE),
        no_step,
        lost=given_up,
    )
    for trouble in filter(None, troubles):
        raise ConfigError(f"{config.check or '--controllers'}: {trouble}")


def _trouble_of(name: str, cells: Sequence[tuple[str, int]], limit: float) -> str:
    """Why a controller cannot take part in these scenes with these seeds; empty if it can."""
    decided = set[str]()
    try:
        for scene, seed in cells:
            settings = tunnel_config(scene, name, seed)
            make = partial(make_controller, plain(name), settings.control, settings.robot)
            with contextlib.closing(Apart(make, limit)) as made:
                if made.needs:
                    instance = draw_scene(settings, scene_of(settings), 0)
                    require_route(settings.scene, instance, made.needs)
                elif (robot := settings.robot.model_dump_json()) not in decided:
                    decided.add(robot)
                    _decide(made, settings)
    except ControllerError as error:
        return f"{name!r}: {error}"
    except (ConfigError, SceneError) as error:
        return f"{name!r}: {error}" if str(error).startswith("control.") else str(error)
    return ""


def _decide(made: Controller, config: TunnelConfig) -> None:
    """Let a controller decide on one reading, that of straight antennae."""
    checked = CheckedController(made, config.robot, 1)
    counts = np.full((1, 2), config.control.conditioning.counts_high)
    joints = np.zeros((1, len(config.robot.joint_names)))
    checked.reset(np.array([0]))
    checked.step(AntennaFrame(np.zeros(1), counts, joints))


def foretold(config: CompeteConfig, workers: Workers) -> str:
    """How long the episodes will take that are left: between two ends, as nobody knows more yet."""
    kept = set[int]() if workers.trials is None else places_of(workers.trials.records)
    left = [d for i, d in enumerate(draws(config)) if i not in kept and workers.mine(i)]
    limits = dict[tuple[str, int], float]()
    for draw in left:
        if (key := (draw.scene, draw.seed)) not in limits:
            made = tunnel_config(draw.scene, draw.controller, draw.seed)
            scene = draw_scene(made, scene_of(made), 0)
            limits[key] = time_limit_of(scene, made.time_limit)
    seconds = sum(limits[draw.scene, draw.seed] for draw in left)
    count = min(workers.count, max(1, len(left)))
    low, high = (span(START + seconds * cost / count) for cost in COSTS)
    what, where = f"episode{'s' * (len(left) != 1)}", f"worker{'s' * (count != 1)}"
    return (
        f"{len(left)} {what} of {seconds:,.0f} s together at most: {low} to {high}, {count} {where}"
    )


def run(
    config: CompeteConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> Done:
    """Run all episodes."""
    workers = workers_from(workers)
    workers = replace(workers, engine=workers.engine or Processes())
    planned = draws(config)
    _NOTE.info(foretold(config, workers))

    def given_up(place: int, failure: Failure) -> EpisodeRow:
        return lost(planned[place], failure.reason)

    rows = gather(
        Together(run_episodes, BATCH, _cell),
        [(draw,) for draw in planned],
        workers,
        on_step,
        on_result=on_row,
        lost=given_up,
    )
    return Done(rows, summarise(config, rows))


def _cell(draw: Draw) -> tuple[str, str, int]:
    return draw.controller, draw.scene, draw.seed


def summarise(config: CompeteConfig, rows: Sequence[EpisodeRow]) -> CompeteResult:
    """The result of the rows of a run."""
    check = compared(read_rows(Path(config.check)), rows) if config.check else None
    return CompeteResult(
        **vars(standing(rows, config.tie, check)),
        seed=None if config.check else config.seed,
        trials=max((row.trial for row in rows), default=-1) + 1,
        decision_limit_s=config.decision_limit,
        tie=config.tie,
    )


def prepared(config: CompeteConfig, folder: Path | None) -> CompeteConfig:
    """The configuration with its seed, checked; see `settled` and `check`."""
    config = settled(config, folder)
    check(config)
    return config


EXPERIMENT = Experiment.of_folder(
    __name__,
    CompeteConfig,
    procedure=run,
    tables=tables,
    sentence=sentence,
    result=CompeteResult,
    row=EpisodeRow,
    settled=prepared,
    files=lambda config: {"README.md": lambda outcome: readme(outcome.result(), outcome.rows)},
    workers="here",
    unshared=lambda config: (
        "expected no --hidden beside it, as each shard would draw a seed of its own; give --seed"
        if config.hidden
        else ""
    ),
    captions={
        "ranks": "Rank of each controller with its 95 % interval, and how often it succeeded with "
        "Wilson's.",
        "scenes": "Successes of each controller in each scene.",
        "profiles": "Share of the draws that a controller crosses within a factor of the time of "
        "the fastest (Dolan and More).",
    },
)
