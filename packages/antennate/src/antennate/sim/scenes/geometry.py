"""The plan of a passage, seen from above: a corridor along a centre line, rooms and blind arms.

The centre line starts at the origin along +x. Walls are the centre line moved sideways, mitred at
the turns; at a turn the outer wall may be rounded. Whatever runs along the walls, the walls
themselves or the cylinders before them, is a line beside the centre line at some distance. Rooms
and arms are told by their free floor, that between the linings; a line farther out is that much
longer and wider there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from antennate.params.scene import TunnelParams
from antennate.types import Floats


def centre_line(params: TunnelParams) -> Floats:
    """Corner points of the centre line [m], shape (segments + 1, 2)."""
    heading = 0.0
    points = [np.zeros(2)]
    for length, turn in zip(params.segments, (*params.turns_deg, 0.0), strict=True):
        points.append(points[-1] + length * np.array([math.cos(heading), math.sin(heading)]))
        heading += math.radians(turn)
    return np.array(points)


def offset_corners(points: Floats, distance: float, corner_radius: float = 0.0) -> list[Floats]:
    """The polyline moved sideways by `distance` [m], positive to the left; of each corner (k, 2).

    Corners are mitred; where the moved line is the outer one it is rounded by `corner_radius` [m].
    """
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    moved: list[list[Floats]] = [[points[0] + distance * normal[0]]]
    for i in range(1, len(points) - 1):
        before, after = normal[i - 1], normal[i]
        mitre = points[i] + distance * (before + after) / (1.0 + before @ after)
        into, out = along[i - 1], along[i]
        turn = math.atan2(into[0] * out[1] - into[1] * out[0], into @ out)
        if turn * distance < 0 and corner_radius > 0:
            moved.append(_fillet(mitre, into, out, turn, corner_radius))
        else:
            moved.append([mitre])
    moved.append([points[-1] + distance * normal[-1]])
    return [np.array(corner) for corner in moved]


def _fillet(corner: Floats, into: Floats, out: Floats, turn: float, radius: float) -> list[Floats]:
    """Points of an arc of `radius` that touches both lines at a corner."""
    back = radius * math.tan(abs(turn) / 2)
    start = corner - back * into
    side = math.copysign(1.0, turn) * np.array([-into[1], into[0]])
    centre = start + radius * side
    angles = np.linspace(0.0, turn, max(3, math.ceil(abs(turn) / 0.2) + 1))
    spoke = start - centre
    cos, sin = np.cos(angles), np.sin(angles)
    return [
        centre + np.array([c * spoke[0] - s * spoke[1], s * spoke[0] + c * spoke[1]])
        for c, s in zip(cos, sin, strict=True)
    ]


def resample(points: Floats, spacing: Floats) -> Floats:
    """Points at growing arc lengths `spacing` [m] along a polyline, up to its end, shape (n, 2)."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(step)])
    spacing = spacing[spacing <= arc[-1]]
    return np.stack([np.interp(spacing, arc, points[:, k]) for k in range(2)], axis=1)


def progress(points: Floats, where: Floats) -> float:
    """Arc length of the centre line's nearest point [m]; past its ends it goes on straight.

    What lies past an end is as far away as that end: the line itself ends there.
    """
    x, y = where.tolist()
    corners = points.tolist()
    best, best_distance, done = 0.0, math.inf, 0.0
    last = len(corners) - 2
    for i in range(last + 1):
        (x0, y0), (x1, y1) = corners[i], corners[i + 1]
        dx, dy = x1 - x0, y1 - y0
        length = math.hypot(dx, dy)
        s = ((x - x0) * dx + (y - y0) * dy) / length
        part = min(max(s / length, 0.0), 1.0)
        if i > 0:
            s = max(s, 0.0)
        if i < last:
            s = min(s, length)
        distance = math.hypot(x - x0 - dx * part, y - y0 - dy * part)
        if distance < best_distance:
            best, best_distance = done + s, distance
        done += length
    return best


