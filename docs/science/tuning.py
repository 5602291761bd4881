"""Tune each controller with the same budget: `python docs/science/tuning.py [FOLDER [NAME...]]`.

For each controller a study by plan `optuna` proposes as many settings and walks each through the
same draws of four hard scenes. The one of the least mean time, a failure as the limit, then walks
beside the default through fresh draws. A search that was stopped goes on. At the end the table of
all searches that have ended is printed, and FOLDER/tuning.csv holds their trials. Without a folder
the table of docs/leaderboard.md is printed, of the trials in docs/science/tuning.csv.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from antennate.sim.scenes.registry import make_scene
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies.statistics import difference95, holm, signed_rank

ROOT, ROWS = Path(__file__).parents[2], Path(__file__).with_suffix(".csv")
COLUMNS = (
    *("controller", "design", "phase", "setting", "seed", "trial"),
    *("outcome", "time_s", "limit_s"),
)
SCENES = ("uturn", "corner", "deadend", "room")
SEED = 600024
"""The first public seed of which the first eight draws hold each scene twice."""
PROPOSALS, DRAWS, FRESH = 16, 8, 4
"""Settings that are tried, draws of each, and how many times as many fresh draws."""

SEARCHED = {
    "timed": """
"control.timed.walk_time" = { low = 2.5, high = 15, log = true }
"control.escape.reverse_time" = { low = 1, high = 5 }
"control.escape.turn_time" = { low = 1.2, high = 6 }
""",
    "schedule": """
"control.schedule.walk_time" = { low = 2.5, high = 15, log = true }
"control.schedule.headings" = { low = 0.5, high = 3, entries = [4, 4], rising = true }
"control.schedule.reverse_times" = { low = 1, high = 6, entries = [3, 3], rising = true }
""",
    "closed": """
"control.search.patience" = { low = 1, high = 8, log = true }
"control.search.reverse_time" = { low = 1, high = 5 }
"control.search.turn_time" = { low = 1.2, high = 6 }
"control.search.growth" = { low = 1, high = 1.6 }
""",
    "geometric": """
"control.search.patience" = { low = 1, high = 8, log = true }
"control.geometric.reverse_distance" = { low = 0.2, high = 1.1 }
"control.geometric.turn_angle" = { low = 0.5, high = 2.5 }
"control.search.growth" = { low = 1, high = 1.6 }
""",
    "follow": """
"control.follow.bend" = { low = 0.05, high = 0.5 }
"control.follow.gain" = { low = 0.3, high = 5, log = true }
"control.follow.rate_gain" = { low = 0, high = 2 }
"control.follow.smoothing_time" = { low = 0.1, high = 2, log = true }
""",
    "centre": """
"control.centre.gain" = { low = 0.3, high = 5, log = true }
"control.centre.rate_gain" = { low = 0, high = 2 }
"control.centre.smoothing_time" = { low = 0.1, high = 2, log = true }
""",
}


class Mixed:
    """One of the hard scenes in each draw."""

    random = True

    def draw(self, robot, rng):
        return make_scene(str(rng.choice(SCENES))).draw(robot, rng)


def search(name: str, folder: Path) -> None:
    """Run the search of one controller, or go on with it."""
    file = folder / f"{name}.toml"
    file.write_text(
        f'experiment = "tunnel"\nplan = "optuna"\npoints = {PROPOSALS}\ntrials = {DRAWS}\n'
        f'validated = 1\nvalidation_factor = {FRESH}\nminimize = ["time_s"]\n\n'
        f"[vary]{SEARCHED[name]}\n[reference]\ndefault = {{}}\n\n[settings]\n"
        f'scene = "{Path(__file__).relative_to(ROOT)}:Mixed"\n'
        f'controllers = ["{name}"]\nseed = {SEED}\n'
    )
    command = [sys.executable, "-m", "antennate", "study", file, "--out", folder / name]
    subprocess.run([*command, "--resume", "--trust-code", "--no-figures"], cwd=ROOT, check=True)


def rows_of(name: str, folder: Path) -> list[dict[str, str]]:
    """The trials of a search, each with its setting."""
    designs = json.loads((folder / "result.json").read_text())["search"]["designs"]
    settings = {
        str(design["point"]): " ".join(
            f"{key.removeprefix('control.')}={' '.join(map(str, np.atleast_1d(value)))}"
            for key, value in design["values"].items()
        )
        for design in designs
    }
    with (folder / "trials.csv").open(newline="", encoding="utf-8") as file:
        return [
            {"controller": name, "design": row["point"], "setting": settings[row["point"]]}
            | {key: row[key] for key in COLUMNS if key in row and key != "controller"}
            for row in csv.DictReader(file)
        ]


def compared(name: str, rows: list[dict[str, str]]) -> tuple[str, float]:
    """The best setting of a search beside the default on fresh draws, and p of Wilcoxon's test."""
    draws: dict[str, list[tuple[bool, float]]] = {}
    for row in rows:
        if row["phase"] == "validation" and row["controller"] == name:
            draw = row["outcome"] == "success", float(row["time_s"])
            draws.setdefault(row["setting"], []).append(draw)
    default = np.array(draws.pop(""))
    best = next(iter(draws), "")  # the default itself where that was the best of the search
    tuned = np.array(draws[best]) if best else default
    both = (default, tuned)
    crossed = " | ".join(f"{int(values[:, 0].sum())}" for values in both)
    times = " | ".join(f"{values[:, 1].mean():.1f}" for values in both)
    less, ends = difference95(tuned[:, 1], default[:, 1], TIME_LIMIT)
    low, high = ends or (np.nan, np.nan)
    found = shown(best) if best else "the default"
    cells = f"| `{name}` | {found} | {crossed} | {times} | {less:+.1f} ({low:+.1f} to {high:+.1f})"
    return cells, signed_rank(tuned[:, 1] - default[:, 1])


def shown(setting: str) -> str:
    """A setting as the page writes it."""
    text = re.sub(r"[-+]?[0-9]+\.?[0-9]*(e[-+]?[0-9]+)?", lambda m: f"{float(m[0]):.2g}", setting)
    return re.sub(r" ?([a-z_.]+)=", r", `\1` ", text).removeprefix(", ")


def main() -> None:
    """Search, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SEARCHED))
    options = parser.parse_args()
    if strange := set(options.names) - set(SEARCHED):
        parser.error(f"expected {', '.join(SEARCHED)}, found {', '.join(sorted(strange))}")
    if options.folder is None:
        with ROWS.open(newline="", encoding="utf-8") as file:
            rows = [*csv.DictReader(file)]
    else:
        folder: Path = options.folder.resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for name in options.names or SEARCHED:
            search(name, folder)
        ended = [name for name in SEARCHED if (folder / name / "result.json").exists()]
        rows = [row for name in ended for row in rows_of(name, folder / name)]
        with (folder / ROWS.name).open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    names = dict.fromkeys(row["controller"] for row in rows)
    cells, p = zip(*(compared(name, rows) for name in names), strict=True)
    for cell, raw, chance in zip(cells, p, holm(p), strict=True):
        print(f"{cell} | {raw:.2g} | {chance:.2g} |")


if __name__ == "__main__":
    main()
