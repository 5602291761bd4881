"""A simulation that is watched, and changed by hand.

What is changed by hand is told to the log and to the result, as the run does not follow from its
configuration any more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from antennate.control.registry import make_controller
from antennate.figures import SERIES, rgba
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.frames import LinkFrames
from antennate.sim.shapes import VisibleModel, snapshot
from antennate.telemetry import Restart
from antennate.telemetry.ticks import Tick, felt, numbers_of
from antennate.telemetry.view.channel import LINKS, PLACES, SCENE, SNAPSHOT, TICK, Channel
from antennate.telemetry.view.pace import Pace, Tuning
from antennate.types import AntennaFrame, Contact, Controller

_SIDES = (rgba(SERIES[0]), rgba(SERIES[1]))
_FARTHEST = 50.0
"""Farthest from the origin that an obstacle is put [m]; a world beyond 100 m is unsound."""
_NOT_A_NUMBER = (math.nan, math.nan)
_LINKS = ("joints", "names", "parents")
NONE = -1
"""Stands for a maneuver where there is none."""


class SimulationView(Pace):
    """Shows one trial after the other.

    Args:
        channel: To the process that shows it.
        speed: Times real time at which it begins; 0 is as fast as it goes.
        steered: Whether the page has controls; without them it changes nothing.
        paused: Whether it stands at first.
        every: Whether each tick is sent in real time, with joints and links of the robot.

    Attributes:
        results: The folder that is to hold the results, empty if there is none.
    """

    def __init__(
        self,
        channel: Channel,
        speed: float = 1.0,
        steered: bool = True,
        paused: bool = False,
        every: bool = False,
    ) -> None:
        super().__init__(channel, speed)
        self.state["paused"] = paused
        self._steered = steered
        if not steered:
            self.state = {"speed": None, "paused": False}
        self.results = ""
        self._fresh: list[str] = []
        self._seen: Any = None
        self._model: VisibleModel | None = None
        self._every = every
        self._frames: LinkFrames | None = None
        self._data: Any = None
        self._title, self._number = "", 0
        self._last: tuple[AntennaFrame | None, Controller | None, int] = (None, None, NONE)

    def begin(self, title: str, seed: int | None = None) -> None:
        """A trial begins; `seed` is the one that it has, None where there is no chance."""
        self._title, self._number, self._seen = title, 0, None
        self.tuning = None
        self.state |= {"title": title, "values": {}, "results": self.results}
        self.state.pop("seed", None)
        if seed is not None:
            self.state["seed"] = seed

    def controller(
        self, name: str, control: ControlParams, robot: RobotSpec, batch: int = 1
    ) -> Controller:
        """A controller of that name whose numbers the page can change."""

        def make(values: ControlParams) -> Controller:
            return make_controller(name, values, robot, batch)

        self.tuning = Tuning(name, control, make)
        self.state["values"] = self.tuning.values
        return self.tuning.controller

    def tick(
        self,
        model: Any,
        data: Any,
        frame: AntennaFrame | None = None,
        controller: Controller | None = None,
        maneuver: int = NONE,
    ) -> Sequence[str]:
        """Show a tick if a picture is due, and wait until its time has come.

        Args:
            model: The compiled model, of mujoco.
            data: Its state.
            frame: What was read, None without antennae.
            controller: What decided, None without one.
            maneuver: The `Maneuver` without a controller, if there is one.

        Returns:
            What was changed by hand since the last tick, for the log.
        """
        self._number += 1
        if self._seen is not model:
            self._seen, self._model = model, VisibleModel(model, _SIDES)
            self.tell()
            self.channel.send_whole(SCENE, self._model.shapes().pack())
            if self._every:
                self._frames = LinkFrames(model)
                names = {name: getattr(self._frames, name) for name in _LINKS}
                self.channel.tell(LINKS, **names)
        elif self.idle:
            return ()
        self._data, self._last = data, (frame, controller, maneuver)
        self.wait(data.time)
        if self.due():
            self.redraw()
        elif self._frames is not None:
            self.channel.send_together(*self._now(self._frames))
        done, self._fresh = self._fresh, []
        return done

    def redraw(self) -> None:
        """Show where everything is."""
        if self._model is not None and self._data is not None:
            now = (SNAPSHOT, snapshot(self._data))
            self.channel.send_together(now, *self._now(self._frames))

    def _now(self, frames: LinkFrames | None) -> list[tuple[bytes, bytes]]:
        """Messages of this tick, with joints and links where they are wanted."""
        tick = self._tick(self._data.time, *self._last)
        if frames is None:
            return [(TICK, tick.pack())]
        tick = replace(tick, **frames.drives(self._data))
        return [(TICK, tick.pack()), (PLACES, frames.places(self._data).tobytes())]

    def _tick(
        self, t: float, frame: AntennaFrame | None, controller: Controller | None, maneuver: int
    ) -> Tick:
        left, right = _NOT_A_NUMBER if frame is None else frame.counts[0].tolist()
        level, contact, phase = _NOT_A_NUMBER, (Contact.UNKNOWN, Contact.UNKNOWN), ()
        if controller is not None:
            level, contact = controller.level[0].tolist(), controller.contact[0].tolist()
            maneuver, phase = int(controller.maneuver[0]), numbers_of(controller, "phase")
        return Tick(
            number=self._number,
            t=t,
            now=t,
            counts=(left, right),
            reading=(left, right),
            level=level,
            contact=contact,
            maneuver=maneuver,
            phase=phase[0] if len(phase) == 1 else math.nan,
            angles=(),
            **felt(frame),
        )

    def look(self) -> None:
        """Carry out what the page wants, if it may want anything."""
        if self._steered:
            super().look()

    def carry_out(self, order: Mapping[str, Any]) -> None:
        """Carry out one order; one that cannot be is left alone, and the page says so."""
        super().carry_out(order)
        what = order.get("do")
        if what == "move":
            self._move(order)
        elif what == "restart" and "seed" in self.state:
            seed = order.get("seed")
            if isinstance(seed, int) and 0 <= seed < 1 << 32:
                self.note(f"begun anew with seed {seed}")
                raise Restart(seed)

    def _move(self, order: Mapping[str, Any]) -> None:
        body, x, y = (order.get(each) for each in ("body", "x", "y"))
        if not isinstance(body, int) or self._model is None:
            return
        if not isinstance(x, float | int) or not isinstance(y, float | int):
            return
        if not (abs(x) <= _FARTHEST and abs(y) <= _FARTHEST):  # nor where one is NaN
            return
        if self._model.move(self._data, body, x, y) and order.get("end"):
            self.note(f"obstacle {body} moved to x = {x:.3f} m, y = {y:.3f} m")

    def note(self, what: str) -> None:
        """Keep what was changed by hand; of a slider that is drawn the last value counts."""
        t = 0.0 if self._data is None else float(self._data.time)
        line = f"{self._title}, {t:.2f} s: {what}"
        self._fresh.append(f"by hand: {what}")
        name = what.partition(" = ")[0]
        if self.by_hand and name in self.by_hand[-1] and self.by_hand[-1].startswith(self._title):
            self.by_hand.pop()
        self.by_hand.append(line)
        super().note(what)
