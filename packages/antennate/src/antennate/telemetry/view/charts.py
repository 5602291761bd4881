"""Strip charts of the last seconds, and the map from above."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import viser
from viser import uplot

from antennate.figures import MANEUVER_COLOURS, MANEUVER_NAMES, SERIES
from antennate.sim import shapes
from antennate.sim.shapes import Shapes
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import Poses
from antennate.types import Contact, Floats, Maneuver, State

_WINDOW = 10.0
"""Time that charts show [s]."""
_KEPT = 1200
"""Most ticks in a chart: more than that time has, even where every tick is shown."""
_HEIGHT, _PADDING = 120, (10, 10, 0, 0)
"""Height of a chart, and the room above and beside it for the halves of the outermost labels
[pixels]."""
_SIDES = ("left", "right")
LABELS = {"missed": "missed ticks", "misses": "missed answers"}
"""What counters are called where that is not their name in a log; as in the status line."""
_COUNTERS = ("missed", "crc", "lost", "misses", "stale", "refused")
"""Counters of what went wrong; those of what went well only grow."""
_STATE, _COUNTS = (9,), tuple(range(10, 10 + len(_COUNTERS)))
"""Columns of the supervisor's state and of these counters."""
_UNSEEN = 1e-7
"""How far the left end of the charts moves, as a share of that time."""
_SPLITS, _NUMBERS = (0.0, 0.5, 1.0), (f"-{_WINDOW:g}", f"-{_WINDOW / 2:g}", "0")
"""Where the axis of time has numbers, and which [s]."""
_OUTSIDE = 0.2
"""How far the axis of a chart with words goes beyond them."""
_NOTE = '<p style="font-size:0.8em;margin:0.4em">The last 10 s; 0 is now.</p>'
_STEP = 100.0
"""Limits of the readings are multiples of this [counts], so that they seldom change."""
_PATH = 400
"""Points of the path on the map; every second one goes when there are more."""
_MARGIN, _PEN = 0.1, 0.006
"""Room around the map [m], and width of the path as a share of the map."""
_CONTACTS = ("free", "contact", "unknown")
"""Words for the values of `Contact`."""
_WORDS = 88
"""Room for them, their ticks and a gap beside a chart [pixels]."""
_MUTED = "#858585"
"""A grey that is read on white and on black."""
_FAINT, _THIN = "#B09A6A", 0.45
"""Colour of obstacles, and how much of it covers the page."""


class _Look(NamedTuple):
    """How a chart looks.

    Attributes:
        title: Its title.
        lines: Names and colours of its lines.
        limits: The ends of its axis, None for as the values are.
        words: What the values 0, 1, 2 and so on mean, empty for numbers.
    """

    title: str
    lines: Sequence[tuple[str, str]]
    limits: tuple[float, float] | None = None
    words: Sequence[str] = ()


class Charts:
    """Counts, level with theta, contact, maneuver, supervisor and counters over time."""

    def __init__(self, server: viser.ViserServer, tab: Any) -> None:
        self._rows = deque[tuple[float, ...]](maxlen=_KEPT)
        self._limits = (0.0, _STEP)
        self._known = set[int]()
        self._nudge = 0.0
        pair = [(side, SERIES[i]) for i, side in enumerate(_SIDES)]
        counters = [LABELS.get(name, name) for name in _COUNTERS]
        maneuvers = [MANEUVER_NAMES[each] for each in Maneuver]
        states = [each.name for each in State]
        looks = {
            (1, 2): _Look("readings [counts]", pair, self._limits),
            (3, 4, 8): _Look("bending level, and θ", [*pair, ("θ", _MUTED)], (0.0, 1.0)),
            (5, 6): _Look("contact", pair, words=_CONTACTS),
            (7,): _Look("maneuver", [("maneuver", _MUTED)], words=maneuvers),
            _STATE: _Look("supervisor", [("supervisor", _MUTED)], words=states),
            _COUNTS: _Look("counted in these seconds", list(zip(counters, SERIES, strict=False))),
        }
        begin = np.stack([np.array([0.0, 1.0]), *np.zeros((_COUNTS[-1], 2))])
        with tab:
            server.gui.add_html(_NOTE, order=0)
            self._charts = {
                which: _chart(server, look, _data(begin, which), which[0])
                for which, look in looks.items()
            }

    @property
    def any(self) -> bool:
        """Whether there is anything to show; a bench has no signals."""
        return bool(self._known)

    def take(self, tick: Tick, theta: float) -> None:
        """Keep a tick; a time before the last one begins anew."""
        if self._rows and tick.now <= self._rows[-1][0]:
            if tick.now == self._rows[-1][0]:
                return
            self._rows.clear()
        if tick.state:  # on a robot it is news that a reading is missing
            self._known |= {which[0] for which in self._charts}
        values = (*tick.reading, *tick.level, *tick.contact, tick.maneuver, theta)
        state = State.__members__.get(tick.state, np.nan)
        counts = (getattr(tick, name) for name in _COUNTERS)
        self._rows.append((tick.now, *map(float, (*values, state, *counts))))
        while self._rows[0][0] < tick.now - _WINDOW:
            self._rows.popleft()

    def show(self) -> None:
        """Draw what was kept; a chart of what nobody reads or decides here is not shown."""
        if not self._rows:
            return
        columns = np.array(self._rows).T
        columns[0] = 1.0 + (columns[0] - columns[0, -1]) / _WINDOW
        columns[_COUNTS[0] :] -= columns[_COUNTS[0] :, :1]
        self._known |= _known(columns)
        for which, chart in self._charts.items():
            if chart.visible != (which[0] in self._known):
                chart.visible = which[0] in self._known
        columns = np.concatenate([self._begin(), columns], axis=1)
        limits = _limits(columns[1:3])
        if limits != self._limits:  # a chart finds none itself where a reading is missing
            self._limits = limits
            self._charts[1, 2].scales = _scales(limits)
        for which, chart in self._charts.items():
            chart.data = _data(columns, which)

    def _begin(self) -> Floats:
        """A column at the left end, where lines show nothing.

        So all charts have the same axis of time at any time, from 0 to 1: where the client loses
        the ends of an axis, as it may while it draws a chart anew, it takes these. The end moves by
        what nobody sees, as the client numbers an axis only when it moves.
        """
        self._nudge = _UNSEEN - self._nudge
        begin = np.full((_COUNTS[-1] + 1, 1), np.nan)
        begin[_COUNTS[0] :] = 0.0  # limits of these are as the values are
        begin[0] = -self._nudge
        return begin


