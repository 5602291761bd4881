"""A log on a page, tick by tick at a speed."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from antennate.colours import SERIES, rgba
from antennate.params.scene import PhysicsParams
from antennate.sim.shapes import VisibleModel
from antennate.sim.world import World, compile_world
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader, Record
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES, EVENTS
from antennate.telemetry.view.channel import HEADER, POSES, SCENE, TICK, Channel, Poses
from antennate.telemetry.view.pace import Pace, Restart
from antennate.types import Floats

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
    """

    def __init__(
        self, channel: Channel, header: Header, title: str, speed: float, arena: World | None = None
    ) -> None:
        super().__init__(channel, speed)
        self._header, self._arena = header, arena
        self._scene: _Scene | None = None
        self._begin_at: float | None = None
        self.state |= {"title": title, "again": True, "theta": header.params.rule.threshold}
        self.begin()

    def begin(self) -> None:
        """From the beginning."""
        self._begin_at = self._scene = None
        self.tell()
        self.channel.send(HEADER, self._header.pack())

    def show(self, tick: Tick) -> None:
        """Show a tick if a picture is due, once its time has come.

        Raises:
            Restart: A person wants it from the beginning.
        """
        if self._begin_at is None:
            self._begin_at = tick.now
        self.wait(tick.now - self._begin_at)
        if self.due():
            if self._scene is not None:
                self.channel.send(POSES, self._scene.poses(tick.now).pack())
            self.channel.send(TICK, tick.pack())

    def play(self, log: LogReader) -> None:
        """Show all ticks of a log.

        Raises:
            Restart: A person wants it from the beginning.
            LogError: The disk fails.
        """
        for records, tick in log.groups():
            for record in records:
                if record.topic is EVENTS:
                    self.say(EVENTS.type.decode(record.data)["msg"])
            if tick is not None:
                self.keep(tick, records)
                self.show(tick)

    def rest(self) -> None:
        """Wait at the end until the page is gone.

        Raises:
            Restart: A person wants it from the beginning.
        """
        while not self.channel.closed:
            self.look()
            time.sleep(_LOOK)

    def carry_out(self, order: Mapping[str, Any]) -> None:
        """Carry out one order; an unknown one is left alone.

        Raises:
            Restart: A person wants it from the beginning.
        """
        super().carry_out(order)
        if order.get("do") == "restart":
            raise Restart(0)

    def keep(self, tick: Tick, records: Sequence[Record]) -> None:
        """Keep coordinates and forces of a tick; the first coordinates bring the scene."""
        for record in records:
            if record.topic is COORDINATES:
                found = COORDINATES.type.decode(record.data)
                place = np.array(found["position"])
                if self._scene is None:
                    self._scene = _Scene(self._header, self._arena, len(place))
                    shapes = self._scene.model.shapes().pack()
                    self.channel.send_whole(SCENE, shapes)
                self._scene.take(tick.now, place, found["robot"])
            elif record.topic is CONTACT_FORCES and self._scene is not None:
                self._scene.forces = _bars(CONTACT_FORCES.type.decode(record.data))


class _Scene:
    """The world of a log, between the last two places that it tells."""

    def __init__(self, header: Header, arena: World | None, count: int) -> None:
        robot = header.robot
        whole = arena is not None and arena.model.nq == count
        self._bare = not whole
        world = arena if arena is not None and whole else None
        self._world = world or World(compile_world(PhysicsParams(), robot), robot)
        self.model = VisibleModel(self._world.model, _SIDES)
        self.forces = np.zeros((0, 6), np.float32)
        self._last: tuple[float, Floats] = (-math.inf, np.zeros(0))
        self._before = self._last

    def take(self, t: float, place: Floats, robot: int) -> None:
        """Coordinates at a time [s]; without the arena those of the robot."""
        if self._bare:
            place = place[robot : robot + self._world.model.nq]
        self._before, self._last = self._last, (t, place)

    def poses(self, t: float) -> Poses:
        """Where all is at a time [s]: between the two places that are known, so a little late."""
        (first, before), (last, now) = self._before, self._last
        share = (t - last) / (last - first) if math.isfinite(first) and last > first else 1.0
        place = now if share >= 1.0 else before + max(0.0, share) * (now - before)
        if len(place) == self._world.model.nq:
            self._world.place_all(place)
        data = self._world.data
        return Poses(t, self.model.poses(data), self.forces)


def _bars(found: Mapping[str, Any]) -> Any:
    """Forces of a log, whose directions are not known, as arrows upwards."""
    places = np.array([found["x"], found["y"], found["z"]]).T.reshape(-1, 3)
    bars = np.zeros((len(places), 6), np.float32)
    bars[:, :3], bars[:, 5] = places, found["normal"]
    return bars
