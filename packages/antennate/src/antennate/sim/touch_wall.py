"""Structured walls beside the bench, built of fixed bars and balls.

A wall lies in its own frame: it begins at x = 0, runs along +x, and its nearest plain surface is at
y = `near`. Faces at its ends stand up to `top`. Bars are laid behind the surface by their radius
along y, so that edges are rounded by it and steep faces stand forward by it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from antennate.errors import SceneError
from antennate.params.bench import TouchWallsParams
from antennate.sim.bench import Ball, Bar
from antennate.types import Floats

WallKind = Literal["flat", "sinusoidal", "boulders", "step", "gap", "corner"]
WALLS: tuple[WallKind, ...] = ("flat", "sinusoidal", "boulders", "step", "gap", "corner")

BAR_RADIUS = 0.002
"""Radius of the bars, and of every edge [m]."""
_SHORTEST = 0.02
"""Least plain surface between the ends of a wall [m]."""
_PARTS_PER_WAVE = 16


@dataclass(frozen=True, slots=True)
class Site:
    """Where a wall stands.

    Attributes:
        near: Distance of its surface from the traverse [m].
        clear: Distance out of reach of the straight antenna [m]: slanting ends begin there.
        top: Distance out of reach of the antenna however it points [m].
        length: Length of the wall [m].
        phase: Phase of what is periodic, in turns.
    """

    near: float
    clear: float
    top: float
    length: float
    phase: float


def outline(walls: TouchWallsParams, kind: WallKind, site: Site) -> list[Floats]:
    """Surface lines of a wall, each of shape (n, 2) [m]; for boulders, their centres."""
    if kind == "boulders":
        return [_boulders(walls, site)]
    if kind == "flat":
        return [_between(kind, site, walls.flat.entry_deg, [])]
    if kind == "sinusoidal":
        return [_wavy(walls, site)]
    if kind == "step":
        middle = site.length / 2
        back = site.near + walls.step.depth
        return [_between(kind, site, walls.step.entry_deg, [(middle, site.near), (middle, back)])]
    if kind == "gap":
        return _gapped(walls, site)
    return [_cornered(walls, site)]


def build(walls: TouchWallsParams, kind: WallKind, site: Site, x: float) -> list[Ball | Bar]:
    """The obstacles of a wall that begins at x [m]."""
    lines = outline(walls, kind, site)
    if kind == "boulders":
        radius = walls.boulders.radius
        return [Ball(x + float(cx), float(cy), radius) for cx, cy in lines[0]]
    bars: list[Ball | Bar] = []
    for line in lines:
        back = line + np.array([x, BAR_RADIUS])
        for (x0, y0), (x1, y1) in zip(back[:-1].tolist(), back[1:].tolist(), strict=True):
            if (x0, y0) != (x1, y1):
                bars.append(Bar(x0, y0, x1, y1, BAR_RADIUS))
    return bars


def _ramp(site: Site, distance: float, entry_deg: float) -> float:
    """Length of a slanting end from `clear` to a surface at `distance` [m]."""
    return max(0.0, site.clear - distance) / math.tan(math.radians(entry_deg))


def _between(kind: str, site: Site, entry_deg: float, middle: list[tuple[float, float]]) -> Floats:
    """A line with a face at both ends, through the points of `middle`."""
    last = middle[-1][1] if middle else site.near
    begin = _ramp(site, site.near, entry_deg)
    end = site.length - _ramp(site, last, entry_deg)
    bounds = [begin, *(x for x, _ in middle), end]
    if bounds[1] - begin < _SHORTEST or end - bounds[-2] < _SHORTEST:
        raise SceneError(
            f"wall.{kind}: expected at least {_SHORTEST:g} m of surface between its ends, found "
            f"{min(bounds[1] - begin, end - bounds[-2]):.3g} m; make the wall longer or its ends "
            "steeper"
        )
    inner = [(begin, site.near), *middle, (end, last)]
    return np.array(
        [
            (0.0, site.top),
            (0.0, max(site.clear, site.near)),
            *inner,
            (site.length, max(site.clear, last)),
            (site.length, max(site.top, last)),
        ]
    )


def _wavy(walls: TouchWallsParams, site: Site) -> Floats:
    wave = walls.sinusoidal
    plain = _between("sinusoidal", site, wave.entry_deg, [])
    begin, end = plain[2, 0], plain[3, 0]
    parts = max(2, math.ceil(_PARTS_PER_WAVE * (end - begin) / wave.wavelength))
    x = np.linspace(begin, end, parts + 1)
    turn = 2.0 * math.pi * (x / wave.wavelength + site.phase)
    y = site.near + wave.amplitude * np.sin(turn)
    return np.vstack([plain[:2], np.stack([x, y], axis=1), plain[4:]])


def _boulders(walls: TouchWallsParams, site: Site) -> Floats:
    row = walls.boulders
    count = 1 + math.floor((site.length - 2 * row.radius) / row.pitch)
    if count < 2:
        raise SceneError(
            f"wall.boulders: expected room for two spheres, found a pitch of {row.pitch:g} m and a "
            f"radius of {row.radius:g} m on {site.length:g} m"
        )
    x = row.radius + row.pitch * np.arange(count)
    return np.stack([x, np.full(count, site.near + row.radius)], axis=1)


def _gapped(walls: TouchWallsParams, site: Site) -> list[Floats]:
    gap = walls.gap
    side = (site.length - gap.width) / 2
    if side < _SHORTEST:
        raise SceneError(
            f"wall.gap.width: expected at most {site.length - 2 * _SHORTEST:g} m on a wall of "
            f"{site.length:g} m, found {gap.width:g} m"
        )
    half = Site(site.near, site.clear, site.top, side, site.phase)
    first = _between("gap", half, gap.entry_deg, [])
    return [first, first + np.array([side + gap.width, 0.0])]


def _cornered(walls: TouchWallsParams, site: Site) -> Floats:
    corner = walls.corner
    run = corner.rise / math.tan(math.radians(corner.turn_deg))
    begin, middle = _ramp(site, site.near, corner.entry_deg), site.length / 2
    if middle - begin < _SHORTEST or middle + run > site.length:
        raise SceneError(
            f"wall.corner: expected a rise of at most "
            f"{(site.length / 2) * math.tan(math.radians(corner.turn_deg)):.3g} m and "
            f"{_SHORTEST:g} m of surface before it on a wall of {site.length:g} m, "
            f"found a rise of {corner.rise:g} m"
        )
    return np.array(
        [
            (0.0, site.top),
            (0.0, site.clear),
            (begin, site.near),
            (middle, site.near),
            (middle + run, site.near - corner.rise),
            (middle + run, site.top),
        ]
    )


def intrusion(walls: TouchWallsParams, kind: WallKind) -> float:
    """How far a wall comes nearer than its plain surface [m]."""
    if kind == "sinusoidal":
        return walls.sinusoidal.amplitude
    return walls.corner.rise if kind == "corner" else 0.0
