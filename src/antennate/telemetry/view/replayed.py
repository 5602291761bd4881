"""A log on a page while a controller decides upon it again, with numbers that can be changed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from antennate.hardware.safety.controller import Decision
from antennate.params.control import ControlParams
from antennate.sim.world import World
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import recorded_controller
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.channel import Channel
from antennate.telemetry.view.player import LogPlayer
from antennate.telemetry.view.tuning import Tuning
from antennate.types import Controller

_UNKNOWN = (math.nan, math.nan)


class ReplayPlayer(LogPlayer):
    """Shows the ticks of a log with what is decided now.

    Args:
        channel: To the process that shows it.
        header: The header of the log.
        title: What is shown, in a few words.
        speed: Times real time at which it begins; 0 is as fast as it goes.
        arena: The world in which it was simulated, None for a bare floor.
        name: The controller that decides, None for the recorded one.

    Raises:
        LogError: It is code outside this package, and only the log names it.
        ConfigError: There is none of that name.

    Attributes:
        controller: What decides.
    """

    def __init__(
        self,
        channel: Channel,
        header: Header,
        title: str,
        speed: float,
        arena: World | None,
        name: str | None,
    ) -> None:
        def make(control: ControlParams) -> Controller:
            return recorded_controller(header.model_copy(update={"params": control}), name)

        self._now = 0.0
        tuning = Tuning(name or header.controller, header.params, make)
        self.controller = tuning.controller
        super().__init__(channel, header, title, speed, arena, tuning)

    def ticks(self, log: LogReader) -> Iterator[Tick]:
        """The ticks of a log; what it tells of the scene is kept for the page."""
        for records, tick in log.groups():
            if tick is not None:
                self.keep(tick, records)
                yield tick

    def decided(self, tick: Tick, decision: Decision) -> None:
        """Show a tick with what was decided upon it now.

        Raises:
            Restart: A person wants it from the beginning.
        """
        self._now = tick.now
        level: Any = np.asarray(self.controller.level, float).ravel().tolist()
        self.show(
            dataclasses.replace(
                tick,
                maneuver=decision.maneuver,
                contact=decision.contact,
                level=tuple(level) if len(level) == len(_UNKNOWN) else _UNKNOWN,
            )
        )

    def note(self, what: str) -> None:
        """Keep what was changed by hand, and say so."""
        self.by_hand.append(f"{self._now:.2f} s: {what}")
        super().note(what)
