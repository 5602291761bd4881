"""Strip charts of the last seconds, and the map from above."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser
from viser import uplot

from antennate.colours import MANEUVER_COLOURS, MANEUVER_NAMES, SERIES
from antennate.sim import shapes
from antennate.sim.shapes import Shapes
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import Poses
from antennate.types import Floats, Maneuver

_KEPT = 600
"""Ticks in a chart: 10 s of them at 60 Hz."""
_HEIGHT = 120
_SIDES = ("left", "right")
_STEP = 100.0
"""Limits of the readings are multiples of this [counts], so that they seldom change."""
_PATH = 400
"""Points of the path on the map; every second one goes when there are more."""
_MARGIN = 0.1
_SHORT = {Maneuver.TURN_L: "left", Maneuver.TURN_R: "right"}
_MUTED, _FAINT = "#6E6E6E", "#D8CDB8"


class Charts:
    """Counts, level with theta, contact and maneuver over time."""

    def __init__(self, server: viser.ViserServer, tab: Any) -> None:
        self._server, self._tab = server, tab
        self._rows = deque[tuple[float, ...]](maxlen=_KEPT)
        self._limits = (0.0, _STEP)
        pair = [(side, SERIES[i]) for i, side in enumerate(_SIDES)]
        contact, one = "contact: 0 free, 1 touches, 2 unknown", [("maneuver", "#222222")]
        self._add = {
            (1, 2): ("readings [counts]", pair, self._limits),
            (3, 4, 8): ("level b, and θ", [*pair, ("θ", _MUTED)], (0.0, 1.0)),
            (5, 6): (contact, pair, (-0.2, 2.2)),
            (7,): (_maneuvers(), one, (-0.2, 4.2)),
        }
        begin = np.stack([np.arange(2.0), *np.zeros((8, 2))])
        self._charts = {which: self._chart(which, begin) for which in self._add}

    def _chart(self, which: tuple[int, ...], columns: Floats) -> Any:
        with self._tab:
            return _chart(self._server, *self._add[which], _data(columns, which), which[0])

    def take(self, tick: Tick, theta: float) -> None:
        """Keep a tick; a time before the last one begins anew."""
        if self._rows and tick.now <= self._rows[-1][0]:
            if tick.now == self._rows[-1][0]:
                return
            self._rows.clear()
        values = (*tick.reading, *tick.level, *tick.contact, tick.maneuver)
        self._rows.append((tick.now, *map(float, values), theta))

    def show(self) -> None:
        """Draw what was kept."""
        if not self._rows:
            return
        columns = np.array(self._rows).T
        limits = _limits(columns[1:3])
        if limits != self._limits:  # a chart finds none itself where a reading is missing
            self._limits, which = limits, (1, 2)
            self._add[which] = (*self._add[which][:2], limits)
            self._charts[which].remove()
            self._charts[which] = self._chart(which, columns)
            return  # a chart takes no others before it is there
        for which, chart in self._charts.items():
            chart.data = _data(columns, which)


def _data(columns: Floats, which: tuple[int, ...]) -> tuple[Floats, ...]:
    return columns[0], *(columns[i] for i in which)


def _limits(counts: Floats) -> tuple[float, float]:
    """Whole steps around the readings that are known [counts]."""
    known = counts[np.isfinite(counts)]
    if not known.size:
        return 0.0, _STEP
    low, high = _STEP * np.floor(known.min() / _STEP), _STEP * np.ceil(known.max() / _STEP)
    return float(low), float(max(high, low + _STEP))


def _maneuvers() -> str:
    return ", ".join(f"{int(m)} {_SHORT.get(m, MANEUVER_NAMES[m])}" for m in Maneuver)


def _chart(
    server: viser.ViserServer,
    title: str,
    lines: Sequence[tuple[str, str]],
    limits: tuple[float, float],
    data: tuple[Floats, ...],
    order: float,
) -> Any:
    axis: Any = uplot.Axis(size=56)
    return server.gui.add_uplot(
        data,
        (
            uplot.Series(label="t [s]"),
            *(uplot.Series(label=name, stroke=colour, width=1.5) for name, colour in lines),
        ),
        title=title,
        scales={"x": uplot.Scale(time=False), "y": uplot.Scale(range=limits)},
        axes=(uplot.Axis(size=24), axis),
        legend=uplot.Legend(show=False),
        height=_HEIGHT,
        order=order,
    )


class Map:
    """Obstacles, the robot and the way of its head from above."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._html = server.gui.add_html("")
        self._path: list[tuple[float, float]] = []
        self._every = self._count = 1
        self._last = -np.inf

    def take(self, t: float, head: Floats) -> None:
        """Keep a place of the head [m]; a time before the last one begins anew."""
        if t < self._last:
            self._path, self._every = [], 1
        self._last, self._count = t, self._count + 1
        if self._count % self._every:
            return
        self._path.append((float(head[0]), float(head[1])))
        if len(self._path) > _PATH:
            self._path, self._every = self._path[::2], 2 * self._every

    def show(self, what: Shapes, now: Poses) -> None:
        """Draw it."""
        places, solid = now.poses[:, :2], ~what.robot
        marks = [_mark(what, now, i, _FAINT) for i in np.flatnonzero(solid).tolist()]
        marks += [_mark(what, now, i, "#555555") for i in np.flatnonzero(what.robot).tolist()]
        way = " ".join(f"{x:.3f},{-y:.3f}" for x, y in self._path)
        inside = np.concatenate([places, np.array(self._path).reshape(-1, 2)])
        low, high = inside.min(axis=0) - _MARGIN, inside.max(axis=0) + _MARGIN
        width, height = high - low
        self._html.content = (
            f'<svg viewBox="{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}" '
            'style="width:100%;max-height:320px;background:#fff" role="img" '
            f'aria-label="map from above">{"".join(marks)}'
            f'<polyline points="{way}" fill="none" stroke="{_COLOUR}" stroke-width="0.008"/></svg>'
        )


_COLOUR = MANEUVER_COLOURS[Maneuver.FORWARD]


def _mark(what: Shapes, now: Poses, i: int, colour: str) -> str:
    """A shape in plan: a circle, or the outline of a box or of a capsule that lies."""
    x, y = now.poses[i, :2].tolist()
    axes = now.poses[i, 3:].reshape(3, 3)
    size = what.size[i]
    kind = int(what.kind[i])
    if kind == shapes.BOX:
        corners = [
            now.poses[i, :2] + axes[:2, 0] * size[0] * a + axes[:2, 1] * size[1] * b
            for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
        points = " ".join(f"{u:.3f},{-v:.3f}" for u, v in corners)
        return f'<polygon points="{points}" fill="{colour}"/>'
    if kind in (shapes.CAPSULE, shapes.CYLINDER):
        dx, dy = (axes[:2, 2] * size[1]).tolist()
        return (
            f'<line x1="{x - dx:.3f}" y1="{-(y - dy):.3f}" x2="{x + dx:.3f}" y2="{-(y + dy):.3f}" '
            f'stroke="{colour}" stroke-width="{2 * size[0]:.4f}" stroke-linecap="round"/>'
        )
    return (
        f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{max(float(size[0]), 0.002):.4f}" fill="{colour}"/>'
    )
