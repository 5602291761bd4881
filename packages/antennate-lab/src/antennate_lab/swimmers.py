"""Figure of swimmers: the curvature map of three links with its optimal strokes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.types import Floats
from geometric_locomotion.maps import CurvatureMap
from geometric_locomotion.optimal import Objective

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOOPS: dict[Objective, tuple[str, Any]] = {
    "distance": ("farthest", "solid"),
    "efficiency": ("most efficient", (0, (4, 1.5))),
}


@style.styled
def swimmer_figure(maps: CurvatureMap) -> Figure:
    """Curvature in two body frames, one above the other, and what the frame is worth."""
    figure = style.canvas(style.WIDTH, 11.5)
    upper, lower = np.array(figure.subfigures(2, 1, height_ratios=(2.9, 1)))
    panels = np.array(upper.subplots(2, 1, sharex=True))
    top = float(np.abs(maps.forward).max())
    titles = ("Minimum-perturbation coordinates", "Frame of the middle link")
    images = [
        _draw_map(panel, maps, values, top)
        for panel, values in zip(panels, (maps.forward, maps.middle), strict=True)
    ]
    for panel, title in zip(panels, titles, strict=True):
        panel.set_title(title)
    label = "displacement over area of a small loop [lengths/rad²]"
    upper.colorbar(images[0], ax=panels, label=label, **style.above(figure))
    panels[1].set_xlabel("front joint [rad]")
    upper.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=1)
    _draw_sizes(lower.subplots(), maps)
    lower.legend(loc="outside lower center", ncols=1)
    return figure


def _draw_map(panel: Axes, maps: CurvatureMap, values: Floats, top: float) -> Any:
    """The curvature over both joints, and the optimal strokes on it."""
    image = panel.pcolormesh(
        maps.angle, maps.angle, values.T, cmap="RdBu", vmin=-top, vmax=top, rasterized=True
    )
    panel.contour(maps.angle, maps.angle, values.T, levels=[0.0], colors=style.MUTED, linewidths=1)
    for objective, (name, line) in _LOOPS.items():
        loop = maps.loops[objective]
        label = f"{name}: {loop.distance:.4f} lengths, efficiency {loop.efficiency:.2%}"
        panel.plot(*loop.shape.T, color=style.INK, linestyle=line, label=label)
    panel.set_aspect("equal")
    panel.grid(visible=False)
    panel.set_ylabel("rear joint [rad]")
    return image


def _draw_sizes(panel: Axes, maps: CurvatureMap) -> None:
    """Distance by circles of the size of the angles, and its two estimates."""
    first, second = style.series(2)
    panel.plot(maps.size, maps.exact, color=style.INK, label="integrated")
    panel.plot(
        maps.size,
        maps.corrected,
        color=first,
        linestyle=(0, (5, 1.5)),
        label="corrected integral, minimum-perturbation coordinates",
    )
    panel.plot(
        maps.size,
        maps.corrected_middle,
        color=second,
        linestyle=(0, (1, 1.2)),
        label="corrected integral, frame of the middle link",
    )
    panel.set_xlabel("radius of a circular stroke [rad]")
    panel.set_ylabel("distance [lengths]")
    panel.set_title("What the body frame is worth")
