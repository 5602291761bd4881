"""Students by touch and their rivals: `python docs/science/students.py PART FOLDER BOARD`.

Parts, one command each, from the root of the clone; what was stopped goes on with the same command:

- `teach`: five students of each of ARMS, `examples/imitate.py` with seeds 1 to 5.
- `judge`: each on the 20 draws of one part of the judged board, which `paces.py` left in BOARD.
- `table`: each arm beside the blind rules there, by the words of `paces.py`, and the arms beside
  one another.

The teacher is the search of `geometric` at 0.8 Hz, told the side on which the way goes on; the
student learns to say that side, too. All have the same budget, chosen before: 60,000 decisions in
the four scenes of the board with corners. An arm is judged by its five students together, each on
20 of the 100 draws. It has learnt to feel the side if it takes less time than its blind twin and
than the students of today's antenna, each by an interval that leaves out 0.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from paces import BLIND, DRAWS, PARTS, cells, judged, run

from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.config import SCENES_OF_BOARD, plain
from antennate_lab.compete.episodes import EpisodeRow

ROBOT, SWING = "docs/science/design_45.toml", 19.6
"""The best antenna that was found, and the sweep of its base [deg]."""
ARMS = {
    "today": (),
    "design45": ("--robot", ROBOT, "--swing", f"{SWING:g}"),
    "blind": ("--readings", "none"),
}
"""What the students are taught with."""
LESSONS = (
    *("--frequency", "0.8", "--teacher-knows", "side", "--decisions", "60000"),
    *("--scene", "uturn", "corner", "room", "deadend"),
)


def teach(folder: Path, workers: int) -> None:
    """Teach all students that have no policy yet, those of seed 1 first."""

    def one(arm: str, seed: int) -> None:
        out = folder / f"{arm}-{seed}"
        if (out / "policy.onnx").exists():
            return
        words = ["--out", str(out), "--seed", str(seed), *LESSONS, *ARMS[arm]]
        out.mkdir(parents=True, exist_ok=True)
        with (out / "taught.txt").open("w") as told:
            subprocess.run([sys.executable, "examples/imitate.py", *words], stdout=told, check=True)
        print(f"{arm}-{seed}: taught", flush=True)

    students = [(arm, seed) for seed in range(1, PARTS + 1) for arm in ARMS]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(one, *zip(*students, strict=True)))


def judge(folder: Path, board: Path, workers: int, draws: int) -> None:
    """Let each student walk on the draws of its part of the board."""
    for part in range(1, PARTS + 1):
        seed = tomllib.loads((board / f"judged-{part}" / "config.toml").read_text())["seed"]
        for arm, own in ARMS.items():
            texts, scenes = str(folder / f"{arm}-{part}" / "policy.onnx"), SCENES_OF_BOARD
            if ROBOT in own:
                texts += f"+gait.antenna_amplitude={math.radians(SWING)!r}"
                scenes = tuple(f"{scene}+robot={ROBOT}" for scene in scenes)
            run(folder / f"judged-{arm}-{part}", [texts], seed, draws, workers, scenes)


def table(folder: Path, board: Path) -> None:
    """Print each arm beside the best blind rule, and the arms beside one another."""

    def rows_of(pattern: str, where: Path, name: str) -> Iterable[EpisodeRow]:
        for path in sorted(where.glob(pattern)):
            for row in read_rows(path):
                yield replace(row, controller=name or plain(row.controller))

    rows = [*rows_of("judged-?/trials.csv", board, "")]
    for arm in ARMS:
        rows += rows_of(f"judged-{arm}-?/trials.csv", folder, arm)
    found = cells(rows)
    print("| | crossed | time [% of limit] |\n|---|---|---|")
    for name, (crossed, share) in found.items():
        print(f"| {name} | {crossed.sum():.0f} of {crossed.size} | {100 * share.mean():.1f} |")
    pairs = [*((arm, blind) for arm in ARMS for blind in BLIND), ("design45", "today")]
    pairs += [(arm, "blind") for arm in ("today", "design45")]
    print("", *(judged(a, found[a], b, found[b]) for a, b in pairs), sep="\n\n")


def main(argv: Sequence[str]) -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=("teach", "judge", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("board", type=Path, help="folder of the judged board of paces.py")
    parser.add_argument("--draws", type=int, default=DRAWS, help="of each scene; 2, to see it run")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args(argv)
    if given.part == "teach":
        teach(given.folder, given.workers)
    elif given.part == "judge":
        judge(given.folder, given.board, given.workers, given.draws)
    else:
        table(given.folder, given.board)


if __name__ == "__main__":
    main(sys.argv[1:])