def _data(columns: Floats, which: tuple[int, ...]) -> tuple[Floats, ...]:
    return columns[0], *(columns[i] for i in which)


def _known(columns: Floats) -> set[int]:
    """First columns of the charts in which there is something."""
    signals = {
        1: np.isfinite(columns[1:3]).any(),
        3: np.isfinite(columns[3:5]).any(),
        5: (columns[5:7] != Contact.UNKNOWN).any(),
        7: (columns[7] >= 0).any(),
        _STATE[0]: np.isfinite(columns[_STATE[0]]).any(),
        _COUNTS[0]: np.isfinite(columns[_STATE[0]]).any(),
    }
    return {which for which, is_known in signals.items() if is_known}


def _limits(counts: Floats) -> tuple[float, float]:
    """Whole steps around the readings that are known [counts]."""
    finite = counts[np.isfinite(counts)]
    if not finite.size:
        return 0.0, _STEP
    low, high = _STEP * np.floor(finite.min() / _STEP), _STEP * np.ceil(finite.max() / _STEP)
    return float(low), float(max(high, low + _STEP))


def _chart(server: viser.ViserServer, look: _Look, data: tuple[Floats, ...], order: float) -> Any:
    axis: Any = uplot.Axis(size=_WORDS)
    limits, words = look.limits, look.words
    if words:
        limits = -_OUTSIDE, len(words) - 1 + _OUTSIDE
        axis |= uplot.Axis(splits=tuple(map(float, range(len(words)))), values=tuple(words))
    return server.gui.add_uplot(
        data,
        (
            uplot.Series(label=f"share of {_WINDOW:g} s"),
            *(uplot.Series(label=name, stroke=colour, width=1.5) for name, colour in look.lines),
        ),
        title=look.title,
        scales=_scales(limits),
        axes=(uplot.Axis(size=24, splits=_SPLITS, values=_NUMBERS), axis),
        legend=uplot.Legend(show=len(look.lines) > len(_SIDES) + 1),
        height=_HEIGHT,
        padding=_PADDING,
        order=order,
    )


def _scales(limits: tuple[float, float] | None) -> dict[str, uplot.Scale]:
    """Scales of both axes."""
    y = uplot.Scale(auto=True) if limits is None else uplot.Scale(range=limits)
    return {"x": uplot.Scale(time=False), "y": y}


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
        places = now.poses[:, :2]
        obstacles, robot = (
            "".join(_mark(what, now, i) for i in np.flatnonzero(which).tolist())
            for which in (~what.robot, what.robot)
        )
        way = " ".join(f"{x:.3f},{-y:.3f}" for x, y in self._path)
        inside = np.concatenate([places, np.array(self._path).reshape(-1, 2)])
        low, high = inside.min(axis=0) - _MARGIN, inside.max(axis=0) + _MARGIN
        width, height = high - low
        self._html.content = (
            f'<svg viewBox="{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}" '
            'style="width:100%;max-height:320px" role="img" aria-label="map from above">'
            f'<g style="color:{_FAINT};opacity:{_THIN}">{obstacles}</g>{robot}'
            f'<polyline points="{way}" fill="none" stroke="{_COLOUR}" '
            f'stroke-width="{_PEN * max(width, height):.5f}"/></svg>'
        )


_COLOUR = MANEUVER_COLOURS[Maneuver.FORWARD]


def _mark(what: Shapes, now: Poses, i: int) -> str:
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
        return f'<polygon points="{points}" fill="currentColor"/>'
    if kind in (shapes.CAPSULE, shapes.CYLINDER):
        dx, dy = (axes[:2, 2] * size[1]).tolist()
        return (
            f'<line x1="{x - dx:.3f}" y1="{-(y - dy):.3f}" x2="{x + dx:.3f}" y2="{-(y + dy):.3f}" '
            f'stroke="currentColor" stroke-width="{2 * size[0]:.4f}" stroke-linecap="round"/>'
        )
    radius = max(float(size[0]), 0.002)
    return f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{radius:.4f}" fill="currentColor"/>'
