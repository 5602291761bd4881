"""Kills studies at random moments, the driver or one of its workers, until each is finished.

Words: folder, number of kills, seed. Prints one JSON object: kills of drivers and of workers,
studies, tables that differ from an undisturbed one, trials lost, trials twice in a table, and
trials that were carried out again.
"""

from __future__ import annotations

import csv
import json
import os
import random
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

TRIALS = 300
"""Trials of one study."""
PLAN = """
experiment = "{code}:trial"
plan = "grid"
trials = {trials}
[settings]
sleep = 0.005
[vary]
x = [0.5, 1.5]
"""


def start(folder: Path, out: str) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "antennate", "study", "plan.toml", "--trust-code"]
    words += ["--out", out, "--workers", "2", "--no-figures", "--json"]
    known = {**os.environ, "STUDY_NOTES": str(folder / "notes.txt")}
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(words, cwd=folder, env=known, **pipes)


def children(process: int) -> list[int]:
    """Worker processes, by what the system says; the tracker of multiprocessing is none."""
    every = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return [int(n) for n in every if b"spawn_main" in Path(f"/proc/{n}/cmdline").read_bytes()]


def disturbed(folder: Path, most: int, chance: random.Random) -> tuple[int, int]:
    """One study, killed again and again until it ends; kills of its drivers and of its workers."""
    drivers = workers = 0
    while True:
        driver = start(folder, "run")
        while drivers + workers < most:
            try:
                driver.wait(chance.uniform(0.0, 3.0))
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


def one(folder: Path, most: int, chance: random.Random) -> dict[str, int]:
    """One study and what became of it."""
    folder.mkdir(parents=True)
    code = Path(__file__).with_name("study_trials.py")
    notes = folder / "notes.txt"
    plan = PLAN.format(code=code, trials=TRIALS // 2)
    (folder / "plan.toml").write_text(plan)
    whole = start(folder, "whole")
    said = whole.communicate()[1]
    assert whole.returncode == 0, said.decode()
    notes.unlink()
    drivers, workers = disturbed(folder, most, chance)
    tables = [(folder / run / "trials.csv").read_bytes() for run in ("whole", "run")]
    rows = list(csv.DictReader(tables[1].decode().splitlines()))
    different = {(row["x"], row["trial"]) for row in rows if row["status"] == "ok"}
    return {
        "drivers": drivers,
        "workers": workers,
        "studies": 1,
        "tables that differ": int(tables[0] != tables[1]),
        "lost": TRIALS - len(different),
        "twice": len(rows) - len({(row["x"], row["trial"]) for row in rows}),
        "again": len(notes.read_text().splitlines()) - TRIALS,
    }


def main() -> None:
    folder, count, seed = Path(sys.argv[1]).resolve(), int(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(seed)
    total: Counter[str] = Counter()
    while total["drivers"] + total["workers"] < count:
        left = count - total["drivers"] - total["workers"]
        total.update(one(folder / str(total["studies"]), left, chance))
    sys.stdout.write(json.dumps(total))


if __name__ == "__main__":
    main()
