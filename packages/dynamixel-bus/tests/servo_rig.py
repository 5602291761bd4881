"""Nineteen twin servos and a master, in invented time."""

from __future__ import annotations

from dynamixel_bus.answers import MOTION, Answer, Span, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.models import XC430_W240, XL330_M288
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.simulated_wire import SimulatedWire

IDS = list(range(1, 20))
MODELS = {i: (XC430_W240 if i <= 17 else XL330_M288).number for i in IDS}


def servos() -> list[Servo]:
    """17 for the body, 2 for the antennae, each at its own place, quick to answer."""
    made: list[Servo] = []
    for i in IDS:
        servo = Servo(XC430_W240 if i <= 17 else XL330_M288, i, position=100.0 * i)
        servo.set("return_delay_time", 0)
        made.append(servo)
    return made


class Rig:
    """The servos, the wire and its clock, the master."""

    def __init__(self, fast: bool = True, loss: float = 0.0) -> None:
        self.twin = ServoBus(servos(), loss=loss)
        self.link = SimulatedWire(self.twin)
        self.bus = Bus(self.link, fast=fast, clock=self.link.now)

    def cycle(self, span: Span = MOTION, period: float = 0.01) -> tuple[dict[int, Answer], float]:
        """Read all, and how long that took [s]; then wait for the end of the period."""
        begin = self.link.now()
        answers = self.bus.read_all(IDS, span)
        took = self.link.now() - begin
        self.link.sleep(max(period - took, 0.0))
        return answers, took

    def say_firmware(self, version: int) -> None:
        """All servos have this firmware; before 45, or 46 of the XL330, they take no fast reads."""
        for servo in self.twin.servos:
            servo.set("firmware_version", version)

    def servo(self, name: int) -> Servo:
        return self.twin.servos[name - 1]


def positions(answers: dict[int, Answer]) -> dict[int, int]:
    """Positions [ticks] of those that answered; the last four bytes of a span."""
    return {
        i: int.from_bytes(a.data[-4:], "little", signed=True)
        for i, a in answers.items()
        if isinstance(a, Value)
    }
