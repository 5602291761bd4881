"""The page: what has come is drawn, at most 60 times a second.

Nothing that comes from outside becomes markup: texts are escaped, numbers are written by us.
"""

from __future__ import annotations

import html
import math
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import viser

from antennate.figures import SERIES, called, rgba
from antennate.sim.shapes import Shapes, VisibleModel, picture
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import (
    HEADER,
    POSES,
    SCENE,
    SNAPSHOT,
    STATE,
    TEXT,
    TICK,
    Channel,
    Poses,
    read,
)
from antennate.telemetry.view.charts import LABELS, Charts, Map
from antennate.telemetry.view.pace import RATE
from antennate.telemetry.view.player import LogScene
from antennate.telemetry.view.scene import Controls, SceneView

_SLOW = 0.1
"""Time between two pictures of charts, map and status [s]: they are read, not watched."""
_ARROW_ROBOT, _ARROW_BENCH = 20, 100
"""Length of an arrow at first [mm/N]: robots push with newtons, antennae with tenths of one."""
_LINES = 6
_ENDED = "The run has ended", "The replay has ended"
_SENDING = 0.5
"""Time for the last messages to leave [s]; assumed."""
_SIDES = (rgba(SERIES[0]), rgba(SERIES[1]))
_COUNTERS = ("missed", "frames", "crc", "lost", "misses", "stale", "sent", "refused")


class Page:
    """The page of the browser.

    Args:
        server: Where it is shown.
        channel: Where orders go.
    """

    def __init__(self, server: viser.ViserServer, channel: Channel) -> None:
        self._server, self._channel = server, channel
        self._scene: SceneView | None = None
        self._robot: _Robot | None = None
        self._controls: Controls | None = None
        self._state: Mapping[str, Any] = {}
        self._tick: Tick | None = None
        self._poses: Poses | None = None
        self._drawn: Poses | None = None
        self._lines = deque[str](maxlen=_LINES)
        self._due = self._due_slow = 0.0
        gui = server.gui
        gui.main_panel.dock_right()
        self._status = gui.add_html(_status(None, {}, ()))
        self._panel = gui.add_panel(visible=False)
        self._charts = Charts(server, self._panel.add_tab("signals"))
        self._panel.dock_left()
        self._map = Map(server)
        with gui.add_folder("picture"):
            self._follow = gui.add_checkbox("follow the robot", True)
            self._arrow = gui.add_slider("arrows [mm for 1 N]", 1, 500, 1, _ARROW_ROBOT)

    def draw(self, now: float) -> float:
        """Draw what is due at a time [s]; the time until more may be due [s]."""
        if not self._server.get_clients():
            return _SLOW  # nobody looks; what has come is kept
        if self._new and now >= self._due:
            self._due = now + 1.0 / RATE
            self._draw()
        if now >= self._due_slow:
            self._due_slow = now + _SLOW
            self._draw_slow()
        return max(0.0, self._due - now) if self._new else _SLOW

    def end(self) -> None:
        """Show the last picture, and that the program has ended; the browser keeps both."""
        clients = self._server.get_clients().values()
        if not clients:
            return
        self._draw()
        if results := str(self._state.get("results", "")):
            results = f"Results: {results}"
        ended = _ENDED["again" in self._state]
        self._lines.append(f"{ended}. {results}".strip())
        self._draw_slow()
        for client in clients:
            client.add_notification(ended, results)
        self._server.flush()
        time.sleep(_SENDING)

    @property
    def _new(self) -> bool:
        return self._poses is not self._drawn and self._scene is not None

    def take(self, kind: bytes, content: bytes) -> None:
        """Take a message."""
        if kind == POSES:
            self._poses = Poses.unpack(content)
            self._note_head()
        elif kind == SNAPSHOT and self._scene is not None:
            if (now := picture(content, self._scene.shapes)) is not None:
                self._poses = Poses(*now)
                self._note_head()
        elif kind == TICK:
            self._take_tick(Tick.unpack(content))
        elif kind == TEXT:
            self._lines.append(content.decode("utf-8", "replace"))
        elif kind == STATE:
            self._take_state(read(content))
        elif kind == SCENE:
            self._robot = None
            self._begin(Shapes.unpack(content))
        elif kind == HEADER:
            self._robot = _Robot(Header.unpack(content))
            self._begin(self._robot.model.shapes())

    def _take_state(self, state: Mapping[str, Any]) -> None:
        names = state.get("values", {}).keys(), "seed" in state
        before = self._state.get("values", {}).keys(), "seed" in self._state
        self._state = state
        if state.get("speed") is None:
            return
        if self._controls is None or names != before:
            if self._controls is not None:
                self._controls.remove()
            self._controls = Controls(self._server, self._channel, state)
            if self._scene is not None:
                self._controls.drags(self._scene)
        else:
            self._controls.show(state)

    def _begin(self, shapes: Shapes) -> None:
        if self._scene is None:
            self._arrow.value = _ARROW_ROBOT if shapes.robot.any() else _ARROW_BENCH
        self._scene = SceneView(self._server, shapes)
        self._poses = self._drawn = None
        if self._controls is not None:
            self._controls.drags(self._scene)

    def _take_tick(self, tick: Tick) -> None:
        theta = self._state.get("values", {}).get("threshold", self._state.get("theta", math.nan))
        if self._tick is not None and tick.number < self._tick.number:
            self._lines.clear()
        self._tick = tick
        self._charts.take(tick, theta)
        if self._robot is not None:
            self._poses = self._robot.poses(tick)

    def _note_head(self) -> None:
        if self._scene is not None and self._poses is not None:
            robot = np.flatnonzero(self._scene.shapes.robot)
            if len(robot) and len(self._poses.poses) == len(self._scene.shapes.kind):
                self._map.take(self._poses.t, self._poses.poses[robot[0], :2])

    def _draw(self) -> None:
        now, scene = self._poses, self._scene
        self._drawn = now
        if now is None or scene is None or len(now.poses) != len(scene.shapes.kind):
            return
        scene.follow, scene.arrow_scale = self._follow.value, 1e-3 * self._arrow.value
        robot = now.poses[scene.shapes.robot, :2]
        scene.show(now, robot.mean(axis=0) if len(robot) else np.zeros(2))

    def _draw_slow(self) -> None:
        self._charts.show()
        if self._panel.visible != self._charts.any:
            self._panel.visible = self._charts.any
        if self._scene is not None and self._drawn is not None and self._robot is None:
            self._map.show(self._scene.shapes, self._drawn)
        self._status.content = _status(self._tick, self._state, tuple(self._lines))


