"""Students by touch and their rivals: `python docs/science/students.py PART FOLDER`.

Parts, one command each, from the root of the clone; what was stopped goes on with the same command:

- `teach`: five students of each of ARMS, `examples/imitate.py` with seeds 1 to 5.
- `judge`: each on the 20 draws of two parts of the judged board, those that `paces.py` has kept.
- `keep`: their rows go to `students.csv`; `--seeds` asks for some of the students first.
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
import csv
import math
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, fields, replace
from pathlib import Path

from paces import BLIND, EACH, JUDGED, PARTS, cells, judged, kept, run, whole_part

from antennate_lab.compete.config import SCENES_OF_BOARD, plain
from antennate_lab.compete.episodes import EpisodeRow

ROBOT, SWING = "docs/science/design_45.toml", 19.6
"""The best antenna that was found, and the sweep of its base [deg]."""
STUDENTS = PARTS // 2
"""Students of each arm."""
ARMS = {
    "today": (),
    "design45": ("--robot", ROBOT, "--swing", f"{SWING:g}"),
    "blind": ("--readings", "none"),
}
"""What the students are taught with."""
WALKED = Path(__file__).with_name("students.csv")
"""Rows of the students that are kept."""
LESSONS = (
    *("--frequency", "0.8", "--teacher-knows", "side", "--decisions", "60000"),
    *("--scene", "uturn", "corner", "room", "deadend"),
)


def teach(folder: Path, seeds: Iterable[int], workers: int) -> None:
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

    students = [(arm, seed) for seed in seeds for arm in ARMS]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(one, *zip(*students, strict=True)))


def judge(folder: Path, seeds: Iterable[int], workers: int, draws: int) -> None:
    """Let each student walk on the draws of its two parts of the board."""
    hidden = [*dict.fromkeys(row.seed for row in kept())]
    for student in seeds:
        for part in (student - 1, student - 1 + STUDENTS):
            if part >= len(hidden):
                sys.exit(f"{JUDGED}: expected part {part + 1} of the board, found {len(hidden)}")
            for arm, own in ARMS.items():
                texts, scenes = str(folder / f"{arm}-{student}" / "policy.onnx"), SCENES_OF_BOARD
                if ROBOT in own:
                    texts += f"+gait.antenna_amplitude={math.radians(SWING)!r}"
                    scenes = tuple(f"{scene}+robot={ROBOT}" for scene in scenes)
                out = folder / f"judged-{arm}-{part}"
                run(out, [texts], hidden[part], draws, workers, scenes)


def keep(folder: Path) -> None:
    """Keep the rows of the students of a folder, each by a policy's name in place of its path."""
    rows = kept(WALKED)
    done = {(row.controller, row.seed) for row in rows}
    for arm in ARMS:
        for path in sorted(folder.glob(f"judged-{arm}-*/trials.csv")):
            own = [replace(row, controller=f"{arm}.onnx") for row in whole_part(path)]
            rows += own * ((own[0].controller, own[0].seed) not in done)
    with WALKED.open("w", newline="") as file:
        table = csv.DictWriter(file, [field.name for field in fields(EpisodeRow)])
        table.writeheader()
        table.writerows(map(asdict, rows))


def table() -> None:
    """Print each arm beside the blind rules, and the arms beside one another."""
    walked = [replace(row, controller=Path(row.controller).stem) for row in kept(WALKED)]
    by_arm = [{row.seed for row in walked if row.controller == arm} for arm in ARMS]
    if (found := len(whole := set.intersection(*by_arm))) < PARTS:
        sys.exit(f"{WALKED}: expected {PARTS} parts that all arms have walked, found {found}")
    board = [replace(row, controller=plain(row.controller)) for row in kept()]
    shown = cells(row for row in [*board, *walked] if row.seed in whole)
    print("| | crossed | time [% of limit] |\n|---|---|---|")
    for name, (crossed, share) in shown.items():
        print(f"| {name} | {crossed.sum():.0f} of {crossed.size} | {100 * share.mean():.1f} |")
    pairs = [*((arm, blind) for arm in ARMS for blind in BLIND), ("design45", "today")]
    pairs += [(arm, "blind") for arm in ("today", "design45")]
    print("", *(judged(a, shown[a], b, shown[b]) for a, b in pairs), sep="\n\n")


def main(argv: Sequence[str]) -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=("teach", "judge", "keep", "table"))
    parser.add_argument("folder", type=Path, help="of the students and their runs")
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=range(1, STUDENTS + 1), help="which students"
    )
    parser.add_argument("--draws", type=int, default=EACH, help="of each scene; 2, to see it run")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args(argv)
    if given.part == "teach":
        teach(given.folder, given.seeds, given.workers)
    elif given.part == "judge":
        judge(given.folder, given.seeds, given.workers, given.draws)
    elif given.part == "keep":
        keep(given.folder)
    else:
        table()


if __name__ == "__main__":
    main(sys.argv[1:])
