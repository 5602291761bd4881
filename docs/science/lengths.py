"""What a longer antenna costs at the wall and in the tunnel: `python docs/science/lengths.py PART`.

Parts: `sweep` (boulder wall, descending and stiff antennae of each length over the base angle),
`wall` (fresh walls at the angle of each length at which descending passes most ahead of stiff),
`tunnel` (the default tunnel with each antenna) and `table` (writes the table of corridors.md).
Each of the first three writes docs/science/lengths_PART.json.

Written before the runs: a length *passes the wall* if on fresh walls the lower 95 % end of its
descending antenna is above the upper end of the stiff one of the same length. In the tunnel a
length *costs* if fewer are crossed than with today's, on the same draws, McNemar's p below 0.05
after Holm's correction over the lengths and controllers. Seeds 594001, 594002 and 594003 were used
for nothing before.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from sides import Begun, Design, designs

import antennate
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.experiments.wall.physics import WallConfig
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.registry import make_scene
from antennate.sim.sim_robot import SimRobot
from antennate.studies.statistics import holm, mcnemar, wilson95

HERE = Path(__file__).parent
ANGLES = (41.0, 44.0, 47.0, 50.0, 53.0, 56.0, 59.0, 62.0)
"""Of the base at the wall [deg]."""
SWEEP, FRESH, TUNNEL = 594_001, 594_002, 594_003
EACH, WALLS, TRIALS = 6, 40, 40
"""Trials of a cell of the sweep, of a profile on fresh walls, of a controller in the tunnel."""
PROFILES = "descending", "stiff"
CONTROLLERS = "geometric", "closed"
ANTENNAE: Mapping[str, Design] = {
    "0.12": Design("0.12"),
    "0.18": Design("0.18", length=0.18),
    "0.24": Design("0.24", length=0.24),
    "0.31": Design("0.31", length=0.31),
    "59": designs()["59"],
}
"""By name: the paper's beam at four lengths, and the design that told most of the side."""


def wall(name: str, angle: float, seed: int, trials: int) -> dict[str, Any]:
    """Outcomes of both profiles of an antenna at a base angle [deg]."""
    config = WallConfig.model_validate(
        {
            "seed": seed,
            "trials": trials,
            "profiles": PROFILES,
            "antenna": ANTENNAE[name].robot.antenna.model_dump(exclude={"base_angle"}),
            "wall": {"base_angle": math.radians(angle)},
        }
    )
    found = antennate.run(config).summary["profiles"]
    keys = "trials", "successes", "jams", "slips", "invalid", "hinge_max_deg", "force_max_n"
    return {profile: {key: found[profile][key] for key in keys} for profile in PROFILES}


class Early:
    """The default tunnel, which the robot enters from farther off, with room for long antennae."""

    random = True

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Any:
        """Draw one, with cylinders where today's robot would have them."""
        return Begun(make_scene("tunnel").draw(RobotSpec(), rng), "tunnel")


def tunnel(name: str, controller: str) -> list[dict[str, Any]]:
    """Rows of a controller with an antenna."""
    config = TunnelConfig(seed=TUNNEL, trials=TRIALS, robot=ANTENNAE[name].robot)

    def bodies(batch: int) -> Any:
        period, step = config.control.period, config.physics.timestep
        return Early(), SimRobot(batch, config.robot, period, step)

    def monitor(row: int, episode: Any) -> TrialMonitor:
        return TrialMonitor(episode, controller)

    rows: list[dict[str, Any]] = []
    run_trials(
        *(config, controller, range(TRIALS), lambda found: rows.append(asdict(found[0]))),
        apparatus=Apparatus(bodies=bodies, monitor=monitor),
    )
    keys = "trial", "outcome", "time_s", "reason"
    return [{key: row[key] for key in keys} for row in sorted(rows, key=lambda row: row["trial"])]


