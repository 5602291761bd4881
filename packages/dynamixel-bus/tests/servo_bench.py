"""One servo on a wire, spoken to in bytes at the addresses of the manual, in invented time."""

from __future__ import annotations

from manual_tables import Page

from dynamixel_bus import packets
from dynamixel_bus.models import MODELS_BY_NUMBER
from dynamixel_bus.packets import Status
from dynamixel_bus.parser import Parser
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

NONE, RESULT_FAIL, INSTRUCTION, CRC, RANGE, LENGTH, LIMIT, ACCESS = range(8)
"""Numbers of the errors of a status packet, from the manual."""


class Bench:
    """A new servo of a page, at position 2048 unless said otherwise.

    Attributes:
        servo: The servo.
        bus: Its wire.
        t: The time [s].
        divisor: What Position P Gain is divided by, in PWM a pulse.
    """

    divisor = 128.0

    def __init__(self, page: Page, position: float = 2048.0, others: int = 0) -> None:
        self.page = page
        table = MODELS_BY_NUMBER[page.model]
        self.servo = self.make(1, position)
        more = [Servo(table, 2 + n, position) for n in range(others)]
        self.bus = self.wire([self.servo, *more])
        self.t = 0.0

    def make(self, servo: int, position: float) -> Servo:
        """The servo that is looked at."""
        return Servo(MODELS_BY_NUMBER[self.page.model], servo, position)

    def wire(self, servos: list[Servo]) -> ServoBus:
        """What the servos are on."""
        return ServoBus(servos, baud=1_000_000)

    def ask(self, instruction: int, params: bytes = b"", to: int = 1) -> list[Status]:
        """What comes back within 50 ms."""
        self.bus.receive(self.t, packets.encode(to, instruction, params))
        self.wait(0.05)
        found = Parser().feed(self.bus.transmit(self.t))
        return [status for packet in found if (status := packets.as_status(packet))]

    def put(self, name: str, value: int, to: int = 1) -> int:
        """Write a register; the number of the error, 0 for none."""
        row = self.page.row(name)
        data = value.to_bytes(row.size, "little", signed=value < 0)
        (said,) = self.ask(3, row.address.to_bytes(2, "little") + data, to)
        return said.error

    def get(self, name: str, to: int = 1) -> int:
        """Read a register."""
        row = self.page.row(name)
        (said,) = self.ask(2, row.address.to_bytes(2, "little") + bytes([row.size, 0]), to)
        assert said.error == NONE
        assert len(said.data) == row.size
        return int.from_bytes(said.data, "little", signed=row.signed)

    def wait(self, seconds: float) -> None:
        """Let time pass, in steps of a millisecond as a busy bus would."""
        end = self.t + seconds
        while self.t < end - 1e-9:
            self.t = min(self.t + 0.001, end)
            self.bus.advance(self.t)

    def mode(self, mode: int) -> None:
        """Change the operating mode and bring torque."""
        assert self.put("torque_enable", 0) == NONE
        assert self.put("operating_mode", mode) == NONE
        assert self.put("torque_enable", 1) == NONE
