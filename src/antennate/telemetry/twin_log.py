"""The log of a twin while it serves.

A twin knows its goals, its readings and its physics; what its client thinks of them it does not
know. So levels are NaN, contacts UNKNOWN and the maneuver is `UNKNOWN_MANEUVER`.
"""

from __future__ import annotations

import math

import numpy as np

from antennate.params.control import ControlParams
from antennate.sim.trial import TrialConfig
from antennate.sim.world import World
from antennate.telemetry.apart import LogProcess
from antennate.telemetry.header import TWIN, Header
from antennate.telemetry.simulated import Decisions, TickRows
from antennate.twin.config import TwinConfig
from antennate.twin.robot import TwinRobot
from antennate.types import AntennaFrame, Contact

UNKNOWN_MANEUVER = -1


class _Unknown:
    """Stands for a controller that is elsewhere."""

    level = np.full((1, 2), math.nan)
    contact = np.full((1, 2), int(Contact.UNKNOWN))
    maneuver = np.array([UNKNOWN_MANEUVER])


class TwinLog:
    """The log of a twin: its ticks while the physics runs.

    Args:
        log: Writes it.
        robot: The twin.
        config: What is served.
    """

    def __init__(self, log: LogProcess, robot: TwinRobot, config: TwinConfig) -> None:
        self._log, self._robot = log, robot
        self._decisions = Decisions(config.robot, _Unknown())
        self._rows = TickRows(robot.world, self._decisions)

    def take(self, world: World) -> None:
        """Keep a tick, its time that of the twin."""
        robot = self._robot
        frame = AntennaFrame(t=np.array([robot.t]), counts=robot.counts[None])
        decided = self._decisions.take(frame, robot.command)
        numbers, beside = self._rows.rows([self._rows.take(decided)])
        self._log.add(numbers[0], *beside.values())


def header_of(config: TwinConfig, start: int) -> Header:
    """The header of a twin's log; its time begins at `start` [ns], a Unix time."""
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
