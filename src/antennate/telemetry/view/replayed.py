"""A log on a page while a controller decides upon it again, with numbers that can be changed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from antennate.errors import ConfigError
from antennate.hardware.driving.decision import Decision
from antennate.messages import one_line
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
        by_hand: What was changed by hand, in order.
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

        self._tuning = Tuning(name or header.controller, header.params, make)
        self.by_hand: list[str] = []
        self._now = 0.0
        super().__init__(channel, header, title, speed, arena)

    @property
    def controller(self) -> Controller:
        """What decides."""
        return self._tuning.controller

    def begin(self) -> None:
        """From the beginning."""
        self.state["values"] = self._tuning.values
        super().begin()

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

    def carry_out(self, order: Mapping[str, Any]) -> None:
        """Carry out one order; one that cannot be is left alone, and the page says so.

        Raises:
            Restart: A person wants it from the beginning.
        """
        super().carry_out(order)
        if order.get("do") != "set":
            return
        try:
            if done := self._tuning.set(str(order.get("name")), order.get("value")):
                self.by_hand.append(f"{self._now:.2f} s: {done}")
                self.say(f"by hand: {done}")
        except ConfigError as error:
            self.say(one_line(str(error)))
        self.state["values"] = self._tuning.values
        self.tell()
