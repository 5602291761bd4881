"""What the numerics of the engine change: one setting at a time against a fine-step reference.

- Walk: FORWARD on the flat floor; its speed, and how deep the deepest leg sinks into the floor.
- Push: a cylinder slides off at 0.3 m/s in nine directions over a right angle; Coulomb says that it
  stops after v^2 / (2 mu g), and equally far in all of them.
- Tunnel: the open loop, which decides nothing and so carries every difference to the end. A single
  trial is chaotic and differs with every setting; what must agree is the statistics.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import mujoco
import numpy as np

from antennate.experiments.tunnel import experiment as experiment
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.control import GaitParams
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim import trial
from antennate.sim.scenes.scene import SceneInstance
from antennate.sim.scenes.tunnel import Tunnel
from antennate.sim.world import World, compile_world
from antennate.studies.pool import core_count, gather
from antennate.studies.trials import no_step
from antennate.types import Floats, Maneuver
from antennate_lab.gait import physics as gait
from antennate_lab.gait.physics import measure

_CHOSEN = PhysicsParams()
_PUSH = 0.3
"""Speed of a pushed cylinder [m/s]."""
_DIRECTIONS = np.radians(np.linspace(0.0, 90.0, 9))
_SETTLE = 0.3
"""Time a cylinder stands before it is pushed [s]."""


@dataclass(frozen=True)
class Engine:
    """One set of numerics; by default the project's."""

    name: str
    timestep: float = _CHOSEN.timestep
    contact_time: float = _CHOSEN.contact_time
    impratio: float = _CHOSEN.impratio
    pyramidal: bool = False
    sleep: bool = True
    sleep_tolerance: float = _CHOSEN.sleep_tolerance

    @property
    def physics(self) -> PhysicsParams:
        return PhysicsParams(
            timestep=self.timestep,
            contact_time=self.contact_time,
            impratio=self.impratio,
            sleep_tolerance=self.sleep_tolerance,
        )

    def compile(self, _: PhysicsParams, robot: RobotSpec, scene: SceneInstance | None = None):
        """As compile_world, with cone and sleep of this engine."""
        model = compile_world(self.physics, robot, scene)
        if self.pyramidal:
            model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
        if not self.sleep:
            model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        return model


REFERENCE = Engine(
    "reference 0.25 ms", timestep=0.00025, contact_time=0.0005, impratio=10.0, sleep=False
)
CHOSEN = Engine("chosen")
WALKS = (
    REFERENCE,
    replace(REFERENCE, name="0.25 ms, contact 4 ms", contact_time=0.004),
    CHOSEN,
    Engine("0.5 ms", timestep=0.0005),
    Engine("1 ms", timestep=0.001),
    Engine("2.5 ms, contact 5 ms", timestep=0.0025, contact_time=0.005),
    Engine("4 ms, contact 8 ms", timestep=0.004, contact_time=0.008),
    Engine("contact 8 ms", contact_time=0.008),
    Engine("contact 20 ms", contact_time=0.02),
    Engine("impratio 10", impratio=10.0),
    Engine("impratio 100", impratio=100.0),
    Engine("pyramidal", pyramidal=True),
    Engine("no sleep", sleep=False),
    Engine("sleep 1e-4", sleep_tolerance=1e-4),
    Engine("sleep 1e-2", sleep_tolerance=1e-2),
)
TUNNELS = (
    CHOSEN,
    Engine("0.5 ms", timestep=0.0005),
    Engine("1 ms", timestep=0.001),
    Engine("2.5 ms, contact 5 ms", timestep=0.0025, contact_time=0.005),
    Engine("contact 20 ms", contact_time=0.02),
    Engine("impratio 10", impratio=10.0),
    Engine("pyramidal", pyramidal=True),
    Engine("no sleep", sleep=False),
    Engine("sleep 1e-2", sleep_tolerance=1e-2),
)


