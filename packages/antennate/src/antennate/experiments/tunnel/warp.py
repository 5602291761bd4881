"""Trials of one controller in one batch on a GPU, with MuJoCo Warp."""

from __future__ import annotations

from collections.abc import Sequence

from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus, Emit
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.sim.scenes.scene import Scene
from antennate.sim.trial import draw_scene, scene_of
from antennate.sim.warp.robot import CountingRobot, PaddedTunnels, WarpRobot
from antennate.sim.warp.worlds import Limits, require_device

WARP_BATCH = 2048
"""Trials at once."""
_COUNTED = 2
"""Trials on the CPU that tell how many contacts there are."""


def run_trials_on_warp(
    config: TunnelConfig,
    controller: str,
    trials: Sequence[int],
    emit: Emit,
    batch: int = WARP_BATCH,
    limits: Limits | None = None,
    device: str | None = None,
) -> None:
    """Run trials of one controller as `run_trials` does, but in one batch on a device.

    A trial in which contacts are lost, since more rows or contacts came up than there is room for,
    is invalid, and its reason says so.

    Args:
        config: What is run.
        controller: Name of the controller.
        trials: Their numbers.
        emit: Takes each as it ends.
        batch: Trials at once.
        limits: Sizes on the device; if not given, two trials on the CPU tell them.
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.
    """
    require_device(device)
    if not trials:
        return
    plain = scene_of(config)
    scene = PaddedTunnels(plain, (draw_scene(config, plain, trial) for trial in trials))
    sizes = limits or room_for(config, controller, trials[:_COUNTED], scene)
    period, timestep = config.control.period, config.physics.timestep

    def make(rows: int) -> tuple[Scene, WarpRobot]:
        return scene, WarpRobot(rows, config.robot, period, timestep, sizes, device)

    run_trials(config, controller, trials, emit, batch, apparatus=Apparatus(bodies=make))


def room_for(config: TunnelConfig, controller: str, trials: Sequence[int], scene: Scene) -> Limits:
    """Sizes on the device, with a reserve, from these trials on the CPU."""
    period, timestep = config.control.period, config.physics.timestep
    made: list[CountingRobot] = []

    def make(rows: int) -> tuple[Scene, CountingRobot]:
        made.append(CountingRobot(rows, config.robot, period, timestep))
        return scene, made[-1]

    run_trials(config, controller, trials, lambda _: None, apparatus=Apparatus(bodies=make))
    return Limits(*(max(sizes) for sizes in zip(*(robot.room for robot in made), strict=True)))
