"""Control tables of the servo models as data: what lies where, and what may be written.

Sources: https://emanual.robotis.com/docs/en/dxl/x/xc430-w240/ (XC430-W240-T),
https://emanual.robotis.com/docs/en/dxl/x/xl430-w250/ (XL430-W250-T) and
https://emanual.robotis.com/docs/en/dxl/x/xl330-m288/ (XL330-M288-T), section Control Table.
Where a bound is another register (a goal by its limit), the bound here is the widest that register
can set. Bus Watchdog also takes 0, which turns it off, and Secondary ID 253 to 255, which turn it
off too; so say their descriptions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

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
        """It survives power-off and is locked while torque is on."""
        return self.address < EEPROM_END

    @property
    def writable(self) -> bool:
        """It may be written at all."""
        return self.access == "RW"

    def encode(self, value: int) -> bytes:
        """The value as it is sent."""
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, data: bytes) -> int:
        """The value of `size` bytes."""
        return int.from_bytes(data, "little", signed=self.signed)


@dataclass(frozen=True, slots=True)
class Table:
    """The control table of one model.

    Attributes:
        model: Its number.
        firmware: A version whose registers lie as in this table; ROBOTIS's driver has another table
            for an XL330 before 52
            (https://github.com/ROBOTIS-GIT/dynamixel_hardware_interface/pull/69).
        fast_read_firmware: First firmware that understands a fast sync read.
        modes: Operating modes that it has.
        registers: By name, in the order of their addresses.
        indirect: Address of each byte of indirect data, and of the register that says whose it is.
    """

    model: int
    name: str
    firmware: int
    fast_read_firmware: int
    modes: frozenset[int]
    registers: dict[str, Register]
    indirect: dict[int, int]

    def __getitem__(self, name: str) -> Register:
        return self.registers[name]


CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE, CURRENT_POSITION_MODE, PWM_MODE = (
    0,
    1,
    3,
    4,
    5,
    16,
)
"""Operating modes; extended is position over many turns."""

REVERSED, TIME_BASED, TORQUE_BY_GOAL = 1, 4, 8
"""Bits of Drive Mode."""

VELOCITY_UNIT = 0.229 * 2.0 * math.pi / 60.0
"""One count of a velocity [rad/s]."""
ACCELERATION_UNIT = 214.577 * 2.0 * math.pi / 3600.0
"""One count of an acceleration [rad/s²]."""
POSITION_UNIT = 2.0 * math.pi / 4096
"""One count of a position [rad]."""
WATCHDOG_UNIT = 0.020
"""One count of the bus watchdog [s] (e-manual of the XC430-W240, address 98)."""
RETURN_DELAY_UNIT = 2e-6
"""One count of the return delay time [s]."""

BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Bits per second by the value of `baud_rate`."""

GOALS = frozenset({"goal_pwm", "goal_current", "goal_velocity", "goal_position"})
"""Registers that a tripped bus watchdog locks."""

_SIGNED = GOALS | {"homing_offset", "bus_watchdog", "present_pwm", "present_load"}
_SIGNED |= {"present_current", "present_velocity", "present_position"}
_SIGNED |= {"velocity_trajectory", "position_trajectory"}

_RPM, _PULSE, _VOLT, _DUTY = "0.229 rev/min", "1 pulse", "0.1 V", "0.113 %"
_GAIN = (0, 16_383)

_Row = tuple[str, int, int, str, str, int | None, int | None, int | None]

_COMMON: list[_Row] = [
    ("model_number", 0, 2, "R", "", None, None, None),
    ("model_information", 2, 4, "R", "", None, None, None),
    ("firmware_version", 6, 1, "R", "", None, None, None),
    ("id", 7, 1, "RW", "", 1, 0, 252),
    ("baud_rate", 8, 1, "RW", "", 1, 0, 7),
    ("return_delay_time", 9, 1, "RW", "2 us", 250, 0, 254),
    ("drive_mode", 10, 1, "RW", "", 0, 0, 13),
    ("operating_mode", 11, 1, "RW", "", 3, 0, 16),
    ("secondary_id", 12, 1, "RW", "", 255, 0, 255),
    ("protocol_type", 13, 1, "RW", "", 2, 1, 2),
    ("homing_offset", 20, 4, "RW", _PULSE, 0, -1_044_479, 1_044_479),
    ("moving_threshold", 24, 4, "RW", _RPM, 10, 0, 1_023),
    ("temperature_limit", 31, 1, "RW", "1 degC", 80, 0, 100),
    ("max_voltage_limit", 32, 2, "RW", _VOLT, 160, 60, 160),
    ("min_voltage_limit", 34, 2, "RW", _VOLT, 60, 60, 160),
    ("pwm_limit", 36, 2, "RW", _DUTY, 885, 0, 885),
    ("velocity_limit", 44, 4, "RW", _RPM, 306, 0, 1_023),
    ("max_position_limit", 48, 4, "RW", _PULSE, 4_095, 0, 4_095),
    ("min_position_limit", 52, 4, "RW", _PULSE, 0, 0, 4_095),
    ("startup_configuration", 60, 1, "RW", "", 0, 0, 3),
    ("shutdown", 63, 1, "RW", "", 52, None, None),
    ("torque_enable", 64, 1, "RW", "", 0, 0, 1),
    ("led", 65, 1, "RW", "", 0, 0, 1),
    ("status_return_level", 68, 1, "RW", "", 2, 0, 2),
    ("registered_instruction", 69, 1, "R", "", 0, 0, 1),
    ("hardware_error_status", 70, 1, "R", "", 0, None, None),
    ("velocity_i_gain", 76, 2, "RW", "", 1_920, *_GAIN),
    ("velocity_p_gain", 78, 2, "RW", "", 100, *_GAIN),
    ("position_d_gain", 80, 2, "RW", "", 0, *_GAIN),
    ("position_i_gain", 82, 2, "RW", "", 0, *_GAIN),
    ("position_p_gain", 84, 2, "RW", "", 700, *_GAIN),
    ("feedforward_2nd_gain", 88, 2, "RW", "", 0, *_GAIN),
    ("feedforward_1st_gain", 90, 2, "RW", "", 0, *_GAIN),
    ("bus_watchdog", 98, 1, "RW", "20 ms", 0, 0, 127),
    ("goal_pwm", 100, 2, "RW", _DUTY, None, -885, 885),
    ("goal_velocity", 104, 4, "RW", _RPM, None, -1_023, 1_023),
    ("profile_acceleration", 108, 4, "RW", "214.577 rev/min2", 0, 0, 32_767),
    ("profile_velocity", 112, 4, "RW", _RPM, 0, 0, 32_767),
    ("goal_position", 116, 4, "RW", _PULSE, None, -1_048_575, 1_048_575),
    ("realtime_tick", 120, 2, "R", "1 ms", None, 0, 32_767),
    ("moving", 122, 1, "R", "", 0, 0, 1),
    ("moving_status", 123, 1, "R", "", 0, None, None),
    ("present_pwm", 124, 2, "R", _DUTY, None, None, None),
    ("present_load", 126, 2, "R", "0.1 %", None, -1_000, 1_000),
    ("present_velocity", 128, 4, "R", _RPM, None, None, None),
    ("present_position", 132, 4, "R", _PULSE, None, None, None),
    ("velocity_trajectory", 136, 4, "R", _RPM, None, None, None),
    ("position_trajectory", 140, 4, "R", _PULSE, None, None, None),
    ("present_input_voltage", 144, 2, "R", _VOLT, None, None, None),
    ("present_temperature", 146, 1, "R", "1 degC", None, None, None),
    ("backup_ready", 147, 1, "R", "", None, 0, 1),
]


def _indirect(first: int, address: int, data: int, count: int, last: int) -> list[_Row]:
    """Indirect addresses and indirect data of `count` bytes, numbered from `first`."""
    rows: list[_Row] = []
    for n in range(count):
        here = data + n
        rows += [
            (f"indirect_address_{first + n}", address + 2 * n, 2, "RW", "", here, EEPROM_END, last),
            (f"indirect_data_{first + n}", here, 1, "RW", "", 0, 0, 255),
        ]
    return rows


def _table(
    model: int,
    name: str,
    firmware: tuple[int, int],
    modes: set[int],
    changes: dict[str, dict[str, object]],
    more: list[_Row],
) -> Table:
    rows = [Register(*row, signed=row[0] in _SIGNED) for row in _COMMON + more]
    rows = [replace(row, **changes.get(row.name, {})) for row in rows]
    registers = {row.name: row for row in sorted(rows, key=lambda row: row.address)}
    registers["model_number"] = replace(registers["model_number"], default=model)
    data = {
        row.address: registers[name.replace("data", "address")].address
        for name, row in registers.items()
        if name.startswith("indirect_data")
    }
    return Table(model, name, *firmware, frozenset(modes), registers, data)


_FOUR_MODES = {VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE, PWM_MODE}
_INDIRECT_56 = _indirect(1, 168, 224, 28, 661) + _indirect(29, 578, 634, 28, 661)
_CURRENT: dict[str, object] = {"name": "present_current", "unit": "1 mA", "low": None, "high": None}

XC430_W240 = _table(1080, "XC430-W240-T", (48, 45), _FOUR_MODES, {}, _INDIRECT_56)

XL430_W250 = _table(
    1060,
    "XL430-W250-T",
    (48, 45),
    _FOUR_MODES,
    {
        "temperature_limit": {"default": 72},
        "max_voltage_limit": {"default": 140, "high": 140},
        "min_voltage_limit": {"high": 140},
        "velocity_limit": {"default": 265},
        "velocity_i_gain": {"default": 1_000},
        "position_d_gain": {"default": 4_000},
        "position_p_gain": {"default": 640},
    },
    _INDIRECT_56,
)

XL330_M288 = _table(
    1200,
    "XL330-M288-T",
    (52, 46),
    _FOUR_MODES | {CURRENT_MODE, CURRENT_POSITION_MODE},
    {
        "baud_rate": {"high": 6},
        "drive_mode": {"high": 5},
        "protocol_type": {"low": 2, "high": 22},
        "temperature_limit": {"default": 70},
        "max_voltage_limit": {"default": 70, "low": 31, "high": 70},
        "min_voltage_limit": {"default": 35, "low": 31, "high": 70},
        "velocity_limit": {"default": 445, "high": 2_047},
        "shutdown": {"default": 53},
        "velocity_i_gain": {"default": 1_600},
        "velocity_p_gain": {"default": 180},
        "position_p_gain": {"default": 400},
        "goal_velocity": {"low": -2_047, "high": 2_047},
        "present_load": _CURRENT,
    },
    [
        ("current_limit", 38, 2, "RW", "1 mA", 1_750, 0, 1_750),
        ("pwm_slope", 62, 1, "RW", "1.977 mV/ms", 140, 1, 255),
        ("goal_current", 102, 2, "RW", "1 mA", None, -1_750, 1_750),
        *_indirect(1, 168, 208, 20, 227),
    ],
)

TABLES = {table.model: table for table in (XC430_W240, XL330_M288, XL430_W250)}
"""By model number."""


def model_name(model: int | None) -> str:
    """Name of a model, or its number if it is not known."""
    return TABLES[model].name if model in TABLES else f"model {model}"


HARDWARE_ERRORS = {
    0: "input voltage",
    2: "overheating",
    3: "encoder",
    4: "electrical shock",
    5: "overload",
}
"""What the bits of `hardware_error_status` mean."""


def hardware_errors(bits: int) -> list[str]:
    """Names of the errors in a hardware error status."""
    return [name for bit, name in HARDWARE_ERRORS.items() if bits >> bit & 1]
