"""Success over corner angle and free width of the tunnel: one panel for each controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from antennate.figures import INK, canvas, short_name, styled


@styled
def success_map(cells: Sequence[Mapping[str, Any]], controllers: Sequence[str]) -> Figure:
    """Draw the map.

    Args:
        cells: One a tunnel: `turn_deg`, `free_width_m`, and per name in `controllers` the numbers
            `trials`, `successes` and `wilson95`.
        controllers: Panels, left to right.
    """
    angles = sorted({cell["turn_deg"] for cell in cells})
    widths = sorted({cell["free_width_m"] for cell in cells})
    figure = canvas(1.4 + 3.4 * len(controllers), 1.2 + 0.75 * len(angles))
    axes = np.atleast_1d(np.array(figure.subplots(1, len(controllers), sharey=True)))
    scale = ScalarMappable(Normalize(0.0, 1.0), "cividis")
    for panel, controller in zip(axes, controllers, strict=True):
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
        panel.set_title(short_name(controller))
        panel.grid(visible=False)
        panel.set_xticks(range(len(widths)), [f"{w:.2f}" for w in widths])
        panel.set_yticks(range(len(angles)), [f"{a:.0f}" for a in angles])
        panel.set_xlabel("free width [m]")
    axes[0].set_ylabel("corner angle [deg]")
    figure.colorbar(scale, ax=list(axes), label="share of successes", shrink=0.9)
    return figure
