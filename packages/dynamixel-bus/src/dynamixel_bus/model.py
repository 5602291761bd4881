"""A servo model: control table, rating, and the units that all models share.

Models of the X series have the same registers from 0 to 147, so that one master reads and writes
them all. Sources stand in the file of each model (`models`).
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import SupportsIndex, TypeVar

import numpy as np
from numpy.typing import NDArray

TICKS_A_TURN = 4096
"""Datasheet of all models: 4096 pulses a revolution."""
MOST_TICKS = 1_048_575
"""Farthest position in extended mode, 256 turns either way [ticks]."""
FULL_DRIVE = 885
"""Datasheet of all models: counts of the full drive."""
POSITION_UNIT = 2.0 * math.pi / TICKS_A_TURN
"""One count of a position [rad]."""
VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""One count of a velocity [rad/s]."""
ACCELERATION_UNIT = 214.577 * 2.0 * math.pi / 3600.0
"""One count of an acceleration [rad/s²]."""
WATCHDOG_UNIT = 0.020
"""One count of the bus watchdog [s] (e-manual of the XC430-W240, address 98)."""
RETURN_DELAY_UNIT = 2e-6
"""One count of the return delay time [s]."""
BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Bits per second by the value of `baud_rate`."""

CURRENT_MODE, VELOCITY_MODE, POSITION_MODE = 0, 1, 3
EXTENDED_MODE, CURRENT_POSITION_MODE, PWM_MODE = 4, 5, 16
"""Operating modes; extended is position over many turns."""
REVERSED, TIME_BASED, TORQUE_BY_GOAL = 1, 4, 8
"""Bits of Drive Mode."""
GOALS = frozenset({"goal_pwm", "goal_current", "goal_velocity", "goal_position"})
"""Registers that a tripped bus watchdog locks."""
HARDWARE_ERRORS = {
    0: "input voltage",
    2: "overheating",
    3: "encoder",
    4: "electrical shock",
    5: "overload",
}
"""What the bits of `hardware_error_status` mean."""

Number = TypeVar("Number", float, NDArray[np.float64])

EEPROM_END = 64
"""Registers below this address survive power-off and are locked while torque is on."""


@dataclass(frozen=True, slots=True)
class Register:
    """One entry of a control table; values are counts.

    Attributes:
        name: Name in the manual, lower case with underscores.
        address: First byte.
        size: Bytes, low first.
        access: "R" or "RW".
        unit: What one count is; "" if it has none.
        default: Value after a reset, None if the manual gives none.
        low: Smallest value that may be written, None without a bound in the table.
        high: Largest.
        signed: Two's complement.
    """

    name: str
    address: int
    size: int
    access: str
    unit: str
    default: int | None
    low: int | None
    high: int | None
    signed: bool

    @property
    def eeprom(self) -> bool:
        """Whether the register survives power-off and is locked while torque is on."""
        return self.address < EEPROM_END

    @property
    def writable(self) -> bool:
        """Whether the register may be written at all."""
        return self.access == "RW"

    def encode(self, value: SupportsIndex) -> bytes:
        """The value as it is sent.

        Args:
            value: A whole number, of NumPy too, in the register's unit.

        Raises:
            TypeError: It is no whole number.
            OverflowError: The register cannot hold it.
        """
        whole = operator.index(value)
        try:
            return whole.to_bytes(self.size, "little", signed=self.signed)
        except OverflowError:
            sign = "a signed" if self.signed else "an unsigned"
            raise OverflowError(
                f"{self.name}: expected {sign} number of {self.size} bytes, found {whole}"
            ) from None

    def decode(self, data: bytes) -> int:
        """The value of `size` bytes."""
        return int.from_bytes(data, "little", signed=self.signed)


@dataclass(frozen=True, slots=True)
class Rating:
    """The motor of a servo, and what its position loop makes of an error.

    Attributes:
        voltage: Supply at which the other numbers hold [V].
        stall_torque: Torque at standstill [N·m].
        no_load_speed: Speed unloaded [rad/s].
        stall_current: Current with the shaft held [A].
        standby_current: Current without torque [A].
        gain_divisor: What Position P Gain is divided by: counts of drive per tick of error.
        armature: Inertia at the output [kg·m²].
        friction: Friction at the output that is always there [N·m].
        load_friction: Friction of the gear as a share of the torque of its motor.
        p_gain: Position P Gain of a new servo.
        sources: Where each number comes from, by name.
    """

    voltage: float
    stall_torque: float
    no_load_speed: float
    stall_current: float
    standby_current: float
    gain_divisor: float
    armature: float
    friction: float
    load_friction: float
    p_gain: float
    sources: Mapping[str, str] = field(repr=False)

    @property
    def position_gain(self) -> float:
        """Share of the full drive per radian of position error [1/rad]."""
        return position_gain(self.p_gain, self.gain_divisor)


@dataclass(frozen=True, eq=False)
class ServoModel:
    """One model: its control table and its rating.

    Attributes:
        number: Its model number, by which it answers a ping.
        name: Name of the maker.
        source: Page of its manual.
        firmware: A version whose registers lie as in this table.
        fast_read_firmware: First firmware that understands a fast sync read.
        modes: Operating modes that it has.
        registers: By name, in the order of their addresses.
        indirect: Address of each byte of indirect data, and of the register that says whose it is.
        rating: Its motor.
    """

    number: int
    name: str
    source: str
    firmware: int
    fast_read_firmware: int
    modes: frozenset[int]
    registers: Mapping[str, Register]
    indirect: Mapping[int, int]
    rating: Rating

    def __getitem__(self, name: str) -> Register:
        return self.registers[name]

    @functools.cached_property
    def counts_per_ampere(self) -> float:
        """Counts of goal and present current for one ampere; infinite without such registers."""
        unit = self.registers["present_current"].unit if "present_current" in self.registers else ""
        return 1e3 / float(unit.removesuffix(" mA")) if unit else math.inf


def position_at(angle: Number, zero: Number, direction: Number) -> Number:
    """Position, not rounded [ticks], of a joint at an angle [rad]; its zero [ticks], 1 or -1."""
    return zero + direction * angle / POSITION_UNIT


def angle_at(position: Number, zero: Number, direction: Number) -> Number:
    """Angle [rad] of a joint at a position [ticks]; its zero [ticks], 1 or -1."""
    return (position - zero) * direction * POSITION_UNIT


def position_gain(p_gain: Number, divisor: Number) -> Number:
    """Share of the full drive per radian of position error [1/rad].

    Args:
        p_gain: Position P Gain as its register holds it, a number or an array of any shape.
        divisor: Counts of drive per tick of error are that gain over this; likewise.

    Source: block diagram of the position loop in the manuals of the X series.
    """
    return p_gain / divisor / POSITION_UNIT / FULL_DRIVE


def hardware_errors(bits: int) -> list[str]:
    """Names of the errors in a hardware error status."""
    return [name for bit, name in HARDWARE_ERRORS.items() if bits >> bit & 1]
