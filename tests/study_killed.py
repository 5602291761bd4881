"""Kills studies at random moments, the driver or one of its workers, until each is finished.

A kill comes after a random part of the time that an undisturbed study took, so that it falls on
any part of a study on a slow computer too.

Words: folder, number of kills, seed, trials of a study (else 300). Prints one JSON object:
kills of drivers and of workers, studies, tables that differ from an undisturbed one, trials lost,
trials twice in a table, and trials that were carried out again. After each study the same so far,
on stderr.
"""

from __future__ import annotations

import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import antennate

TRIALS = 300
"""Trials of one study."""
PLAN = """
experiment = "{code}:trial"
plan = "grid"
trials = {trials}
[settings]
sleep = 0.03
[vary]
x = [0.5, 1.5]
"""


def start(folder: Path, out: str) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "antennate", "study", "plan.toml", "--trust-code"]
    words += ["--out", out, "--workers", "2", "--no-figures", "--json"]
    source = str(Path(antennate.__file__).parents[1])  # PYTHONPATH may be relative, and cwd is not
    known = {**os.environ, "PYTHONPATH": source, "STUDY_NOTES": str(folder / "notes.txt")}
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(words, cwd=folder, env=known, **pipes)


def children(process: int) -> list[int]:
    """Worker processes, by what the system says; the tracker of multiprocessing is none."""
    every = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return [int(n) for n in every if b"spawn_main" in Path(f"/proc/{n}/cmdline").read_bytes()]


def disturbed(folder: Path, most: int, longest: float, chance: random.Random) -> tuple[int, int]:
    """One study, killed again and again until it ends; kills of its drivers and of its workers."""
    drivers = workers = 0
    while True:
        driver = start(folder, "run")
        while drivers + workers < most:
            try:
                driver.wait(chance.uniform(0.0, longest))
                break
            except subprocess.TimeoutExpired:
                pass
            try:
                processes = children(driver.pid)
                if processes and chance.random() < 0.6:
                    os.kill(chance.choice(processes), signal.SIGKILL)
                    workers += 1
                    continue
            except OSError:
                continue  # it has just ended
            driver.kill()
            drivers += 1
            break
        said = driver.communicate()[1]
        if driver.returncode == 0:
            return drivers, workers
        assert driver.returncode == -signal.SIGKILL, said.decode()


def one(folder: Path, most: int, chance: random.Random, trials: int) -> dict[str, int]:
    """One study and what became of it."""
    folder.mkdir(parents=True)
    code = Path(__file__).with_name("study_trials.py")
    notes = folder / "notes.txt"
    plan = PLAN.format(code=code, trials=trials // 2)
    (folder / "plan.toml").write_text(plan)
    begin = time.monotonic()
    whole = start(folder, "whole")
    said = whole.communicate()[1]
    took = time.monotonic() - begin
    assert whole.returncode == 0, said.decode()
    notes.unlink()
    drivers, workers = disturbed(folder, most, took, chance)
    tables = [(folder / run / "trials.csv").read_bytes() for run in ("whole", "run")]
    rows = list(csv.DictReader(tables[1].decode().splitlines()))
    different = {(row["x"], row["trial"]) for row in rows if row["status"] == "ok"}
    return {
        "drivers": drivers,
        "workers": workers,
        "studies": 1,
        "tables that differ": int(tables[0] != tables[1]),
        "lost": trials - len(different),
        "twice": len(rows) - len({(row["x"], row["trial"]) for row in rows}),
        "again": len(notes.read_text().splitlines()) - trials,
    }


def all_of(folder: Path, count: int, seed: int, trials: int) -> Counter[str]:
    """Studies until there were so many kills, and what became of them."""
    chance = random.Random(seed)
    total: Counter[str] = Counter()
    while total["drivers"] + total["workers"] < count:
        left = count - total["drivers"] - total["workers"]
        total.update(one(folder / str(total["studies"]), left, chance, trials))
        sys.stderr.write(f"{json.dumps(total)}\n")
    return total


def main() -> None:
    folder, count, seed = Path(sys.argv[1]).resolve(), int(sys.argv[2]), int(sys.argv[3])
    trials = int(sys.argv[4]) if len(sys.argv) > 4 else TRIALS
    sys.stdout.write(json.dumps(all_of(folder, count, seed, trials)))


if __name__ == "__main__":
    main()
