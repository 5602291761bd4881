"""Draw docs/images/corridors.png and docs/images/hard.png: scenes from above, as they are drawn."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.patches import Circle

from antennate import figures as style
from antennate.params.scene import TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.corridors import CorridorsScene
from antennate.sim.scenes.registry import HARD
from antennate.sim.scenes.scene import Scene
from antennate.sim.scenes.tunnel import Tunnel

IMAGES = Path(__file__).parent / "images"
DRAWS = 12
"""Draws of `corridors`, seeds 0 to 11."""
COLUMNS = 3
BAR = 0.5
"""Bar of the scale [m]."""


def main() -> None:
    """Draw both."""
    corridors = (drawn(CorridorsScene(), seed) for seed in range(DRAWS))
    picture("corridors", [(told(scene), scene) for scene in corridors])
    picture("hard", [(name, drawn(make(), 0)) for name, make in HARD.items()])


def drawn(scene: Scene, seed: int) -> Tunnel:
    """One instance."""
    instance = scene.draw(RobotSpec(), np.random.default_rng(seed))
    assert isinstance(instance, Tunnel)
    return instance


def told(scene: Tunnel) -> str:
    """Width, mass and limit of a draw."""
    params: TunnelParams = scene.params
    return (
        f"{params.free_width:.2f} m wide, {1e3 * params.cylinder.mass:.0f} g\n"
        f"{scene.length:.1f} m in {scene.time_limit:.0f} s"
    )


@style.styled
def picture(name: str, scenes: Iterable[tuple[str, Tunnel]]) -> None:
    """Scenes side by side, each with a bar of its scale, the start at the circle."""
    scenes = list(scenes)
    rows = -(-len(scenes) // COLUMNS)
    figure = style.canvas(style.WIDTH, 1.75 * rows)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for panel, (title, scene) in zip(panels, scenes, strict=False):
        show(panel, scene)
        panel.set_title(title, fontsize=7)
    for panel in panels:
        panel.set_axis_off()
    figure.savefig(IMAGES / f"{name}.png", facecolor="white")


def show(panel: Axes, scene: Tunnel) -> None:
    """One scene."""
    for wall in scene.walls:
        panel.plot(*wall.T, color=style.INK, linewidth=1.2)
    circles = [Circle(tuple(at), scene.params.cylinder.radius) for at in scene.cylinders.tolist()]
    panel.add_collection(PatchCollection(circles, facecolor=style.FAINT, edgecolor=style.MUTED))
    panel.plot(*scene.route.T, color=style.MUTED, linewidth=0.8, linestyle=(0, (4, 2)))
    panel.plot(*scene.exit.T, color=style.INK, linewidth=0.8, linestyle=(0, (2, 2)))
    panel.plot(*scene.route[0], color=style.INK, marker="o", markersize=4)
    right, low = np.concatenate(scene.walls).max(axis=0)[0], panel.dataLim.y0
    below = low - 0.08 * max(panel.dataLim.width, panel.dataLim.height)
    panel.plot([right - BAR, right], [below, below], color=style.INK, linewidth=2.0)
    panel.annotate(
        *(f"{BAR} m", (right - BAR, below), (-3, 0)),
        textcoords="offset points", ha="right", va="center", fontsize=6,
    )  # fmt: skip
    panel.set_aspect("equal")
    panel.margins(0.08)


if __name__ == "__main__":
    main()
