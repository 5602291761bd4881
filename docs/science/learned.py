"""The table of learned policies in docs/envs.md: `python docs/science/learned.py`.

It is made of rows of docs/science/learned.csv: trials of `antennate tunnel` that the page names.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from antennate.studies.statistics import holm, mcnemar, signed_rank

ROWS, SEED = Path(__file__).with_suffix(".csv"), "67957488"
STUDENT = "taught"
RIVALS = ("blind twin", "timed", "timed at 1 Hz", "geometric", "geometric at 1 Hz")
RESAMPLES = 4000


def read() -> dict[str, np.ndarray]:
    """Whether each draw was crossed, and its time [s], of a failure the limit: shape (n, 2)."""
    with ROWS.open(newline="", encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: int(row["trial"]))
    trials: dict[str, list[tuple[bool, float]]] = {}
    for row in rows:
        out = row["outcome"] == "success"
        time = float(row["time_s"] if out else row["limit_s"])
        if row["seed"] == SEED:
            trials.setdefault(row["controller"], []).append((out, time))
    return {name: np.array(values) for name, values in trials.items()}


def main() -> None:
    """Print the row of the student, and a row for each rival with Holm's correction."""
    trials = read()
    own, cells, p = trials[STUDENT], [], []
    print(f"| {shown(STUDENT, own)} | | | |")
    for name in RIVALS:
        other = trials[name]
        change = own[:, 1] - other[:, 1]
        sample = np.random.default_rng(0).choice(change, (RESAMPLES, len(change)))
        low, high = np.percentile(sample.mean(axis=1), [2.5, 97.5])
        crossed = mcnemar(np.stack([own[:, 0], other[:, 0]], axis=1) > 0.0)
        cells.append(f"| {shown(name, other)} | {change.mean():+.1f} ({low:+.1f} to {high:+.1f}) ")
        p.append((signed_rank(change), crossed.mcnemar_p))
    for row, times, successes in zip(cells, *map(holm, zip(*p, strict=True)), strict=True):
        print(f"{row}| {times:.2g} | {successes:.2g} |")


def shown(name: str, trials: np.ndarray) -> str:
    """The cells of a controller: its name, draws crossed, and mean time."""
    return f"{name} | {int(trials[:, 0].sum())} | {trials[:, 1].mean():.1f}"


if __name__ == "__main__":
    main()
