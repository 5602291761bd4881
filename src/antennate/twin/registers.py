"""One DYNAMIXEL servo as a register machine: what it stores, refuses and does. Time is an argument.

It moves to its goal at a limited speed and without inertia. Where the manuals are silent the worse
case is assumed: torque on keeps an old goal, as reported in
https://github.com/pollen-robotics/reachy_mini/issues/1136, and so does a Clear; a tripped bus
watchdog takes nothing but 0; a read that touches an undefined byte is refused as a whole; a restart
takes a quarter second.
"""

from __future__ import annotations

import math

from antennate.hardware.dynamixel.packets import StatusError
from antennate.hardware.dynamixel.tables import (
    EXTENDED_MODE,
    GOALS,
    POSITION_UNIT,
    VELOCITY_UNIT,
    WATCHDOG_UNIT,
    Register,
    Table,
)

BOOT_TIME = 0.25
"""Time after a reboot in which it takes nothing [s]; assumed, the manual says nothing."""

_POSITION_MODES = (3, 4, 5)
_VELOCITY_MODE = 1
_TICKS = 4096
_SPEED_UNIT = VELOCITY_UNIT / POSITION_UNIT
_TORQUE_BY_GOAL = 8
"""Bit of Drive Mode."""
_TRIPPED = -1
_FIRMWARE = 48
_VOLTS_MARGIN = 10
_ROOM_TEMPERATURE = 25


