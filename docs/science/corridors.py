"""What docs/science/corridors.md reports: `python docs/science/corridors.py FOLDER...`.

The folders are runs of `antennate tunnel --scene corridors` with one seed: each may hold some of
the controllers. `closed` is compared with each of the others on the trials that both have, in all
draws and in those alone that `open` does not cross. It writes the tables of the page,
docs/science/corridors.json, docs/science/corridors.csv and the figure.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from antennate.control.registry import looks
from antennate.figures import WIDTH, canvas, render, styled
from antennate.jackknife import jackknife95
from antennate.studies.statistics import mcnemar, mean95, signed_rank, wilson95
from antennate.types import Floats

HERE = Path(__file__).parent
OURS = "closed"
COLUMNS = ("seed", "trial", "controller", "outcome", "time_s", "limit_s")

Rows = dict[str, dict[int, dict[str, str]]]
"""Rows of a table of trials: by controller, then by number of the trial."""


def rows_of(folders: list[Path]) -> Rows:
    """All valid rows of these runs; the runs must have one seed."""
    rows: Rows = {}
    for folder in folders:
        with (folder / "trials.csv").open(newline="") as file:
            for each in csv.DictReader(file):
                if each["outcome"] != "invalid":
                    rows.setdefault(each["controller"], {})[int(each["trial"])] = each
    seeds = {each["seed"] for cell in rows.values() for each in cell.values()}
    if len(seeds) != 1:
        sys.exit(f"expected runs of one seed, found {', '.join(sorted(seeds)) or 'none'}")
    return rows


def shares(cell: dict[int, dict[str, str]], trials: list[int]) -> Floats:
    """Time of each trial as a share of its limit; 1 of a failure, shape (n,)."""
    return np.array(
        [
            float(cell[trial]["time_s"]) / float(cell[trial]["limit_s"])
            if cell[trial]["outcome"] == "success"
            else 1.0
            for trial in trials
        ]
    )


def alone(cell: dict[int, dict[str, str]]) -> dict[str, Any]:
    """A controller by itself."""
    used = shares(cell, sorted(cell))
    crossed = int((used < 1.0).sum())
    mean, ends = mean95(used, 0.0, 1.0, restricted=True)
    return {
        "trials": len(used),
        "successes": crossed,
        "wilson95": wilson95(crossed, len(used)),
        "left": sum(each["outcome"] == "left" for each in cell.values()),
        "share": mean,
        "share_95": ends,
    }


def against(ours: Floats, rival: Floats) -> dict[str, Any]:
    """Two controllers on the same trials, by shares of the limits, shape (n,).

    `ratio` is the mean of ours over that of the rival less 1, with a jackknife interval that leaves
    out one draw at a time.
    """
    count = len(ours)
    left = (ours.sum() - ours) / (rival.sum() - rival) - 1.0
    ratio = float(ours.sum() / rival.sum() - 1.0)
    found = mcnemar(np.stack([ours < 1.0, rival < 1.0], axis=1))
    return {
        "trials": count,
        "successes": [int((used < 1.0).sum()) for used in (ours, rival)],
        "shares": [float(ours.mean()), float(rival.mean())],
        "ratio": ratio,
        "ratio_95": jackknife95(ratio, left).tolist(),
        "only_ours": found.only_first,
        "only_rival": found.only_second,
        "mcnemar_p": found.mcnemar_p,
        "wilcoxon_p": signed_rank(ours - rival),
    }


def judged(rows: Rows) -> dict[str, Any]:
    """Everything on the page."""
    seed = next(iter(rows[OURS].values()))["seed"]
    pairs: dict[str, dict[str, Any]] = {"all": {}, "open fails": {}}
    for name in rows:
        if name == OURS:
            continue
        both = sorted(rows[OURS].keys() & rows[name].keys())
        pairs["all"][name] = against(shares(rows[OURS], both), shares(rows[name], both))
        hard = [t for t in both if rows.get("open", {}).get(t, {}).get("outcome") != "success"]
        if "open" in rows and name != "open":
            hard = [t for t in hard if t in rows["open"]]
            parts = [shares(rows[each], hard) for each in (OURS, name)]
            pairs["open fails"][name] = against(*parts)
    return {
        "seed": int(seed),
        "controllers": {n: alone(c) for n, c in rows.items()},
        "pairs": pairs,
    }


def row(*cells: object) -> str:
    """A row of a table in Markdown."""
    return "| " + " | ".join(map(str, cells)) + " |"


def tables(result: dict[str, Any]) -> list[str]:
    """Both tables."""
    lines = [row("", *result["controllers"])]
    lines += [row(*["---"] * (1 + len(result["controllers"])))]
    cells = list(result["controllers"].values())
    lines += [row("crossed", *(f"{c['successes']} of {c['trials']}" for c in cells))]
    lines += [row("Wilson 95 %", *("{:.2f}–{:.2f}".format(*c["wilson95"]) for c in cells))]
    lines += [row("left elsewhere", *(c["left"] for c in cells))]
    means = ("{:.1f} ({:.1f}–{:.1f})".format(*_percent(c["share"], *c["share_95"])) for c in cells)
    lines += [row("restricted mean time [% of the limit]", *means), ""]
    lines += [row(*("`closed` against", "draws", "crossed", "time [%]", "only ours, only rival"))]
    lines[-1] += " McNemar p | Wilcoxon p |"
    lines += [row(*["---"] * 7)]
    for draws, pairs in result["pairs"].items():
        for name, pair in pairs.items():
            which = f"`{name}`" + ("" if draws == "all" else ", where `open` fails")
            time = "{:+.0f} ({:+.0f} to {:+.0f})".format(
                *_percent(pair["ratio"], *pair["ratio_95"])
            )
            crossed = "{} : {}".format(*pair["successes"])
            only = f"{pair['only_ours']}, {pair['only_rival']}"
            tests = (f"{pair['mcnemar_p']:.2g}", f"{pair['wilcoxon_p']:.2g}")
            lines += [row(which, pair["trials"], crossed, time, only, *tests)]
    return lines


def _percent(*values: float) -> list[float]:
    return [100.0 * value for value in values]


@styled
def figure_of(rows: Rows) -> Figure:
    """Share of the draws that are crossed within a share of their limits, a line a controller."""
    figure = canvas(WIDTH, 2.8)
    panel = figure.subplots()
    colours = {name: colour for name, (colour, _) in looks(rows).items()}
    for name, cell in rows.items():
        used = np.sort(shares(cell, sorted(cell)))
        used = used[used < 1.0]
        at = np.concatenate([[0.0], np.repeat(used, 2), [1.0]])
        crossed = np.repeat(np.arange(len(used) + 1), 2) / len(cell)
        panel.plot(100 * at, 100 * crossed, label=name, color=colours[name], linewidth=1.4)
    panel.set_xlim(0, 100)
    panel.set_ylim(0, 100)
    panel.set_xlabel("time [% of the limit of the draw]")
    panel.set_ylabel("draws crossed [%]")
    panel.legend(loc="lower right")
    return figure


def main(folders: list[Path]) -> None:
    """Write the tables, the numbers, the rows and the figure."""
    rows = rows_of(folders)
    result = judged(rows)
    (HERE / "corridors.json").write_text(json.dumps(result, indent=1) + "\n")
    with (HERE / "corridors.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows(cell[trial] for cell in rows.values() for trial in sorted(cell))
    (HERE / "corridors.png").write_bytes(render(figure_of(rows))["png"])
    written("corridors", tables(result))


def written(part: str, lines: list[str]) -> None:
    """Put tables into their place on the page, between two comments."""
    page = HERE / "corridors.md"
    begin, rest = page.read_text().split(f"<!-- {part}: ")
    head, rest = rest.split("\n", 1)
    _, end = rest.split(f"<!-- end of {part} -->")
    text = "\n".join(lines)
    page.write_text(f"{begin}<!-- {part}: {head}\n{text}\n<!-- end of {part} -->{end}")


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
