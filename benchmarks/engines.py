"""Two engines, and two sets of processor instructions: what they cost and how far they disagree.

`mujoco` 3.17 is the engine that is locked; `mujoco-core` 4.0.1 is the other that is accepted. It
lives in an environment of its own under `peers/.venv`, made at the first run.

- `trial`: CPU time of the same tunnel trials over the bare engine, and the realtime factor, each
  engine in turn in one run.
- `ways`: the same tunnels crossed by `closed` and `open`, on each engine, with all of NumPy's
  processor instructions and with the oldest ones only (NPY_DISABLE_CPU_FEATURES).
- `pairs`: for each two of these ways the trials that end in another way, and the difference of
  the restricted mean time. That is what a comparison of controllers cannot see below: a tie.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from measuring import in_turn, ratios, spread

from antennate.studies.statistics import compare

ROOT = Path(__file__).parents[1]
FOLDER = Path(__file__).with_name("peers") / ".venv"
OTHER = "mujoco-core==4.0.1"
SEED = 20261126
"""Never used while anything was chosen."""
CONTROLLERS = ("closed", "open")
"""Those compared if none is named."""
LIMIT_S = 100.0
"""Time limit of the default tunnel, as which a failure counts."""
_TRIAL = """
import json, sys
sys.path.insert(0, sys.argv[1])
import trial
print(json.dumps(trial.measure(sys.argv[2] == "quick")))
"""


def installed() -> Path:
    """The Python of the other engine's environment, which is made if it is missing."""
    folder = FOLDER / OTHER.replace("==", "-")
    python = folder / "bin" / "python"
    uv = shutil.which("uv")
    if not python.exists():
        if uv is None:
            raise SystemExit("benchmarks/engines.py: expected uv, found none: pip install uv")
        folder.parent.mkdir(parents=True, exist_ok=True)
        without = folder.with_suffix(".override")
        without.write_text("mujoco ; sys_platform == 'never'\n")
        fill = [uv, "pip", "install", "--quiet", "--python", str(python)]
        fill += ["--override", str(without), "-e", str(ROOT), OTHER]
        for words in ([uv, "venv", "--quiet", "--python", sys.executable, str(folder)], fill):
            subprocess.run(words, check=True)
    return python


def engines() -> dict[str, str]:
    """The Python of each engine, by the engine's distribution and version."""
    pythons = {}
    for python in (sys.executable, str(installed())):
        code = "from antennate.sim.engine_setup import engines; print(*engines().popitem())"
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True)
        pythons[done.stdout.strip()] = python
    return pythons


def old_instructions() -> str:
    """All sets of processor instructions that NumPy can do without."""
    config: Any = np.show_config(mode="dicts")
    return " ".join(config["SIMD Extensions"]["found"])


def trials_of(python: str, quick: bool) -> dict[str, Any]:
    """What `trial.measure` says in another Python."""
    words = [python, "-c", _TRIAL, str(Path(__file__).parent), "quick" if quick else "whole"]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def measure(quick: bool) -> dict[str, Any]:
    """The cost of a trial on both engines, in turn in one run."""
    pythons = engines()
    figures: dict[str, list[dict[str, Any]]] = {name: [] for name in pythons}

    def once(name: str) -> float:
        figures[name].append(trials_of(pythons[name], quick))
        return figures[name][-1]["step_us"]["median"]

    steps = in_turn({name: lambda n=name: once(n) for name in pythons}, 1 if quick else 3)
    locked, other = pythons
    table = {}
    for name, runs in figures.items():
        for at_once in ("1", "24"):
            if at_once in runs[0]["at_once"]:
                row = [run["at_once"][at_once] for run in runs]
                table.setdefault(name, {})[at_once] = {
                    key: spread([each[key]["median"] for each in row])
                    for key in ("over_bare_engine", "realtime_factor")
                }
    return {
        "engines": table,
        "step_us": {name: spread(values) for name, values in steps.items()},
        "step_over_other": spread(ratios(steps[locked], steps[other])),
    }


def crossed(python: str, without: str, options: argparse.Namespace) -> dict[str, Any]:
    """The rows of the tunnel on one engine without some processor instructions, by controller."""
    names = options.controllers
    env = {**os.environ, "NPY_DISABLE_CPU_FEATURES": without}
    with tempfile.TemporaryDirectory() as folder:
        words = [python, "-m", "antennate", "tunnel", "--controllers", *names, "--no-figures"]
        words += ["--trials", str(options.trials), "--seed", str(SEED)]
        words += ["--workers", str(options.workers)]
        subprocess.run([*words, "--out", f"{folder}/run"], env=env, check=True, capture_output=True)
        with Path(folder, "run", "trials.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    return {name: [row for row in rows if row["controller"] == name] for name in names}


def restricted(rows: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Which trials succeeded, and the time of each, a failure as the limit [s]."""
    success = np.array([row["outcome"] == "success" for row in rows])
    times = [float(row["time_s"]) if row["outcome"] == "success" else LIMIT_S for row in rows]
    return success, np.array(times)


def agreement(options: argparse.Namespace) -> dict[str, Any]:
    """How the same tunnels end on two engines and with two sets of processor instructions."""
    old = old_instructions()
    ways = {
        f"{name}{mark}": (python, without)
        for name, python in engines().items()
        for mark, without in (("", ""), (", old instructions", old))
    }
    ended = {}
    for name, (python, without) in ways.items():
        ended[name] = crossed(python, without, options)
        sys.stderr.write(f"{name}: {options.trials} trials\n")
    pairs = []
    for one, other in itertools.combinations(ways, 2):
        for controller in options.controllers:
            pairs.append({"controller": controller, "ways": [one, other]})
            pairs[-1] |= differing(ended[one][controller], ended[other][controller])
    return {
        "seed": SEED,
        "trials": options.trials,
        "old_instructions": old,
        "ways": {name: told(ended[name]) for name in ways},
        "pairs": pairs,
    }


def told(rows: Mapping[str, list[dict[str, Any]]]) -> dict[str, dict[str, float]]:
    """Successes and restricted mean time [s] of each controller."""
    table = {}
    for name, each in rows.items():
        success, times = restricted(each)
        table[name] = {"successes": int(success.sum()), "time_s": round(float(times.mean()), 2)}
    return table


def differing(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> dict[str, Any]:
    """Trials that end in another way, and the difference of the restricted mean time."""
    first, second = restricted(one), restricted(other)
    paired = compare(first[0], second[0], first[1], second[1])
    return {
        "same_rows": sum(a == b for a, b in zip(one, other, strict=True)),
        "other_end": int((first[0] != second[0]).sum()),
        "difference_s": round(paired.time_difference_s or 0.0, 2),
        "difference_95": [round(end, 2) for end in paired.time_difference_95 or ()],
    }


def measure_agreement(quick: bool) -> dict[str, Any]:
    """How far two engines and two sets of instructions disagree on the default tunnel."""
    return agreement(
        argparse.Namespace(trials=4 if quick else 200, workers=2, controllers=CONTROLLERS)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    print(json.dumps(agreement(parser.parse_args()), indent=1))


if __name__ == "__main__":
    main()
