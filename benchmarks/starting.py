"""Starting: a Dask cluster beside local processes, and the way from a command to its first tick.

- `dask`: trials that compute for one second each, on processes of this machine and on a Dask
  cluster here.
- `start`: time on the clock from the command to the first control tick, to import the package, and
  from the command to the first trial that a study goes on with.
- `whole`: the main job, `antennate tunnel` as it is by default but for its figures, with one worker
  and with two.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from measuring import in_turn, ratios, spread, wall_seconds

from antennate.control.registry import make_controller
from antennate.robots.spec import RobotSpec
from antennate.studies.engines import make_engine
from antennate.studies.pool import Workers, gather
from antennate.types import AntennaFrame, Controller, JointCommand

CONTROLLER = "closed"
CORES = 2
NOTE = "ANTENNATE_FIRST_TICK"
"""Names the file in which `noting` keeps the time of its first step, and `trial` that of each."""
STUDY = f"""
experiment = "{Path(__file__).resolve()}:trial"
plan = "grid"
trials = 1000
[vary]
x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]
"""
ALL, FINISHED = 10_000, 9_900
"""Trials of the study, and how many of them it has when it goes on."""


def compute(seconds: float) -> float:
    """A trial that takes so much CPU time of its thread [s]."""
    begin = time.thread_time()
    while time.thread_time() - begin < seconds:
        sum(range(1000))
    return seconds


def measure_dask(quick: bool) -> dict[str, Any]:
    """Trials of one second on local processes and on a Dask cluster of as many."""
    seconds, trials = (0.2, 8) if quick else (1.0, 20)
    started: dict[str, list[float]] = {"local": [], "dask": []}
    steady: dict[str, list[float]] = {"local": [], "dask": []}

    def run(name: str) -> float:
        begin, times = time.perf_counter(), list[float]()
        gather(
            compute,
            [(seconds,)] * trials,
            Workers(CORES, make_engine(name)),
            lambda done, total: None,
            lambda _: times.append(time.perf_counter() - begin),
        )
        whole = time.perf_counter() - begin
        started[name].append(times[CORES - 1] - seconds)
        steady[name].append((times[-1] - times[CORES - 1]) / (trials / CORES - 1))
        return whole

    whole = in_turn({name: lambda n=name: run(n) for name in started}, 2)
    return {
        "trials": trials,
        "trial_s": seconds,
        "start_s": {name: spread(values) for name, values in started.items()},
        "steady_s": {name: spread(values) for name, values in steady.items()},
        "steady_over_local": spread(ratios(steady["dask"], steady["local"])),
        "whole_over_local": spread(ratios(whole["dask"], whole["local"])),
    }


def noting(control: Any, robot: RobotSpec, batch: int) -> Controller:
    """The controller `closed`, which notes when it is first asked."""
    made = make_controller(CONTROLLER, control, robot, batch)
    step = made.step

    def first(frame: AntennaFrame) -> JointCommand:
        with Path(os.environ[NOTE]).open("a", encoding="utf-8") as file:
            file.write(f"{time.monotonic()}\n")
        made.step = step  # pyright: ignore[reportAttributeAccessIssue]
        return step(frame)

    made.step = first  # pyright: ignore[reportAttributeAccessIssue]
    return made


def first_tick(workers: int) -> float:
    """Time from the command to the first control tick of any trial [s]."""
    with tempfile.TemporaryDirectory() as folder:
        note = Path(folder) / "note"
        words = ["-m", "antennate", "tunnel", "--trials", "2", "--time-limit", "0.05", "--json"]
        words += ["--controllers", f"{Path(__file__).resolve()}:noting"]
        words += ["--workers", str(workers), "--out", f"{folder}/run"]
        begin = time.monotonic()
        done = subprocess.run(
            [sys.executable, *words],
            env={**os.environ, NOTE: str(note)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise SystemExit(f"antennate tunnel: {done.stderr.strip() or done.stdout.strip()}")
        return min(map(float, note.read_text(encoding="utf-8").split())) - begin


def trial(config: dict[str, float], seed: int) -> dict[str, float]:
    """A trial that takes no time, and notes when it was run."""
    with Path(os.environ[NOTE]).open("a", encoding="utf-8") as file:
        file.write(f"{time.monotonic()}\n")
    return {"value": seed * config["x"]}


def go_on(folder: Path, finished: int) -> float:
    """Time from the command to the first trial of a study that has so many finished ones [s]."""
    run, note = folder / "run", folder / "note"
    note.unlink(missing_ok=True)
    if finished:
        (run / "result.json").unlink()
        store = run / "trials.jsonl"
        lines = store.read_bytes().splitlines(keepends=True)
        store.write_bytes(b"".join(lines[: finished - ALL]))  # without the last trials
    words = ["study", str(folder / "study.toml"), "--trust-code", "--no-figures"]
    begin = time.monotonic()
    subprocess.run(
        [sys.executable, "-m", "antennate", *words, "--workers", str(CORES), "--out", str(run)],
        env={**os.environ, NOTE: str(note)},
        capture_output=True,
        check=True,
    )
    times = [float(text) for text in note.read_text(encoding="utf-8").split()]
    if len(times) != ALL - finished:
        raise SystemExit(f"expected {ALL - finished} trials, found {len(times)}")
    return min(times) - begin


def python(code: str) -> float:
    """Time on the clock of a Python process [s]."""
    return wall_seconds(lambda: subprocess.run([sys.executable, "-c", code], check=True))


def measure_start(quick: bool) -> dict[str, Any]:
    """From the command to the first tick, and what importing takes."""
    cases = {
        "python": lambda: python("pass"),
        "import antennate": lambda: python("import antennate"),
        "antennate --version": lambda: wall_seconds(
            lambda: subprocess.run(
                [sys.executable, "-m", "antennate", "--version"], check=True, capture_output=True
            )
        ),
        "first tick, one worker": lambda: first_tick(1),
        "first tick, two workers": lambda: first_tick(CORES),
    }
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "study.toml").write_text(STUDY, encoding="utf-8")
        go_on(Path(folder), 0)
        cases[f"first of the last {ALL - FINISHED} of {ALL:,} trials"] = lambda: go_on(
            Path(folder), FINISHED
        )
        found = in_turn(cases, 2 if quick else 5)
    imported = [a - b for a, b in zip(found["import antennate"], found["python"], strict=True)]
    return {
        "seconds": {name: spread(values) for name, values in found.items()},
        "import": spread(imported),
    }


def whole_run(workers: int, more: list[str]) -> float:
    """Time on the clock of the command [s]."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "antennate", "tunnel", "--out", f"{folder}/run", *more]
        words += ["--no-figures", "--workers", str(workers)]
        return wall_seconds(lambda: subprocess.run(words, check=True, capture_output=True))


def measure_whole(quick: bool) -> dict[str, Any]:
    """The main job on one worker and on two, once each: it takes minutes."""
    more = ["--trials", "2", "--time-limit", "5"] if quick else []
    found = in_turn({n: lambda n=n: whole_run(n, more) for n in (1, CORES)}, 1)
    return {
        "seconds": {str(n): spread(values) for n, values in found.items()},
        "faster": spread(ratios(found[1], found[CORES])),
    }
