"""The log of a twin while it serves.

A twin knows its goals, its readings and its physics; what its client thinks of them it does not
know. So levels are NaN, contacts UNKNOWN and the maneuver is `UNKNOWN_MANEUVER`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from antennate.params.control import ControlParams
from antennate.sim.trial import TrialConfig
from antennate.sim.world import World
from antennate.telemetry.header import TWIN, Header
from antennate.telemetry.log_queue import LogQueue
from antennate.telemetry.rows import RowLog
from antennate.telemetry.simulated import Decisions, TakenTick, TickRows
from antennate.twin.config import TwinConfig
from antennate.twin.robot import TwinRobot
from antennate.types import AntennaFrame, Contact

UNKNOWN_MANEUVER = -1


class _Unknown:
    """Stands for a controller that is elsewhere."""

    level = np.full((1, 2), math.nan)
    contact = np.full((1, 2), int(Contact.UNKNOWN))
    maneuver = np.array([UNKNOWN_MANEUVER])


class TwinLog(LogQueue[TakenTick]):
    """The log of a twin: its ticks while the physics runs.

    Args:
        path: A file that does not exist yet.
        robot: The twin.
        config: What is served.
        start: Time of its beginning [ns], a Unix time.
        on_failure: As for `LogQueue`.

    Raises:
        LogError: The file exists or cannot be written, or the disk is nearly full.
    """

    def __init__(
        self,
        path: Path,
        robot: TwinRobot,
        config: TwinConfig,
        start: int,
        on_failure: Callable[[str], None],
    ) -> None:
        self._robot, self._decisions = robot, Decisions(config.robot, _Unknown())
        self._rows = TickRows(robot.world, self._decisions)
        super().__init__(RowLog(path, _header(config, start), self._rows.rows), on_failure)

    def take(self, world: World) -> None:
        """Keep a tick, its time that of the twin."""
        robot = self._robot
        frame = AntennaFrame(t=np.array([robot.t]), counts=robot.counts[None])
        self.add(self._rows.take(self._decisions.take(frame, robot.command)))


def _header(config: TwinConfig, start: int) -> Header:
    fields = set(TrialConfig.model_fields) - {"robot"}
    return Header(
        controller=TWIN,
        params=ControlParams(rate=config.control.rate, gait=config.control.gait),
        robot=config.robot,
        seed=config.seed,
        trial=config.trial,
        start=start,
        arena=config.model_dump(mode="json", include=fields),
    )
