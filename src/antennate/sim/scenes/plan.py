"""The plan of a passage: a corridor along a centre line, with rooms and blind arms.

Whatever runs along the walls, the walls themselves or the cylinders before them, is a line beside
the centre line at some distance. Rooms and arms are told by their free floor, that between the
linings; a line farther out is that much longer and wider there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from antennate.sim.scenes import geometry
from antennate.types import Floats

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
        return geometry.is_simple(np.concatenate([left, right[::-1]]))

    def _parts(self, distance: float, corner_radius: float) -> list[Floats]:
        """Points at the start, along the first piece, at the first corner, and so on to the end."""
        corners = geometry.offset_corners(self.centre, distance, corner_radius)
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
        """The same passage with a longer first and last piece."""
        centre = self.centre.copy()
        centre[0] -= behind * self._axes(0)[0]
        centre[-1] += ahead * self._axes(len(centre) - 2)[0]
        rooms = tuple(
            room if room.piece else replace(room, start=room.start + behind, end=room.end + behind)
            for room in self.rooms
        )
        return replace(self, centre=centre, rooms=rooms)
