"""Torque, goals and watchdogs: the only module that writes registers 64, 98 and 100 to 119.

Nothing here decides: whether torque may come on says the supervisor of a walking robot, or the
person who moves one joint by keys. A packet for all servos has no answer, so what was written is
read back. Registers have the same addresses in all models.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence

from antennate.hardware.dynamixel.bringup import BringUpError, read_register
from antennate.hardware.safety.deadlines import READ_LEG, READ_OUTSIDE, WATCHDOG_COUNTS
from dynamixel_bus import inquiry
from dynamixel_bus.answers import Answer, Span, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import EXTENDED_MODE, Register
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.port import PortError

_TRIES = 5
"""Tries to take torque off: at 1 % loss five in a row are one in 10^10 (assumed)."""
_WRITES = 3
"""Writes until a servo that has another value is given up: noise seldom spoils three (assumed)."""
_COMMON = XC430_W240.registers
_TORQUE, _GOAL = _COMMON["torque_enable"], _COMMON["goal_position"]


def send_goals(bus: Bus, goals: Mapping[int, int]) -> None:
    """Goal positions by id [ticks]; nothing is read back."""
    bus.write_all(_GOAL.address, {servo: _GOAL.encode(goal) for servo, goal in goals.items()})


def ask_goal(bus: Bus, servo: int, goal: int) -> Answer:
    """Goal position of one servo [ticks], and its answer: a Value if it took it."""
    return bus.write(servo, _GOAL.address, _GOAL.encode(goal))


def hold_here(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Make each goal position the present one [ticks], and read it back."""
    wrong = dict[int, int]()
    for _ in range(_WRITES):
        present = read_register(bus, ids, _COMMON["present_position"])  # it may be moved by hand
        wrong = _written(bus, _GOAL, present)
        if not wrong:
            return present
    raise _unwritten(_GOAL, wrong)


def arm_watchdogs(bus: Bus, ids: Sequence[int], counts: int = WATCHDOG_COUNTS) -> None:
    """Clear the bus watchdogs, hold the present position, and arm them."""
    modes = read_register(bus, ids, _COMMON["operating_mode"])
    offsets = read_register(bus, ids, _COMMON["homing_offset"])
    if bad := [i for i in ids if modes[i] == EXTENDED_MODE and offsets[i]]:
        raise BringUpError(
            f"expected no homing offset in extended position mode, found one in servos {bad}"
        )
    _write_checked(bus, _COMMON["bus_watchdog"], dict.fromkeys(ids, 0))
    hold_here(bus, ids)
    _write_checked(bus, _COMMON["bus_watchdog"], dict.fromkeys(ids, counts))


def limit_speed(bus: Bus, velocities: Mapping[int, int]) -> None:
    """Give each servo its profile velocity [0.229 rev/min], and no profile acceleration.

    Another program may have left others; after a restart there is none.
    """
    _write_checked(bus, _COMMON["profile_acceleration"], dict.fromkeys(velocities, 0))
    _write_checked(bus, _COMMON["profile_velocity"], velocities)


def allow_full_pwm(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Let each servo use all of the PWM that its EEPROM allows: that, by id.

    Goal PWM bounds the force in every mode of position. It stays as it is written until the supply
    goes off, so that a `setup jog` that was killed would leave a joint without force.
    """
    limits = read_register(bus, ids, _COMMON["pwm_limit"])
    limit_pwm(bus, limits)
    return limits


def limit_pwm(bus: Bus, pwm: Mapping[int, int]) -> None:
    """Give each servo its largest PWM [0.113 %]."""
    _write_checked(bus, _COMMON["goal_pwm"], pwm)


def enable(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Torque on, each servo where it stands: those positions [ticks]."""
    left, wrong = dict.fromkeys(ids, 1), dict[int, int]()
    for _ in range(_WRITES):
        present = hold_here(bus, ids)
        wrong = _written(bus, _TORQUE, left)
        if not wrong:
            return present
        left = dict.fromkeys(wrong, 1)
    raise _unwritten(_TORQUE, wrong)


def disable(
    bus: Bus, ids: Sequence[int], tries: int = _TRIES, budget: float = READ_OUTSIDE
) -> list[int]:
    """Torque off as well as can be, whatever the bus does: the ids that did not confirm it.

    The watchdogs of the others are switched off, so that nobody takes the robot for one whose
    program died; those that may have torque keep theirs. The last of the tries, each with a budget
    of time for the answers [s], writes into noise as well.
    """
    left = list(ids)
    for more in reversed(range(tries)):
        with contextlib.suppress(PortError):
            bus.write_all(_TORQUE.address, dict.fromkeys(left, b"\0"), anyway=not more)
            replies = bus.read_all(left, Span(_TORQUE.address, 1, spare=1), budget)
            left = [i for i in left if not isinstance(r := replies[i], Value) or r.data != b"\0"]
        if not left:
            break
        if more:
            with contextlib.suppress(PortError):
                bus.settle()
    if off := [i for i in ids if i not in left]:
        with contextlib.suppress(PortError):
            bus.write_all(_COMMON["bus_watchdog"].address, dict.fromkeys(off, b"\0"), anyway=True)
    return left


def loosen(bus: Bus, servo: int) -> bool:
    """Torque off for one servo while others walk, in a part of a tick; whether it confirmed it."""
    return _took(bus, servo, _TORQUE, 0)


def fasten(bus: Bus, servo: int, place: int) -> bool:
    """Goal of one loose servo where it stands [ticks], then torque; whether it confirmed both."""
    return _took(bus, servo, _GOAL, place) and _took(bus, servo, _TORQUE, 1)


def _took(bus: Bus, servo: int, register: Register, value: int) -> bool:
    bus.write_all(register.address, {servo: register.encode(value)})
    return inquiry.read_once(bus, servo, register, READ_LEG) == value


def _write_checked(bus: Bus, register: Register, values: Mapping[int, int]) -> None:
    """Write a register of each servo, and again where another value is read back."""
    left, wrong = dict(values), dict[int, int]()
    for _ in range(_WRITES):
        wrong = _written(bus, register, left)
        if not wrong:
            return
        left = {i: values[i] for i in wrong}
    raise _unwritten(register, wrong)


def _written(bus: Bus, register: Register, values: Mapping[int, int]) -> dict[int, int]:
    """Write a register of each servo once; those that have another value then, and that value."""
    bus.write_all(register.address, {i: register.encode(v) for i, v in values.items()})
    there = read_register(bus, list(values), register)
    return {i: there[i] for i, value in values.items() if there[i] != value}


def _unwritten(register: Register, wrong: Mapping[int, int]) -> BringUpError:
    """The error of servos that kept other values."""
    by_value: dict[int, list[int]] = {}
    for servo, value in wrong.items():
        by_value.setdefault(value, []).append(servo)
    values = ", ".join(f"{value} in servos {ids}" for value, ids in by_value.items())
    return BringUpError(f"could not write {register.name}, found {values}")