def crossing(line: Floats, before: Floats, after: Floats) -> int:
    """Whether a step crosses a line between its ends.

    Args:
        line: The left and the right end, as seen by who goes out over it, shape (2, 2).
        before: Where the step begins, shape (2,).
        after: Where it ends, likewise.

    Returns:
        1 outwards, -1 inwards, 0 not between the ends. Who stands on the line is outside.
    """
    (x0, y0), (dx, dy) = line[0].tolist(), (line[1] - line[0]).tolist()
    sides, along = [], []
    for x, y in (before.tolist(), after.tolist()):
        sides.append(dx * (y - y0) - dy * (x - x0))
        along.append(dx * (x - x0) + dy * (y - y0))
    out = (sides[1] >= 0.0) - (sides[0] >= 0.0)
    if not out:
        return 0
    part = sides[0] / (sides[0] - sides[1])
    at = along[0] + part * (along[1] - along[0])
    return out if 0.0 <= at <= dx**2 + dy**2 else 0


def is_simple(polygon: Floats) -> bool:
    """Whether no two sides of a closed polygon of corners (n, 2) meet but neighbours."""
    ends = np.roll(polygon, -1, axis=0)
    count = len(polygon)
    first, second = np.triu_indices(count, 2)
    apart = (first + count - second) % count > 1  # the last side is a neighbour of the first
    first, second = first[apart], second[apart]

    def side(a: Floats, b: Floats, c: Floats) -> Floats:
        return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]

    a, b, c, d = polygon[first], ends[first], polygon[second], ends[second]
    across = (side(a, b, c) * side(a, b, d) <= 0.0) & (side(c, d, a) * side(c, d, b) <= 0.0)
    near = np.minimum(a, b) <= np.maximum(c, d)  # or else they may be parts of one line
    near &= np.minimum(c, d) <= np.maximum(a, b)
    return not (across & near.all(axis=1)).any()


def distance(points: Floats, where: Floats) -> float:
    """Distance of a point from a polyline (n, 2), its ends included [m]."""
    along = np.diff(points, axis=0)
    from_start = where - points[:-1]
    part = np.clip((from_start * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(from_start - part[:, None] * along).T).min())


def contains(polygon: Floats, where: Floats) -> bool:
    """Whether a point lies inside a closed polygon of corners (n, 2), by counting crossings."""
    x, y = where.tolist()
    corners = polygon.tolist()
    inside = False
    x0, y0 = corners[-1]
    for x1, y1 in corners:
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            inside = not inside
        x0, y0 = x1, y1
    return inside


_SHORTEST = 0.02
"""Shortest piece of a line between two corners [m]; below it, it turns back on itself."""


@dataclass(frozen=True, slots=True)
class Room:
    """A room on a straight piece, as wide to the left as to the right.

    Attributes:
        piece: Number of the piece.
        start: Where it begins, from the beginning of the piece [m]; `end` likewise.
        width: Its width [m].
        gap: Width of a bare opening in its far wall, by which the last piece leaves it [m]; None
            for one as wide as the corridor, and lined like it.
    """

    piece: int
    start: float
    end: float
    width: float
    gap: float | None = None


@dataclass(frozen=True, slots=True)
class Arm:
    """A blind arm: it goes straight on where the way turns.

    Attributes:
        turn: Number of the turn, not of 0 deg.
        end: How far it goes past the corner of the centre line [m].
    """

    turn: int
    end: float


