"""What a person may change on the page of a simulation; each change is an order to the program.

A page of a robot has none of it: nothing on it can move anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import viser

from antennate.telemetry.view.channel import ORDER, Channel
from antennate.telemetry.view.scene import SceneView

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
