"""How fast the gait may be: `python docs/science/pace.py PART [--rows FILE]`.

Parts: `flat` walks the flat floor over the frequency of the gait, `trials` runs controllers through
a corner and a U-turn, and `table` prints the tables of docs/science/pace.md. Rows are added to the
file a cell after the other, and cells that it has are not run again.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.robots.joints import LegParams
from antennate.robots.servos import ServoParams, ServosParams
from antennate.robots.spec import RobotSpec
from antennate.sim.world import World
from antennate.types import Floats, Maneuver
from antennate_lab.gait.config import GaitStudyConfig
from antennate_lab.gait.physics import measure, walk_flat

ROWS = Path(__file__).with_suffix(".csv")
SEED, DRAWS = 530_001, 20
STALL, RATED, CURRENT, FULL = 1.7, 11.1, 1.3, 0.999
"""Torque [N·m], supply [V] and current [A] at stall, and the share of that torque at full drive."""
AHEAD, TURN, PACES = ("swift", "FORWARD"), ("serpenoid", "TURN_L"), (0.6, 0.7, 0.8, 0.9, 1.0)
FLAT = {
    (*AHEAD, 11.1, False): (0.3, 0.4, 0.5, *PACES, 1.1, 1.2, 1.5, 2.0),
    (*AHEAD, 10.2, False): (*PACES, 1.1),
    (*TURN, 11.1, False): PACES,
    (*TURN, 10.8, False): PACES,
    (*TURN, 10.8, True): PACES,
}
"""Frequencies [Hz] by gait, maneuver, supply [V] and whether servos are the worst assumed."""
OF_CELL = ["part", "name", "what", "hz", "divisor", "volts", "worst"]
COLUMNS = [
    *(*OF_CELL, "trial", "outcome", "time_s", "limit_s", "ticks", "speed_m_s", "turn_deg_s"),
    *("legs_speed", "yaw_rms", "yaw_rms_worst", "yaw_full", "yaw_longest_s"),
    *("legs_full", "legs_longest_s", "any_full"),
]
"""Torques and speeds are shares of those at stall and without load."""


@dataclass(frozen=True)
class Cell:
    """Gait or controller, maneuver or scene, frequency [Hz], gain divisor, supply [V], servos."""

    part: str
    name: str
    what: str
    hz: float
    divisor: float = 128.0
    volts: float = RATED
    worst: bool = False

    @property
    def robot(self) -> RobotSpec:
        """The robot, with legs as fast as their servos unloaded.

        The worst servos have 73 % of the torque, and gears take 35 % of the load.
        """
        share = self.volts / RATED
        torque, friction = (0.73 * STALL, 0.35) if self.worst else (STALL, 0.0)
        servo = ServoParams(
            gain_divisor=self.divisor, stall_torque=torque * share, load_friction=friction
        )
        servo = servo.model_copy(update={"no_load_speed": servo.no_load_speed * share})
        legs = LegParams(fastest=servo.no_load_speed)
        return RobotSpec(servos=ServosParams(xc430_w240=servo), legs=legs)


def cells(part: str) -> list[Cell]:
    """All cells of a part."""
    both = 128.0, 256.0
    if part == "flat":
        walks = [(hz, *what) for what, paces in FLAT.items() for hz in paces]
        return [Cell(part, *w[1:3], w[0], d, *w[3:]) for w in walks for d in both]
    runs = [("open", "corner", both[0])]
    for scene in ("corner", "uturn"):
        runs += [(name, scene, d) for name in ("geometric", "timed") for d in both]
        runs.append(("closed", scene, both[0]))
    return [Cell(part, name, scene, hz, d) for hz in (0.6, 0.8, 1.0) for name, scene, d in runs]


def walk(cell: Cell) -> list[dict[str, Any]]:
    """The row of a walk on the flat floor, after three cycles."""
    robot, f, settling = cell.robot, cell.hz, 3
    servo, cycles = robot.servos.xc430_w240, max(6, round(6 * f))
    gait = GaitParams.named(cell.name).model_copy(update={"frequency": f, "turn_offset": 0.52})
    counted = {"settling_cycles": settling, "cycles": cycles}
    config = GaitStudyConfig(robot=robot).model_copy(update={"gait": gait, **counted})
    seen: list[tuple[Floats, Floats]] = []

    def watch(world: World, _: Any) -> None:
        if world.t > settling / f:
            seen.append((world.drive_torques().copy(), world.drive_speeds().copy()))

    pace = measure(walk_flat(config, "pace", gait, Maneuver[cell.what], watch), settling, cycles)
    drives, speeds = (np.array(part) for part in zip(*seen, strict=True))
    drive, speed = drives / servo.stall_torque, speeds / servo.no_load_speed
    yaw, legs = robot.places("yaw"), robot.places("legs")
    row = {
        "speed_m_s": pace.speed_m_s,
        "turn_deg_s": pace.yaw_deg_per_cycle * f,
        "legs_speed": abs(speed[:, legs]).max(),
        "yaw_rms_worst": np.sqrt(((drive - speed)[:, yaw] ** 2).mean(axis=0).max()),
        "yaw_full": (abs(drive[:, yaw]) > FULL).mean(),
        "legs_full": (abs(drive[:, legs]) > FULL).mean(),
    }
    return [row]


def control_at(hz: float) -> ControlParams:
    """The control at a frequency of the gait; walks and escapes by the clock keep their cycles."""
    own, factor = ControlParams(), 0.6 / hz
    times = {
        "timed": ("walk_time",),
        "escape": ("reverse_time", "turn_time"),
        "search": ("reverse_time", "reverse_most", "turn_time", "lost_turn", "return_time"),
    }
    changed: dict[str, Any] = {"gait": own.gait.model_copy(update={"frequency": hz})}
    for group, names in times.items():
        params = getattr(own, group)
        scaled = {name: factor * getattr(params, name) for name in names}
        changed[group] = params.model_copy(update=scaled)
    return own.model_copy(update=changed)


class Loads(TrialMonitor):
    """Watches a trial, and adds up the loads of the servos from the sixth tick on."""

    def begin(self, robot: RobotSpec) -> Loads:
        """Begin to watch a robot."""
        servo = robot.servos.xc430_w240
        self.scale, self.seen, self.some = (servo.stall_torque, servo.no_load_speed), 0, 0
        self.yaw, self.legs = robot.places("yaw"), robot.places("legs")
        self.squares, self.full, self.run, self.longest = np.zeros((4, len(robot.joint_names)))
        return self

    def tick(self, world: Any, maneuver: int, failure: object = None) -> Any:
        """Let a control tick pass; the outcome once there is one."""
        if failure is None and self.episode.ticks > 5:
            drive = world.drive_torques() / self.scale[0]
            full = abs(drive) > FULL
            self.seen += 1
            self.some += bool(full[self.yaw].any() or full[self.legs].any())
            self.squares += (drive - world.drive_speeds() / self.scale[1]) ** 2
            self.full += full
            self.run = np.where(full, self.run + 1.0, 0.0)
            self.longest = np.maximum(self.longest, self.run)
        return super().tick(world, maneuver, failure)

    def row(self) -> dict[str, Any]:
        """What the loads come to."""
        squares, full = self.squares / max(self.seen, 1), self.full / max(self.seen, 1)
        return {
            "ticks": self.seen,
            "yaw_rms": math.sqrt(squares[self.yaw].mean()),
            "yaw_rms_worst": math.sqrt(squares[self.yaw].max()),
            "yaw_full": full[self.yaw].mean(),
            "yaw_longest_s": 0.01 * self.longest[self.yaw].max(),
            "legs_full": full[self.legs].mean(),
            "legs_longest_s": 0.01 * self.longest[self.legs].max(),
            "any_full": self.some / max(self.seen, 1),
        }


def cross(cell: Cell) -> list[dict[str, Any]]:
    """The rows of the trials of a controller in a scene."""
    count, limit = (10, 40.0) if cell.name == "open" else (DRAWS, None)
    given = {"scene": cell.what, "seed": SEED, "trials": count, "time_limit": limit}
    config = TunnelConfig(**given, robot=cell.robot, control=control_at(cell.hz))
    loads: dict[int, Loads] = {}
    rows: list[dict[str, Any]] = []

    def monitor(_: int, episode: Any) -> Loads:
        loads[episode.number] = Loads(episode, cell.name).begin(cell.robot)
        return loads[episode.number]

    def emit(found: Any) -> None:
        own = {name: getattr(found[0], name) for name in ("trial", "outcome", "time_s", "limit_s")}
        rows.append(own | loads[found[0].trial].row())

    run_trials(config, cell.name, range(count), emit, count, apparatus=Apparatus(monitor=monitor))
    return sorted(rows, key=lambda row: row["trial"])


def run(part: str, path: Path) -> None:
    """Run the cells of a part that a file lacks, and add their rows to it."""
    done = pd.read_csv(path)[OF_CELL].to_numpy().tolist() if path.exists() else []
    for cell in cells(part):
        own = asdict(cell)
        if [*own.values()] in done:
            continue
        rows = pd.DataFrame([own | row for row in (walk if part == "flat" else cross)(cell)])
        text = rows.reindex(columns=COLUMNS).to_csv(
            index=False, header=not path.exists(), float_format="%.5g", lineterminator="\n"
        )
        with path.open("a") as file:
            file.write(text)
        print(cell, flush=True)


def table(path: Path) -> None:
    """Print the tables of the page, and differences between paces of paired draws."""
    rows = pd.read_csv(path)
    flat = rows[rows.part == "flat"].dropna(axis=1, how="all")
    print(flat.to_string(float_format="{:.3g}".format))
    trials = rows[rows.part == "trials"].copy()
    trials["success"] = trials.outcome == "success"
    trials["taken"] = trials.time_s.where(trials.success, trials.limit_s)
    shares, torques = ["yaw_full", "legs_full", "any_full"], ["yaw_rms", "yaw_rms_worst"]
    trials[shares] = trials[shares].mul(100 * trials.ticks, axis=0)
    trials[torques] = (trials[torques] ** 2).mul(trials.ticks, axis=0)
    by = trials.groupby(["divisor", "name", "hz"])
    loads = by[shares + torques].sum().div(by.ticks.sum(), axis=0)
    loads[torques] **= 0.5
    loads["heat_w"] = CURRENT * RATED * loads.yaw_rms_worst**2
    loads = loads.join(by[["yaw_longest_s", "legs_longest_s"]].max())
    scenes = trials.groupby(["divisor", "name", "hz", "what"])
    crossed = scenes.success.agg("sum").astype(str) + "/" + scenes.size().astype(str)
    ends = (crossed + ", " + scenes.taken.mean().map("{:.1f}".format)).unstack()
    print(ends.join(loads).to_string(float_format="{:.3g}".format))
    rng = np.random.default_rng(1)
    draws = trials.pivot_table("taken", ["divisor", "name", "trial"], ["hz", "what"]).dropna()
    for key, times in draws.groupby(["divisor", "name"]):
        means = times.T.groupby("hz").mean().T
        for low, high in ((0.6, 0.8), (0.8, 1.0)):
            less = (means[high] - means[low]).to_numpy()
            between = np.percentile(rng.choice(less, (5000, DRAWS)).mean(axis=1), [2.5, 97.5])
            print(*key, f"{high} less {low} Hz: {less.mean():+.1f} s", between.round(1))


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("flat", "trials", "table"))
    parser.add_argument("--rows", type=Path, default=ROWS)
    given = parser.parse_args()
    table(given.rows) if given.part == "table" else run(given.part, given.rows)


if __name__ == "__main__":
    main()