@dataclass(frozen=True, slots=True)
class Plan:
    """A passage, seen from above.

    Attributes:
        centre: Corner points of the centre line [m], shape (n, 2).
        width: Free width of the corridor [m].
        rooms: Its rooms, at most one a piece.
        arms: Its blind arms, at most one a turn.
        lining: How far the walls stand behind the free floor [m].
    """

    centre: Floats
    width: float
    rooms: tuple[Room, ...] = ()
    arms: tuple[Arm, ...] = ()
    lining: float = 0.0

    def line(self, distance: float, corner_radius: float = 0.0) -> Floats:
        """The line beside the centre line at `distance` [m], positive to the left, shape (n, 2).

        Args:
            distance: From the centre line, where there is no room.
            corner_radius: Rounding of the outer side of turns [m].
        """
        return np.concatenate(self._parts(distance, corner_radius))

    def is_sound(self, distance: float, behind: float, ahead: float) -> bool:
        """Whether the lines at `distance` to both sides [m] do not touch one another.

        Args:
            distance: From the centre line.
            behind: Room that is needed behind the entrance, too [m].
            ahead: The same past the exit.
        """
        plan = self._longer(behind, ahead)
        sides = [plan._parts(side * distance, 0.0) for side in (1.0, -1.0)]
        along = np.diff(plan.centre, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        for parts in sides:
            for i, ahead_of in enumerate(along):
                corners = [parts[2 * i][-1], *parts[2 * i + 1], parts[2 * i + 2][0]]
                steps = np.diff(np.array(corners), axis=0)
                forward = steps @ ahead_of
                if (np.hypot(*steps.T) < _SHORTEST).any() or (forward < -1e-9).any():
                    return False
            for arm in self.arms:
                end = parts[2 * arm.turn + 2]
                if len(end) > 1 and (end[1] - end[2]) @ along[arm.turn] < _SHORTEST:
                    return False
        left, right = map(np.concatenate, sides)
        return is_simple(np.concatenate([left, right[::-1]]))

    def _parts(self, distance: float, corner_radius: float) -> list[Floats]:
        """Points at the start, along the first piece, at the first corner, and so on to the end."""
        corners = offset_corners(self.centre, distance, corner_radius)
        for arm in self.arms:
            if distance * self._turn(arm.turn) < 0:
                corners[arm.turn + 1] = self._arm(arm, distance)
        bumps: list[Floats] = [np.zeros((0, 2))] * (len(self.centre) - 1)
        for room in self.rooms:
            bumps[room.piece] = bump = self._room(room, distance)
            if room.gap is not None:
                normal = self._axes(room.piece)[1]
                side = (bump[-1] - self.centre[room.piece]) @ normal
                end = (self.centre[-1] + side * normal)[None]
                is_wall = abs(distance) >= self.width / 2 + self.lining
                corners[-1] = end if is_wall else end[:0]  # no lining through the opening
        parts = [corners[0]]
        for bump, corner in zip(bumps, corners[1:], strict=True):
            parts += [bump, corner]
        return parts

    def _room(self, room: Room, distance: float) -> Floats:
        along, normal = self._axes(room.piece)
        beyond = abs(distance) - self.width / 2
        out, gap = room.width / 2 + beyond, abs(distance)
        if room.gap is not None:
            gap = room.gap / 2 + max(0.0, self.lining - beyond)
        places = [
            (room.start - beyond, abs(distance)),
            (room.start - beyond, out),
            (room.end + beyond, out),
            (room.end + beyond, gap),
        ]
        side = math.copysign(1.0, distance)
        return np.array(
            [self.centre[room.piece] + s * along + side * d * normal for s, d in places]
        )

    def _arm(self, arm: Arm, distance: float) -> Floats:
        """The outer line goes on to the end of the arm, and comes back to the next piece."""
        corner, turn = self.centre[arm.turn + 1], self._turn(arm.turn)
        along, normal = self._axes(arm.turn)
        then, then_normal = self._axes(arm.turn + 1)
        end = corner + (arm.end + abs(distance) - self.width / 2) * along
        back = corner + distance * then_normal
        back = back - distance * (1.0 + math.cos(turn)) / math.sin(turn) * then
        return np.array([end + distance * normal, end - distance * normal, back])

    def _axes(self, piece: int) -> tuple[Floats, Floats]:
        """Unit vectors along a piece and to its left."""
        along = self.centre[piece + 1] - self.centre[piece]
        along = along / np.hypot(*along)
        return along, np.array([-along[1], along[0]])

    def _turn(self, turn: int) -> float:
        """Angle of a turn [rad], positive to the left."""
        (x0, y0), (x1, y1) = (self._axes(turn + i)[0].tolist() for i in range(2))
        return math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)

    def _longer(self, behind: float, ahead: float) -> Plan:
        """The passage with a longer first and last piece."""
        centre = self.centre.copy()
        centre[0] -= behind * self._axes(0)[0]
        centre[-1] += ahead * self._axes(len(centre) - 2)[0]
        rooms = tuple(
            room if room.piece else replace(room, start=room.start + behind, end=room.end + behind)
            for room in self.rooms
        )
        return replace(self, centre=centre, rooms=rooms)
