"""From power-on to torque without a jump: who is there, watchdogs armed, goals where servos stand.

Each step changes nothing unless all servos are fit for it, and what was written is read back.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence

from antennate.hardware.actuators import ActuatorError
from antennate.hardware.dynamixel import inquiry
from antennate.hardware.dynamixel.answers import Span, Value
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.dynamixel.inquiry import Present, State
from antennate.hardware.dynamixel.tables import EXTENDED_MODE, XC430_W240, Register, model_name
from antennate.hardware.ports.port import PortError

WATCHDOG_COUNTS = 5
"""Bus watchdog [20 ms]: a servo stops 100 ms, ten ticks, after the last packet (assumed)."""

_TRIES = 5
"""Tries to take torque off: at 1 % loss five in a row are one in 10^10 (assumed)."""
_WRITES = 3
"""Writes until a servo that has another value is given up: noise seldom spoils three (assumed)."""
_READS = 10
"""Tries until a servo is given up that is asked: 1 s, so that a computer which stands still for a
while is no silent servo (assumed)."""
_BUDGET = 0.1
"""Time for one reading of all outside the loop [s]: ten times what 19 answers take (assumed)."""
_COMMON = XC430_W240.registers
"""Both models have the registers used here at the same addresses."""
_TORQUE = _COMMON["torque_enable"]


class BringUpError(ActuatorError):
    """The servos are not fit to be moved; says which and why."""


def require(bus: Bus, expected: Mapping[int, int]) -> None:
    """Whether the servos of these model numbers by id are on the bus, and nothing else.

    Raises:
        BringUpError: Otherwise; the text says each id that is not, and why.
    """
    faults = {i: _fault(inquiry.look(bus, i), model) for i, model in expected.items()}
    strangers = {status.id for status in bus.scan()} - faults.keys()
    faults |= dict.fromkeys(sorted(strangers), "not expected")
    wrong: dict[str, list[int]] = {}
    for servo, fault in faults.items():
        if fault:
            wrong.setdefault(fault, []).append(servo)
    if wrong:
        fit = len(faults) - sum(map(len, wrong.values()))
        why = "; ".join(f"{_named(ids, len(expected))}: {fault}" for fault, ids in wrong.items())
        raise BringUpError(f"expected {len(expected)} servos, found {fit} fit; {why}")


def _named(ids: Sequence[int], count: int) -> str:
    if len(ids) == count > 1:
        return f"all {count}"
    return f"id{'s' if len(ids) > 1 else ''} {', '.join(map(str, ids))}"


def require_models(bus: Bus, models: Mapping[int, int]) -> None:
    """All ids answer with these model numbers: a glance of some ms, unlike `require`.

    Raises:
        BringUpError: One did not answer, or with another model.
    """
    found = read_register(bus, list(models), _COMMON["model_number"])
    if wrong := {i: found[i] for i, model in models.items() if found[i] != model}:
        wanted = {i: models[i] for i in wrong}
        raise BringUpError(f"expected model numbers {wanted} by id, found {wrong}")


def hold_here(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Make each goal position the present one [ticks], and read it back.

    Raises:
        BringUpError: A servo did not answer, or refused: a tripped bus watchdog locks goals.
    """
    register, wrong = _COMMON["goal_position"], dict[int, int]()
    for _ in range(_WRITES):
        present = read_register(bus, ids, _COMMON["present_position"])  # it may be moved by hand
        wrong = _written(bus, register, present)
        if not wrong:
            return present
    raise _unwritten(register, wrong)


def require_modes(bus: Bus, modes: Mapping[int, int]) -> None:
    """All ids are in these operating modes: another program may have changed one since.

    Raises:
        BringUpError: One did not answer, or is in another mode.
    """
    found = read_register(bus, list(modes), _COMMON["operating_mode"])
    if wrong := {i: found[i] for i, mode in modes.items() if found[i] != mode}:
        wanted = {i: modes[i] for i in wrong}
        raise BringUpError(f"expected operating modes {wanted} by id, found {wrong}")


def arm_watchdogs(bus: Bus, ids: Sequence[int], counts: int = WATCHDOG_COUNTS) -> None:
    """Clear the bus watchdogs, hold the present position, and arm them.

    Raises:
        BringUpError: A servo did not take it; or it is in extended position mode with a homing
            offset, where the watchdog makes it move
            (https://github.com/ROBOTIS-GIT/DynamixelSDK/issues/584).
    """
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

    Raises:
        BringUpError: A servo did not take it.
    """
    _write_checked(bus, _COMMON["profile_acceleration"], dict.fromkeys(velocities, 0))
    _write_checked(bus, _COMMON["profile_velocity"], velocities)


def allow_full_pwm(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Let each servo use all of the PWM that its EEPROM allows: that, by id.

    Goal PWM bounds the force in every mode of position. It stays as it is written until the supply
    goes off, so that a `jog` that was killed would leave a joint without force.

    Raises:
        BringUpError: A servo did not take it.
    """
    limits = read_register(bus, ids, _COMMON["pwm_limit"])
    _write_checked(bus, _COMMON["goal_pwm"], limits)
    return limits


def enable(bus: Bus, ids: Sequence[int]) -> dict[int, int]:
    """Torque on, each servo where it stands: those positions [ticks].

    Raises:
        BringUpError: A servo did not take it; those that did keep holding their place.
    """
    register, left = _COMMON["torque_enable"], dict.fromkeys(ids, 1)
    wrong: dict[int, int] = {}
    for _ in range(_WRITES):
        present = hold_here(bus, ids)
        wrong = _written(bus, register, left)
        if not wrong:
            return present
        left = dict.fromkeys(wrong, 1)
    raise _unwritten(register, wrong)


def disable(
    bus: Bus, ids: Sequence[int], tries: int = _TRIES, budget: float = _BUDGET
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


def read_register(bus: Bus, ids: Sequence[int], register: Register) -> dict[int, int]:
    """One register of each servo.

    Raises:
        BringUpError: A servo did not answer after several tries.
    """
    values = inquiry.read_some(bus, ids, register, _READS, _BUDGET)
    if left := [servo for servo in ids if servo not in values]:
        raise BringUpError(f"could not read {register.name} of servos {left}")
    return values


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
    """Write a register of each servo once; those that have another value then, and that value.

    A packet for all servos has no answer, so one lost byte of it is seen only by reading.
    """
    bus.write_all(register.address, {i: register.encode(v) for i, v in values.items()})
    there = read_register(bus, list(values), register)
    return {i: there[i] for i, value in values.items() if there[i] != value}


def _unwritten(register: Register, wrong: Mapping[int, int]) -> BringUpError:
    """The error of servos that kept other values."""
    by_value: dict[int, list[int]] = {}
    for servo, value in wrong.items():
        by_value.setdefault(value, []).append(servo)
    found = ", ".join(f"{value} in servos {ids}" for value, ids in by_value.items())
    return BringUpError(f"could not write {register.name}, found {found}")


def _fault(present: Present | None, model: int) -> str:
    """What is wrong with a servo, empty if nothing is."""
    if present is None:
        return "silent"
    if present.model not in (None, model):
        return f"expected model {model_name(model)}, found number {present.model}"
    return _REASONS[present.state]


_REASONS: Mapping[State, str] = {
    "ok": "",
    "broken": "answers are never whole: two servos with this id, or a bad cable?",
    "collides": "answers collide: two servos with this id?",
    "mute": "answers pings alone: switch its supply off and on",
}
