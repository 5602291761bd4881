"""The table of learned policies in docs/envs.md: `python docs/science/learned.py`.

It is made of docs/science/learned.csv, the trials of `antennate tunnel` that the page names.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from antennate.studies.statistics import holm, mcnemar, signed_rank

ROWS = Path(__file__).with_suffix(".csv")
RIVALS, POLICIES = ("timed", "timed at 1 Hz"), ("taught by closed", "taught by the route")
RESAMPLES = 4000


def read() -> dict[str, np.ndarray]:
    """Whether each draw was crossed, and its time [s], of a failure the limit: shape (n, 2)."""
    with ROWS.open(newline="", encoding="utf-8") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: int(row["trial"]))
    trials: dict[str, list[tuple[bool, float]]] = {}
    for row in rows:
        out = row["outcome"] == "success"
        time = float(row["time_s"] if out else row["limit_s"])
        trials.setdefault(row["controller"], []).append((out, time))
    return {name: np.array(values) for name, values in trials.items()}


def main() -> None:
    """Print, for each rival, its row and a row for each policy."""
    trials = read()
    for rival in RIVALS:
        compare(rival, trials[rival], {name: trials[name] for name in POLICIES})


def compare(rival: str, other: np.ndarray, policies: dict[str, np.ndarray]) -> None:
    """Print the rows of a rival and of policies, on the same draws, with Holm's correction."""
    cells, p = [], []
    for name, own in policies.items():
        change = own[:, 1] - other[:, 1]
        sample = np.random.default_rng(0).choice(change, (RESAMPLES, len(change)))
        low, high = np.percentile(sample.mean(axis=1), [2.5, 97.5])
        crossed = mcnemar(np.stack([own[:, 0], other[:, 0]], axis=1) > 0.0)
        cells.append(
            f"| {name} | {int(own[:, 0].sum())} | {own[:, 1].mean():.1f} "
            f"| {change.mean():+.1f} ({low:+.1f} to {high:+.1f})"
        )
        p.append((signed_rank(change), crossed.mcnemar_p))
    print(f"| {rival} | {int(other[:, 0].sum())} | {other[:, 1].mean():.1f} | | | |")
    for row, times, successes in zip(cells, *map(holm, zip(*p, strict=True)), strict=True):
        print(f"{row} | {times:.2g} | {successes:.2g} |")


if __name__ == "__main__":
    main()
