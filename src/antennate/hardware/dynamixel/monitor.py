"""Health and positions of the servos, a little of it read in every tick."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from itertools import cycle

from antennate.errors import reason
from antennate.hardware.actuators import ActuatorState
from antennate.hardware.dynamixel.answers import POSITION, Answer, Span, Value
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.dynamixel.tables import XC430_W240, hardware_errors
from antennate.hardware.ports.port import PortError
from antennate.hardware.safety.deadlines import READ_ALL, READ_ONE, SUPPLY_AGE, WATCHDOG_COUNTS

_ERRORS = Span(XC430_W240["hardware_error_status"].address, 1)
_WATCHDOG = XC430_W240["bus_watchdog"]
_TORQUE = XC430_W240["torque_enable"]
_VOLTAGE = XC430_W240["present_input_voltage"]
_POSITION = XC430_W240["present_position"]
_VOLT = 0.1
_PATIENCE = 10
"""Ticks after which watchdog and supply are read even if time is short: a round of all 19 then
takes 2 s at the slowest (assumed)."""


class ServoMonitor(ActuatorState):
    """Reads all positions every tick, and one servo's watchdog, torque and the supply in turn.

    The first servo tells the voltage of the supply. All but the positions waits for the next tick
    if they took the whole budget of time [s].

    Attributes:
        positions: Newest position by id [ticks].
        armed: Whether torque and watchdogs are to be on; see `arm`.
        loose: Id of a servo whose torque is off on purpose, None if there is none.
    """

    def __init__(
        self,
        bus: Bus,
        ids: tuple[int, ...],
        clock: Callable[[], float],
        budget: float = READ_ALL,
    ) -> None:
        super().__init__(
            missed=dict.fromkeys(ids, 0),
            errors={},
            watchdogs=(),
            disarmed=(),
            supply=math.nan,
            bus_error="",
        )
        self._bus, self._ids, self._clock, self._budget = bus, ids, clock, budget
        self._turn = cycle(range(len(ids)))
        self._waited = 0
        self.positions: dict[int, int] = {}
        self.armed = False
        self.loose: int | None = None
        self._measured = -math.inf

    def arm(self, armed: bool) -> None:
        """From now on torque and watchdogs are on, or off on purpose."""
        self.armed = armed
        self.loose = None
        self.disarmed = ()
        if armed:
            self.watchdogs = ()

    def step(self) -> None:
        """Read all positions, and one servo's watchdog and torque. A bus error is kept."""
        try:
            self._look()
            self.bus_error = ""
        except PortError as error:
            self.bus_error = reason(error)
            self.missed = {servo: count + 1 for servo, count in self.missed.items()}
        if self._clock() - self._measured > SUPPLY_AGE:
            self.supply = math.nan

    def _look(self) -> None:
        end = self._clock() + self._budget
        answers = self._bus.read_all(self._ids, POSITION, self._budget)
        dead = not any(isinstance(reply, Value) for reply in answers.values())
        for servo, reply in answers.items():
            self._note(servo, reply, dead)
        self._waited += 1
        if self._clock() + READ_ONE > end and self._waited < _PATIENCE:
            return
        self._waited = 0
        at = next(self._turn)
        servo = self._ids[at]
        if self.missed[servo]:
            return
        self.guard(servo)
        if at == 0 and (volts := self._one(servo, Span(_VOLTAGE.address, 2))) is not None:
            self.supply = _VOLT * _VOLTAGE.decode(volts)
            self._measured = self._clock()

    def guard(self, servo: int) -> None:
        """Whether a servo still has the watchdog and the torque that it was given."""
        data = self._one(servo, Span(_WATCHDOG.address, _WATCHDOG.size))
        if data is None:
            return
        watchdog = _WATCHDOG.decode(data)
        self.watchdogs = _with(self.watchdogs, servo, watchdog < 0)
        if not self.armed or servo == self.loose:
            return
        lost = 0 <= watchdog != WATCHDOG_COUNTS
        torque = self._one(servo, Span(_TORQUE.address, _TORQUE.size, spare=1))
        if torque is not None or lost:
            lost |= torque is not None and not _TORQUE.decode(torque)
            self.disarmed = _with(self.disarmed, servo, lost)

    def _note(self, servo: int, reply: Answer, dead: bool) -> None:
        if not isinstance(reply, Value):
            # one that was not asked for want of time has missed nothing
            asked = self._bus.missed.get(servo, 0)
            self.missed[servo] = self.missed[servo] + 1 if dead else max(self.missed[servo], asked)
            return
        self.missed[servo] = 0
        self.positions[servo] = _POSITION.decode(reply.data)
        if reply.alert:
            bits = self._one(servo, _ERRORS)
            words = hardware_errors(bits[0]) if bits else []
            self.errors[servo] = ", ".join(words) or self.errors.get(servo, "alert")
        else:
            self.errors.pop(servo, None)

    def _one(self, servo: int, span: Span) -> bytes | None:
        reply = self._bus.read_all([servo], span, READ_ONE)[servo]
        return reply.data if isinstance(reply, Value) else None


def _with(ids: Iterable[int], servo: int, is_in: bool) -> tuple[int, ...]:
    others = tuple(i for i in ids if i != servo)
    return (*others, servo) if is_in else others
