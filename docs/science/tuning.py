"""Tune each controller with the same budget: `python docs/science/tuning.py [FOLDER [NAME...]]`.

For each controller `antennate study design` proposes as many settings and walks each through the
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
"timed.walk_time" = { low = 2.5, high = 15, log = true }
"escape.reverse_time" = { low = 1, high = 5 }
"escape.turn_time" = { low = 1.2, high = 6 }
""",
    "schedule": """
"schedule.walk_time" = { low = 2.5, high = 15, log = true }
"schedule.headings" = { low = 0.5, high = 3, entries = [4, 4], rising = true }
"schedule.reverse_times" = { low = 1, high = 6, entries = [3, 3], rising = true }
""",
    "closed": """
"search.patience" = { low = 1, high = 8, log = true }
"search.reverse_time" = { low = 1, high = 5 }
"search.turn_time" = { low = 1.2, high = 6 }
"search.growth" = { low = 1, high = 1.6 }
""",
    "geometric": """
"search.patience" = { low = 1, high = 8, log = true }
"geometric.reverse_distance" = { low = 0.2, high = 1.1 }
"geometric.turn_angle" = { low = 0.5, high = 2.5 }
"search.growth" = { low = 1, high = 1.6 }
""",
    "follow": """
"follow.bend" = { low = 0.05, high = 0.5 }
"follow.gain" = { low = 0.3, high = 5, log = true }
"follow.rate_gain" = { low = 0, high = 2 }
"follow.smoothing_time" = { low = 0.1, high = 2, log = true }
""",
    "centre": """
"centre.gain" = { low = 0.3, high = 5, log = true }
"centre.rate_gain" = { low = 0, high = 2 }
"centre.smoothing_time" = { low = 0.1, high = 2, log = true }
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
        f"proposals = {PROPOSALS}\nvalidated = 1\nvalidation_factor = {FRESH}\n\n"
        f"[search]{SEARCHED[name]}\n[reference]\ndefault = {{}}\n\n"
        f'[evaluate.tunnel]\ntrials = {DRAWS}\nminimize = ["time_s"]\n'
        f'settings = {{ scene = "{Path(__file__).relative_to(ROOT)}:Mixed", '
        f'controllers = ["{name}"], seed = {SEED} }}\n'
    )
    command = [sys.executable, "-m", "antennate", "study", "design", file, "--out", folder / name]
    subprocess.run([*command, "--resume", "--trust-code", "--no-figures"], cwd=ROOT, check=True)


def rows_of(name: str, folder: Path) -> list[dict[str, str]]:
    """The trials of a search, each with its setting."""
    designs = json.loads((folder / "result.json").read_text())["designs"]
    settings = {
        str(design["design"]): " ".join(
            f"{key}={' '.join(map(str, np.atleast_1d(value)))}"
            for key, value in design["values"].items()
        )
        for design in designs
    }
    with (folder / "trials.csv").open(newline="", encoding="utf-8") as file:
        return [
            {"controller": name, "setting": settings[row["design"]]}
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
