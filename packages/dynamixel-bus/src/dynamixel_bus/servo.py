"""One virtual servo as a register machine: what it stores, refuses and does. Time is an argument.

Where the manuals are silent the worse case is assumed: torque on keeps an old goal, as reported in
https://github.com/pollen-robotics/reachy_mini/issues/1136, and so does a Clear; a tripped bus
watchdog takes nothing but 0; a restart takes a quarter second.
"""

from __future__ import annotations

import math

from dynamixel_bus.faults import Trouble
from dynamixel_bus.memory import TRIPPED, Memory, beyond_limits, refuses, shut_down
from dynamixel_bus.model import (
    CURRENT_MODE,
    GOALS,
    POSITION_MODE,
    PWM_MODE,
    TORQUE_BY_GOAL,
    WATCHDOG_UNIT,
    Register,
    ServoModel,
)
from dynamixel_bus.motion import Motion, MotorMotion
from dynamixel_bus.packets import StatusError

BOOT_TIME = 0.25
"""Time after a reboot in which it takes nothing [s]; assumed, the manual says nothing."""

_ROOM_TEMPERATURE = 25
_TORQUE_AT_START, _RAM_AT_START = 1, 2
"""Bits of Startup Configuration."""
_REPORTED = frozenset(
    {"moving", "moving_status", "present_pwm", "present_load", "present_current"}
    | {"present_velocity", "present_position", "velocity_trajectory", "position_trajectory"}
)
"""Registers that tell what the shaft does."""


