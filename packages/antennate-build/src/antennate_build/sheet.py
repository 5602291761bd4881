"""A sheet of paper to draw on, in mm: frame, title block, views, dimensions, tables.

A sheet is a figure of matplotlib whose axes are as large as the paper and count mm from its lower
left corner. A `View` is a place on it with a scale, onto which solids and dimensions are drawn in
their own mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from trimesh.remesh import subdivide_to_size

from antennate import __version__
from antennate import figures as style
from antennate.types import Floats
from antennate_build import kernel
from antennate_build.kernel import Point, Solid

INCH = 25.4
A4 = (297.0, 210.0)
"""Width and height of a sheet [mm]."""
A3 = (420.0, 297.0)
_MARGIN = 8.0
LETTER = 2.6
"""Height of letters [mm]."""
_POINTS = 72.0 / INCH
_EDGE, _THIN = 0.9, 0.35
"""Width of edges, and of all else [points]."""
Place = tuple[float, float]


def new(size: tuple[float, float], title: str, notes: Sequence[str]) -> tuple[Figure, Axes]:
    """A sheet with a frame and a title block.

    Args:
        size: Width and height [mm].
        title: What it shows.
        notes: Lines of the title block below it.
    """
    width, height = size
    figure = Figure(figsize=(width / INCH, height / INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    right, top = width - _MARGIN, height - _MARGIN
    _box(axes, (_MARGIN, _MARGIN), (right, top), 0.9)
    lines = [*notes, f"antennate {__version__}; lengths in mm"]
    tall = 11.0 + 4.6 * len(lines)
    _box(axes, (right - 92.0, _MARGIN), (right, _MARGIN + tall), 0.7)
    text(axes, (right - 89.0, _MARGIN + tall - 5.5), title, size=1.4 * LETTER, weight="bold")
    for n, line in enumerate(lines):
        text(axes, (right - 89.0, _MARGIN + tall - 12.0 - 4.6 * n), line)
    return figure, axes


def _box(axes: Axes, low: Place, high: Place, width: float) -> None:
    xs, ys = (low[0], high[0], high[0], low[0], low[0]), (low[1], low[1], high[1], high[1], low[1])
    axes.plot(xs, ys, color=style.INK, lw=width)


def text(
    axes: Axes, at: Place, words: str, size: float = LETTER, side: str = "left", **more: object
) -> None:
    """Words on the sheet, the middle of their line at a place."""
    axes.text(
        *at,
        words,
        fontsize=size * _POINTS,
        ha=side,
        va="center",
        color=style.INK,
        **more,  # pyright: ignore[reportArgumentType]
    )


def table(
    axes: Axes, at: Place, title: str, rows: Sequence[Sequence[str]], widths: Sequence[float]
) -> float:
    """A table with a head line; returns the height that it takes [mm].

    Args:
        axes: The sheet.
        at: Upper left corner [mm].
        title: Above it.
        rows: The head line, then all others.
        widths: Width of each column [mm].
    """
    x, y, step = *at, 5.0
    text(axes, (x, y - 2.0), title, weight="bold")
    y -= 5.0
    wide = sum(widths)
    for n, row in enumerate(rows):
        axes.plot((x, x + wide), (y, y), color=style.INK, lw=0.7 if n < 2 else 0.2)
        left = x
        for cell, width in zip(row, widths, strict=True):
            text(axes, (left + 1.0, y - step / 2.0), cell, weight="bold" if n == 0 else "normal")
            left += width
        y -= step
    axes.plot((x, x + wide), (y, y), color=style.INK, lw=0.7)
    return at[1] - y


def picture(wide: float, tall: float, seen: tuple[Point, Point]) -> tuple[View, Figure]:
    """A view on a figure of its own without a frame, as large as what is drawn.

    Args:
        wide: Width of the figure [inches].
        tall: Height of it [inches].
        seen: Direction from which solids are looked at, and which one points up.
    """
    figure = Figure(figsize=(wide, tall))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_aspect("equal", adjustable="datalim")
    return View(axes, (0.0, 0.0), 1.0, *seen), figure


@dataclass(frozen=True)
class View:
    """A view of solids on a sheet.

    Attributes:
        axes: The sheet.
        at: Where the origin of the solids lies [mm].
        scale: Sheet over solid.
        eye: Direction from which they are looked at.
        up: Direction that points up on the sheet.
    """

    axes: Axes
    at: Place
    scale: float
    eye: Point
    up: Point

    def flat(self, points: Floats) -> Floats:
        """Places on the sheet of points of space, shape (n, 2)."""
        eye = np.array(self.eye) / np.linalg.norm(self.eye)
        across = np.cross(self.up, eye)
        across /= np.linalg.norm(across)
        upward = np.cross(eye, across)
        return np.array(self.at) + self.scale * np.stack([points @ across, points @ upward], -1)

    def draw(
        self, solid: Solid, hidden: bool = False, colour: str = "", width: float = _EDGE
    ) -> None:
        """Draw the edges of a solid; with a colour it covers what was drawn before."""
        above = 1.0 + 1e-3 * len(self.axes.get_children())
        if colour:
            self._fill(solid, colour, above)
        seen, unseen = kernel.outlines(solid, self.eye, self.up)
        put = [np.array(self.at) + self.scale * line for line in seen]
        self.axes.add_collection(
            LineCollection(
                put, colors=style.INK, linewidths=width, capstyle="round", zorder=above + 5e-4
            )
        )
        if hidden:
            put = [np.array(self.at) + self.scale * line for line in unseen]
            self.axes.add_collection(
                LineCollection(put, colors=style.MUTED, linewidths=_THIN, linestyles=(0, (4, 2)))
            )

    def _fill(self, solid: Solid, colour: str, above: float) -> None:
        flat, _, _ = self._front(solid)
        self.axes.add_collection(
            PolyCollection(
                list(flat), facecolors=colour, edgecolors=colour, linewidths=0.3, zorder=above
            )
        )

    def _front(
        self, solid: Solid, most: float = math.inf, turn: float = 0.2
    ) -> tuple[Floats, Floats, Floats]:
        """Triangles that face the eye on the sheet, their nearness and how bright they are.

        Args:
            solid: The solid.
            most: Longest edge of a triangle [mm]: large ones have no nearness of their own.
            turn: Largest angle between triangles that are neighbours on a round face [rad].
        """
        mesh, eye = (
            kernel.mesh(solid, most / 30.0 if most < math.inf else 0.1, turn),
            np.array(self.eye) / np.linalg.norm(self.eye),
        )
        corners = mesh.points[mesh.triangles]
        if math.isfinite(most):
            points, triangles = subdivide_to_size(mesh.points, mesh.triangles, most, 20)[:2]
            corners = points[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        facing = normals @ eye > 0.0
        corners, normals = corners[facing], normals[facing]
        flat = self.flat(corners.reshape(-1, 3)).reshape(-1, 3, 2)
        light = eye + np.array([0.2, 0.1, 0.9])
        bright = 0.62 + 0.38 * np.clip(normals @ (light / np.linalg.norm(light)), 0.0, 1.0)
        return flat, (corners @ eye).mean(axis=1), bright

    def scene(
        self,
        parts: Sequence[tuple[Solid, str]],
        most: float = 3.0,
        wires: Sequence[tuple[Solid, str]] = (),
    ) -> None:
        """Draw coloured solids, shaded and with edges, what is near over what is far.

        Args:
            parts: Solids and their colours.
            most: Longest edge of a triangle [mm]; the picture takes a while if it is short.
            wires: The same without edges, whose outlines take minutes to find.
        """
        found = [(*self._front(solid, most), to_rgb(colour)) for solid, colour in parts]
        found += [(*self._front(solid, most, 0.3), to_rgb(colour)) for solid, colour in wires]
        flat = np.concatenate([each[0] for each in found])
        order = np.argsort(np.concatenate([each[1] for each in found]))
        colours = np.concatenate([each[2][:, None] * np.array(each[3]) for each in found])
        self.axes.add_collection(
            PolyCollection(
                list(flat[order]),
                facecolors=colours[order],
                edgecolors=colours[order],
                linewidths=0.3,
                rasterized=True,
            )
        )
        self.draw(kernel.together([solid for solid, _ in parts]), width=0.5)

    def wire(self, path: Floats, thickness: float, colour: str) -> None:
        """Draw a wire along a path of space, shape (n, 3), its nearer parts over the others."""
        near = path @ np.array(self.eye)
        flat, width = self.flat(path), thickness * self.scale * _POINTS
        pairs = [
            (near[i : i + 2].mean(), flat[max(i - 1, 0) : i + 3]) for i in range(len(flat) - 1)
        ]
        for _, piece in sorted(pairs, key=lambda pair: pair[0]):
            for lw, ink in ((width + 0.7, style.INK), (max(width - 0.7, 0.2), colour)):
                self.axes.plot(*piece.T, color=ink, lw=lw, solid_capstyle="butt")

    def place(self, point: Point) -> Place:
        """Where a point of space lies on the sheet."""
        x, y = self.flat(np.array([point]))[0]
        return float(x), float(y)

    def length(self, one: Point, other: Point, away: Place, words: str = "") -> None:
        """A dimension between two points of space, `away` from them on the sheet [mm].

        Args:
            one: First point.
            other: Second point.
            away: Shift of the dimension line, across it.
            words: Its text; the distance if not given.
        """
        a, b, shift = np.array(self.place(one)), np.array(self.place(other)), np.array(away)
        words = words or f"{math.dist(one, other):.3g}"
        dimension(self.axes, a, b, shift, words)

    def radius(
        self, centre: Point, radius: float, angle: float, words: str, out: float = 9.0
    ) -> None:
        """A leader to a circle of the view at an angle [deg]."""
        way = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
        start = np.array(self.place(centre)) + self.scale * radius * way
        leader(self.axes, start, start + out * way, words)

    def note(self, point: Point, away: Place, words: str) -> None:
        """A leader from a point of space to words, `away` from it on the sheet [mm]."""
        start = np.array(self.place(point))
        leader(self.axes, start, start + np.array(away), words)


def dimension(axes: Axes, a: Floats, b: Floats, shift: Floats, words: str) -> None:
    """A dimension line with arrows, and the lines that lead to it."""
    way = (b - a) / np.linalg.norm(b - a)
    across = np.array([-way[1], way[0]])
    shift = across * (shift @ across)
    beyond = across * math.copysign(1.2, shift @ across)
    for end in (a, b):
        axes.plot(*np.array([end + 0.1 * shift, end + shift + beyond]).T, color=style.INK, lw=_THIN)
    first, last = a + shift, b + shift
    wide = float(np.linalg.norm(b - a))
    if wide > 8.0:
        _arrow(axes, first, last)
        _arrow(axes, last, first)
        axes.plot(*np.array([first, last]).T, color=style.INK, lw=_THIN)
    else:  # from outside
        for end, sign in ((first, -1.0), (last, 1.0)):
            _arrow(axes, end, end - sign * way)
            axes.plot(*np.array([end, end + 5.0 * sign * way]).T, color=style.INK, lw=_THIN)
    turn = math.degrees(math.atan2(way[1], way[0]))
    turn = (turn + 90.0) % 180.0 - 90.0
    if turn <= -89.0:
        turn = 90.0
    lift = np.array([-math.sin(math.radians(turn)), math.cos(math.radians(turn))]) * 1.9
    middle = (first + last) / 2.0 + lift
    axes.text(
        float(middle[0]),
        float(middle[1]),
        words,
        fontsize=LETTER * _POINTS,
        ha="center",
        va="center",
        rotation=turn,
        color=style.INK,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
    )


def _arrow(axes: Axes, tip: Floats, away: Floats) -> None:
    way = (away - tip) / np.linalg.norm(away - tip)
    across = np.array([-way[1], way[0]])
    corners = [tip, tip + 2.2 * way + 0.4 * across, tip + 2.2 * way - 0.4 * across]
    axes.fill(*np.array(corners).T, color=style.INK, lw=0)


def leader(axes: Axes, start: Floats, end: Floats, words: str) -> None:
    """An arrow to a place, with words at its far end."""
    side = 1.0 if end[0] >= start[0] else -1.0
    _arrow(axes, start, end)
    knee = end + np.array([2.0 * side, 0.0])
    axes.plot(*np.array([start, end, knee]).T, color=style.INK, lw=_THIN)
    at = (float(knee[0] + 0.6 * side), float(knee[1]))
    text(axes, at, words, side="left" if side > 0 else "right")


def balloon(axes: Axes, start: Place, end: Place, words: str) -> None:
    """A sign in a circle with a line to what it names."""
    a, b = np.array(start), np.array(end)
    way = (b - a) / np.linalg.norm(b - a)
    axes.plot(*np.array([a, b - 3.2 * way]).T, color=style.INK, lw=_THIN)
    axes.plot(*a, "o", color=style.INK, ms=2)
    turns = np.linspace(0.0, math.tau, 40)
    circle = b + 3.2 * np.stack([np.cos(turns), np.sin(turns)], -1)
    axes.fill(circle[:, 0], circle[:, 1], facecolor="white", edgecolor=style.INK, lw=0.7, zorder=5)
    text(axes, end, words, side="center", weight="bold", zorder=6)


def helix(radius: float, pitch: float, turns: float, leg: float) -> Floats:
    """The middle line of a torsion spring as `kernel.coil` makes it, shape (n, 3)."""
    angle = np.linspace(0.0, math.tau * turns, int(24 * turns) + 1)
    height = pitch * turns
    body = np.stack(
        [
            radius * np.sin(angle),
            -radius * np.cos(angle),
            height * (angle / angle[-1] - 0.5),
        ],
        -1,
    )
    way = np.array([math.cos(angle[-1]), math.sin(angle[-1]), 0.0])
    return np.vstack([body[0] - [leg, 0.0, 0.0], body, body[-1] + leg * way])
