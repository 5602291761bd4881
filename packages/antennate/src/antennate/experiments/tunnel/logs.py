"""Logs of trials that run in lockstep."""

from __future__ import annotations

from pathlib import Path

from antennate.control.loop import CheckedController
from antennate.control.readings import condition
from antennate.sim.world import World
from antennate.telemetry.header import Header, log_name
from antennate.telemetry.simulated import Decisions, SimulatedLog
from antennate.types import AntennaFrame, JointCommand


class Logs:
    """Logs of the trials that run at once, a file each.

    Args:
        folder: Where they are written.
        batch: Trials at once.
    """

    def __init__(self, folder: Path, batch: int) -> None:
        self._folder, self._batch = folder, batch
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
        if not isinstance(world, World):
            return
        if self._decisions is None:
            self._decisions = Decisions(header.robot, control, self._batch)
        name = condition(header.controller, header.readings)
        path = self._folder / log_name(f"{name}-{header.trial}")
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