class Servo:
    """One servo with its control table.

    Args:
        model: Its model.
        servo: Its id.
        position: Where its shaft is [ticks].
        t: Time of power-on [s].

    Attributes:
        model: Its model.
        memory: The control table.
        motion: Its shaft, and how it is moved.
        eeprom_writes: Registers of the EEPROM written so far.
        plugged: It is on the bus and has power.
        registered: Address and data of a Reg Write that waits for its Action.
        trouble: What is wrong with its answers.
    """

    def __init__(
        self, model: ServoModel, servo: int, position: float = 2048.0, t: float = 0.0
    ) -> None:
        self.model = model
        self.memory = Memory(model)
        self.motion = self._make_motion(position)
        self.eeprom_writes = 0
        self.plugged = True
        self.registered: tuple[int, bytes] | None = None
        self.trouble: Trouble | None = None
        self._moved, self._reported = True, -1
        self._t = self._fed = self._boot = t
        self.set("id", servo)
        self.set("firmware_version", model.firmware)
        self._start(t)

    # for whoever runs it: anything goes

    def get(self, name: str) -> int:
        """The value of a register."""
        if name in _REPORTED:
            self._report()
        return self.memory.get(name)

    def set(self, name: str, value: int) -> None:
        """Change a register, whatever its access."""
        self.memory.set(name, value)

    @property
    def position(self) -> float:
        """Where the shaft is, as the servo counts [ticks]."""
        self._refresh()
        return self.motion.position

    @property
    def last_fed(self) -> float:
        """When an instruction packet last fed its bus watchdog [s]."""
        return self._fed

    @property
    def torque(self) -> bool:
        """Whether the servo holds or moves."""
        return self.get("torque_enable") == 1

    def place(self, position: float) -> None:
        """Somebody turns the shaft to where the servo counts this [ticks]."""
        self._refresh()
        self.motion.place(position)
        self._show()

    def push(self, ticks: float) -> None:
        """Somebody turns the shaft there [ticks], if it has no torque."""
        if not self.torque:
            self._refresh()
            self.motion.turn_to(ticks)
            self._show()

    def fail(self, bits: int) -> None:
        """A hardware error: latched until a reboot; torque goes if Shutdown says so."""
        self.set("hardware_error_status", self.get("hardware_error_status") | bits)
        if bits & self.get("shutdown"):
            self.set("torque_enable", 0)

    def freeze(self, frozen: bool = True) -> None:
        """Let it tell its present position from now on, or the true one again."""
        self._refresh()
        self.motion.frozen = round(self.motion.position) if frozen else None
        self._show()

    def misread(self, ticks: int) -> None:
        """Let it tell a position that is wrong by so much from now on."""
        self.motion.misread = ticks
        self._show()

    def restart(self, t: float, time: float = BOOT_TIME) -> None:
        """Power lost and back after a time [s]: registers below 64 stay, others are reset."""
        self.advance(t)
        self._start(t + time)

    def plug(self, t: float, into: bool = True) -> None:
        """Put it on the bus, which gives it power; or take it off."""
        self.restart(t)
        self.plugged = into
        if not into:
            self.set("torque_enable", 0)

    # what the wire sees

    def awake(self, t: float) -> bool:
        """Whether the servo takes packets."""
        return self.plugged and t >= self._boot

    def advance(self, t: float) -> None:
        """Let time pass until t [s]."""
        if t <= self._t:
            return
        trip = self._trip_time()
        if trip < t:
            self._move(trip)
            self.set("bus_watchdog", TRIPPED)
            self.motion.stopped = True
        self._move(t)

    def feed_watchdog(self, t: float) -> None:
        """An instruction packet, for any servo, was on the bus."""
        self.advance(t)
        self._fed = t

    def read(self, address: int, length: int) -> tuple[StatusError, bytes]:
        """Bytes of the table."""
        self._report()
        return self.memory.read(address, length)

    def write(self, address: int, data: bytes, ram_only: bool = False) -> StatusError:
        """Write whole registers, all or none of them; of the EEPROM none if `ram_only`."""
        error, changes = self._changes(address, data, ram_only)
        for register, value in changes:
            self._store(register, value)
        return error

    def refuses(self, address: int, data: bytes, ram_only: bool = False) -> StatusError:
        """Why a write could not be done now, NONE if it could."""
        return self._changes(address, data, ram_only)[0]

    def clear_turns(self) -> StatusError:
        """Forget whole turns; not while moving."""
        if self.get("moving"):
            return StatusError.RESULT_FAIL
        self._refresh()
        self.motion.rebase()
        self._show()
        return StatusError.NONE

    def factory_reset(self, t: float, keep: tuple[str, ...]) -> None:
        """All registers as delivered but for those to keep; it starts anew."""
        for name, register in self.model.registers.items():
            if register.eeprom and register.writable and name not in keep:
                self.eeprom_writes += 1
                self.set(name, register.default or 0)
        self.restart(t)

    def store_backup(self) -> StatusError:
        """Keep a copy of the registers that a backup has; not under torque."""
        if self.torque:
            return StatusError.RESULT_FAIL
        self.memory.store()
        return StatusError.NONE

    def restore_backup(self) -> StatusError:
        """Take them from the copy; not under torque, and not without one."""
        if self.torque or not self.get("backup_ready"):
            return StatusError.RESULT_FAIL
        self.memory.restore()
        return StatusError.NONE

    # inside

    def _changes(
        self, address: int, data: bytes, ram_only: bool
    ) -> tuple[StatusError, list[tuple[Register, int]]]:
        error, changes = self.memory.changes(address, data, locked=ram_only or self.torque)
        for register, value in changes:
            error = error or refuses(self.memory, register, value)
        return error, [] if error else changes

    def _make_motion(self, position: float) -> Motion:
        return MotorMotion(self.memory, position)

    def _start(self, boot: float) -> None:
        startup = self.get("startup_configuration")
        self.memory.start(stored=bool(startup & _RAM_AT_START))
        self.set("present_input_voltage", round(10 * self.model.rating.voltage))
        self.set("present_temperature", _ROOM_TEMPERATURE)
        self.registered = None
        self._boot = boot
        self.motion.stopped = False
        self.motion.shaft.rest()
        self._refresh()
        self.motion.rebase()
        self._reset_goals()
        self.set("torque_enable", startup & _TORQUE_AT_START)
        self._show()

    def _reset_goals(self) -> None:
        """Goals as after power-on and a change of the mode: full drive, but no motion."""
        mode = self.get("operating_mode")
        self.set("goal_pwm", 0 if mode == PWM_MODE else self.get("pwm_limit"))
        if "goal_current" in self.model.registers:
            self.set("goal_current", 0 if mode == CURRENT_MODE else self.get("current_limit"))
        self.set("goal_velocity", 0)
        self.set("goal_position", round(self.position))

    def _store(self, register: Register, value: int) -> None:
        name, torque = register.name, self.torque
        if register.eeprom:
            self.eeprom_writes += 1
        if name in GOALS or name == "torque_enable":
            self.motion.stopped = False
        if name in ("torque_enable", "bus_watchdog"):
            self._fed = max(self._fed, self._t)
        self.set(name, value)
        by_goal = name in GOALS and self.get("drive_mode") & TORQUE_BY_GOAL
        if not torque and (by_goal or (name == "torque_enable" and value)):
            self._raise_torque()
        if name == "operating_mode":
            self._change_mode()

    def _raise_torque(self) -> None:
        """Torque comes on: in position mode it counts within one turn then."""
        if shut_down(self.memory):
            return
        if self.get("operating_mode") == POSITION_MODE:
            self.motion.rebase()
        self.set("torque_enable", 1)

    def _change_mode(self) -> None:
        """Gains, profile and goals are reset; position mode counts within one turn."""
        for name, register in self.model.registers.items():
            if "gain" in name or name.startswith("profile_"):
                self.set(name, register.default or 0)
        if self.get("operating_mode") == POSITION_MODE:
            self.motion.rebase()
        self._reset_goals()

    def _trip_time(self) -> float:
        watchdog = self.get("bus_watchdog")
        if watchdog <= 0 or not self.torque:
            return math.inf
        return self._fed + WATCHDOG_UNIT * watchdog

    def _refresh(self) -> None:
        """Take note of registers that have changed."""
        if self.motion.refresh(max(self._t, self._fed)):
            if bits := beyond_limits(self.memory):
                self.fail(bits)
            self.motion.refresh(max(self._t, self._fed))

    def _move(self, t: float) -> None:
        self._refresh()
        self._moved |= self.motion.move(t)
        self._t = max(self._t, t)
        since = max(self._t - self._boot, 0.0)
        self.memory.show("realtime_tick", int(1e3 * since) % 32_768)

    def _show(self) -> None:
        """Something has happened that registers tell, once anybody reads them."""
        self._refresh()
        self._moved = True

    def _report(self) -> None:
        """Let registers tell what the shaft does, if it or a register has changed since."""
        if self._moved or self._reported != self.memory.version:
            self._refresh()
            self._moved, self._reported = False, self.memory.version
            self.motion.show(self._t)
