"""What a live view and a log cost: a simulated trial, and the pace of `antennate drive`.

- `log`, `view`, `view_and_log`: wall time of trials with them over that without, at full speed,
  interleaved in one process; `cpu` the same of the CPU time of that process. At most 1.05 is asked.
- `in_turn`: the same of log and page together, from trials in which both rest in every other block
  of 150 ticks: each block over the mean of its neighbours. It has less noise.
- `missed_share`, `walking_missed_share`: cycles that a drive against a twin missed, with a page and
  without one, in turn.

Nothing else may run meanwhile. With `--wait` it prints the link of the page and waits for Enter, so
that a browser draws it too; without one the page is served, but nobody looks.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import pace

from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.sim.world import World
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.telemetry.view.process import ViewProcess
from antennate.telemetry.view.simulation import SimulationView
from antennate.types import AntennaFrame, Controller

CONTROLLER = "closed"
CASES = {"plain": (False, False), "log": (False, True), "view": (True, False)}
CASES |= {"view_and_log": (True, True)}
"""Whether each case has a view, and a log."""
PARTS = [(Decisions, "take"), (SimulatedLog, "take"), (SimulationView, "tick")]
LAST_OF_A_TICK = "SimulationView.tick"
BLOCK = 150
"""Ticks after which log and page rest, or work again: some 0.2 s."""


def trial(config: TunnelConfig, number: int, logs: Path | None, page: ViewProcess | None) -> None:
    """One trial, one at a time, as `tunnel --view` runs it."""
    if page is None:
        run_trials(config, CONTROLLER, [number], lambda found: None, logs=logs)
        return
    view = SimulationView(page.channel, 0.0)
    view.begin(f"{CONTROLLER}, trial {number}", config.seed)

    def watch(world: World, frame: AntennaFrame, control: Controller) -> Any:
        return view.tick(world.model, world.data, frame, control)

    kept: list[Any] = []
    seen = Apparatus(view.controller, watch=watch)
    run_trials(config, CONTROLLER, [number], kept.append, logs=logs, apparatus=seen)


class InTurn:
    """Lets log and page rest in every other block of ticks, and keeps the time of each block."""

    def __init__(self, works: bool) -> None:
        self._works, self._ticks, self._begin = works, 0, time.perf_counter()
        self._last: dict[str, Any] = {}
        self._blocks: list[tuple[bool, float]] = []

    def __enter__(self) -> InTurn:
        self._stack = contextlib.ExitStack()
        for owner, name in PARTS:
            call = self._gated(f"{owner.__name__}.{name}", getattr(owner, name))
            self._stack.enter_context(mock.patch.object(owner, name, call))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _gated(self, key: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def run(*args: Any) -> Any:
            if self._works or key not in self._last:
                self._last[key] = call(*args)
            if key == LAST_OF_A_TICK:
                self._count()
            return self._last[key]

        return run

    def _count(self) -> None:
        self._ticks += 1
        if self._ticks % BLOCK == 0:
            now = time.perf_counter()
            self._blocks.append((self._works, now - self._begin))
            self._works, self._begin = not self._works, time.perf_counter()

    @property
    def ratios(self) -> list[float]:
        """Time of blocks with log and page over that of their neighbours without, and so on."""
        blocks = self._blocks[1:]
        found: list[float] = []
        for i in range(1, len(blocks) - 1):
            works, now = blocks[i]
            ratio = 2 * now / (blocks[i - 1][1] + blocks[i + 1][1])
            found.append(ratio if works else 1 / ratio)
        return found


def simulated(trials: int, repetitions: int, wait: bool) -> dict[str, Any]:
    """Ratios of the cases to the plain one, medians over trials."""
    config = TunnelConfig()
    walls: dict[str, list[float]] = {name: [] for name in CASES}
    cpus: dict[str, list[float]] = {name: [] for name in CASES}
    in_turn: list[float] = []
    with (
        ViewProcess(0, "antennate.cli.pages") as page,
        tempfile.TemporaryDirectory() as folder,
    ):
        if wait:
            input("open the link, then press Enter ")
        for number, turn in itertools.product(range(trials), range(repetitions)):
            first = turn % len(CASES)  # none always follows the same one
            for name, (viewed, logged) in [*CASES.items()][first:] + [*CASES.items()][:first]:
                logs = Path(folder) / f"{number}-{turn}-{name}"
                logs.mkdir()
                begin = time.monotonic(), time.process_time()
                trial(config, number, logs if logged else None, page if viewed else None)
                walls[name].append(time.monotonic() - begin[0])
                cpus[name].append(time.process_time() - begin[1])
            logs = Path(folder) / f"{number}-{turn}-in-turn"
            logs.mkdir()
            with InTurn(turn % 2 == 0) as blocks:
                trial(config, number, logs, page)
            in_turn += blocks.ratios
        dropped = page.channel.dropped
    ratios = {
        name: {
            "wall": _middle(_ratios(walls[name], walls["plain"])),
            "cpu": _middle(_ratios(cpus[name], cpus["plain"])),
        }
        for name in CASES
        if name != "plain"
    }
    return {**ratios, "in_turn": {"view_and_log": _middle(in_turn)}, "dropped": dropped}


def _ratios(times: list[float], plain: list[float]) -> list[float]:
    return [one / other for one, other in zip(times, plain, strict=True)]


def _middle(values: list[float]) -> str:
    """Median and quartiles."""
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return f"{middle:.3f} ({low:.3f} to {high:.3f})"


def driven(seconds: float, pairs: int) -> dict[str, Any]:
    """Missed cycles of drives with a page and without, in turn."""
    found: dict[str, list[dict[str, Any]]] = {"plain": [], "view": []}
    for _ in range(pairs):
        found["plain"].append(pace.summary(pace.walk(seconds, 0)))
        found["view"].append(
            pace.summary(pace.walk(seconds, 0, more=("--view", "--view-port", "0")))
        )
    keys = ("missed_share", "walking_missed_share", "worst_lateness_ms")
    return {
        name: {key: [row.get(key) for row in rows] for key in keys} for name, rows in found.items()
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=4)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0, help="time of each walk")
    parser.add_argument("--pairs", type=int, default=3, help="drives with and without a page")
    parser.add_argument("--wait", action="store_true", help="wait until a browser has the page")
    parser.add_argument("--json", action="store_true", help="print one JSON object and no table")
    args = parser.parse_args()
    result: dict[str, Any] = {"cores": os.cpu_count()}
    if args.trials:
        result["simulated"] = simulated(args.trials, args.repetitions, args.wait)
    if args.pairs:
        result["driven"] = driven(args.seconds, args.pairs)
    if args.json:
        print(json.dumps(result))
        return
    for name, rows in result.items():
        print(f"{name}: {rows}" if not isinstance(rows, dict) else name)
        for case, values in rows.items() if isinstance(rows, dict) else ():
            print(f"  {case}: {values}")


if __name__ == "__main__":
    main()
