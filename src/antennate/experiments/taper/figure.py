"""Figure of `antenna taper`: stiffness along the animal and along the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.taper.experiment import TaperOutcome

_ANIMAL, _STRETCHES = style.INK, style.MUTED
_LADDER, _SUGGESTED = style.PROFILE_LOOKS["descending"][0], "#56B4E9"
"""The ladder is that of the descending profile, unless told otherwise; no profile has the other."""


@style.styled
def figures(outcome: TaperOutcome) -> dict[str, Figure]:
    """The proxy of the animal, its stretches, the ladder, and the ladder that follows it best."""
    figure, result = style.canvas(style.WIDTH, 3.8), outcome.result()
    panel = figure.subplots()
    segments = np.array([row["proxy"] for row in result["segments"]])
    places = (np.arange(len(segments)) + 0.5) / len(segments)
    panel.plot(
        places,
        segments,
        color=_ANIMAL,
        marker="o",
        markersize=4,
        label=f"animal, {len(segments)} segments: {result['base_over_tip']:.0f} : 1",
    )
    _steps(panel, result["stretches"], _STRETCHES, (0, (2, 1.5)), "animal, one stretch a spring")
    for name, colour in (("ladder", _LADDER), ("suggested", _SUGGESTED)):
        row = result[name]
        coils = "-".join(f"{n:g}" for n in row["active_coils"])
        label = f"{name} {coils}: {row['base_over_tip']:.3g} : 1"
        _steps(panel, row["proxy"], colour, "solid", label)
    panel.set_yscale("log")
    panel.set(
        xlim=(0, 1),
        xlabel="place along the antenna, base to tip",
        ylabel="stiffness over that of the base",
    )
    panel.legend(loc="lower left", fontsize=8)
    return {"taper": figure}


def _steps(panel: Axes, values: list[float], colour: Any, line: Any, label: str) -> None:
    edges = np.linspace(0.0, 1.0, len(values) + 1)
    look = {"color": colour, "linestyle": line, "linewidth": 1.8}
    above = 3 if line != "solid" else 2  # dashes show a line below them
    panel.stairs(values, edges, baseline=None, label=label, zorder=above, **look)