class Servo:
    """One servo with its control table.

    Args:
        table: Its model.
        servo: Its id.
        position: Where its shaft is [ticks].
        t: Time of power-on [s].
    """

    def __init__(self, table: Table, servo: int, position: float = 2048.0, t: float = 0.0) -> None:
        self.table = table
        self.eeprom_writes = 0
        self._memory = bytearray(max(r.address + r.size for r in table.registers.values()))
        self._starts = {r.address: r for r in table.registers.values()}
        self._where = {
            r.name: (slice(r.address, r.address + r.size), r.size, r.signed)
            for r in table.registers.values()
        }
        self._defined = {
            a for r in self._starts.values() for a in range(r.address, r.address + r.size)
        }
        for register in table.registers.values():
            self.set(register.name, register.default or 0)
        self.set("id", servo)
        self.set("firmware_version", _FIRMWARE)
        self._position = position
        self._t = t
        self._start(t)

    # for the twin and for tests: anything goes

    def get(self, name: str) -> int:
        """The value of a register."""
        where, _, signed = self._where[name]
        return int.from_bytes(self._memory[where], "little", signed=signed)

    def set(self, name: str, value: int) -> None:
        """Change a register, whatever its access."""
        where, size, signed = self._where[name]
        self._memory[where] = value.to_bytes(size, "little", signed=signed)

    @property
    def position(self) -> float:
        """Where the shaft is [ticks]."""
        return self._position

    @property
    def last_fed(self) -> float:
        """When an instruction packet last fed its bus watchdog [s]."""
        return self._fed

    @property
    def torque(self) -> bool:
        """It holds or moves."""
        return self.get("torque_enable") == 1

    def place(self, position: float) -> None:
        """Somebody turns the shaft [ticks]."""
        self._position = position
        self.set("present_position", round(position))

    def fail(self, bits: int) -> None:
        """A hardware error: latched until a reboot; torque goes if Shutdown says so."""
        self.set("hardware_error_status", self.get("hardware_error_status") | bits)
        if bits & self.get("shutdown"):
            self.set("torque_enable", 0)

    def restart(self, t: float, time: float = BOOT_TIME) -> None:
        """Power lost and back after a time [s]: registers below 64 stay, others are reset."""
        self.advance(t)
        self._start(t + time)

    # what the wire sees

    def awake(self, t: float) -> bool:
        """It takes packets."""
        return t >= self._boot

    def advance(self, t: float) -> None:
        """Let time pass until t [s]."""
        if t <= self._t:
            return
        trip = self._trip_time()
        if trip < t:
            self._move(trip)
            self.set("bus_watchdog", _TRIPPED)
            self._stopped = True
        self._move(t)

    def feed_watchdog(self, t: float) -> None:
        """An instruction packet, for any servo, was on the bus."""
        self.advance(t)
        self._fed = t

    def read(self, address: int, length: int) -> tuple[StatusError, bytes]:
        """Bytes of the table."""
        if not length or any(a not in self._defined for a in range(address, address + length)):
            return StatusError.ACCESS, b""
        return StatusError.NONE, bytes(self._memory[address : address + length])

    def write(self, address: int, data: bytes) -> StatusError:
        """Write whole registers, all or none of them."""
        changes: list[tuple[Register, int]] = []
        at = 0
        while at < len(data) or not data:
            register = self._starts.get(address + at)
            if register is None or not register.writable:
                return StatusError.ACCESS
            if len(data) - at < register.size:
                return StatusError.DATA_LENGTH
            changes.append((register, register.decode(data[at : at + register.size])))
            at += register.size
        for register, value in changes:
            if (error := self._refuses(register, value)) != StatusError.NONE:
                return error
        for register, value in changes:
            self._store(register, value)
        return StatusError.NONE

    def clear_turns(self) -> StatusError:
        """Forget whole turns; not while moving."""
        if self.get("moving"):
            return StatusError.RESULT_FAIL
        self._position %= _TICKS
        self._show(0.0)
        return StatusError.NONE

    # inside

    def _start(self, boot: float) -> None:
        for register in self.table.registers.values():
            if not register.eeprom:
                self.set(register.name, register.default or 0)
        for goal, limit in (("goal_pwm", "pwm_limit"), ("goal_velocity", "velocity_limit")):
            self.set(goal, self.get(limit))
        if "goal_current" in self.table.registers:
            self.set("goal_current", self.get("current_limit"))
        if self.get("operating_mode") != EXTENDED_MODE:
            self._position %= _TICKS
        self.set("goal_position", round(self._position))
        self.set("present_input_voltage", self.get("min_voltage_limit") + _VOLTS_MARGIN)
        self.set("present_temperature", _ROOM_TEMPERATURE)
        self._boot = self._fed = boot
        self._stopped = False
        self._show(0.0)

    def _refuses(self, register: Register, value: int) -> StatusError:
        if register.eeprom and self.torque:
            return StatusError.ACCESS
        locked = register.name in GOALS or (register.name == "bus_watchdog" and value != 0)
        if locked and self.get("bus_watchdog") == _TRIPPED:
            return StatusError.DATA_RANGE
        low, high = register.low, register.high
        if (low is not None and value < low) or (high is not None and value > high):
            return StatusError.DATA_RANGE
        if register.name == "torque_enable" and value and self.get("hardware_error_status"):
            return StatusError.RESULT_FAIL
        least, most = self._limits(register.name)
        return StatusError.NONE if least <= value <= most else StatusError.DATA_LIMIT

    def _limits(self, name: str) -> tuple[float, float]:
        if name == "goal_position" and self.get("operating_mode") != EXTENDED_MODE:
            return self.get("min_position_limit"), self.get("max_position_limit")
        limits = {
            "goal_velocity": "velocity_limit",
            "profile_velocity": "velocity_limit",
            "goal_pwm": "pwm_limit",
            "goal_current": "current_limit",
        }
        bound = self.get(limits[name]) if name in limits else math.inf
        return -bound, bound

    def _store(self, register: Register, value: int) -> None:
        if register.eeprom:
            self.eeprom_writes += 1
        if register.name in GOALS or register.name == "torque_enable":
            self._stopped = False
        if register.name in ("torque_enable", "bus_watchdog"):
            self._fed = max(self._fed, self._t)
        self.set(register.name, value)
        if register.name in GOALS and self.get("drive_mode") & _TORQUE_BY_GOAL:
            self.set("torque_enable", 1)
        if register.name == "operating_mode":
            self.set("goal_position", round(self._position))

    def _trip_time(self) -> float:
        watchdog = self.get("bus_watchdog")
        if watchdog <= 0 or not self.torque:
            return math.inf
        return self._fed + WATCHDOG_UNIT * watchdog

    def _speed(self) -> float:
        """Velocity that is aimed at [ticks/s], with sign in velocity mode, else the limit."""
        if self.get("operating_mode") == _VELOCITY_MODE:
            return _SPEED_UNIT * self.get("goal_velocity")
        limit = self.get("velocity_limit")
        return _SPEED_UNIT * min(self.get("profile_velocity") or limit, limit)

    def _move(self, t: float) -> None:
        elapsed = max(t - self._t, 0.0)
        self._t = max(self._t, t)
        step = 0.0
        mode = self.get("operating_mode")
        if self.torque and not self._stopped:
            reach = self._speed() * elapsed
            if mode == _VELOCITY_MODE:
                step = reach
            elif mode in _POSITION_MODES:
                step = self.get("goal_position") - self._position
                step = max(-reach, min(reach, step))
        self._position += step
        if elapsed:
            self._show(step / elapsed)

    def _show(self, speed: float) -> None:
        self.set("present_velocity", round(speed / _SPEED_UNIT))
        self.set("present_position", round(self._position))
        self.set("moving", int(abs(speed) / _SPEED_UNIT > self.get("moving_threshold")))
        since = max(self._t - self._boot, 0.0)
        self.set("realtime_tick", int(1e3 * since) % 32_768)
