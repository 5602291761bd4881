"""Passages of many antennae in one batch on a GPU, with MuJoCo Warp."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from antennate.errors import ConfigError
from antennate.experiments.wall.config import COMMAND_PERIOD, WallConfig
from antennate.experiments.wall.outcome import Traverse, WallTrial, classify, invalid
from antennate.experiments.wall.passage import SETTLE, Passage, draw, kept, ramp
from antennate.sim.chain import Motion
from antennate.sim.warp.benches import WarpBenches
from antennate.sim.warp.packages import require_device
from antennate.sim.warp.worlds import Limits
from antennate.studies.experiment import Trial
from antennate.types import Floats, Ints

WARP_BATCH = 1024
"""Trials at once. Each keeps some 200 kB of samples."""
Emit = Callable[[int, tuple[WallTrial, Traverse | None]], None]


def run_trials_on_warp(
    config: WallConfig,
    trials: Sequence[Trial],
    emit: Emit,
    batch: int = WARP_BATCH,
    limits: Limits | None = None,
    device: str | None = None,
) -> None:
    """Run trials in batches on a device; emit the index of each with its row and its passage.

    The spheres, springs, friction and ways are those of the same trials on the CPU. A trial in
    which contacts are lost, since there is no room for them, is invalid, and its reason says so.

    Args:
        config: What is run.
        trials: Profiles and numbers of trials.
        emit: Takes what came out; of the first trial of a profile the passage too.
        batch: Trials at once.
        limits: Sizes on the device; if not given, what straight links can touch.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.

    Raises:
        ConfigError: Another solver is chosen, two engines are installed, there is no such device,
            or Warp cannot hold that model.
        MissingPackageError: Warp is not installed.
    """
    if config.solver != "mujoco":
        raise ConfigError(
            f"solver: expected mujoco with --engine warp, found {config.solver}; the chain runs "
            "on the CPU alone"
        )
    require_device(device)
    sizes = limits or room_for(config)
    for first in range(0, len(trials), batch):
        part = trials[first : first + batch]
        drawn = [draw(config, profile, trial) for profile, trial in part]
        for i, found in enumerate(_passages(config, drawn, sizes, device)):
            profile, trial = part[i]
            if isinstance(found, str):
                emit(first + i, (invalid(config.seed, trial, profile, found), None))
                continue
            row = classify(config.wall, config.seed, trial, profile, found)
            emit(first + i, (row, found if trial == 0 else None))


def room_for(config: WallConfig) -> Limits:
    """Sizes on the device: each link touches all spheres along it, and one more at each end."""
    link = config.antenna.link_length + 2 * config.antenna.radius
    touches = config.antenna.hinges * (2 + math.ceil(link / config.wall.sphere_diameter))
    return Limits(rows=3 * touches + config.antenna.hinges + 1, contacts=touches)


def _passages(
    config: WallConfig, drawn: Sequence[Passage], limits: Limits, device: str | None
) -> list[Traverse | str]:
    """What was seen on each way, or why it is invalid."""
    most = max(len(each.balls) for each in drawn)
    benches: WarpBenches | None = None
    for row, each in enumerate(drawn):
        bench = each.bench(further=most - len(each.balls))
        benches = benches or WarpBenches(bench, len(drawn), limits, device)
        benches.put(row, bench.model, bench.data)
    if benches is None:
        return []
    tips, went = _drive(config, drawn, benches)
    return [
        str(benches.failures[row])
        if row in benches.failures
        else each.traverse(tips[row], went(row))
        for row, each in enumerate(drawn)
    ]


def _drive(
    config: WallConfig, drawn: Sequence[Passage], benches: WarpBenches
) -> tuple[Floats, Callable[[int], Motion]]:
    """Settle, approach and travel: the tips as the travel begins [m], and the motion of each row.

    A row whose approach is shorter begins its travel sooner, as it does alone.
    """
    wall = config.wall
    settle = round(SETTLE / COMMAND_PERIOD)
    substeps = round(COMMAND_PERIOD / config.physics.timestep)
    far = np.array([each.approach for each in drawn])
    steps: Ints = np.array([len(ramp(way, wall.speed)) for way in far.tolist()])
    count = len(ramp(wall.travel, wall.speed))
    slots = np.full(count + 1, -1)
    slots[[0, *(i + 1 for i in kept(count))]] = np.arange(len(kept(count)) + 1)
    size = config.antenna.hinges + 5
    states = np.zeros((len(drawn), slots.max() + 1, size))
    forces, touches = np.zeros((*states.shape[:2], 2)), np.zeros(states.shape[:2], bool)
    commands = np.zeros((len(drawn), 5))
    commands[:, 4] = [each.base for each in drawn]
    for tick in range(settle + int(steps.max()) + count):
        ahead = np.clip(tick + 1 - settle, 0, steps)
        along = np.clip(tick + 1 - settle - steps, 0, count)
        commands[:, 0], commands[:, 1] = far * ahead / steps, wall.travel * along / count
        commands[:, 2] = wall.speed * ((ahead > 0) & (along == 0))
        commands[:, 3] = wall.speed * (along > 0)
        benches.drive(commands, substeps)
        running = (ahead == steps) & (tick < settle + steps + count)
        due: Ints = np.flatnonzero(running & (slots[along] >= 0))
        if len(due):
            at = due, slots[along[due]]
            states[at], forces[at], pressing = benches.seen(due)
            touches[at] = pressing > 0
    lengths = np.full(config.antenna.hinges, config.antenna.link_length)

    def motion(row: int) -> Motion:
        return Motion(lengths, states[row], forces[row], touches[row])

    tips = np.array([motion(row)[:1].joints[0, -1, 1] for row in range(len(drawn))])
    return tips, lambda row: motion(row)[1:]
