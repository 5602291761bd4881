"""Draw docs/images/corridors.png, hard.png and ground.png: scenes from above or from the side."""

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.patches import Circle

from antennate import figures as style
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.corridors import CorridorsScene
from antennate.sim.scenes.ground import BEYOND, KINDS, Ground, GroundScene
from antennate.sim.scenes.scene import Scene
from antennate.sim.scenes.tunnel import HARD, Tunnel
from antennate.sim.world import new_spec
from antennate.types import Floats

IMAGES = Path(__file__).parent / "images"
DRAWS = 12
"""Draws of `corridors`, seeds 0 to 11."""
COLUMNS = 3
BAR = 0.5
"""Bar of the scale [m]."""


def main() -> None:
    """Draw all three."""
    corridors = (drawn(CorridorsScene(), seed) for seed in range(DRAWS))
    picture("corridors", [(told(scene), scene) for scene in corridors])
    picture("hard", [(name, drawn(make(), 0)) for name, make in HARD.items()])
    ground()


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


@style.styled
def ground() -> None:
    """Profiles of the scenes of ground in the middle of the way, with the robot at the start."""
    robot = RobotSpec.named("scuttle3d")
    figure = style.canvas(style.WIDTH, 2.6)
    panels = figure.subplots(3, 2, squeeze=False).ravel()
    for panel, name in zip(panels, KINDS, strict=True):
        scene = GroundScene(name).draw(robot, np.random.default_rng(1))
        x = np.linspace(-0.95, scene.length + 0.6 * BEYOND, 1500)
        panel.fill_between(x, profile(scene, x), -0.1, color=style.FAINT, linewidth=0)
        panel.plot(x, profile(scene, x), color=style.INK, linewidth=0.9)
        radius = robot.leg_radius
        for link in range(robot.links):
            at = (-link * robot.link_pitch, scene.ground + radius)
            panel.add_patch(Circle(at, radius, facecolor=style.MUTED, edgecolor=style.INK))
        exits = scene.length
        high = scene.height(exits)
        panel.plot([exits, exits], [high, high + 0.25], color=style.INK, linestyle=(0, (2, 2)))
        panel.plot([x[-1] - BAR, x[-1]], [-0.17, -0.17], color=style.INK, linewidth=2.0)
        panel.set(title=name, ylim=(-0.22, 0.62), aspect="equal")
        panel.title.set_fontsize(7)
        panel.set_axis_off()
    figure.savefig(IMAGES / "ground.png", facecolor="white")


def profile(scene: Ground, x: Floats) -> Floats:
    """Height of the ground in the middle of the way [m], by rays that fall there."""
    spec = new_spec(PhysicsParams())
    scene.build(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom, down = np.zeros(1, np.int32), np.array([0.0, 0.0, -1.0])
    rays = (np.array([at, 0.0, 2.0]) for at in x.tolist())
    return 2.0 - np.array([mujoco.mj_ray(model, data, r, down, None, 1, -1, geom) for r in rays])


if __name__ == "__main__":
    main()
