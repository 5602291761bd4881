"""Trials of the tunnel in batches, as workers, a page and a GPU carry them out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from antennate.control.readings import YOKED
from antennate.errors import ConfigError
from antennate.experiments.tunnel.batch import run_trials, watched
from antennate.experiments.tunnel.lockstep import Emit
from antennate.experiments.tunnel.physics import TunnelConfig

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView


def on_cpu(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    logs: Path | None = None,
    view: SimulationView | None = None,
) -> None:
    """Run trials of one condition; see `run_trials`. A page may show them."""
    run_trials(config, condition, trials, emit, logs=logs, apparatus=watched(view))


def on_warp(
    config: TunnelConfig,
    condition: str,
    trials: Sequence[int],
    emit: Emit,
    device: str | None,
    logs: Path | None,
) -> None:
    """Run trials of one condition in batches on a GPU."""
    if logs is not None:
        raise ConfigError("--log: expected another engine, found warp, which keeps no logs")
    if YOKED in config.readings:
        raise ConfigError(f"--readings {YOKED}: expected another engine, found warp")
    from antennate.experiments.tunnel.warp import run_trials_on_warp  # needs a GPU

    run_trials_on_warp(config, condition, trials, emit, device=device)
