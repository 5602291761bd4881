"""Worlds behind the wall: a fourth one is a function here and a line in WORLDS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from twin_rig import Stage, before_twin, rig, simulation

from antennate.control.decision import decision_of
from antennate.control.loop import run_loop
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.driving.connect import await_board
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import ReplayRobot, recorded_controller
from antennate.telemetry.ticks import Tick, angles_of, decided
from antennate.telemetry.writer import LogWriter
from antennate.twin.config import TwinConfig
from antennate.types import AntennaFrame, Clock, Controller, JointCommand, Robot

CONFIG = TunnelConfig(seed=0)
LAYOUT = RobotSpec()
TICKS = 260
"""Ticks that a world can at least be run."""
ARMED_AT = 100
"""Tick at which a session is asked for torque."""


@dataclass
class Seen:
    """One tick as seen from in front of the wall."""

    frame: AntennaFrame
    command: JointCommand
    maneuver: int
    contact: tuple[int, int]
    now: float

    def decision(self) -> tuple[int, bytes]:
        angles = (self.command.yaw, self.command.leg, self.command.antenna)
        return self.maneuver, b"".join(part.tobytes() for part in angles)


@dataclass
class World:
    """A body with the control that belongs to it, at its first tick."""

    body: Any
    control: Any
    header: Header
    controller: Any
    go_on: Callable[[AntennaFrame, JointCommand], bool] = lambda frame, command: True
    tick_of: Callable[[AntennaFrame, JointCommand, int], Tick] | None = None
    seen: list[Seen] = field(default_factory=list)
    early: list[AntennaFrame] = field(default_factory=list)

    def run(self, ticks: float = math.inf, log: LogWriter | None = None) -> list[Seen]:
        """Run some ticks, or until the world ends; note them, and write them to a log."""

        def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
            number, now = len(self.seen) + 1, self.body.clock.now()
            left, right = self.controller.contact[0].tolist()
            maneuver = int(self.controller.maneuver[0])
            self.seen.append(Seen(frame, command, maneuver, (left, right), now))
            if log is not None:
                own = self.tick_of
                plain = plain_tick(self.controller, frame, command, number, now)
                log.write(plain if own is None else own(frame, command, number))
            return self.go_on(frame, command) and number < ticks

        run_loop(self.body, self.control, self.header.params.period, go_on)
        return self.seen


def plain_tick(
    controller: Controller, frame: AntennaFrame, command: JointCommand, number: int, now: float
) -> Tick:
    """The tick of a controller without supervisor."""
    seen = decided(controller, decision_of(controller), frame)
    angles = angles_of(command)
    return Tick(**seen, angles=angles, number=number, now=now, reading=seen["counts"])


class Blinded:
    """A simulated body whose left antenna is gone from some tick on."""

    def __init__(self, body: Robot, after: float) -> None:
        self._body, self._left = body, after

    @property
    def clock(self) -> Clock:
        return self._body.clock

    def read(self) -> AntennaFrame:
        frame = self._body.read()
        self._left -= 1
        if self._left < 0:
            frame.counts[0, 0] = math.nan
        return frame

    def write(self, command: JointCommand) -> None:
        self._body.write(command)


def _world(stage: Stage, name: str, trial: int) -> World:
    header = Header(
        controller=name,
        params=CONFIG.control,
        robot=LAYOUT,
        seed=CONFIG.seed,
        trial=trial,
        phase=float(stage.control.phase[0]),
    )
    return World(stage.body, stage.control, header, stage.control, stage.go_on)


def simulated(folder: Path, name: str, trial: int, blind: float = math.inf) -> World:
    """The pure simulation, rounded as servos and board do."""
    world = _world(simulation(CONFIG, name, trial), name, trial)
    world.body = Blinded(world.body, blind)
    return world


def twin(folder: Path, name: str, trial: int, blind: float = math.inf) -> World:
    """The hardware code before the twin, in lock-step."""
    stage = before_twin(CONFIG, name, trial)
    world = _world(stage, name, trial)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        assert stage.robot is not None
        stage.robot.board_silent = len(world.seen) >= blind
        return stage.go_on(frame, command)

    world.go_on = go_on
    return world


def session(folder: Path, name: str, trial: int, blind: float = math.inf) -> World:
    """The same with its supervisor; armed at tick ARMED_AT, blind for 30 ticks only."""
    made = rig(TwinConfig(seed=CONFIG.seed, trial=trial), name)
    await_board(made.session.board, made.clock)
    header = Header(controller=name, params=CONFIG.control, robot=LAYOUT)

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        made.session.orders.arm = len(world.seen) >= ARMED_AT
        made.robot.board_silent = blind <= len(world.seen) < blind + 30
        return True

    def tick_of(frame: AntennaFrame, command: JointCommand, number: int) -> Tick:
        tick = Tick.of(made.session, made.clock.now())
        assert tick.number == number
        return Tick.unpack(tick.pack())

    world = World(
        made.session, made.session.control, header, made.session.control.controller, go_on, tick_of
    )
    return world


def recorded(world: World, path: Path, ticks: float = math.inf) -> Path:
    """Run a world and keep its log."""
    with LogWriter(path, world.header) as log:
        world.run(ticks, log)
    return path


def replayed(path: Path) -> World:
    """The world that a log is."""
    with LogReader(path) as log:
        body, control = ReplayRobot(list(log), log.header), recorded_controller(log.header)
    return World(body, control, log.header, control, lambda frame, command: body.more)


def replay_of_simulation(folder: Path, name: str, trial: int, blind: float = math.inf) -> World:
    """The third world: what the pure simulation left on disk."""
    return replayed(recorded(simulated(folder, name, trial, blind), folder / "log", TICKS))


WORLDS = {
    "simulation": simulated,
    "twin": twin,
    "session": session,
    "replay": replay_of_simulation,
}
"""Makers of worlds; each takes a folder, a controller, a trial and the tick of its blindness."""
