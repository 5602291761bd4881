"""DYNAMIXEL servos as the actuators of a robot: goals [ticks], torque, and what they report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import cycle

import numpy as np

from antennate.errors import FAILURES, reason
from antennate.hardware.actuators import ActuatorState, JointFaults
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.leg_turns import LegTurns
from antennate.hardware.joints import Joints
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import READ_ALL, READ_ONE, SUPPLY_AGE, WATCHDOG_COUNTS
from antennate.hardware.safety.following import Following
from antennate.params.safety import FollowingParams
from antennate.types import Floats, JointCommand
from dynamixel_bus.answers import DRIVE, POSITION, Answer, Span, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import hardware_errors
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.port import PortError

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
"""Ticks after which the drive of a joint that is behind is read even if time is short: then three
readings take 0.1 s (assumed)."""


class ServoMonitor(ActuatorState):
    """Reads all positions every tick, and one servo's watchdog, torque and the supply in turn.

    The first servo tells the voltage of the supply. One more servo tells its operating mode, or its
    drive where somebody wants to know it. All but the positions waits for the next tick if they
    took the whole budget of time [s].

    Args:
        modes: Operating modes by id that are watched while armed.

    Attributes:
        positions: Newest position by id [ticks].
        answered: Ids that told theirs in the last `step`.
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
        self.answered: set[int] = set()
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
        self.answered = set()
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
        self.answered.add(servo)
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


class DynamixelActuators:
    """All servos of one robot on one bus, as `Actuators`; for one thread.

    Any packet feeds the watchdogs of the servos: nothing is sent but by the calls below.
    """

    def __init__(
        self,
        bus: Bus,
        joints: Joints,
        clock: Callable[[], float],
        following: FollowingParams | None = None,
    ) -> None:
        self.bus, self.joints = bus, joints
        self.tally, self.robot = bus.tally, joints.robot
        self.state = ServoMonitor(bus, joints.ids, clock, modes=self.robot.modes)
        self.turns = LegTurns(bus, joints)
        self.following = Following(joints, following or FollowingParams(), self.state.well)
        self.left_on: list[int] = []
        self._now = clock
        self._goals: Floats | None = None

    @property
    def enabled(self) -> bool:
        """Whether torque was given and not taken."""
        return self._goals is not None

    @property
    def resting(self) -> bool:
        """Whether the robot has to stand still, as while a leg forgets its turns."""
        return self.turns.standing

    def check(self, command: JointCommand) -> JointCommand:
        """A copy of a command that can be sent; CommandError if it cannot."""
        command = self.joints.plain(command)
        self.joints.ticks(command)
        return command

    def enable(self, command: JointCommand) -> None:
        """Torque on where everything stands, for all servos or for none.

        Legs count their turns from where they stand, so that `command` is near.
        """
        try:
            self._goals = self._enable(command)
        except FAILURES:
            self.disable()
            raise
        self.left_on = []
        self.state.arm(True)

    def _enable(self, command: JointCommand) -> Floats:
        """Where everything stands [ticks]."""
        bus, ids = self.bus, self.joints.ids
        self.turns.reset()
        self.following.disarm()
        bringup.require_models(bus, self.joints.models)
        bringup.require_modes(bus, self.robot.modes)
        torque.arm_watchdogs(bus, ids)
        torque.limit_speed(bus, self.joints.profiles)
        limits = torque.allow_full_pwm(bus, ids)
        stood = torque.hold_here(bus, ids)
        self.joints.align(np.array([stood[servo] for servo in ids], float), command)
        present = torque.enable(bus, ids)
        place = np.array([present[servo] for servo in ids], float)
        self.following.arm(place, limits)
        return place

    def disable(self, again: bool = False) -> list[int]:
        """Torque off, group by group, verified: ids that did not confirm it."""
        if again:
            self.left_on = torque.disable(self.bus, self.left_on, 1, READ_ALL)
            return list(self.left_on)
        self._goals = None
        self.turns.reset()
        self.following.rest()
        self.state.arm(False)
        self.left_on = []
        for group in self.joints.in_order_of_release:
            try:
                self.left_on += torque.disable(self.bus, group)
            except Exception as error:  # noqa: BLE001 the next group has its turn whatever happens
                self.left_on += group
                self.state.tracebacks.keep(self._now(), error)
        return list(self.left_on)

    def command(self, command: JointCommand | None, time: float = math.inf) -> int:
        """Send goals a time [s] nearer to a command, or as they are; joints too slow for it."""
        goals, slow = self._goals, 0
        if command is not None:
            wanted: Floats = self.joints.ticks(command).astype(float)
            if goals is not None and math.isfinite(time):
                reach = self.joints.reach(time)
                slow = int((abs(wanted - goals) > reach).sum())
                wanted = goals + np.clip(wanted - goals, -reach, reach)
            goals = wanted
        if goals is None:
            return 0
        pairs = zip(self.joints.ids, np.rint(goals).astype(int).tolist(), strict=True)
        torque.send_goals(self.bus, dict(pairs))
        if self._goals is not None:
            self._goals = goals
        return slow

    def away(self, command: JointCommand, time: float) -> int:
        """Number of joints that a time [s] is too short for, on their way to a command."""
        if self._goals is None:
            return 0
        way = abs(self.joints.ticks(command) - self._goals)
        return int((way > self.joints.reach(time)).sum())

    def maintain(self, may_begin: bool) -> None:
        """Let legs that have turned far forget their turns, a step a tick."""
        if self._goals is None:
            return
        if may_begin:
            self.turns.begin(self._goals)
        self.turns.step(self._goals, self.state.positions, may_begin)

    def look(self) -> None:
        """Read all positions, and a little more in turn; judge whether joints follow."""
        state, ids, began = self.state, self.joints.ids, self._now()
        state.loose = self.turns.loose
        state.step(tuple(ids[at] for at in self.following.suspects))
        ticks = np.array([state.positions.get(servo, math.nan) for servo in ids])
        silent = np.array([servo not in state.answered for servo in ids])
        state.angles = tuple(np.where(silent, math.nan, self.joints.angles(ticks)).tolist())
        if self._goals is not None:
            idle = {*state.watchdogs, *state.disarmed, *state.modes}  # why they do not follow
            unknown = np.array([state.missed[servo] > 0 or servo in idle for servo in ids])
            self._judge((began, state.read_at), np.where(unknown, math.nan, ticks))

    def _judge(self, span: tuple[float, float], ticks: Floats) -> None:
        """Whether joints follow, unless they stand for legs that forget their turns."""
        state, following = self.state, self.following
        if self._goals is None or self.turns.standing:
            following.rest()
            return
        following.step(span, self._goals, ticks)
        if state.drive is not None:
            servo, pwm, position = state.drive
            following.drive(self._now(), self.joints.ids.index(servo), pwm, position)
        state.joints, state.margins = following.faults, following.margins
