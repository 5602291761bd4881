"""Film of a twin while it serves: readings, way of the head, true contact and torque."""

from __future__ import annotations

import numpy as np

from antennate.robots.spec import ANTENNA_PREFIXES
from antennate.sim.world import World
from antennate.telemetry import film
from antennate.telemetry.film import MOST_PICTURES, Film, WalkRecorder
from antennate.telemetry.strip import Band
from antennate.twin.config import Passage, TwinConfig
from antennate.twin.robot import TwinRobot

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
