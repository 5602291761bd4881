"""The table of `geometric` in docs/science/geometry.md: `python docs/science/geometric.py`.

It is made of docs/science/geometric.csv: trials of `antennate tunnel` by seed, scene, controller
and frequency, those of the commands that the page names.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from antennate.studies.statistics import signed_rank

ROWS = Path(__file__).with_suffix(".csv")
CLOSED, HASTE, OURS = ("closed", "0.6"), ("closed", "0.7026"), ("geometric", "0.6")
SCENES = ("tunnel", "corner", "uturn", "room")
RESAMPLES = 4000


def main() -> None:
    """Print the rows of the table: crossed and restricted mean time, then both differences."""
    times: dict[tuple[str, ...], np.ndarray] = {}
    crossed: dict[tuple[str, ...], int] = {}
    with ROWS.open(newline="") as file:
        table = list(csv.DictReader(file))
    for scene in SCENES:
        for name, frequency in (CLOSED, HASTE, OURS):
            key = (scene, name, frequency)
            rows = [r for r in table if (r["scene"], r["controller"], r["frequency_hz"]) == key]
            rows.sort(key=lambda r: int(r["trial"]))
            out = [r["outcome"] == "success" for r in rows]
            limits = [
                float(r["time_s"] if o else r["limit_s"]) for r, o in zip(rows, out, strict=True)
            ]
            times[key], crossed[key] = np.array(limits), sum(out)
    for scene in SCENES:
        keys = [(scene, *kind) for kind in (CLOSED, HASTE, OURS)]
        cells = [f"{crossed[key]}, {times[key].mean():.1f} s" for key in keys]
        for rival in keys[:2]:
            change = times[keys[2]] - times[rival]
            sample = np.random.default_rng(0).choice(change, (RESAMPLES, len(change)))
            low, high = np.percentile(sample.mean(axis=1), [2.5, 97.5])
            p = signed_rank(change)
            cells += [f"{change.mean():+.1f} ({low:+.1f} to {high:+.1f})", f"{p:.2g}"]
        print(f"| `{scene}` | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
