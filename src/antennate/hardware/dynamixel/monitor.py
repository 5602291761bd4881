"""Health and positions of the servos, a little of it read in every tick."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import cycle

from antennate.dxl.answers import DRIVE, POSITION, Answer, Span, Value
from antennate.dxl.bus import Bus
from antennate.dxl.model import hardware_errors
from antennate.dxl.models import XC430_W240
from antennate.errors import reason
from antennate.hardware.actuators import ActuatorState, JointFaults
from antennate.hardware.safety.deadlines import READ_ALL, READ_ONE, SUPPLY_AGE, WATCHDOG_COUNTS
from antennate.port import PortError

_ERRORS = Span(XC430_W240["hardware_error_status"].address, 1)
_WATCHDOG = XC430_W240["bus_watchdog"]
_TORQUE = XC430_W240["torque_enable"]
_VOLTAGE = XC430_W240["present_input_voltage"]
_POSITION = XC430_W240["present_position"]
_PWM = XC430_W240["present_pwm"]
_MODE = XC430_W240["operating_mode"]
_VOLT = 0.1
_PATIENCE = 10
"""Ticks after which watchdog and supply are read even if time is short: a round of all 19 then
takes 2 s at the slowest (assumed)."""
_PATIENCE_BEHIND = 3
"""The same for the drive of a joint that is behind: then three readings take 0.1 s (assumed)."""


class ServoMonitor(ActuatorState):
    """Reads all positions every tick, and one servo's watchdog, torque and the supply in turn.

    The first servo tells the voltage of the supply. One more servo tells its operating mode, or its
    drive where somebody wants to know it. All but the positions waits for the next tick if they
    took the whole budget of time [s].

    Args:
        modes: Operating modes by id that are watched while armed.

    Attributes:
        positions: Newest position by id [ticks].
        read_at: When positions were last read [s].
        drive: Id, Present PWM [counts] and position [ticks] of a servo that was asked for its drive
            in this tick, None if none was.
        armed: Whether torque and watchdogs are to be on; see `arm`.
        loose: Id of a servo whose torque is off on purpose, None if there is none.
    """

    def __init__(
        self,
        bus: Bus,
        ids: tuple[int, ...],
        clock: Callable[[], float],
        budget: float = READ_ALL,
        modes: Mapping[int, int] | None = None,
    ) -> None:
        super().__init__(
            missed=dict.fromkeys(ids, 0),
            errors={},
            watchdogs=(),
            disarmed=(),
            modes={},
            joints=JointFaults(),
            supply=math.nan,
            bus_error="",
        )
        self._bus, self._ids, self._clock, self._budget = bus, ids, clock, budget
        self._modes = modes or {}
        self._turn, self._mode_turn = cycle(range(len(ids))), cycle(self._modes)
        self._waited = self._waited_more = self._asked = 0
        self.read_at = -math.inf
        self.drive: tuple[int, int, int] | None = None
        self.positions: dict[int, int] = {}
        self.armed = False
        self.loose: int | None = None
        self._measured = -math.inf

    def arm(self, armed: bool) -> None:
        """From now on torque and watchdogs are on, or off on purpose."""
        self.armed = armed
        self.loose = None
        self.disarmed = ()
        self.modes, self.joints = {}, JointFaults()
        if armed:
            self.watchdogs = ()

    def step(self, suspects: Sequence[int] = ()) -> None:
        """Read all positions, and one servo's watchdog and torque. A bus error is kept.

        One of `suspects`, ids of joints that are behind, tells its drive in every second tick.
        """
        self.drive = None
        try:
            self._look(suspects)
            self.bus_error = ""
        except PortError as error:
            self.bus_error = reason(error)
            self.missed = {servo: count + 1 for servo, count in self.missed.items()}
        if self._clock() - self._measured > SUPPLY_AGE:
            self.supply = math.nan

    def _look(self, suspects: Sequence[int]) -> None:
        end = self._clock() + self._budget
        answers = self._bus.read_all(self._ids, POSITION, self._budget)
        self.read_at = self._clock()
        dead = not any(isinstance(reply, Value) for reply in answers.values())
        for servo, reply in answers.items():
            self._note(servo, reply, dead)
        self._waited += 1
        if self._clock() + READ_ONE <= end or self._waited >= _PATIENCE:
            self._waited = 0
            self._next(next(self._turn))
        self._waited_more += 1
        short = self._clock() + READ_ONE > end
        patience = _PATIENCE_BEHIND if suspects else _PATIENCE
        if self.armed and (not short or self._waited_more >= patience):
            self._waited_more = 0
            self._more(suspects, short)

    def _next(self, at: int) -> None:
        """Watchdog and torque of the servo whose turn it is, the supply with the first."""
        servo = self._ids[at]
        if self.missed[servo]:
            return
        self.guard(servo)
        if at == 0 and (volts := self._one(servo, Span(_VOLTAGE.address, 2))) is not None:
            self.supply = _VOLT * _VOLTAGE.decode(volts)
            self._measured = self._clock()

    def _more(self, suspects: Sequence[int], short: bool) -> None:
        """The drive of one suspect, or the operating mode of the next servo."""
        self._asked += 1
        if suspects and (short or self._asked % 2 or not self._modes):
            servo = suspects[self._asked // 2 % len(suspects)]
            if (data := self._one(servo, DRIVE)) is not None:
                pwm, position = data[: _PWM.size], data[-_POSITION.size :]
                self.drive = servo, _PWM.decode(pwm), _POSITION.decode(position)
        elif self._modes and not self.missed[servo := next(self._mode_turn)]:
            self._ask_mode(servo)

    def _ask_mode(self, servo: int) -> None:
        data = self._one(servo, Span(_MODE.address, _MODE.size))
        due = self._modes.get(servo)
        if data is None or due is None:
            return
        self.modes.pop(servo, None)
        if (mode := _MODE.decode(data)) != due:
            self.modes[servo] = f"mode {mode} where {due} is due"

    def well(self, servo: int) -> bool:
        """Whether a servo says, out of turn, that it has its torque, its watchdog and its mode."""
        try:
            answered = self.guard(servo)
            self._ask_mode(servo)
        except PortError:
            return False
        return answered and servo not in {*self.watchdogs, *self.disarmed, *self.modes}

    def guard(self, servo: int) -> bool:
        """Ask a servo for the watchdog and the torque that it was given; whether it answered."""
        data = self._one(servo, Span(_WATCHDOG.address, _WATCHDOG.size))
        if data is None:
            return False
        watchdog = _WATCHDOG.decode(data)
        self.watchdogs = _with(self.watchdogs, servo, watchdog < 0)
        if not self.armed or servo == self.loose:
            return True
        lost = 0 <= watchdog != WATCHDOG_COUNTS
        torque = self._one(servo, Span(_TORQUE.address, _TORQUE.size, spare=1))
        if torque is not None or lost:
            lost |= torque is not None and not _TORQUE.decode(torque)
            self.disarmed = _with(self.disarmed, servo, lost)
        return True

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
