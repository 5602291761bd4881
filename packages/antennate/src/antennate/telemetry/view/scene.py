"""The 3-D scene of a page and what a person may do there.

Shapes of one kind are one node, so that a picture is a few messages, however many shapes there are.
Each change is an order to the program; a page of a robot has no controls: nothing on it can move
anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from antennate.sim import shapes
from antennate.sim.shapes import Shapes
from antennate.telemetry.view.channel import ORDER, Channel, Poses
from antennate.types import Floats, Ints

ROOT = "/world"
_ARROW = (190, 0, 60)
_ROBOT = 0.6
"""Length of a robot [m], from which on arrows have their full thickness."""
_FLOOR = 4.0
"""Side of the floor that is drawn [m]; it goes on beyond in the distance."""
_CELL = 0.1
_LINES = ((125, 125, 125), (95, 95, 95))
"""Colours of its lines: seen on white and on black."""
_FADE = 6.0
"""Where they have faded [m from the camera]; farther ones are too close together to be seen."""
_AMBIENT = 1.5
"""Light from all sides, so that nothing is black behind what one sees through."""
_ALONG_Z = np.array([0.0, 0.0, 1.0])


class SceneView:
    """The scene of one model.

    Args:
        server: Where it is shown.
        what: The shapes.

    Attributes:
        shapes: The shapes.
        groups: The nodes of the scene.
        places: Where the shapes are [m], shape (n, 3).
        middle: How far everything is moved to follow the robot [m], shape (3,).
        follow: Whether the robot stays in the middle of the picture.
        arrow_scale: Length of an arrow for each unit of force [m/N].
    """

    def __init__(self, server: viser.ViserServer, what: Shapes) -> None:
        self._server, self.shapes = server, what
        self.follow, self.arrow_scale = True, 0.1
        self.places = np.zeros((len(what.kind), 3), np.float32)
        self.middle: Floats = np.zeros(3)
        server.scene.reset()
        server.scene.set_up_direction("+z")
        server.scene.configure_environment_map(None)
        server.scene.add_light_ambient("/light", intensity=_AMBIENT)
        self._root = server.scene.add_frame(ROOT, show_axes=False)
        if np.isfinite(what.floor[0]):
            _floor(server, float(what.floor[0]))
        self.groups = [_Group(server, *group) for group in _groups(what)]
        self._arrows = server.scene.add_arrows(
            f"{ROOT}/forces",
            np.zeros((0, 2, 3)),
            _ARROW,
            **_thickness(1.0),
        )
        self._aimed = False

    def show(self, now: Poses, target: Floats) -> None:
        """Put everything where it is.

        Args:
            now: The poses.
            target: What stays in the middle of the picture while it is followed [m], shape (2,).
        """
        self.places = places = now.poses[:, :3]
        turned = now.poses[:, 3:].reshape(-1, 3, 3)
        with self._server.atomic():
            for group in self.groups:
                group.place(places, turned)
            self._arrows.points = arrows(now.forces, self.arrow_scale, 2 * self._arrows.head_length)
            self.middle = np.array([-target[0], -target[1], 0.0]) if self.follow else np.zeros(3)
            self._root.position = self.middle
        if not self._aimed:
            self._aim(places)

    def _aim(self, places: NDArray[np.float32]) -> None:
        """Look from behind and above at the robot, once."""
        self._aimed = True
        robot = places[self.shapes.robot]
        reach = float(np.ptp(robot if len(robot) else places, axis=0).max())
        for name, size in _thickness(min(1.0, reach / _ROBOT)).items():
            setattr(self._arrows, name, size)
        camera = self._server.initial_camera
        camera.position = (-0.7 * reach, -0.9 * reach, 1.3 * reach)
        camera.look_at = (0.0, 0.0, 0.0)


def arrows(forces: NDArray[np.float32], scale: float, least: float) -> NDArray[np.float32]:
    """Both ends of each arrow [m], shape (k, 2, 3): none of a force of zero.

    Args:
        forces: Place [m] and force [N] of each, shape (n, 6).
        scale: Length for each unit of force [m/N].
        least: Length of the arrow of a weak force, so that it is seen [m].
    """
    size = np.linalg.norm(forces[:, 3:], axis=1, keepdims=True)
    acting = size[:, 0] > 0
    at, force, size = forces[acting, :3], forces[acting, 3:], size[acting]
    return np.stack([at, at + np.maximum(scale, least / size) * force], axis=1)


def _thickness(scale: float) -> dict[str, Any]:
    """Thickness of arrows [m]; they are thinner beside a single antenna."""
    return {
        "shaft_radius": 0.004 * scale,
        "head_radius": 0.009 * scale,
        "head_length": 0.018 * scale,
    }


class _Group:
    """Shapes that are drawn as one node: instances of one mesh.

    Attributes:
        which: Numbers of the shapes.
        node: The node of the scene.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        which: Ints,
        mesh: tuple[Any, Any],
        scale: Floats,
        shift: Floats,
        colour: NDArray[np.uint8],
    ) -> None:
        self.which, self._shift = which, shift
        count = len(which)
        self.node = server.scene.add_batched_meshes_simple(
            f"{ROOT}/{name}",
            *mesh,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            batched_positions=np.zeros((count, 3)),
            batched_scales=scale,
            batched_colors=_linear(colour[:, :3]),
            batched_opacities=None if (colour[:, 3] == 255).all() else colour[:, 3] / 255.0,
            lod="off",
        )
        self._before: NDArray[np.float32] = np.zeros(0, np.float32)

    def place(self, places: NDArray[np.float32], turned: NDArray[np.float32]) -> None:
        """Put its shapes where they are, if anything has moved."""
        rotation = Rotation.from_matrix(turned[self.which])
        at = places[self.which] + rotation.apply(self._shift)
        now = np.concatenate([at.ravel(), rotation.as_quat().ravel()]).astype(np.float32)
        if not np.array_equal(now, self._before):
            self._before = now
            self.node.batched_positions = at
            self.node.batched_wxyzs = rotation.as_quat(scalar_first=True)


