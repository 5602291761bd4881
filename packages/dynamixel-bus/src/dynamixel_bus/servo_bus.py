"""Servos behind one half-duplex wire: bytes in, bytes out, at the pace of the baud rate.

No input or output, and no clock: every call is told the time [s].

A reply leaves one return delay after the request, and is there when its last byte is. Servos asked
together answer one after the other; each waits for the one before it, so that the chain stops at a
silent servo, in sync reads (https://github.com/ROBOTIS-GIT/DynamixelSDK/issues/331) as in fast
ones. Two servos with one id talk at the same time, and of their bits the zeros win. The master
is expected to be quiet meanwhile; collisions of its packets with answers are not simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import zip_longest

import numpy as np

from dynamixel_bus import instructions, packets
from dynamixel_bus.faults import Fault, Noise, Trouble, spoil
from dynamixel_bus.instructions import two_words
from dynamixel_bus.model import BAUD_RATES, RETURN_DELAY_UNIT
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import BROADCAST, Instruction, Packet, Status
from dynamixel_bus.parser import Parser
from dynamixel_bus.servo import Servo

_GIVE_UP = 0.01
"""Silence after which servos forget half a packet [s]: ten times the longest packet used."""

_GOAL = XC430_W240["goal_position"]


class ServoBus:
    """The servos and the wire.

    Args:
        servos: In any order; two may share an id.
        baud: Bits per second while the master's are not known; a byte is ten bits.
        loss: Share of answers that get lost between the wire and the master.
        rng: Which of them.

    Attributes:
        trouble: Faults of servos, by the id that each had when the bus was made.
        latency: Time by which the adapter delivers answers late [s].
        echo: The adapter hears what it sends, and gives it to the master.
        noise: What the wire does to bytes, both ways.
        master_baud: Bits per second of the master; servos set to another baud understand nothing.
            None while that is not known: then all do.
        on_goals: Called when a sync write has given every servo a goal position.
    """

    def __init__(
        self,
        servos: Sequence[Servo],
        baud: int = 1_000_000,
        loss: float = 0.0,
        rng: np.random.Generator | None = None,
    ) -> None:
        self.servos = list(servos)
        self.trouble: dict[int, Trouble] = {}
        self._first_ids = {id(servo): servo.get("id") for servo in self.servos}
        self.loss = loss
        self.latency = 0.0
        self.echo = False
        self.noise = Noise(seed=1)
        self.master_baud: int | None = None
        self.on_goals: Callable[[], None] = lambda: None
        self._baud = baud
        self._rng = rng or np.random.default_rng(0)
        self._parser = Parser()
        self._t = self._last = 0.0
        self._out: list[tuple[float, bytes]] = []

    def advance(self, t: float) -> None:
        """Let the servos move until t."""
        self._t = max(self._t, t)
        for servo in self.servos:
            servo.advance(t)

    def receive(self, t: float, data: bytes) -> None:
        """The master sends these bytes from t on, or once it has sent the ones before."""
        if t - self._last > _GIVE_UP:
            self._parser.reset()
        self._last = max(self._last, t) + self._byte_time * len(data)
        if self.echo:
            self._out.append((self._last + self.latency, data))
        for packet in self._parser.feed(self.noise(data)):
            if packet.instruction != Instruction.STATUS:
                self._handle(self._last, packet)
                # Goals may have let time pass. That is no silence: the bytes behind them came
                # together with them, so the wire is busy until then.
                self._last = max(self._last, self._t)

    def next_time(self) -> float | None:
        """When the next bytes for the master are there [s]."""
        return min((when for when, _ in self._out), default=None)

    def transmit(self, t: float) -> bytes:
        """Bytes that have reached the master by t."""
        due = sorted((when, i) for i, (when, _) in enumerate(self._out) if when <= t)
        data = b"".join(self._out[i][1] for _, i in due)
        self._out = [item for item in self._out if item[0] > t]
        return self.noise(data)

    # requests

    def _handle(self, t: float, packet: Packet) -> None:
        present = [s for s in self.servos if s.awake(t) and self._understands(s)]
        for servo in present:
            servo.feed_watchdog(t)
        many = {
            Instruction.SYNC_READ: self._sync_read,
            Instruction.FAST_SYNC_READ: self._fast_sync_read,
            Instruction.SYNC_WRITE: self._sync_write,
            Instruction.BULK_READ: self._bulk_read,
            Instruction.FAST_BULK_READ: self._fast_bulk_read,
            Instruction.BULK_WRITE: self._bulk_write,
        }
        if packet.instruction in many:
            if packet.id == BROADCAST and len(packet.params) > 4:
                many[Instruction(packet.instruction)](t, present, packet.params)
            return
        reached = [s for s in present if instructions.is_for(s, packet)]
        for servos in self._by_id(reached):
            replies = [a for s in servos if (a := instructions.answer(t, s, packet)) is not None]
            t = self._reply(t, servos[0], [packets.status(reply) for reply in replies])

    def _sync_write(self, t: float, present: list[Servo], params: bytes) -> None:
        address, length = two_words(params)
        known: dict[int, list[Servo]] = {}
        for servo in present:
            known.setdefault(servo.get("id"), []).append(servo)
        for at in range(4, len(params) - length, length + 1):
            for servo in known.get(params[at], ()):
                servo.write(address, params[at + 1 : at + 1 + length])
        named = set(params[4 :: length + 1])
        if address == _GOAL.address and named >= {servo.get("id") for servo in self.servos}:
            self.on_goals()

    def _bulk_write(self, t: float, present: list[Servo], params: bytes) -> None:
        while len(params) > 5:
            address, length = two_words(params[1:])
            if len(params) < 5 + length:
                return
            for servo in present:
                if servo.get("id") == params[0]:
                    servo.write(address, params[5 : 5 + length])
            params = params[5 + length :]

    def _sync_read(self, t: float, present: list[Servo], params: bytes) -> None:
        self._chain(t, present, [(name, *two_words(params)) for name in params[4:]])

    def _bulk_read(self, t: float, present: list[Servo], params: bytes) -> None:
        self._chain(t, present, _bulk(params))

    def _chain(self, t: float, present: list[Servo], asked: list[tuple[int, int, int]]) -> None:
        """Let servos answer one after the other: id, address and length of each."""
        for name, address, length in asked:
            servos = [s for s in present if s.get("id") == name and s.get("status_return_level")]
            if not servos:
                return
            replies = [instructions.status(s, *s.read(address, length)) for s in servos]
            t = self._reply(t, servos[0], [packets.status(reply) for reply in replies])

    def _fast_sync_read(self, t: float, present: list[Servo], params: bytes) -> None:
        self._join(t, present, [(name, *two_words(params)) for name in params[4:]])

    def _fast_bulk_read(self, t: float, present: list[Servo], params: bytes) -> None:
        self._join(t, present, _bulk(params))

    def _join(self, t: float, present: list[Servo], asked: list[tuple[int, int, int]]) -> None:
        """Let servos answer with one packet together: id, address and length of each.

        A firmware that does not know the instruction is silent, and so are those behind it.
        """
        chain: list[tuple[Servo, Status]] = []
        known = {s.get("id"): s for s in reversed(present) if s.get("status_return_level")}
        for name, address, length in asked:
            servo = known.get(name)
            if servo is None or servo.get("firmware_version") < servo.model.fast_read_firmware:
                break
            error, data = servo.read(address, length)
            chain.append((servo, instructions.status(servo, error, data.ljust(length, b"\0"))))
        size = sum(length + 4 for _, _, length in asked)
        pieces = instructions.fast_pieces(size, [reply for _, reply in chain])
        for (servo, _), piece in zip(chain, pieces, strict=True):
            broken = any(self._is(servo, f) for f in (Fault.BAD_CRC, Fault.TRUNCATED))
            delay = 0.0 if servo is not chain[0][0] else None
            t = self._reply(t, servo, [piece], delay)
            if broken:
                return

    # answers

    def _reply(
        self, t: float, servo: Servo, replies: list[bytes], delay: float | None = None
    ) -> float:
        """Put the replies of servos of one id on the wire after t; the time at which they end."""
        if not replies:
            return t
        trouble = self._use(servo)
        start = t + (RETURN_DELAY_UNIT * servo.get("return_delay_time") if delay is None else delay)
        if trouble and trouble.fault is Fault.LATE:
            start += trouble.delay
        data = replies[0] if len(replies) == 1 else bytes(_collide(replies))
        data = spoil(data, trouble.fault) if trouble else data
        end = start + self._byte_time * len(data)
        if not (self.loss and self._rng.random() < self.loss):
            self._out.append((end + self.latency, data))
        return end

    @property
    def _byte_time(self) -> float:
        """Time that a byte takes [s]: ten bits."""
        return 10.0 / (self.master_baud or self._baud)

    def _understands(self, servo: Servo) -> bool:
        same = self.master_baud is None or BAUD_RATES[servo.get("baud_rate")] == self.master_baud
        return same and servo.get("protocol_type") != 1 and not self._is(servo, Fault.SILENT)

    def _is(self, servo: Servo, fault: Fault) -> bool:
        trouble = self._trouble_of(servo)
        return trouble is not None and trouble.fault is fault and trouble.count != 0

    def _trouble_of(self, servo: Servo) -> Trouble | None:
        """A fault stays with its servo when the id of that changes."""
        if servo.trouble or not self.trouble:
            return servo.trouble
        return self.trouble.get(self._first_ids.get(id(servo), servo.get("id")))

    def _use(self, servo: Servo) -> Trouble | None:
        trouble = self._trouble_of(servo)
        if trouble is None or trouble.count == 0:
            return None
        if trouble.count is not None:
            trouble.count -= 1
        return trouble

    def _by_id(self, servos: list[Servo]) -> list[list[Servo]]:
        found: dict[int, list[Servo]] = {}
        for servo in servos:
            found.setdefault(servo.get("id"), []).append(servo)
        return [found[name] for name in sorted(found)]


def _bulk(params: bytes) -> list[tuple[int, int, int]]:
    """Id, address and length of each servo that a bulk read asks."""
    return [(params[at], *two_words(params[at + 1 :])) for at in range(0, len(params) - 4, 5)]


def _collide(replies: list[bytes]) -> list[int]:
    mixed: list[int] = []
    for together in zip_longest(*replies, fillvalue=0xFF):
        byte = 0xFF
        for bits in together:
            byte &= bits
        mixed.append(byte)
    return mixed
