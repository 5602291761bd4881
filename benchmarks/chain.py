"""Trials of the compiled chain over those of the engine, in one process at equal work.

Every trial runs with both solvers, one directly after the other, so that a change of the machine's
load meets both. Drawing, building, simulating and judging count; importing and compiling do not.
Beside the speed stands how far the two agree, trial by trial.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from antennate.antenna.statics import PROFILES, Profile
from antennate.experiments.calibrate.run import CalibrateConfig, push
from antennate.experiments.sweep.experiment import SweepRow, map_cell
from antennate.experiments.sweep.physics import SweepConfig
from antennate.experiments.wall.experiment import run_trial
from antennate.experiments.wall.physics import WallConfig, WallTrial
from antennate.params.bench import Solver
from antennate.sim import chain
from antennate.studies.statistics import wilson95

SOLVERS: tuple[Solver, ...] = ("mujoco", "chain")
Pair = tuple[Any, Any]


def timed(action: Callable[[Solver], Any]) -> tuple[Pair, tuple[float, float]]:
    """What an action returns with either solver, and the CPU time of each [s]."""
    found, seconds = [], []
    for solver in SOLVERS:
        before = time.process_time()
        found.append(action(solver))
        seconds.append(time.process_time() - before)
    return (found[0], found[1]), (seconds[0], seconds[1])


def speed(seconds: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Trials a second of both, and the median ratio."""
    engine, fast = zip(*seconds, strict=True)
    ratios = [one / other for one, other in zip(engine, fast, strict=True)]
    return {
        "trials": len(seconds),
        "engine_per_s": len(seconds) / sum(engine),
        "chain_per_s": len(seconds) / sum(fast),
        "ratio": statistics.median(ratios),
    }


def walls(trials: int, timestep: float) -> dict[str, Any]:
    """Boulder walls of all profiles."""
    physics = {"timestep": timestep, "contact_time": 2 * timestep}
    configs = {
        s: WallConfig.model_validate({"solver": s, "physics": physics, "trials": trials})
        for s in SOLVERS
    }
    seconds, profiles = [], {}
    for profile in PROFILES:
        pairs: list[tuple[WallTrial, WallTrial]] = []
        for trial in range(trials):
            pair, cost = timed(lambda s, p=profile, t=trial: run_trial(configs[s], p, t)[0])
            pairs.append(pair)
            seconds.append(cost)
        profiles[profile] = _agreement(pairs)
    return {**speed(seconds), "profiles": profiles}


def _agreement(pairs: Sequence[tuple[WallTrial, WallTrial]]) -> dict[str, Any]:
    sides = list(zip(*pairs, strict=True))
    passed = [sum(row.outcome == "success" for row in side) for side in sides]
    sticks = [abs(one.longest_stick_mm - other.longest_stick_mm) for one, other in pairs]
    return {
        "successes": passed,
        "jams": [sum(row.outcome == "jam" for row in side) for side in sides],
        "slips": [sum(row.outcome == "slip" for row in side) for side in sides],
        "wilson95": [wilson95(count, len(pairs)) for count in passed],
        "same_outcome": sum(one.outcome == other.outcome for one, other in pairs),
        "stick_mm": [statistics.median(row.longest_stick_mm for row in side) for side in sides],
        "stick_differs_mm": [statistics.median(sticks), max(sticks)],
        "force_mean_n": [statistics.median(row.force_mean_n for row in side) for side in sides],
    }


def pushes(trials: int) -> dict[str, Any]:
    """Pushes of the calibration rig."""
    configs = {s: CalibrateConfig(solver=s) for s in SOLVERS}
    seconds, counts = [], []
    for trial in range(min(trials, 30)):
        (one, other), cost = timed(lambda s, t=trial: push(configs[s], t).samples)
        seconds.append(cost)
        counts.append(float(abs(one.counts - other.counts).max()))
    return {**speed(seconds), "counts_differ": max(counts)}


def sweeps(trials: int) -> dict[str, Any]:
    """Cells of the map of base sweeps."""
    configs = {s: SweepConfig(solver=s) for s in SOLVERS}
    base, profile = configs["mujoco"], "descending"
    grid = [(d, c, a) for d in base.distances for c in base.centres for a in base.amplitudes]
    seconds, shares = [], []
    names = ("forward", "backward", "straight", "transition", "free")

    def cell(solver: Solver, at: int, kind: Profile = profile) -> SweepRow:
        return map_cell(configs[solver], kind, "moving", at, *grid[at])[0]

    for at in np.linspace(0, len(grid) - 1, min(trials, len(grid))).astype(int).tolist():
        (one, other), cost = timed(lambda s, k=at: cell(s, k))
        seconds.append(cost)
        shares.append(max(abs(getattr(one, n) - getattr(other, n)) for n in names))
    differ = {"shares_differ": [statistics.median(shares), max(shares)]}
    return {**speed(seconds), **differ}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--trials", type=int, default=10, help="trials of each profile, of each")
    parser.add_argument("--timestep", type=float, default=5e-4, help="of the walls [s]")
    options = parser.parse_args()
    chain.warm_up("chain")
    found = {
        "wall": walls(options.trials, options.timestep),
        "calibrate": pushes(options.trials),
        "sweep": sweeps(options.trials),
    }
    if options.json:
        print(json.dumps(found, indent=1))
        return
    print("study      trials  engine [1/s]  chain [1/s]  ratio")
    for name, part in found.items():
        rates = f"{part['engine_per_s']:12.2f}  {part['chain_per_s']:11.1f}"
        print(f"{name:9}  {part['trials']:6d}  {rates}  {part['ratio']:5.1f}")
    print("\nprofile          successes: engine, chain  same outcome  sticks differ [mm]")
    for name, part in found["wall"]["profiles"].items():
        passed = f"{part['successes'][0]:>17d}, {part['successes'][1]:>5d}"
        worst = f"{part['stick_differs_mm'][1]:18.2f}"
        print(f"{name:15}  {passed:>24}  {part['same_outcome']:12d}  {worst}")
    print(f"\npushes: readings differ by at most {found['calibrate']['counts_differ']:g} counts")
    median, most = found["sweep"]["shares_differ"]
    print(f"sweeps: shares of time differ by {median:.3f} in the median, {most:.3f} at most")


if __name__ == "__main__":
    main()