def _linear(colour: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Amounts of light, 0 to 255, of colours of a screen (sRGB, IEC 61966-2-1).

    The client takes the colours of instances for amounts of light: without this all are too pale.
    """
    c = colour / 255.0
    light = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * light).astype(np.uint8)


def _groups(
    what: Shapes,
) -> list[tuple[str, Ints, tuple[Any, Any], Floats, Floats, NDArray[np.uint8]]]:
    """Name, shapes, mesh, scale and shift along their own axes, and colour of each group."""
    round_, box = trimesh.creation.icosphere(2), trimesh.creation.box((2.0, 2.0, 2.0))
    tube = trimesh.creation.cylinder(1.0, 2.0, sections=24)
    groups = []
    kind, size = what.kind, what.size.astype(np.float64)

    def add(name: str, which: Ints, mesh: Any, scale: Floats, shift: float = 0.0) -> None:
        for moves in (False, True):
            chosen = what.moves[which] == moves
            if chosen.any():
                numbers = which[chosen]
                along = shift * size[numbers, 1:2] * _ALONG_Z
                label = f"{name}_{'moving' if moves else 'fixed'}"
                groups.append((label, numbers, mesh, scale[chosen], along, what.colour[numbers]))

    def of(*kinds: int) -> Ints:
        return np.flatnonzero(np.isin(kind, kinds))

    ball, tubes = of(shapes.SPHERE), of(shapes.CAPSULE, shapes.CYLINDER)
    whole, caps, boxes = of(shapes.ELLIPSOID), of(shapes.CAPSULE), of(shapes.BOX)
    sphere = (round_.vertices, round_.faces)
    add("sphere", ball, sphere, size[ball][:, [0, 0, 0]])
    add("ellipsoid", whole, sphere, size[whole])
    add("tube", tubes, (tube.vertices, tube.faces), size[tubes][:, [0, 0, 1]])
    for name, sign in (("top", 1.0), ("bottom", -1.0)):
        add(name, caps, sphere, size[caps][:, [0, 0, 0]], sign)
    add("box", boxes, (box.vertices, box.faces), size[boxes])
    for number, (corners, triangles) in enumerate(what.ends.tolist()):
        first, start = what.ends[number - 1].tolist() if number else (0, 0)
        mesh = (what.vertices[first:corners], what.faces[start:triangles])
        which = np.flatnonzero(what.mesh == number)
        add(f"mesh{number}", which, mesh, np.ones((len(which), 3)))
    return groups


def _floor(server: viser.ViserServer, height: float) -> None:
    server.scene.add_grid(
        f"{ROOT}/floor",
        width=_FLOOR,
        height=_FLOOR,
        infinite_grid=True,
        cell_size=_CELL,
        section_size=5 * _CELL,
        cell_color=_LINES[0],
        section_color=_LINES[1],
        fade_distance=_FADE,
        position=(0.0, 0.0, height),
    )


SPEEDS = {"0.1×": 0.1, "0.25×": 0.25, "0.5×": 0.5, "1×": 1.0, "2×": 2.0, "5×": 5.0, "max": 0.0}
"""Times real time; 0 is as fast as it goes."""
SLIDERS = {
    "threshold": ("θ: level that is contact", 0.02, 0.98, 0.01),
    "averaging_time": ("T_avg [s]", 0.01, 1.0, 0.01),
    "hold_time": ("T_hold [s]", 0.1, 5.0, 0.1),
    "turn_offset": ("offset of turns [rad]", 0.05, 1.0, 0.01),
}
"""Label, least, most and step of each number of the controller that can be changed."""


class Controls:
    """The buttons and sliders.

    Args:
        server: Where they are shown.
        channel: Where orders go.
        state: What can be changed, and its values.
    """

    def __init__(
        self, server: viser.ViserServer, channel: Channel, state: Mapping[str, Any]
    ) -> None:
        self._channel, self._quiet = channel, False
        gui, self._folders = server.gui, list[Any]()
        with self._folder(gui, "time"):
            self._pause = gui.add_checkbox("pause", bool(state.get("paused")))
            self._pause.on_update(lambda event: self._order(event, "pause", on=self._pause.value))
            step = gui.add_button("one step")
            step.on_click(lambda event: self._order(event, "step"))
            self._speed = gui.add_dropdown(
                "speed", list(SPEEDS), initial_value=_named(state.get("speed", 1.0))
            )
            self._speed.on_update(
                lambda event: self._order(event, "speed", value=SPEEDS[self._speed.value])
            )
            self._seed = None
            if "seed" in state:
                self._seed = gui.add_number("seed", int(state["seed"]), min=0, step=1)
                restart = gui.add_button("restart with this seed")
                restart.on_click(self._restart)
            elif state.get("again"):
                again = gui.add_button("from the beginning")
                again.on_click(lambda event: self._order(event, "restart"))
        self._sliders: dict[str, Any] = {}
        values = state.get("values", {})
        if values:
            with self._folder(gui, "controller: a change starts it anew"):
                for name, (label, low, high, step_) in SLIDERS.items():
                    if name in values:
                        self._add(gui, name, label, min(low, values[name]), high, step_, values)

    def _folder(self, gui: viser.GuiApi, label: str) -> Any:
        self._folders.append(gui.add_folder(label))
        return self._folders[-1]

    def remove(self) -> None:
        """Take them off the page."""
        for folder in self._folders:
            folder.remove()

    def _add(
        self, gui: Any, name: str, label: str, low: float, high: float, step: float, values: Any
    ) -> None:
        value = float(values[name])
        slider = gui.add_slider(label, low, max(high, value), step, value)
        slider.on_update(lambda event: self._order(event, "set", name=name, value=slider.value))
        self._sliders[name] = slider

    def show(self, state: Mapping[str, Any]) -> None:
        """Show values that the program has now, without an order."""
        self._quiet = True
        try:
            for name, slider in self._sliders.items():
                value = state.get("values", {}).get(name)
                if value is not None and value != slider.value:
                    slider.value = value
            if bool(state.get("paused")) != self._pause.value:
                self._pause.value = bool(state.get("paused"))
        finally:
            self._quiet = False

    def drags(self, scene: SceneView) -> None:
        """Let a person drag what can be moved."""
        for group in scene.groups:
            if (scene.shapes.body[group.which] >= 0).any():
                _Drag(scene, group, self._tell).begin()

    def _restart(self, event: Any) -> None:
        if self._seed is not None:
            self._order(event, "restart", seed=int(self._seed.value))

    def _order(self, event: Any, do: str, **more: Any) -> None:
        """Send what a person did; a value that the program set itself has no client."""
        if event.client_id is not None and not self._quiet:
            self._tell(do=do, **more)

    def _tell(self, **order: Any) -> None:
        self._channel.tell(ORDER, **order)


class _Drag:
    """Drags the shapes of one group over the floor."""

    def __init__(self, scene: SceneView, group: Any, tell: Callable[..., None]) -> None:
        self._scene, self._group, self._tell = scene, group, tell
        self._body, self._held = -1, np.zeros(3)

    def begin(self) -> None:
        """Take drags from now on."""

        async def drag(event: Any) -> None:
            if event.phase == "start":
                self._start(event)
            elif self._body >= 0:
                x, y, _ = self._over_floor(event) + self._held
                over = event.phase == "end"
                self._tell(do="move", body=self._body, x=float(x), y=float(y), end=over)

        self._group.node.on_drag("left")(drag)

    def _start(self, event: Any) -> None:
        number = int(self._group.which[event.instance_index or 0])
        self._body = int(self._scene.shapes.body[number])
        place = self._scene.places[number]
        self._held = place - (np.array(event.start_position) - self._scene.middle)

    def _over_floor(self, event: Any) -> Any:
        """Where the pointer is at the height at which the shape is held [m]."""
        eye = np.array(event.client.camera.position)
        to, height = np.array(event.end_position), event.start_position[2]
        share = (height - eye[2]) / (to[2] - eye[2]) if to[2] != eye[2] else 1.0
        return eye + share * (to - eye) - self._scene.middle


def _named(speed: float) -> str:
    """The name of a speed; of another one the nearest."""
    if speed <= 0:
        return "max"
    return min((abs(value - speed), name) for name, value in SPEEDS.items() if value)[1]