def best(cells: Mapping[str, Any]) -> float:
    """Angle at which descending passes most ahead of stiff; the middle one of equals [deg]."""
    ahead = {
        angle: cell["descending"]["successes"] - cell["stiff"]["successes"]
        for angle, cell in cells.items()
    }
    most = [float(angle) for angle, lead in ahead.items() if lead == max(ahead.values())]
    return most[len(most) // 2]


def run(part: str, workers: int) -> None:
    """Run a part and write its file."""
    with ProcessPoolExecutor(workers) as pool:
        if part == "tunnel":
            cells = [(name, controller) for name in ANTENNAE for controller in CONTROLLERS]
            found = pool.map(tunnel, *zip(*cells, strict=True))
            seed = TUNNEL
        else:
            sweep = read("sweep")["cells"] if part == "wall" else {}
            angles = {name: [best(sweep[name])] if sweep else ANGLES for name in ANTENNAE}
            cells = [(name, f"{angle:g}") for name in ANTENNAE for angle in angles[name]]
            seed, trials = (SWEEP, EACH) if part == "sweep" else (FRESH, WALLS)
            jobs = [pool.submit(wall, name, float(a), seed, trials) for name, a in cells]
            found = (job.result() for job in jobs)
        table: dict[str, dict[str, Any]] = {}
        for (name, key), cell in zip(cells, found, strict=True):
            table.setdefault(name, {})[key] = cell
            print(part, name, key, flush=True)
    out = {"seed": seed, "cells": table}
    (HERE / f"lengths_{part}.json").write_text(json.dumps(out, indent=1) + "\n")


def read(part: str) -> Any:
    """What a part has written."""
    return json.loads((HERE / f"lengths_{part}.json").read_text())


def ends(successes: int, trials: int) -> str:
    """Successes and their 95 % interval."""
    low, high = wilson95(successes, trials)
    return f"{successes} of {trials} ({low:.2f}–{high:.2f})"


def table() -> None:
    """Write the table of the page."""
    walls = read("wall")["cells"]
    ran = (HERE / "lengths_tunnel.json").exists()
    tunnels = read("tunnel")["cells"] if ran else {}
    crossed = {
        (name, controller): np.array([row["outcome"] == "success" for row in rows])
        for name, cells in tunnels.items()
        for controller, rows in cells.items()
    }
    valid = {
        (name, controller): np.array([row["outcome"] != "invalid" for row in rows])
        for name, cells in tunnels.items()
        for controller, rows in cells.items()
    }
    others = [key for key in crossed if key[0] != "0.12"]
    both = {(n, c): valid["0.12", c] & valid[n, c] for n, c in others}
    pairs = [
        mcnemar(np.stack([crossed["0.12", c], crossed[n, c]], axis=1)[both[n, c]])
        for n, c in others
    ]
    raised = dict(zip(others, holm([pair.mcnemar_p for pair in pairs]), strict=True))
    heads = ("antenna", "base at the wall", *PROFILES, "largest hinge, descending")
    heads = (*heads, *(f"tunnel, `{c}`" for c in CONTROLLERS if ran))
    lines = [f"| {' | '.join(heads)} |", "|" + " --- |" * len(heads)]
    for name, design in ANTENNAE.items():
        ((angle, cell),) = walls[name].items()
        words = f"{design.length:.2f} m" + (", soft (design 59)" if name == "59" else "")
        passed = [ends(cell[p]["successes"], cell[p]["trials"]) for p in PROFILES]
        most = cell["descending"]["hinge_max_deg"]
        line = [words, f"{angle}°", *passed, f"{most:.0f}°"]
        for controller in tunnels.get(name, ()):
            p = raised.get((name, controller))
            text = ends(int(crossed[name, controller].sum()), int(valid[name, controller].sum()))
            line.append(text + (f", p = {p:.2g}" if p is not None else ""))
        lines.append(f"| {' | '.join(line)} |")
    page = HERE / "corridors.md"
    begin, rest = page.read_text().split("<!-- lengths: ")
    head, rest = rest.split("\n", 1)
    after = rest.split("<!-- end of lengths -->")[1]
    text = "\n".join(lines)
    page.write_text(f"{begin}<!-- lengths: {head}\n{text}\n<!-- end of lengths -->{after}")


def main() -> None:
    """Do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=["sweep", "wall", "tunnel", "table"])
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    if asked.part == "table":
        table()
    else:
        run(asked.part, asked.workers)


if __name__ == "__main__":
    main()
