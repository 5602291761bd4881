"""Everything that docs/science/tunnel.md reports, run again: `python docs/science/study.py PART`.

Parts: `evaluation` (three controllers, 200 fresh trials each), `ablation` (one change at a time),
`map` (success over corner angle and corridor width), `scenes` (tunnels and robots on which
nothing was chosen) and `servos` (what is not known of the servos that walk). Each writes
docs/science/PART.json; the figure of the map is drawn from it.
Results do not depend on the number of workers.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from antennate.control.readings import short_names
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.figures import INK, WIDTH, above, canvas, render, styled
from antennate.studies.columns import content
from antennate.studies.pool import core_count

HERE = Path(__file__).parent
EVALUATION_SEED = 20261126
"""Never used while anything was chosen."""
ABLATION_SEED = 4242
MAP_SEED = 777

ABLATIONS: dict[str, dict[str, Any]] = {
    "closed": {},
    "no patience": {"search": {"patience": 0.0}},
    "no growth: every turn goes as far": {"search": {"growth": 1.0}},
    "nothing proves that it gets on": {"search": {"free_time": 60.0, "proof_time": 300.0}},
    "walls are never lost": {"search": {"lost_time": 3600.0}},
    "turns at the gait's own offset": {"escape": {"turn_offset": 0.349}},
}
ONE_WAY = {"robot": {"antenna": {"sensor": {"directions": "one"}}}}
"""A flex sensor that answers to bending in one direction alone."""

SCENES_SEED = 2602
SCENES: dict[str, dict[str, Any]] = {
    "default": {},
    "two corners, 90° and back": {
        "tunnel": {"segments": (1.0, 1.0, 1.0), "turns_deg": (90.0, -90.0)},
        "time_limit": 150.0,
    },
    "U-turn, 2 × 90° to one side": {
        "tunnel": {"segments": (1.0, 1.0, 1.0), "turns_deg": (90.0, 90.0)},
        "time_limit": 150.0,
    },
    "corner of 60°": {"tunnel": {"turns_deg": (60.0,)}},
    "corner of 120°": {"tunnel": {"turns_deg": (120.0,)}},
    "0.30 m wide": {"tunnel": {"free_width": 0.30}},
    "0.50 m wide": {"tunnel": {"free_width": 0.50}},
    "cylinders of 0.3 kg": {"tunnel": {"cylinder": {"mass": 0.3}}},
    "slippery floor, friction 0.3": {"robot": {"leg_friction": 0.3}},
    "half the timestep": {"physics": {"timestep": 0.001}},
    "antenna of 9 cm": {"robot": {"antenna": {"length": 0.09}}},
    "antenna of 15 cm": {"robot": {"antenna": {"length": 0.15}}},
}
"""What differs from the default; a longer tunnel has as much more time."""

SERVOS: dict[str, dict[str, float]] = {
    "divisor 128, 1.7 N·m (default)": {},
    "divisor 256": {"gain_divisor": 256.0},
    "73 % of the stall torque": {"stall_torque": 0.73 * 1.7},
    "both": {"gain_divisor": 256.0, "stall_torque": 0.73 * 1.7},
    "friction of the load 0.35": {"load_friction": 0.35},
}
"""The XC430-W240, of which no recording is known."""

ANGLES_DEG = (60.0, 75.0, 90.0, 105.0)
WIDTHS_M = (0.32, 0.40, 0.50)


def _config(trials: int, seed: int, controllers: tuple[str, ...], **rest: Any) -> TunnelConfig:
    given = {"trials": trials, "seed": seed, "controllers": controllers}
    return TunnelConfig.model_validate({**given, **rest})


def _results(config: TunnelConfig, workers: int, name: str) -> dict[str, Any]:
    result = EXPERIMENT.run(config, workers)
    print(f"{name}: done", file=sys.stderr)
    return content(result.result())


def evaluation(trials: int, workers: int) -> dict[str, Any]:
    """The three controllers as they are, on fresh trials."""
    return _results(
        _config(trials, EVALUATION_SEED, ("open", "paper", "closed")), workers, "evaluation"
    )


def ablation(trials: int, workers: int) -> dict[str, Any]:
    """The closed controller with one part taken away at a time."""
    out = {}
    for name, change in ABLATIONS.items():
        config = _config(trials, ABLATION_SEED, ("closed",), control=change)
        out[name] = _results(config, workers, name)["controllers"]["closed"]
    config = _config(trials, ABLATION_SEED, ("paper", "closed"), **ONE_WAY)
    one_way = _results(config, workers, "sensor of one direction")["controllers"]
    out["closed, sensor that sees one direction"] = one_way["closed"]
    out["paper, sensor that sees one direction"] = one_way["paper"]
    return out


def scenes(trials: int, workers: int) -> dict[str, Any]:
    """Open and closed where nothing was ever chosen, the default beside them."""
    found = {}
    for name, change in SCENES.items():
        config = _config(trials, SCENES_SEED, ("open", "closed"), **change)
        result = _results(config, workers, name)
        found[name] = {key: result[key] for key in ("time_limit_s", "controllers")}
    return {"trials": trials, "seed": SCENES_SEED, "scenes": found}


def servos(trials: int, workers: int) -> dict[str, Any]:
    """Open and closed with what the servos of yaw and legs might be, in the tunnels of `scenes`."""
    found = {}
    for name, change in SERVOS.items():
        robot = {"servos": {"xc430_w240": change}}
        config = _config(trials, SCENES_SEED, ("open", "closed"), robot=robot)
        found[name] = _results(config, workers, name)["controllers"]
    return {"trials": trials, "seed": SCENES_SEED, "servos": found}


def success_grid(trials: int, workers: int) -> dict[str, Any]:
    """Open and closed over corner angle and free width."""
    cells = []
    for angle in ANGLES_DEG:
        for width in WIDTHS_M:
            tunnel = {"turns_deg": (angle,), "free_width": width}
            config = _config(trials, MAP_SEED, ("open", "closed"), tunnel=tunnel)
            found = _results(config, workers, f"{angle:g} deg, {width:g} m")["controllers"]
            cells.append({"turn_deg": angle, "free_width_m": width, "controllers": found})
    return {"trials": trials, "cells": cells}


@styled
def success_map(cells: Sequence[Mapping[str, Any]], controllers: Sequence[str]) -> Figure:
    """Draw the map.

    Args:
        cells: One a tunnel: `turn_deg`, `free_width_m`, and per name in `controllers` the numbers
            `trials`, `successes` and `wilson95`.
        controllers: Panels, top to bottom.
    """
    angles = sorted({cell["turn_deg"] for cell in cells})
    widths = sorted({cell["free_width_m"] for cell in cells})
    figure = canvas(WIDTH, 0.9 + (0.6 + 0.5 * len(angles)) * len(controllers))
    axes = np.atleast_1d(np.array(figure.subplots(len(controllers), 1)))
    scale = ScalarMappable(Normalize(0.0, 1.0), "cividis")
    for panel, (controller, label) in zip(axes, short_names(controllers).items(), strict=True):
        share = np.full((len(angles), len(widths)), np.nan)
        for cell in cells:
            row, column = angles.index(cell["turn_deg"]), widths.index(cell["free_width_m"])
            found = cell["controllers"][controller]
            share[row, column] = found["successes"] / found["trials"]
            low, high = found["wilson95"]
            panel.text(
                column,
                row,
                f"{found['successes']}/{found['trials']}\n{low:.2f}–{high:.2f}",
                ha="center",
                va="center",
                fontsize=8,
                color="white" if share[row, column] < 0.6 else INK,
            )
        panel.imshow(share, origin="lower", norm=scale.norm, cmap=scale.cmap, aspect="auto")
        panel.set_title(label)
        panel.grid(visible=False)
        panel.set_xticks(range(len(widths)), [f"{w:.2f}" for w in widths])
        panel.set_yticks(range(len(angles)), [f"{a:.0f}" for a in angles])
        panel.set_xlabel("free width [m]")
        panel.set_ylabel("corner angle [deg]")
    figure.colorbar(scale, ax=list(axes), label="share of successes", **above(figure))
    return figure


def main() -> None:
    """Run one part and write it beside this file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("evaluation", "ablation", "map", "scenes", "servos"))
    parser.add_argument("--trials", type=int, default=None)
    parser.add_argument("--workers", type=int, default=core_count())
    options = parser.parse_args()
    function, usual = {
        "evaluation": (evaluation, 200),
        "ablation": (ablation, 60),
        "map": (success_grid, 20),
        "scenes": (scenes, 40),
        "servos": (servos, 40),
    }[options.part]
    result = function(options.trials or usual, options.workers)
    (HERE / f"{options.part}.json").write_text(json.dumps(result, indent=1) + "\n")
    if options.part == "map":
        files = render(success_map(result["cells"], ("open", "closed")))
        (HERE / "map.png").write_bytes(files["png"])


if __name__ == "__main__":
    main()
