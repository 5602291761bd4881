"""The table of the learned policy in docs/envs.md: `python docs/science/learned.py`.

It is made of docs/science/learned.csv, the trials of the commands that the page names, and of the
rows of `closed` and `geometric` in docs/science/geometric.csv.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from antennate.studies.statistics import holm, mcnemar, signed_rank

HERE = Path(__file__).parent
FRESH, KNOWN = "20261377", "20261201"
COMPARED = (
    ("uturn", FRESH, "timed"),
    ("uturn", FRESH, "blind"),
    ("uturn", KNOWN, "closed"),
    ("uturn", KNOWN, "geometric"),
    ("room", KNOWN, "blind"),
    ("room", KNOWN, "closed"),
    ("room", KNOWN, "geometric"),
)
"""Scene, seed and rival of each comparison."""
RESAMPLES = 4000
Trials = dict[int, tuple[bool, float]]
"""Whether each draw was crossed, and its time [s], of a failure the limit."""


def read() -> dict[tuple[str, str, str], Trials]:
    """All trials by scene, seed and controller."""
    trials: dict[tuple[str, str, str], Trials] = {}
    for name in ("learned", "geometric"):
        with (HERE / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if row.get("frequency_hz", "0.6") == "0.6":
                    out = row["outcome"] == "success"
                    key = row["scene"], row["seed"], row["controller"]
                    time = float(row["time_s"] if out else row["limit_s"])
                    trials.setdefault(key, {})[int(row["trial"])] = out, time
    return trials


def main() -> None:
    """Print a row for each comparison."""
    trials, rows = read(), []
    for scene, seed, rival in COMPARED:
        own, other = trials[scene, seed, "policy"], trials[scene, seed, rival]
        draws = sorted(own.keys() & other.keys())
        (a, s), (b, t) = (np.array([x[i] for i in draws]).T for x in (own, other))
        change = s - t
        sample = np.random.default_rng(0).choice(change, (RESAMPLES, len(change)))
        low, high = np.percentile(sample.mean(axis=1), [2.5, 97.5])
        p = signed_rank(change), mcnemar(np.stack([a, b], axis=1) > 0.0).mcnemar_p
        cells = [
            f"`{scene}`, {seed}",
            f"`{rival}`" if rival != "blind" else "blind twin",
            f"{int(a.sum())}, {s.mean():.1f} s",
            f"{int(b.sum())}, {t.mean():.1f} s",
            f"{change.mean():+.1f} ({low:+.1f} to {high:+.1f})",
        ]
        rows.append((cells, p, len(draws)))
    corrected = zip(*(holm([p[i] for _, p, _ in rows]) for i in (0, 1)), strict=True)
    for (cells, _, draws), (times, crossed) in zip(rows, corrected, strict=True):
        print(f"| {' | '.join(cells)} | {times:.2g} | {crossed:.2g} | {draws} |")


if __name__ == "__main__":
    main()
