"""A distribution of corridors, wide and narrow, with corners, rooms and blind arms."""

from __future__ import annotations

import math

import numpy as np

from antennate.errors import SceneError
from antennate.params.scene import CorridorsParams, CylinderParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.geometry import Arm, Room
from antennate.sim.scenes.scene import LEFT_BEHIND
from antennate.sim.scenes.tunnel import Tunnel, build_along, plan_of

_APART = 0.05
"""Distance from walls to walls of other pieces beyond their thickness, either side [m]."""
_AHEAD = 0.4
"""What is free behind the exit [m]: head and antennae are out before they meet anything."""
_DOOR = 0.4
"""Least distance of a room from the ends of its piece [m]: its walls begin behind its lining."""
_TRIES = 1000
"""Layouts drawn for one width, mass and number of pieces."""


class CorridorsScene:
    """Draws corridors.

    How many pieces a draw has, how wide it is, how heavy its cylinders are and whether it has a
    room or an arm is drawn first, and stays. Lengths, turns and places are then drawn until the
    passage does not run into itself, behind the entrance and the exit neither.

    Args:
        params: Ranges to draw from.
    """

    random = True

    def __init__(self, params: CorridorsParams | None = None) -> None:
        self._params = params or CorridorsParams()

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Tunnel:
        """Draw one corridor."""
        params = self._params
        if params.free_width[0] < robot.width:
            raise SceneError(
                f"corridors.free_width must be at least the robot's width of {robot.width} m, "
                f"found {params.free_width[0]} m"
            )
        pieces = int(rng.integers(params.pieces[0], params.pieces[1] + 1))
        width = rng.uniform(*params.free_width)
        mass = math.exp(rng.uniform(*np.log(params.mass)))
        strewn = rng.uniform(*params.strewn)
        feature = rng.random()
        room = feature < params.room_share
        arm = not room and pieces > 1 and feature < params.room_share + params.arm_share
        for _ in range(_TRIES):
            lengths, turns = self._course(pieces, rng)
            plan = TunnelParams(
                segments=lengths,
                turns_deg=turns,
                mirror="never",
                free_width=width,
                strewn=round(strewn * sum(lengths)),
                cylinder=CylinderParams(mass=mass),
            )
            drawn = self._drawn(plan, room, arm, robot, rng)
            if drawn is not None:
                return drawn
        raise SceneError(
            f"corridors: expected a passage that does not run into itself, found none in {_TRIES} "
            f"draws of {pieces} pieces {width:.2f} m wide; shorten the range of pieces or of "
            "free_width, or lengthen that of length"
        )

    def _course(
        self, pieces: int, rng: np.random.Generator
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Lengths of the pieces [m] and the turns between them [deg]."""
        params = self._params
        lengths = rng.uniform(*params.length, pieces)
        turns = rng.uniform(-params.largest_turn, params.largest_turn, pieces - 1)
        turns[rng.random(pieces - 1) < params.straight_share] = 0.0
        return tuple(lengths.tolist()), tuple(turns.tolist())

    def _drawn(
        self,
        params: TunnelParams,
        room: bool,
        arm: bool,
        robot: RobotSpec,
        rng: np.random.Generator,
    ) -> Tunnel | None:
        """A passage of this course; None if it runs into itself, or has no room for the rest."""
        rooms = self._rooms(params, rng) if room else ()
        arms = self._arms(params, rng) if arm else ()
        if (room and not rooms) or (arm and not arms):
            return None
        plan = plan_of(params, rooms, arms)
        if not plan.is_sound(params.wall_distance + _APART, LEFT_BEHIND, _AHEAD):
            return None
        try:
            limit = round(self._params.pace * params.length, 1)
            return build_along(plan, params, robot, rng, time_limit=limit)
        except SceneError:  # what is strewn finds no room
            return None

    def _rooms(self, params: TunnelParams, rng: np.random.Generator) -> tuple[Room, ...]:
        """A room on one of the pieces, none if that is too short."""
        piece = int(rng.integers(len(params.segments)))
        length = rng.uniform(*self._params.room_length)
        width = rng.uniform(*self._params.room_width)
        spare = params.segments[piece] - length - 2 * _DOOR
        if spare < 0.0:
            return ()
        start = _DOOR + rng.uniform(0.0, spare)
        return (Room(piece, start, start + length, width),)

    def _arms(self, params: TunnelParams, rng: np.random.Generator) -> tuple[Arm, ...]:
        """A blind arm at one of the sharp turns, none if there is none."""
        sharp = [i for i, turn in enumerate(params.turns_deg) if abs(turn) >= self._params.arm_turn]
        if not sharp:
            return ()
        depth = rng.uniform(*self._params.arm_depth)
        return (Arm(int(rng.choice(sharp)), params.free_width / 2 + depth),)


SCENES = {"corridors": CorridorsScene}
"""Scenes of this module by name."""
