"""The program's side of a view: when a picture is due, how fast time goes, what a person wants."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable, Mapping
from typing import Any

from antennate.control.loop import Retunable
from antennate.control.registry import unread
from antennate.errors import ConfigError
from antennate.messages import one_line
from antennate.params.base import Params, from_values
from antennate.params.control import ControlParams
from antennate.telemetry.view.channel import ORDER, STATE, TEXT, Channel, read
from antennate.types import Controller

_PLACES = ("rule.threshold", "conditioning.averaging_time", "rule.hold_time")
_TURNS = ("gait.turn_offset", "escape.turn_offset")
"""Yaw offset of turns: the first of these that is read."""


class Tuning:
    """A controller and its numbers.

    Args:
        name: Name of the controller, as `make_controller` takes it.
        control: Its numbers at first.
        make: Makes it of such numbers.

    Attributes:
        controller: It.
    """

    def __init__(
        self, name: str, control: ControlParams, make: Callable[[ControlParams], Controller]
    ) -> None:
        self.controller = Retunable(make, control)
        read = [place for place in _PLACES + _TURNS if place not in unread(name, control)]
        self._places: dict[str, tuple[str, str]] = {}
        for group, _, field in (place.partition(".") for place in read):
            self._places.setdefault(field, (group, field))

    @property
    def values(self) -> dict[str, float]:
        """The numbers in force, by their names on the page."""
        control = self.controller.control
        return {
            name: getattr(getattr(control, group), field)
            for name, (group, field) in self._places.items()
        }

    def set(self, name: str, value: Any) -> str:
        """Change one of them; what was changed, empty if there is none of that name."""
        if name not in self._places:
            return ""
        group, field = self._places[name]
        control = self.controller.control
        old: Params = getattr(control, group)
        made: Any = from_values(type(old), old.model_dump() | {field: value})
        self.controller.retune(control.model_copy(update={group: made}))
        return f"control.{group}.{field} = {getattr(made, field):g}"


RATE = 60.0
"""Pictures a second."""
_LOOK = 0.05
"""Longest wait of a program that is paused before it looks again [s]."""
_LATE = 0.2
"""A program that is later than this does not catch up [s]."""


class Pace:
    """Lets a simulation or a log run at a speed, stand and step, as the page wants it.

    If the page is gone it runs on without one, as fast as it goes.

    Args:
        channel: To the process that shows it.
        speed: Times real time at which it begins; 0 is as fast as it goes.
        tuning: The controller whose numbers the page may change, None without one.

    Attributes:
        state: What the page shows of the controls.
        by_hand: What was changed by hand, in order.
    """

    def __init__(self, channel: Channel, speed: float, tuning: Tuning | None = None) -> None:
        self.channel, self.tuning = channel, tuning
        values = {} if tuning is None else tuning.values
        self.state: dict[str, Any] = {"speed": speed, "paused": False, "values": values}
        self.by_hand: list[str] = []
        self._steps = 0
        self._next = -math.inf
        self._begin: tuple[float, float] | None = None

    def tell(self) -> None:
        """Show the state of the controls."""
        self.channel.tell(STATE, **self.state)

    def say(self, text: str) -> None:
        """Show a line."""
        self.channel.send(TEXT, text.encode())

    @property
    def idle(self) -> bool:
        """Whether it runs at full speed and no picture is due, so that there is nothing to do."""
        if time.monotonic() >= self._next:
            return False
        return not (self.state["speed"] or self.state["paused"])

    def due(self) -> bool:
        """Whether a picture is due; if so, orders have been taken."""
        now = time.monotonic()
        if now < self._next:
            return False
        self._next = now + 1.0 / RATE
        self.look()
        return True

    def wait(self, t: float) -> None:
        """Return when time t [s] of the program has come."""
        while self.state["paused"] and not self._steps and not self.channel.closed:
            select.select((self.channel,), (), (), _LOOK)
            self.look()
            self.redraw()
            self._begin = None
        if self._steps:
            self._steps -= 1
            self._next = -math.inf  # a step is shown at once
        speed = self.state["speed"]
        if not speed or self.channel.closed:
            self._begin = None
            return
        now = time.monotonic()
        if self._begin is None or t < self._begin[1]:
            self._begin = now, t
        due = self._begin[0] + (t - self._begin[1]) / speed
        if now > due + _LATE:
            self._begin = None
        while (left := due - time.monotonic()) > 0 and not self.channel.closed:
            time.sleep(min(left, _LOOK))
            self.look()
            if self.state["paused"] or self.state["speed"] != speed:
                self._begin = None
                return

    def redraw(self) -> None:
        """Show again what may have been changed while it stands."""

    def look(self) -> None:
        """Carry out what the page wants."""
        for kind, content in self.channel.receive():
            if kind == ORDER:
                self.carry_out(read(content))

    def carry_out(self, order: Mapping[str, Any]) -> None:
        """Carry out one order; one that cannot be is left alone."""
        what, value = order.get("do"), order.get("value")
        if what == "pause":
            self.state["paused"] = bool(order.get("on"))
            self.tell()
        elif what == "step":
            self.state["paused"] = True
            self._steps += 1
            self.tell()
        elif what == "speed" and isinstance(value, float | int) and 0 <= value <= 100:
            self.state["speed"] = float(value)
            self._begin = None
        elif what == "set" and self.tuning is not None:
            try:
                if done := self.tuning.set(str(order.get("name")), value):
                    self.note(done)
            except ConfigError as error:
                self.say(one_line(str(error)))
            self.state["values"] = self.tuning.values
            self.tell()

    def note(self, what: str) -> None:
        """Say what was changed by hand."""
        self.say(f"by hand: {what}")