def walk(engine: Engine) -> dict[str, float]:
    """Speed and leg penetration of FORWARD on the flat floor."""
    ticks = max(1, round(0.01 / engine.timestep))
    config = gait.GaitStudyConfig(rate=1.0 / (ticks * engine.timestep), physics=engine.physics)
    sunk: list[float] = []

    class Watched(World):
        work = 0.0

        def advance(self, count: int) -> None:
            super().advance(count)
            sunk.append(-float(self.data.contact.dist.min(initial=0.0)))

    with (
        mock.patch.object(gait, "compile_world", engine.compile),
        mock.patch.object(gait, "MeteredWorld", Watched),
    ):
        before = time.process_time()
        walked = gait.walk_flat(config, "forward", GaitParams(), Maneuver.FORWARD)
        cpu = time.process_time() - before
    pace = measure(walked, config.settling_cycles, config.cycles)
    settled = np.array(sunk)[len(sunk) // 3 :]
    return {
        "speed_m_s": pace.speed_m_s,
        "sunk_mean_mm": 1e3 * float(settled.mean()),
        "sunk_max_mm": 1e3 * float(settled.max()),
        "walk_realtime": float(walked.t[-1]) / cpu,
    }


def push(engine: Engine) -> dict[str, float]:
    """Stopping distance of a cylinder, and how it differs between directions."""
    stops = np.array([_slide(engine, direction) for direction in _DIRECTIONS])
    return {
        "stop_mm": 1e3 * float(stops.mean()),
        "stop_spread": float(stops.max() - stops.min()) / float(stops.mean()),
    }


def coulomb_stop(params: TunnelParams) -> float:
    """Closed form of the stopping distance [m]."""
    return _PUSH**2 / (2.0 * params.cylinder.friction * 9.81)


def _slide(engine: Engine, direction: float) -> float:
    far = np.array([[-9.0, 9.0], [9.0, 9.0]])
    field = Tunnel(TunnelParams(), far * [1.0, 0.0], (far, -far[::-1]), np.array([[3.0, 0.0]]))
    robot = RobotSpec()
    world = World(engine.compile(engine.physics, robot, field), robot)
    model, data = world.model, world.data
    flags = int(model.opt.enableflags)
    model.opt.enableflags = flags & ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    world.step(round(_SETTLE / engine.timestep))
    start = data.body("cylinder0").xpos[:2].copy()
    for axis, value in (("x", math.cos(direction)), ("y", math.sin(direction))):
        data.qvel[model.joint(f"cylinder0_{axis}").dofadr[0]] = _PUSH * value
    model.opt.enableflags = flags
    world.step(round(0.5 / engine.timestep))
    return float(np.linalg.norm(data.body("cylinder0").xpos[:2] - start))


def run_engine(engine: Engine, limit: float, trials: list[int]) -> list[tuple[TrialResult, float]]:
    """Trials of the open loop on one engine, with the CPU time of each."""
    found: list[tuple[TrialResult, float]] = []
    config = TunnelConfig(time_limit=limit, physics=engine.physics)
    with mock.patch.object(trial, "compile_world", engine.compile):
        for number in trials:
            before = time.process_time()
            rows: list[TrialResult] = []
            experiment.run_trials(
                config, "open", [number], lambda item, to=rows: to.append(item[0])
            )
            found.append((rows[0], time.process_time() - before))
    return found


def tunnels(engines: list[Engine], trials: int, limit: float) -> dict[str, dict[str, Any]]:
    """Outcome statistics of the open loop per engine."""
    halves = [list(range(trials))[i::2] for i in range(2)]
    tasks = [(engine, limit, half) for engine in engines for half in halves]
    parts = gather(run_engine, tasks, min(2, core_count()), no_step)
    rows: dict[str, list[tuple[TrialResult, float]]] = {engine.name: [] for engine in engines}
    for (engine, *_), part in zip(tasks, parts, strict=True):
        rows[engine.name] += part
    outcomes = {name: _statistics(found, limit) for name, found in rows.items()}
    for engine in engines:
        if engine.pyramidal:  # a contact's force is then spread over the edges of its cone
            outcomes[engine.name]["mean_force_n"] = None
    return outcomes


def _statistics(found: list[tuple[TrialResult, float]], limit: float) -> dict[str, Any]:
    times: Floats = np.array([row.time_s for row, _ in found])
    error = float(times.std(ddof=1)) / math.sqrt(len(times))
    ended = [row.time_s if row.outcome == "success" else limit for row, _ in found]
    return {
        "trials": len(found),
        "successes": sum(row.outcome == "success" for row, _ in found),
        "invalid": sum(row.outcome == "invalid" for row, _ in found),
        "mean_time_s": float(times.mean()),
        "mean_time_se": error,
        "mean_force_n": float(np.mean(np.array([row.force_mean_n for row, _ in found], float))),
        "realtime": sum(ended) / sum(cpu for _, cpu in found),
    }


def flat_table(rows: dict[str, dict[str, float]]) -> str:
    """Walks and pushes as a Markdown table."""
    lines = [
        "| numerics | speed [m/s] | against reference | legs sink, mean [mm] | at most [mm] "
        "| cylinder stops after [mm] | spread over directions | time, chosen = 1 |",
        "|---|---|---|---|---|---|---|---|",
    ]
    reference, pace = rows[REFERENCE.name]["speed_m_s"], rows[CHOSEN.name]["walk_realtime"]
    for name, row in rows.items():
        change = 100.0 * (row["speed_m_s"] / reference - 1.0)
        lines.append(
            f"| {name} | {row['speed_m_s']:.4f} | {change:+.1f} % "
            f"| {row['sunk_mean_mm']:.2f} | {row['sunk_max_mm']:.2f} | {row['stop_mm']:.2f} "
            f"| {100 * row['stop_spread']:.1f} % | {pace / row['walk_realtime']:.2g} |"
        )
    return "\n".join(lines)


def tunnel_table(rows: dict[str, dict[str, Any]]) -> str:
    """Tunnel outcomes as a Markdown table."""
    lines = [
        "| numerics | successes | restricted mean time [s] | mean force [N] | time, chosen = 1 |",
        "|---|---|---|---|---|",
    ]
    pace = rows[CHOSEN.name]["realtime"]
    for name, row in rows.items():
        invalid = f", {row['invalid']} invalid" if row["invalid"] else ""
        force = "-" if row["mean_force_n"] is None else f"{row['mean_force_n']:.2f}"
        lines.append(
            f"| {name} | {row['successes']} of {row['trials']}{invalid} "
            f"| {row['mean_time_s']:.1f} ± {row['mean_time_se']:.1f} "
            f"| {force} | {pace / row['realtime']:.2g} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quick", action="store_true", help="few tunnels, coarser reference")
    options = parser.parse_args()
    flat: dict[str, Any] = {engine.name: walk(engine) | push(engine) for engine in WALKS}
    if not options.json:
        print(flat_table(flat), flush=True)
    step = 0.0005 if options.quick else 0.00025
    finer = Engine(
        f"{1e3 * step:g} ms, impratio 10, no sleep",
        timestep=step,
        impratio=10.0,
        sleep=False,
    )
    trials, limit = (6, 30.0) if options.quick else (20, 50.0)
    engines = TUNNELS[:1] + TUNNELS[-2:] if options.quick else TUNNELS
    outcomes = tunnels([finer, *engines], trials, limit)
    if options.json:
        print(json.dumps({"flat": flat, "tunnel": outcomes}, indent=2))
        return
    print(f"\n{tunnel_table(outcomes)}")
    print(f"\nCoulomb: {1e3 * coulomb_stop(TunnelParams()):.2f} mm; tunnels end after {limit:g} s.")


if __name__ == "__main__":
    main()
