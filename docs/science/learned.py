"""The tables of learned policies in docs/envs.md: `python docs/science/learned.py`.

They are made of rows of docs/science/learned.csv: trials of `antennate tunnel` that the page names;
and of docs/science/learned_elsewhere.csv, the table of an `antennate compete` in other scenes.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.stats import wilcoxon

from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies.statistics import difference95, holm, mcnemar, signed_rank
from antennate_lab.compete.checking import read_rows

ROWS, SEED = Path(__file__).with_suffix(".csv"), "67957488"
STUDENT = "taught"
OTHERS = tuple(f"taught, seed {seed}" for seed in (22, 23, 24, 25))
RIVALS = ("blind twin", "timed", "timed at 1 Hz", "geometric", "geometric at 1 Hz")
ELSEWHERE, ENTRY = ROWS.with_name("learned_elsewhere.csv"), "entries/apprentice/policy.onnx"
FAMILIES = (("closed", "geometric"), ("docs/science/one_hertz.py:geometric",), ("timed",))
"""The rivals there, the control, and the clock, each with Holm's correction of its own."""


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
    """Print the student and its rivals, then students of other training seeds, then their mean."""
    trials = read()
    own, cells, p = trials[STUDENT], [], []
    print(f"{shown(STUDENT, own)}| | | |")
    for name in RIVALS:
        other = trials[name]
        crossed = mcnemar(np.stack([own[:, 0], other[:, 0]], axis=1) > 0.0)
        cells.append(f"{shown(name, other)}| {less(own, other)} ")
        p.append((signed_rank(own[:, 1] - other[:, 1]), crossed.mcnemar_p))
    for row, times, successes in zip(cells, *map(holm, zip(*p, strict=True)), strict=True):
        print(f"{row}| {times:.2g} | {successes:.2g} |")
    print()
    students = [trials[name] for name in OTHERS]
    compared(
        [(shown(*pair), pair[1], trials["timed"]) for pair in zip(OTHERS, students, strict=True)]
    )
    print()
    five = np.mean([own, *students], axis=0)
    compared([(f"| {name} ", five, trials[name]) for name in RIVALS[1:]])
    print()
    elsewhere()


def elsewhere() -> None:
    """Print the entry beside each family of rivals in scenes in which it did not learn.

    Beside Pratt's p is that of Wilcoxon's own way, without the draws that both fail.
    """
    trials: dict[tuple[str, str], dict[tuple[int, int], tuple[bool, float]]] = {}
    for row in read_rows(ELSEWHERE):
        out = row.outcome == "success"
        draws = trials.setdefault((row.scene, row.controller), {})
        draws[row.seed, row.trial] = out, row.time_s if out else row.limit_s
    for family in FAMILIES:
        cells, p, without = [], [], []
        for (scene, name), draws in trials.items():
            if name in family:
                own = np.array([trials[scene, ENTRY][draw] for draw in draws])
                other = np.array(list(draws.values()))
                p.append(signed_rank(own[:, 1] - other[:, 1]))
                crossed = mcnemar(np.stack([own[:, 0], other[:, 0]], axis=1) > 0.0)
                cell = f"{shown(scene, own)}{shown(name, other)}| {less(own, other)} "
                cells.append((cell, f"{crossed.mcnemar_p:.2g}"))
                apart = (own[:, 1] - other[:, 1]).round(6)  # as many decimals as the table
                _, alone = wilcoxon(apart)
                without.append(alone)
        columns = zip(cells, holm(p), holm(without), strict=True)
        for (cell, crossed), times, other in columns:
            print(f"{cell}| {times:.2g} | {other:.2g} | {crossed} |")


def compared(pairs: list[tuple[str, np.ndarray, np.ndarray]]) -> None:
    """Print rows that begin so: a policy's times less those of a rival, and p with Holm's."""
    p = holm([signed_rank(own[:, 1] - other[:, 1]) for _, own, other in pairs])
    for (cell, own, other), times in zip(pairs, p, strict=True):
        print(f"{cell}| {less(own, other)} | {times:.2g} |")


def less(own: np.ndarray, other: np.ndarray) -> str:
    """The mean of the differences of time [s] and its 95 % interval over draws."""
    mean, ends = difference95(own[:, 1], other[:, 1], TIME_LIMIT)
    low, high = ends or (np.nan, np.nan)
    return f"{mean:+.1f} ({low:+.1f} to {high:+.1f})"


def shown(name: str, trials: np.ndarray) -> str:
    """The first cells of a controller: its name, draws crossed, and mean time."""
    return f"| {name} | {int(trials[:, 0].sum())} | {trials[:, 1].mean():.1f} "


if __name__ == "__main__":
    main()
