"""A twin robot before the doctor, in invented time: each wire is opened at a speed."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from lockstep import BoardPort, LockstepClock
from stated import stated

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Row
from antennate.hardware.doctor.checkup import Checkup, examine
from antennate.hardware.doctor.fix import apply, plan
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.twin.robot import TwinRobot
from dynamixel_bus.port import Port

ROBOT = DoctorConfig(robot=stated())


class Patient:
    """A robot with faults, and what opens its two ports."""

    def __init__(self, *faults: str, robot: RobotSpec | None = None) -> None:
        self.spec = stated(robot)
        self.robot: TwinRobot = watched(TwinConfig(robot=self.spec))[0]
        self.clock = LockstepClock(self.robot)
        self.board = BoardPort(self.robot, self.clock)
        demands = [read(text) for text in faults]
        Faults(demands, self.spec.ids, has_imu=self.spec.has_imu).apply(self.robot, 0.0)
        self.clock.latency = self.robot.bus.latency
        self.robot.bus.latency = 0.0

    @contextlib.contextmanager
    def bus(self, baud: int) -> Iterator[Port]:
        self.robot.bus.master_baud = baud
        yield self.clock

    @contextlib.contextmanager
    def esp32(self, baud: int) -> Iterator[Port]:
        yield self.board

    def examine(self, bus: bool = True, esp32: bool = True, swapped: bool = False) -> Checkup:
        openers = (self.esp32, self.bus) if swapped else (self.bus, self.esp32)
        return examine(
            ROBOT.model_copy(update={"robot": self.spec}),
            ("/dev/bus", openers[0]) if bus else None,
            ("/dev/esp32", openers[1]) if esp32 else None,
            self.clock.now,
        )

    def fix(self) -> list[str]:
        """Changes made until nothing is left to change."""
        made: list[str] = []
        while (survey := self.examine(esp32=False).bus) and (changes := plan(survey, self.spec)):
            for change in changes:
                apply(self.bus, change, self.clock.now)
                made.append(str(change))
        return made


def wrong(checkup: Checkup) -> dict[str, Row]:
    """Rows of both ports that are not ok, by part and check."""
    rows = (row for row in checkup.rows if row.part != "robot")
    return {f"{row.part}: {row.check}": row for row in rows if row.grade != "ok"}
