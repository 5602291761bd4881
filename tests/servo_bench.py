"""One servo on a wire, spoken to in bytes at the addresses of the manual, in invented time."""

from __future__ import annotations

from manual_tables import Page

from antennate.hardware.dynamixel import packets
from antennate.hardware.dynamixel.packets import Status
from antennate.hardware.dynamixel.parser import Parser
from antennate.hardware.dynamixel.tables import TABLES
from antennate.twin.bus import ServoBus
from antennate.twin.registers import Servo

NONE, RESULT_FAIL, INSTRUCTION, CRC, RANGE, LENGTH, LIMIT, ACCESS = range(8)
"""Numbers of the errors of a status packet, from the manual."""


class Bench:
    """A new servo of a page, at position 2048 unless said otherwise.

    Attributes:
        servo: The servo.
        bus: Its wire.
        t: The time [s].
    """

    def __init__(self, page: Page, position: float = 2048.0, others: int = 0) -> None:
        self.page = page
        table = TABLES[page.model]
        self.servo = Servo(table, 1, position)
        more = [Servo(table, 2 + n, position) for n in range(others)]
        self.bus = ServoBus([self.servo, *more], baud=1_000_000)
        self.t = 0.0

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