class _Robot:
    """The robot of a log or a drive: its joints are known, where it is on the floor is not."""

    def __init__(self, header: Header) -> None:
        self._scene = LogScene(header, None)
        self.model = VisibleModel(self._scene.world.model, _SIDES)

    def poses(self, tick: Tick) -> Poses:
        """Where its parts are."""
        self._scene.place_joints(tick)
        poses = self.model.poses(self._scene.world.data)
        return Poses(tick.now, poses, np.zeros((0, 6), np.float32))


def _status(tick: Tick | None, state: Mapping[str, Any], lines: tuple[str, ...]) -> str:
    rows: list[tuple[str, str]] = []
    if title := str(state.get("title", "")):
        rows.append(("shown", title))
    if tick is not None:
        rows.append(("time", f"{tick.now:.2f} s"))
        if tick.maneuver >= 0:
            rows.append(("maneuver", called(tick.maneuver)))
        if tick.state:
            rows.append(("supervisor", tick.state))
            rows += [("", cause) for cause in tick.causes[:3]]
            rows += [("note", tick.note)] if tick.note else []
            counts = (f"{LABELS.get(n, n)} {getattr(tick, n)}" for n in _COUNTERS)
            rows.append(("counters", ", ".join(counts)))
    rows += [("event", line) for line in lines]
    cells = "".join(
        f'<tr><td style="color:var(--mantine-color-dimmed);padding-right:0.6em;vertical-align:top">'
        f"{html.escape(name)}</td><td>{html.escape(text)}</td></tr>"
        for name, text in rows
    )
    return f'<table id="status" style="font-size:0.8em;margin:0.4em">{cells}</table>'
