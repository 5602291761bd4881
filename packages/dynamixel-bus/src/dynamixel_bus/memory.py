"""The control table of one virtual servo as bytes: what may be read, what may be written where.

Ranges are those of the manual, and limits by other registers. Where the manuals are silent, a read
that touches an undefined byte is refused as a whole.
"""

from __future__ import annotations

import math

from dynamixel_bus.model import (
    CURRENT_POSITION_MODE,
    EXTENDED_MODE,
    GOALS,
    MOST_TICKS,
    TIME_BASED,
    Register,
    ServoModel,
)
from dynamixel_bus.packets import StatusError

TRIPPED = -1
"""Value of a bus watchdog that has stopped the servo."""
_UNUSED_DRIVE_MODE = 2
_VOLTAGE_ERROR, _HEAT_ERROR = 1, 4
"""Bits of Hardware Error Status."""
_LIMITS = {
    "goal_velocity": "velocity_limit",
    "goal_pwm": "pwm_limit",
    "goal_current": "current_limit",
    "profile_velocity": "velocity_limit",
}


class Memory:
    """The bytes of a control table, indirect data included.

    A byte of indirect data is the byte at its indirect address, which as delivered is its own. A
    register that is written through indirect data has to be named there whole and in order.

    Args:
        model: Its model.

    Attributes:
        model: Its model.
        version: Counts the changes by `set`, so that what follows from them can be kept.
        settings: The same without changes of goals.
    """

    def __init__(self, model: ServoModel) -> None:
        self.model = model
        self.version = self.settings = 0
        self._stored: bytes | None = None
        registers = model.registers.values()
        self._bytes = bytearray(max(r.address + r.size for r in registers))
        self._starts = {r.address: r for r in registers}
        self._where = {
            r.name: (slice(r.address, r.address + r.size), r.size, r.signed) for r in registers
        }
        self._values: dict[str, int] = {}
        self._defined = {a for r in registers for a in range(r.address, r.address + r.size)}
        for register in registers:
            self.set(register.name, register.default or 0)

    def get(self, name: str) -> int:
        """The value of a register."""
        return self._values[name]

    def set(self, name: str, value: int) -> None:
        """Change a register, whatever its access."""
        self.show(name, value)
        self.version += 1
        self.settings += name not in GOALS

    def show(self, name: str, value: int) -> None:
        """Change a register that only tells what happens, such as a present velocity."""
        where, size, signed = self._where[name]
        self._bytes[where] = value.to_bytes(size, "little", signed=signed)
        self._values[name] = value

    def read(self, address: int, length: int) -> tuple[StatusError, bytes]:
        """Bytes from an address on."""
        places = self._places(address, length)
        if not places or any(place not in self._defined for place in places):
            return StatusError.ACCESS, b""
        return StatusError.NONE, bytes(self._bytes[place] for place in places)

    def changes(
        self, address: int, data: bytes, locked: bool
    ) -> tuple[StatusError, list[tuple[Register, int]]]:
        """The registers that a write changes and their new values, or why there are none.

        Args:
            address: Where it begins.
            data: Whole registers.
            locked: Whether the EEPROM is locked.
        """
        places = self._places(address, len(data))
        found: list[tuple[Register, int]] = []
        at = 0
        while at < len(places) or not places:
            register = self._starts.get(places[at]) if places else None
            if register is None or not register.writable or (locked and register.eeprom):
                return StatusError.ACCESS, []
            end = at + register.size
            whole = range(register.address, register.address + register.size)
            if places[at:end] != list(whole):
                return StatusError.DATA_LENGTH, []
            found.append((register, register.decode(data[at:end])))
            at = end
        return StatusError.NONE, found

    def start(self, stored: bool) -> None:
        """Let the RAM be as after power-on; that of the backup if `stored`."""
        for register in self.model.registers.values():
            if not register.eeprom:
                self.set(register.name, register.default or 0)
        self.set("backup_ready", int(self._stored is not None))
        if stored:
            self.restore(ram_only=True)

    def store(self) -> None:
        """Make a backup."""
        self._stored = bytes(self._bytes)
        self.set("backup_ready", 1)

    def restore(self, ram_only: bool = False) -> None:
        """Take from the backup what one has, if there is one."""
        for register in self.model.registers.values():
            if self._stored and _backed_up(register) and not (ram_only and register.eeprom):
                where, _, _ = self._where[register.name]
                self.set(register.name, register.decode(self._stored[where]))

    def _places(self, address: int, length: int) -> list[int]:
        """Where the bytes from an address on really lie."""
        names = self.model.indirect
        return [
            int.from_bytes(self._bytes[names[a] : names[a] + 2], "little") if a in names else a
            for a in range(address, address + length)
        ]


def _backed_up(register: Register) -> bool:
    """A backup has the EEPROM, and of the RAM gains, profile and indirect addresses."""
    ram = ("gain", "profile_", "indirect_address_")
    return register.writable and (register.eeprom or any(part in register.name for part in ram))


def refuses(memory: Memory, register: Register, value: int) -> StatusError:
    """Why a value cannot be written, NONE if it can."""
    name = register.name
    locked = name in GOALS or (name == "bus_watchdog" and value != 0)
    if locked and memory.get("bus_watchdog") == TRIPPED:
        return StatusError.DATA_RANGE
    least, most = _limits(memory, name)
    if not least <= value <= most:
        return StatusError.DATA_LIMIT
    if not _in_range(memory, register, value):
        return StatusError.DATA_RANGE
    if name == "torque_enable" and value and shut_down(memory):
        return StatusError.RESULT_FAIL
    return StatusError.NONE


def shut_down(memory: Memory) -> bool:
    """An error that Shutdown selects has taken its torque; only a restart gives it back."""
    return bool(memory.get("hardware_error_status") & memory.get("shutdown"))


def beyond_limits(memory: Memory) -> int:
    """Errors that are new because supply or temperature are beyond their limits, as bits."""
    get, bits = memory.get, 0
    if not get("min_voltage_limit") <= get("present_input_voltage") <= get("max_voltage_limit"):
        bits |= _VOLTAGE_ERROR
    if get("present_temperature") > get("temperature_limit"):
        bits |= _HEAT_ERROR
    return bits & ~get("hardware_error_status")


def _in_range(memory: Memory, register: Register, value: int) -> bool:
    """The table of the manual allows the value."""
    if register.name == "operating_mode":
        return value in memory.model.modes
    if register.name == "drive_mode" and value & _UNUSED_DRIVE_MODE:
        return False
    if register.name == "protocol_type" and 2 < value < 20:
        return False
    low, high = register.low, register.high
    return (low is None or value >= low) and (high is None or value <= high)


def _limits(memory: Memory, name: str) -> tuple[float, float]:
    """Bounds of a goal by another register."""
    if name == "goal_position":
        if memory.get("operating_mode") in (EXTENDED_MODE, CURRENT_POSITION_MODE):
            return -MOST_TICKS, MOST_TICKS
        return memory.get("min_position_limit"), memory.get("max_position_limit")
    if name not in _LIMITS or (name == "profile_velocity" and time_based(memory)):
        return -math.inf, math.inf
    bound = memory.get(_LIMITS[name])
    return -bound, bound


def time_based(memory: Memory) -> bool:
    """Profile registers are times [ms]."""
    return bool(memory.get("drive_mode") & TIME_BASED)
