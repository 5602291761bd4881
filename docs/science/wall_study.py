"""Everything that docs/science/wall.md reports: `python docs/science/wall_study.py PART`.

Parts: `map` (link mass, overlap, base angle and gravity, five profiles), `window` (finer, where the
map tells profiles apart), `cells` (the best cells of both on fresh seeds), `sticks` (how long a tip
stays behind, over the base angle), `scaling` (stiff against compliant without a second force scale)
and `convergence` (half the timestep). Each writes docs/science/wall_PART.json; `map`, `window` and
`sticks` a picture as well.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.wall.experiment import EXPERIMENT
from antennate.experiments.wall.physics import WallConfig, passage
from antennate.studies.columns import content
from antennate.studies.pool import core_count

HERE = Path(__file__).parent
MASSES_G = (0.5, 0.8, 1.0, 1.5)
OVERLAPS_MM = (4.0, 8.0, 12.0)
ANGLES_DEG = (50.0, 70.0, 90.0, 110.0, 130.0)
GRAVITIES = ("down", "off")
WINDOW_MASS_G = 0.8
WINDOW_OVERLAPS_MM = (3.0, 4.0, 6.0, 8.0)
WINDOW_ANGLES_DEG = (47.0, 50.0, 53.0, 56.0, 59.0, 62.0)
STICK_ANGLES_DEG = (41.0, 44.0, 47.0, 50.0, 53.0, 56.0, 59.0, 65.0, 70.0)
STICK_TRIALS = 8
MAP_SEED, FRESH_SEED = 11, 20261121
"""The second was used for nothing before the cells were chosen."""
MAP_TRIALS, FRESH_TRIALS = 4, 40
PATTERN = {"stiff": "jam", "descending": "success", "compliant": "slip"}
"""What the paper reports."""


def _config(mass: float, overlap: float, angle: float, gravity: str, **rest: Any) -> WallConfig:
    return WallConfig.model_validate(
        {
            "wall": {
                "overlap": 1e-3 * overlap,
                "base_angle": math.radians(angle),
                "gravity": gravity,
            },
            "antenna": {"link_mass": 1e-3 * mass},
            **rest,
        }
    )


def _cell(mass: float, overlap: float, angle: float, gravity: str) -> dict[str, Any]:
    return {
        "link_mass_g": mass,
        "overlap_mm": overlap,
        "base_angle_deg": angle,
        "gravity": gravity,
    }


def whole_map(workers: int) -> dict[str, Any]:
    """All cells; parameters stand above."""
    return _grid(itertools.product(MASSES_G, OVERLAPS_MM, ANGLES_DEG, GRAVITIES), workers)


def window(workers: int) -> dict[str, Any]:
    """The stretch of angles in which the map goes from passing to jamming."""
    where = itertools.product((WINDOW_MASS_G,), WINDOW_OVERLAPS_MM, WINDOW_ANGLES_DEG, GRAVITIES)
    return _grid(where, workers)


def _grid(places: Iterable[tuple[float, float, float, str]], workers: int) -> dict[str, Any]:
    cells = []
    for where in places:
        config = _config(*where, trials=MAP_TRIALS, seed=MAP_SEED)
        cells.append(
            {
                **_cell(*where),
                "profiles": content(EXPERIMENT.run(config, workers).result())["profiles"],
            }
        )
        print(where, file=sys.stderr)
    return {"trials": MAP_TRIALS, "seed": MAP_SEED, "cells": cells}


def fits(cell: dict[str, Any], key: str | None) -> float:
    """Share of trials of the three published profiles that end as the paper says."""
    names = {"jam": "jams", "success": "successes", "slip": "slips"}
    shares = []
    for profile, outcome in PATTERN.items():
        counts = cell["profiles"][profile][key] if key else cell["profiles"][profile]
        shares.append(counts[names[outcome]] / counts["trials"])
    return min(shares)


def lead(cell: dict[str, Any]) -> float:
    """How many more of `descending` pass than of the better of `stiff` and `compliant`."""
    passed = {profile: cell["profiles"][profile]["successes"] for profile in PATTERN}
    return passed["descending"] - max(passed["stiff"], passed["compliant"])


def best_cells(workers: int) -> dict[str, Any]:
    """On fresh seeds: the cell that fits the paper best by each count, and that of most lead."""
    cells = [
        cell
        for part in ("map", "window")
        for cell in json.loads((HERE / f"wall_{part}.json").read_text())["cells"]
    ]
    scores: dict[str, Callable[[dict[str, Any]], float]] = {
        "pattern": lambda cell: fits(cell, None),
        "pattern_after_start": lambda cell: fits(cell, "after_start"),
        "lead": lead,
    }
    out = {}
    for name, score in scores.items():
        best = max(score(cell) for cell in cells)
        tied = [cell for cell in cells if score(cell) == best]
        cell = tied[len(tied) // 2]
        where = [cell[k] for k in ("link_mass_g", "overlap_mm", "base_angle_deg", "gravity")]
        config = _config(*where, trials=FRESH_TRIALS, seed=FRESH_SEED)
        result = content(EXPERIMENT.run(config, workers).result())
        out[name] = {
            **_cell(*where),
            "score": best,
            "cells_of_this_score": len(tied),
            "cells": len(cells),
            "profiles": result["profiles"],
            "paired": result["paired"],
        }
        print(name, file=sys.stderr)
    return out


def sticks(workers: int) -> dict[str, Any]:
    """Longest sticks over the base angle, at the default mass, overlap and gravity."""
    rows = []
    for angle in STICK_ANGLES_DEG:
        wall = {"base_angle": math.radians(angle)}
        config = WallConfig.model_validate(
            {"wall": wall, "trials": STICK_TRIALS, "seed": FRESH_SEED}
        )
        outcome = EXPERIMENT.run(config, workers)
        rows += [
            {
                "base_angle_deg": angle,
                "profile": profile,
                "sticks_mm": [r.longest_stick_mm for r in outcome.rows if r.profile == profile],
            }
            for profile in config.profiles
        ]
        print(angle, file=sys.stderr)
    return {"trials": STICK_TRIALS, "seed": FRESH_SEED, "rows": rows}


def scaling(workers: int) -> dict[str, Any]:
    """Difference of the hinge angles of stiff and compliant over a whole passage."""
    out = {}
    for gravity in GRAVITIES:
        still = {"stiffness": 0.0, "friction": 0.0, "base_angle": 0.0, "overlap": 0.0}
        config = WallConfig.model_validate(
            {
                "wall": {"gravity": gravity},
                "variation": still,
                "antenna": {"sensor_stiffness_n_mm_per_deg": 0.0},
            }
        )
        stiff, soft = (passage(config, profile, 0) for profile in ("stiff", "compliant"))
        apart = np.degrees(abs(stiff.hinges - soft.hinges))
        both = (stiff.touching > 0) & (soft.touching > 0)
        out[gravity] = {
            "median_deg": float(np.median(apart)),
            "percentile_90_deg": float(np.percentile(apart, 90)),
            "force_ratio": float(np.median(stiff.force[both]) / np.median(soft.force[both])),
            "samples": int(both.sum()),
        }
    return out


def convergence(workers: int) -> dict[str, Any]:
    """The default run at its timestep and at half of it, contacts as stiff as each allows."""
    rows = {}
    for timestep in (5e-4, 2.5e-4):
        physics = {"timestep": timestep, "contact_time": 2 * timestep}
        config = WallConfig.model_validate({"physics": physics})
        rows[timestep] = EXPERIMENT.run(config, workers)
    coarse, fine = rows.values()
    return {
        "profiles": {str(k): content(o.result())["profiles"] for k, o in rows.items()},
        "trials": len(coarse.rows),
        "fates_that_differ": sum(
            a.outcome != b.outcome for a, b in zip(coarse.rows, fine.rows, strict=True)
        ),
        "fates_after_start_that_differ": sum(
            a.outcome_after_start != b.outcome_after_start
            for a, b in zip(coarse.rows, fine.rows, strict=True)
        ),
    }


@style.styled
def stick_lines(rows: Sequence[Mapping[str, Any]], limit_mm: float) -> Figure:
    """Longest stick of each profile over the base angle: median and range of its trials.

    Args:
        rows: `base_angle_deg`, `profile`, and `sticks_mm`, one for each trial.
        limit_mm: Travel from which a stick counts as a jam [mm].
    """
    figure = style.canvas(style.WIDTH, 4.2)
    panel = figure.subplots()
    profiles = list(dict.fromkeys(row["profile"] for row in rows))
    for k, profile in enumerate(profiles):
        colour, mark, _ = style.PROFILE_LOOKS[profile]
        held = [row for row in rows if row["profile"] == profile]
        middle = np.array([np.median(row["sticks_mm"]) for row in held])
        below = middle - np.array([min(row["sticks_mm"]) for row in held])
        above = np.array([max(row["sticks_mm"]) for row in held]) - middle
        angles = np.array([row["base_angle_deg"] for row in held]) + 0.25 * (k - 2)
        name = profile.replace("_", " ")
        panel.errorbar(angles, middle, [below, above], marker=mark, color=colour, label=name)
    panel.axhline(limit_mm, color=style.INK, linewidth=1, linestyle=(0, (4, 2)))
    panel.annotate(
        "a jam from here on",
        (1, limit_mm),
        (-2, 2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )
    trials = len(rows[0]["sticks_mm"])
    panel.set(
        xlabel="base angle [deg]",
        ylabel="longest stick [mm]",
        title=f"Median and range of {trials} trials a point",
        yscale="log",
    )
    panel.legend()
    return figure


@style.styled
def outcome_map(cells: Sequence[Mapping[str, Any]]) -> Figure:
    """Successes after the start, one profile below the other.

    Over link mass and base angle, with a column for each overlap and a row for each gravity; if all
    masses are equal, over base angle and overlap, with a column for each gravity.

    Args:
        cells: Cells with `link_mass_g`, `overlap_mm`, `base_angle_deg`, `gravity` and `profiles`.
    """
    window = len({cell["link_mass_g"] for cell in cells}) == 1
    axes = ("base_angle_deg", "overlap_mm") if window else ("link_mass_g", "base_angle_deg")
    beside, apart = ("gravity", None) if window else ("overlap_mm", "gravity")
    columns = sorted({cell[beside] for cell in cells})
    rests = sorted({cell[apart] for cell in cells}) if apart else [None]
    rows = list(itertools.product(cells[0]["profiles"], rests))
    height = 0.45 + 0.17 * len({cell[axes[1]] for cell in cells})
    figure = style.canvas(style.WIDTH, 1.4 + height * len(rows))
    panels = figure.subplots(len(rows), len(columns), squeeze=False, sharex=True, sharey=True)
    image = None
    for (profile, rest), line in zip(rows, panels, strict=True):
        for column, panel in zip(columns, line, strict=True):
            held = [
                cell
                for cell in cells
                if cell[beside] == column and (apart is None or cell[apart] == rest)
            ]
            image = _draw_map(panel, held, profile, axes)
        line[0].set_title(profile.replace("_", " ") + (f", gravity {rest}" if apart else ""))
        line[0].set_ylabel(_AXES[axes[1]])
    for column, low in zip(columns, panels[-1], strict=True):
        told = f"gravity {column}" if window else f"overlap {column:g} mm"
        low.set_xlabel(f"{_AXES[axes[0]]}\n{told}")
    if image is not None:
        name = "share of successes after the start;\nin each cell: successes/jams/slips"
        figure.colorbar(image, ax=panels, label=name, **style.above(figure))
    return figure


_AXES = {
    "base_angle_deg": "angle [deg]",
    "overlap_mm": "overlap [mm]",
    "link_mass_g": "mass [g]",
}


def _draw_map(
    panel: Axes, cells: Sequence[Mapping[str, Any]], profile: str, axes: tuple[str, str]
) -> Any:
    columns, rows = (sorted({cell[axis] for cell in cells}) for axis in axes)
    grid = np.full((len(rows), len(columns)), np.nan)
    for cell in cells:
        counts = cell["profiles"][profile]["after_start"]
        at = rows.index(cell[axes[1]]), columns.index(cell[axes[0]])
        grid[at] = counts["successes"] / counts["trials"]
        mark = f"{counts['successes']}/{counts['jams']}/{counts['slips']}"
        ink = "white" if grid[at] < 0.6 else style.INK
        panel.text(at[1], at[0], mark, ha="center", va="center", fontsize=7, color=ink)
    image = panel.imshow(grid, origin="lower", cmap="cividis", vmin=0, vmax=1, aspect="auto")
    panel.set_xticks(range(len(columns)), [f"{value:g}" for value in columns])
    panel.set_yticks(range(len(rows)), [f"{value:g}" for value in rows])
    panel.grid(visible=False)
    return image


PARTS = {
    "map": whole_map,
    "window": window,
    "cells": best_cells,
    "sticks": sticks,
    "scaling": scaling,
    "convergence": convergence,
}


def main() -> None:
    """Run one part and write it beside this file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=tuple(PARTS))
    parser.add_argument("--workers", type=int, default=core_count())
    options = parser.parse_args()
    result = PARTS[options.part](options.workers)
    (HERE / f"wall_{options.part}.json").write_text(json.dumps(result, indent=1) + "\n")
    if options.part in ("map", "window"):
        picture = style.render(outcome_map(result["cells"]))["png"]
        (HERE / f"wall_{options.part}.png").write_bytes(picture)
    if options.part == "sticks":
        limit = 1e3 * WallConfig().wall.jam_travel
        picture = style.render(stick_lines(result["rows"], limit))["png"]
        (HERE / "wall_sticks.png").write_bytes(picture)


if __name__ == "__main__":
    main()
