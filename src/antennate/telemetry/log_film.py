"""Films of what was not recorded for one: of a log, and of a twin while it serves.

Both are drawn afterwards, a log from what it tells of joints and coordinates. A twin shows what it
knows: readings, how far the head has come, true contact and torque.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim.world import World
from antennate.telemetry import film
from antennate.telemetry.film import MOST_PICTURES, Film, WalkRecorder
from antennate.telemetry.reader import LogReader
from antennate.telemetry.strip import Band
from antennate.telemetry.topics import COORDINATES
from antennate.telemetry.view.player import LogScene
from antennate.twin.config import Passage, TwinConfig
from antennate.twin.robot import TwinRobot

_LONGEST = 0.1
"""Longest time between two ticks that is shown [s]: a twin that stands between two drives, and a
part of a log that is lost, are left out."""


def film_of(log: LogReader, arena: World | None, title: str) -> Film:
    """What a log shows, up to as many pictures as a film may have.

    Where the robot is on the floor is in logs of simulations alone; that of a robot stays in the
    middle.

    Args:
        log: The log; it is read.
        arena: The world in which it was simulated, None for a bare floor.
        title: What is shown, in a few words.

    Raises:
        LogError: It has no ticks.
    """
    robot, threshold = log.header.robot, log.header.params.rule.threshold
    recorder, scene, placed = WalkRecorder(robot), LogScene(log.header, None), False
    t, before = 0.0, -math.inf
    for records, tick in log.groups():
        if tick is None:
            continue
        for record in records:
            if record.topic is COORDINATES:
                state = COORDINATES.decode(record.data)
                if not placed:  # what was drawn before has another world
                    scene, placed = LogScene(log.header, arena, len(state["position"])), True
                    recorder, t, before = WalkRecorder(robot), 0.0, -math.inf
                scene.take(tick.now, state["position"], state["robot"])
        t += min(max(0.0, tick.now - before), _LONGEST) if math.isfinite(before) else 0.0
        before = tick.now
        while recorder.due(t) and len(recorder) < MOST_PICTURES:
            if placed:
                scene.place(tick.now)
            else:
                scene.place_joints(tick)
            recorder.see(
                scene.world,
                t,
                counts=tick.reading,
                level=tick.level,
                contact=tick.contact,
                maneuver=tick.maneuver,
            )
        if len(recorder) >= MOST_PICTURES:
            break
    log.require_ticks()
    return recorder.decided(title, threshold)


_TOUCHES = {0: ("free", "#DDDDDD"), 1: ("touches", "#222222")}
_TORQUES = {0: ("off", "#DDDDDD"), 1: ("on", "#999999")}


class TwinFilm:
    """The film of a twin, from the first torque on; it is drawn when all is over.

    Args:
        robot: The twin.
        passage: How far it has come.
        config: What is served.
    """

    def __init__(self, robot: TwinRobot, passage: Passage, config: TwinConfig) -> None:
        self._robot, self._passage, self._config = robot, passage, config
        self._recorder, self._ticks = WalkRecorder(config.robot), 0

    @property
    def full(self) -> bool:
        """Whether no more pictures are kept."""
        return len(self._recorder) >= MOST_PICTURES

    def take(self, world: World) -> None:
        """Offer a tick."""
        t = self._ticks * self._config.control.period
        self._ticks += 1
        if self.full or not self._recorder.due(t):
            return
        _, names, _, _ = world.obstacle_contacts()
        self._recorder.see(
            world,
            t,
            counts=self._robot.counts,
            progress=[self._passage.progress],
            touches=[any(name.startswith(side) for name in names) for side in ANTENNA_PREFIXES],
            torque=any(servo.torque for servo in self._robot.servos),
        )

    def film(self) -> Film | None:
        """The film, None if the physics never began."""
        recorder = self._recorder
        if not len(recorder):
            return None
        touches = recorder.values("touches").astype(np.int64)
        return recorder.walk(
            f"twin, trial {self._config.trial}",
            [film.trace("way of the head [m]", recorder.values("progress"))],
            [
                Band("torque", recorder.values("torque").astype(np.int64), _TORQUES),
                *(Band(side, touches[:, i], _TOUCHES) for i, side in enumerate(("left", "right"))),
            ],
        )
