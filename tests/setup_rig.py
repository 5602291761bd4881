"""A box of factory-new twin servos, a bus in invented time, and a person who plugs them in."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from antennate.errors import BadInputError
from antennate.robots.spec import RobotSpec
from dynamixel_bus.model import BAUD_RATES
from dynamixel_bus.models import MODELS_BY_NUMBER
from dynamixel_bus.port import Port
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.simulated_wire import SimulatedWire

ROBOT = RobotSpec()


def new_servo(model: int, at: float = 2048.0) -> Servo:
    """A servo of the factory: id 1, 57600 bit/s, all registers at the manual's defaults."""
    return Servo(MODELS_BY_NUMBER[model], 1, position=at)


class Box:
    """The servos of a robot, new, and a bus on which some of them are."""

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        self.robot = robot
        self.servos = {
            name: new_servo(robot.models[servo], 2000.0 + 7 * servo)
            for name, servo in zip(robot.joint_names, robot.ids, strict=True)
        }
        self.bus = ServoBus([])
        self.wire = SimulatedWire(self.bus)
        self.opened: list[int] = []

    def plug(self, *names: str) -> None:
        """These servos are on the bus, and no others."""
        self.bus.servos = [self.servos[name] for name in names]

    def plug_all(self) -> None:
        self.plug(*self.servos)

    @contextlib.contextmanager
    def opener(self, baud: int) -> Iterator[Port]:
        self.opened.append(baud)
        self.bus.master_baud = baud
        yield self.wire

    def found(self) -> dict[str, tuple[int, int]]:
        """Id and speed of each servo."""
        return {n: (s.get("id"), BAUD_RATES[s.get("baud_rate")]) for n, s in self.servos.items()}


@dataclass
class Script:
    """Answers from a script: what is done when a text that matches is said, and what is answered.

    Attributes:
        script: Pattern, action and answer of each step; None in place of an answer says nothing.
        said: All that was said and asked.
    """

    script: list[tuple[str, Callable[[], object] | None, str | None]]
    said: list[str] = field(default_factory=list[str])
    shown: list[str] = field(default_factory=list[str])
    pending: list[str] = field(default_factory=list[str])

    def say(self, text: str) -> None:
        self.said.append(text)
        if self.script and re.search(self.script[0][0], text):
            _, action, answer = self.script.pop(0)
            if action is not None:
                action()
            if answer is not None:
                self.pending.append(answer)

    def show(self, text: str) -> None:
        self.shown.append(text)

    def ask(self, text: str) -> str:
        self.say(text)
        if not self.pending:
            raise BadInputError(f"nobody answers {text!r}")
        return self.pending.pop(0)

    def answer(self) -> str | None:
        return self.pending.pop(0) if self.pending else None
