"""Logs of trials that run in lockstep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from antennate.control.loop import CheckedController
from antennate.control.readings import condition
from antennate.sim.world import World
from antennate.telemetry.header import Header, log_name
from antennate.types import AntennaFrame, JointCommand

if TYPE_CHECKING:
    from antennate.telemetry.simulated import Decisions, SimulatedLog


class Logs:
    """Logs of the trials that run at once, a file each; without a folder there are none.

    Args:
        folder: Where they are written; None for no logs.
        batch: Trials at once.

    Attributes:
        folder: As given.
    """

    def __init__(self, folder: Path | None, batch: int) -> None:
        self.folder, self._batch = folder, batch
        self._decisions: Decisions | None = None
        self._running: dict[int, SimulatedLog] = {}

    def begin(self, row: int, world: object, header: Header, control: CheckedController) -> None:
        """Begin the log of the trial in a row; there is none of a robot on a device.

        Args:
            row: The row.
            world: Its robot.
            header: What the log begins with.
            control: Decides for all rows.
        """
        if self.folder is None or not isinstance(world, World):
            return
        from antennate.telemetry.simulated import Decisions, SimulatedLog  # not without logs

        if self._decisions is None:
            self._decisions = Decisions(header.robot, control, self._batch)
        name = condition(header.controller, header.readings)
        path = self.folder / log_name(f"{name}-{header.trial}")
        path.unlink(missing_ok=True)  # what a killed worker left of it
        self._running[row] = SimulatedLog(path, header, world, self._decisions, row)

    def take(self, frame: AntennaFrame, command: JointCommand) -> None:
        """Keep a tick of every trial."""
        if self._running and self._decisions is not None:
            decided = self._decisions.take(frame, command)
            for log in self._running.values():
                log.take(decided)

    def event(self, text: str) -> None:
        """Keep what happened in every log."""
        for log in self._running.values():
            log.event(text)

    def close(self, row: int) -> None:
        """End the log of a row, if there is one."""
        if (log := self._running.pop(row, None)) is not None:
            log.close()

    def drop(self) -> None:
        """Remove the logs of trials that are given up."""
        for log in self._running.values():
            log.close()
            log.path.unlink(missing_ok=True)
        self._running.clear()
