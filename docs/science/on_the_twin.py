"""A controller drives the twin: `python docs/science/on_the_twin.py FOLDER CONTROLLER [WORD...]`.

In each tunnel a twin and a drive run as processes, and then `log replay` decides again on the log.
Further words go to `drive`. FOLDER/drives.csv has a row a drive. Nothing else should run meanwhile.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ANTENNATE = (sys.executable, "-m", "antennate")
LONGEST = 100
"""Time from torque on in which the robot has to get through [s]."""


def drive(folder: Path, controller: str, seed: int, trial: int, words: list[str]) -> dict[str, Any]:
    """Drive through one tunnel, and replay the log."""
    out, passed = folder / f"drive-{trial}", folder / f"passed-{trial}"
    place = ["--seed", str(seed), "--trial", str(trial), "--passed", passed]
    with subprocess.Popen([*ANTENNATE, "twin", *place], stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        try:
            ports = json.loads(twin.stdout.readline())
            line = ["--esp32", ports["esp32"], "--bus", ports["bus"], "--arm", "--no-touch-check"]
            until = ["--until", passed, "--duration", str(LONGEST), "--controller", controller]
            command = [*ANTENNATE, "drive", *line, *until, "--out", out, *words]
            code = subprocess.run(command, check=False).returncode
        finally:
            twin.terminate()
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    again = [*ANTENNATE, "log", "replay", out / "drive.mcap", "--controller", controller, "--json"]
    replay = json.loads(subprocess.run(again, check=True, stdout=subprocess.PIPE).stdout)
    return {
        "controller": controller,
        "words": " ".join(words),
        "seed": seed,
        "trial": trial,
        "crossed": passed.exists(),
        "exit_code": code,
        "ended": result["ended"],
        "worst_state": result["worst_state"],
        "walked_s": result["walked_s"],
        "missed_share": result["walking"] and result["walking"]["missed_share"],
        "ticks": replay["ticks"],
        "different_commands": replay["different_commands"],
    }


def main() -> None:
    """Drive through all tunnels."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("controller")
    parser.add_argument("--seed", type=int, default=67957488)
    parser.add_argument("--trials", type=int, nargs="+", default=range(10))
    options, words = parser.parse_known_args()
    folder: Path = options.folder.resolve()
    folder.mkdir(parents=True)
    rows = []
    for trial in options.trials:
        rows.append(drive(folder, options.controller, options.seed, trial, words))
        with (folder / "drives.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [*rows[0]], lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
