"""A log on a page, tick by tick at a speed; also while a controller decides upon it again."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.control.decision import Decision
from antennate.figures import SERIES, rgba
from antennate.params.control import ControlParams
from antennate.params.scene import PhysicsParams
from antennate.sim.shapes import VisibleModel
from antennate.sim.world import World, compile_world
from antennate.telemetry import Restart
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import recorded_controller
from antennate.telemetry.survey import Record
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, EVENTS
from antennate.telemetry.view.channel import HEADER, POSES, SCENE, TICK, Channel, Poses
from antennate.telemetry.view.pace import Pace, Tuning
from antennate.types import Controller, Floats


class LogScene:
    """A world that is put where a log says, without physics.

    Args:
        header: The header of the log.
        arena: The world in which it was simulated, None for a bare floor.
        count: Coordinates of that world that the log tells, 0 for those of joints alone.

    Attributes:
        world: The world.
    """

    def __init__(self, header: Header, arena: World | None, count: int = 0) -> None:
        robot = header.robot
        whole = arena if arena is not None and arena.model.nq == count else None
        self._bare = whole is None
        self.world = whole or World(compile_world(PhysicsParams(), robot), robot)
        self._last: tuple[float, Floats] = (-math.inf, np.zeros(0))
        self._before = self._last

    def take(self, t: float, place: Sequence[float], robot: int) -> None:
        """Coordinates at a time [s], those of the robot from a number on.

        Without the arena these alone are used.
        """
        coordinates = np.array(place)
        if self._bare:
            coordinates = coordinates[robot : robot + self.world.model.nq]
        self._before, self._last = self._last, (t, coordinates)

    def place(self, t: float) -> None:
        """Put all where it is at a time [s], between the last two places known: a little late."""
        (first, before), (last, now) = self._before, self._last
        share = (t - last) / (last - first) if math.isfinite(first) and last > first else 1.0
        place = now if share >= 1.0 else before + max(0.0, share) * (now - before)
        if len(place) == self.world.model.nq:
            self.world.place_all(place)

    def place_joints(self, tick: Tick) -> None:
        """Put the joints where they were measured, or commanded where that is unknown."""
        angles = np.array(tick.positions or tick.angles)
        before = self.world.drives()
        if angles.shape == before.shape:
            self.world.place_drives(np.where(np.isfinite(angles), angles, before))
            if self.world.robot.pitch_count:
                self.world.stand_on_tail()


_SIDES = (rgba(SERIES[0]), rgba(SERIES[1]))
_LOOK = 0.05


class LogPlayer(Pace):
    """Shows the ticks of a log.

    Args:
        channel: To the process that shows it.
        header: The header of the log.
        title: What is shown, in a few words.
        speed: Times real time at which it begins; 0 is as fast as it goes.
        arena: The world in which it was simulated, None for a bare floor.
        tuning: As of `Pace`.
    """

    def __init__(
        self,
        channel: Channel,
        header: Header,
        title: str,
        speed: float,
        arena: World | None = None,
        tuning: Tuning | None = None,
    ) -> None:
        super().__init__(channel, speed, tuning)
        self._header, self._arena = header, arena
        self._scene: LogScene | None = None
        self._model: VisibleModel | None = None
        self._forces = np.zeros((0, 6), np.float32)
        self._begin_at: float | None = None
        self.state |= {"title": title, "again": True, "theta": header.params.rule.threshold}
        self.begin()

    def begin(self) -> None:
        """Show the log from its beginning."""
        self._begin_at = self._scene = None
        self._forces = np.zeros((0, 6), np.float32)
        self.tell()
        self.channel.send(HEADER, self._header.pack())

    def show(self, tick: Tick) -> None:
        """Show a tick if a picture is due, once its time has come."""
        if self._begin_at is None:
            self._begin_at = tick.now
        self.wait(tick.now - self._begin_at)
        if self.due():
            if self._scene is not None and self._model is not None:
                self._scene.place(tick.now)
                poses = self._model.poses(self._scene.world.data)
                self.channel.send(POSES, Poses(tick.now, poses, self._forces).pack())
            self.channel.send(TICK, tick.pack())

    def play(self, log: LogReader) -> None:
        """Show all ticks of a log."""
        for records, tick in log.groups():
            for record in records:
                if record.topic is EVENTS:
                    t = 1e-9 * (record.time - self._header.start)
                    self.say(f"{t:.2f} s: {EVENTS.decode(record.data)['msg']}")
            if tick is not None:
                self.keep(tick, records)
                self.show(tick)

    def rest(self) -> None:
        """Wait at the end until the page is gone."""
        while not self.channel.closed:
            self.look()
            time.sleep(_LOOK)

    def carry_out(self, order: Mapping[str, Any]) -> None:
        """Carry out one order; an unknown one is left alone."""
        super().carry_out(order)
        if order.get("do") == "restart":
            raise Restart(0)

    def keep(self, tick: Tick, records: Sequence[Record]) -> None:
        """Keep coordinates and forces of a tick; the first coordinates bring the scene."""
        for record in records:
            if record.topic is COORDINATES:
                state = COORDINATES.decode(record.data)
                place = state["position"]
                if self._scene is None:
                    self._scene = LogScene(self._header, self._arena, len(place))
                    self._model = VisibleModel(self._scene.world.model, _SIDES)
                    self.channel.send_whole(SCENE, self._model.shapes().pack())
                self._scene.take(tick.now, place, state["robot"])
            elif record.topic is CONTACT_FORCES:
                self._forces = _bars(CONTACT_FORCES.decode(record.data))


def _bars(contacts: Mapping[str, Any]) -> Any:
    """Forces of a log, whose directions are not known, as arrows upwards."""
    places = np.array([contacts["x"], contacts["y"], contacts["z"]]).T.reshape(-1, 3)
    bars = np.zeros((len(places), 6), np.float32)
    bars[:, :3], bars[:, 5] = places, contacts["normal"]
    return bars


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
        """Show a tick with what was decided upon it now."""
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
