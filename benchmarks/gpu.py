"""How many robots a GPU simulates at once, and what sensing and control cost beside its physics.

For each batch size B, B default tunnels run for `--seconds` with the closed loop, as
`--engine warp` runs them:

- `robot_seconds_per_second`: B times the simulated time over the time on the clock, all included
  but drawing the tunnels, which `prepare_s` gives.
- `over_bare_warp`: that time over the time of as many steps of the same worlds with held targets,
  and nothing read or written between them. 1 would be sensing, control and watching for nothing.

Kernels are compiled at the first run on a machine, which takes minutes; that is in neither.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from importlib import metadata
from typing import Any

from antennate.errors import AntennateError
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.experiments.tunnel.warp import room_for
from antennate.sim.scenes.registry import make_scene
from antennate.sim.trial import draw_scene
from antennate.sim.warp.robot import PaddedTunnels, WarpRobot
from antennate.sim.warp.worlds import Limits, require_warp

CONTROLLER = "closed"
WARM_UP = 5
"""Control ticks before the clock starts: kernels are loaded, the graph is recorded."""


class TimedRobot(WarpRobot):
    """Notes the time on the clock after each control tick."""

    def sleep_until(self, t: float) -> None:
        super().sleep_until(t)
        self.times = [*getattr(self, "times", []), time.perf_counter()]


def measured(
    config: TunnelConfig, scene: PaddedTunnels, batch: int, limits: Limits, device: str | None
) -> dict[str, float]:
    """The figures of one batch size."""
    period, timestep = config.control.period, config.physics.timestep
    robot = TimedRobot(batch, config.robot, period, timestep, limits, device)
    begin, rows = time.perf_counter(), []
    run_trials(
        config,
        CONTROLLER,
        range(batch),
        lambda found: rows.append(found[0]),
        batch,
        apparatus=Apparatus(bodies=lambda _: (scene, robot)),
    )
    ticks = len(robot.times) - WARM_UP - 1
    whole = robot.times[-1] - robot.times[WARM_UP]
    assert robot.worlds is not None
    substeps = round(period / timestep)
    robot.worlds.state()
    start = time.perf_counter()
    for _ in range(ticks):
        robot.worlds.step(substeps)
    robot.worlds.state()
    bare = time.perf_counter() - start
    return {
        "batch": batch,
        "robot_seconds_per_second": batch * ticks * period / whole,
        "bare_warp": batch * ticks * period / bare,
        "over_bare_warp": whole / bare,
        "prepare_s": robot.times[0] - begin,
        "invalid": sum(row.outcome == "invalid" for row in rows),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--batches", type=int, nargs="+", default=[16, 64, 256, 1024, 4096])
    parser.add_argument("--seconds", type=float, default=5.0, help="simulated time of a trial [s]")
    parser.add_argument("--device", help="device of Warp, as cuda:0 or cpu; a GPU if not given")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    told = parser.parse_args()
    try:
        report(told)
    except AntennateError as error:
        raise SystemExit(f"benchmarks/gpu.py: {error}") from None


def measure(batches: list[int], seconds: float, device: str | None) -> dict[str, Any]:
    """The figures of all batch sizes, and of the machine.

    Raises:
        AntennateError: There is no such device, or Warp is not installed.
    """
    warp, _ = require_warp()
    config = TunnelConfig(time_limit=seconds)
    plain = make_scene(config.scene, config.tunnel)
    drawn = (draw_scene(config, plain, trial) for trial in range(max(batches)))
    scene = PaddedTunnels(plain, drawn)
    limits = room_for(TunnelConfig(), CONTROLLER, range(2), scene)
    table = []
    for batch in batches:
        table.append(measured(config, scene, batch, limits, device))
        sys.stderr.write(f"{batch} robots: {table[-1]['robot_seconds_per_second']:.3g} s/s\n")
    return {
        "device": (warp.get_device(device) if device else warp.get_preferred_device()).name,
        "mujoco_warp": metadata.version("mujoco-warp"),
        "warp": metadata.version("warp-lang"),
        "seconds": seconds,
        "rows": limits.rows,
        "contacts": limits.contacts,
        "batches": table,
    }


def report(told: argparse.Namespace) -> None:
    found = measure(told.batches, told.seconds, told.device)
    if told.json:
        print(json.dumps(found, indent=1))
        return
    table = found.pop("batches")
    print(", ".join(f"{name} {value}" for name, value in found.items()))
    for name in table[0]:
        print(f"{name:>26}", *(f"{row[name]:>10.4g}" for row in table))


if __name__ == "__main__":
    main()
