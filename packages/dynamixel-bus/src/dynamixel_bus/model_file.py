"""What stands in the file of a servo model, checked: a control table and a rating.

All models have the registers of the X series from 0 to 147, which one master reads and writes by
the same addresses; a file with another layout is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dynamixel_bus.errors import ConfigError
from dynamixel_bus.messages import nearest, shown
from dynamixel_bus.model import (
    BAUD_RATES,
    CURRENT_MODE,
    CURRENT_POSITION_MODE,
    EEPROM_END,
    EXTENDED_MODE,
    POSITION_MODE,
    PWM_MODE,
    VELOCITY_MODE,
    Rating,
    Register,
    ServoModel,
)

_MODES = (
    CURRENT_MODE,
    VELOCITY_MODE,
    POSITION_MODE,
    EXTENDED_MODE,
    CURRENT_POSITION_MODE,
    PWM_MODE,
)
_FIRMWARE = ("firmware", "fast_read_firmware")
_MILLIAMPERES = re.compile(r"(\d+(?:\.\d+)?) mA")
_COMMON_END = 148
"""Registers below this address are the same in all models, but for load or current."""
_REV_PER_MIN = 2.0 * math.pi / 60.0
"""One revolution a minute [rad/s]."""
_RATINGS = {
    "voltage": ("V", 1.0, 100.0),
    "stall_torque": ("N·m", 1e-6, 1e3),
    "no_load_speed": ("rad/s", 1e-6, 1e3),
    "stall_current": ("A", 1e-6, 100.0),
    "standby_current": ("A", 0.0, 100.0),
    "gain_divisor": ("1", 1e-6, 1e6),
    "armature": ("kg·m²", 1e-9, 1e3),
    "friction": ("N·m", 0.0, 1e3),
    "load_friction": ("1", 0.0, 0.99),
}
"""Ratings in a file: unit, least and largest value."""
_HEAD: dict[str, type] = {
    "number": int,
    "name": str,
    "source": str,
    "firmware": int,
    "fast_read_firmware": int,
    "modes": list,
    "registers": dict,
    "rating": dict,
    "indirect?": list,
}
_ENTRY: dict[str, type] = {
    "address": int,
    "size": int,
    "access": str,
    "unit?": str,
    "default?": int,
    "range?": list,
    "signed?": bool,
}
_INDIRECT: dict[str, type] = dict.fromkeys(("first", "address", "data", "count", "last"), int)
"""Keys of each table of a file, those that may be missing with a question mark."""
_KINDS = {
    int: "a whole number",
    float: "a number",
    str: "a text",
    list: "a list",
    dict: "a table",
    bool: "true or false",
}


def model_of(table: Any, where: str, layout: Mapping[str, Any]) -> ServoModel:
    """The model that the content of a file describes.

    Args:
        table: What stands in the file.
        where: Its path, for errors.
        layout: Entries of the registers that all models have, as they stand in a file.
    """
    known = checked(table, where, _HEAD)
    entries = {name: _register(name, entry, where) for name, entry in known["registers"].items()}
    for group in known.get("indirect", []):
        entries |= _indirect_registers(group, f"{where}: indirect")
    registers = {row.name: row for row in sorted(entries.values(), key=lambda row: row.address)}
    _require_layout(registers, where, layout)
    rating = _rating(known["rating"], registers, where)
    _require_numbers(known, registers, where)
    _require_currents({*known["modes"]}, registers, rating, where)
    registers["model_number"] = replace(registers["model_number"], default=known["number"])
    data = {
        row.address: registers[name.replace("data", "address")].address
        for name, row in registers.items()
        if name.startswith("indirect_data")
    }
    heads = {key: known[key] for key in ("number", "name", "source", *_FIRMWARE)}
    return ServoModel(
        **heads,
        modes=frozenset(known["modes"]),
        registers=registers,
        indirect=data,
        rating=rating,
    )


def checked(
    table: Any, where: str, keys: Mapping[str, type], others: bool = False
) -> dict[str, Any]:
    """A table that has these keys, with values of these types, and no others unless allowed."""
    if not isinstance(table, dict):
        raise ConfigError(f"{where}: expected a table, found {shown(table)}")
    known = {key.rstrip("?"): kind for key, kind in keys.items()}
    for key, value in table.items():
        if key not in known:
            if others:
                continue
            raise ConfigError(f"{where}: unknown key {shown(key)}{nearest(key, known)}")
        whole = known[key] is int and isinstance(value, bool)
        if whole or not isinstance(value, known[key]):
            kind = _KINDS[known[key]]
            raise ConfigError(f"{where}: {key}: expected {kind}, found {shown(value)}")
    if missing := [key for key in keys if not key.endswith("?") and key not in table]:
        raise ConfigError(f"{where}: expected the key {missing[0]}, found none")
    return table


def _register(name: str, entry: Any, where: str) -> Register:
    where = f"{where}: registers.{name}"
    fields = checked(entry, where, _ENTRY)
    low, high = _range(fields.get("range", []), fields.get("default"), where)
    register = Register(
        name,
        fields["address"],
        fields["size"],
        fields["access"],
        fields.get("unit", ""),
        fields.get("default"),
        low,
        high,
        fields.get("signed", False),
    )
    if register.size not in (1, 2, 4) or not 0 <= register.address <= 0xFFFF - register.size:
        raise ConfigError(
            f"{where}: expected an address from 0 to 65535 and a size of 1, 2 or 4, found "
            f"{register.address} and {register.size}"
        )
    if name.startswith("indirect_"):
        raise ConfigError(f"{where}: expected indirect registers in [[indirect]], found them here")
    if register.access not in ("R", "RW"):
        raise ConfigError(f"{where}: access: expected R or RW, found {shown(register.access)}")
    for value in (register.default, low, high):
        try:
            register.encode(value or 0)
        except OverflowError:
            kind = "signed" if register.signed else "unsigned"
            raise ConfigError(
                f"{where}: expected {kind} values of {register.size} bytes, found {value}"
            ) from None
    return register


def _range(bounds: list[Any], default: int | None, where: str) -> tuple[int | None, int | None]:
    """The least and the largest value, within which a default lies."""
    if not bounds:
        return None, None
    if [type(bound) for bound in bounds] != [int, int] or bounds[0] > bounds[1]:
        raise ConfigError(
            f"{where}: range: expected the least and the largest value, found {shown(bounds)}"
        )
    low, high = bounds
    if default is not None and not low <= default <= high:
        raise ConfigError(f"{where}: default: expected {low} to {high}, found {default}")
    return low, high


def _indirect_registers(group: Any, where: str) -> dict[str, Register]:
    """Indirect addresses and indirect data of some bytes, numbered from the first."""
    rows: list[Register] = []
    for key, value in checked(group, where, _INDIRECT).items():
        if not 0 <= value <= (256 if key == "count" else 0xF000):
            raise ConfigError(f"{where}: {key}: expected an address or a count, found {value}")
    for n in range(group["count"]):
        number, data = group["first"] + n, group["data"] + n
        at, last = group["address"] + 2 * n, group["last"]
        rows += [
            Register(f"indirect_address_{number}", at, 2, "RW", "", data, EEPROM_END, last, False),
            Register(f"indirect_data_{number}", data, 1, "RW", "", 0, 0, 255, False),
        ]
    return {row.name: row for row in rows}


def _require_layout(
    registers: Mapping[str, Register], where: str, layout: Mapping[str, Any]
) -> None:
    """Check that no registers overlap, and that the common ones lie where all models have them."""
    end, before = 0, ""
    for row in registers.values():
        if row.address < end:
            raise ConfigError(f"{where}: registers.{row.name}: overlaps {before}")
        end, before = row.address + row.size, row.name
    for name, entry in layout.items():
        if entry["address"] >= _COMMON_END or name == "present_load":
            continue
        register = registers.get(name)
        if register is None:
            raise ConfigError(f"{where}: expected the register {name} of the X series, found none")
        for what, missing in (("address", 0), ("size", 0), ("unit", ""), ("signed", False)):
            wanted, there = entry.get(what, missing), getattr(register, what)
            if wanted != there:
                raise ConfigError(
                    f"{where}: registers.{name}: {what}: expected {shown(wanted)}, as all servos "
                    f"of the X series have it, found {shown(there)}"
                )


def _require_numbers(
    known: Mapping[str, Any], registers: Mapping[str, Register], where: str
) -> None:
    """Check that numbers, modes and speeds are ones that such a servo can have."""
    for name, most in (("number", 0xFFFF), *((name, 0xFF) for name in _FIRMWARE)):
        if not 0 <= known[name] <= most:
            raise ConfigError(f"{where}: {name}: expected 0 to {most}, found {known[name]}")
    modes = known["modes"]
    if any(type(mode) is not int or mode not in _MODES for mode in modes):
        raise ConfigError(f"{where}: modes: expected some of {_MODES}, found {shown(modes)}")
    if registers["operating_mode"].default not in modes:
        raise ConfigError(f"{where}: registers.operating_mode: expected one of its modes")
    low, high = registers["baud_rate"].low, registers["baud_rate"].high
    if low is None or high is None or not 0 <= low <= high < len(BAUD_RATES):
        raise ConfigError(f"{where}: registers.baud_rate: expected a range within 0 to 7")


def _require_currents(
    modes: set[int], registers: Mapping[str, Register], rating: Rating, where: str
) -> None:
    """Check that currents have a unit, and the registers that they need."""
    by_current = modes & {CURRENT_MODE, CURRENT_POSITION_MODE} or "goal_current" in registers
    needed = ("goal_current", "current_limit", "present_current") if by_current else ()
    for name in needed:
        if name not in registers:
            raise ConfigError(f"{where}: expected the register {name}, found none")
    if "present_current" not in registers:
        if "present_load" in registers:
            return
        raise ConfigError(f"{where}: expected present_load or present_current, found neither")
    units = {registers[name].unit for name in ("present_current", *needed)}
    unit = _MILLIAMPERES.fullmatch(units.pop())
    if unit is None or units:
        raise ConfigError(f"{where}: expected one unit of all currents, such as 2.69 mA")
    if 1e3 * rating.stall_current > 0x7FFF * float(unit[1]):
        raise ConfigError(f"{where}: rating.stall_current: expected one that two bytes can tell")


def _rating(table: Any, registers: Mapping[str, Register], where: str) -> Rating:
    where = f"{where}: rating"
    ratings = checked(table, where, dict.fromkeys(_RATINGS, dict))
    values: dict[str, float] = {}
    for name, entry in ratings.items():
        place = f"{where}.{name}"
        checked(entry, place, {"value": object, "unit": str, "source": str})
        value, unit = entry["value"], entry["unit"]
        wanted, least, most = _RATINGS[name]
        scale = _REV_PER_MIN if (wanted, unit) == ("rad/s", "rev/min") else 1.0
        if unit != wanted and scale == 1.0:
            units = f"{wanted} or rev/min" if wanted == "rad/s" else wanted
            raise ConfigError(f"{place}: unit: expected {units}, found {shown(unit)}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and least <= value <= most):
            raise ConfigError(
                f"{place}: value: expected a number from {least:g} to {most:g}, found "
                f"{shown(value)}"
            )
        values[name] = float(value) * scale
    sources = {name: entry["source"] for name, entry in ratings.items()}
    return Rating(
        **values, p_gain=float(registers["position_p_gain"].default or 0), sources=sources
    )
