"""Servo models as TOML files: those in this folder, and any other by its path.

A file may be `like` another model and then holds only what is different. All models have the
registers of the X series from 0 to 147; a file with another layout is refused.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from antennate.dxl.model import EEPROM_END, Rating, Register, ServoModel
from antennate.errors import ConfigError
from antennate.files import read_toml
from antennate.messages import nearest, shown

_FOLDER = Path(__file__).parent
_LARGEST_FILE = 200_000
"""Most bytes of a model file."""
_COMMON_END = 148
"""Registers below this address are the same in all models, but for load or current."""
_REV_PER_MIN = 2.0 * math.pi / 60.0
"""One revolution a minute [rad/s]."""
_UNITS = {
    "voltage": "V",
    "stall_torque": "N·m",
    "no_load_speed": "rad/s",
    "stall_current": "A",
    "standby_current": "A",
    "gain_divisor": "1",
    "armature": "kg·m²",
    "friction": "N·m",
    "load_friction": "1",
}
"""Ratings in a file, and their units."""


def servo_model(name: str | Path) -> ServoModel:
    """A servo model, by the name of a shipped one or by the path of a file.

    Args:
        name: A name such as `xc430-w240`, or a path that ends in `.toml`.

    Raises:
        ConfigError: There is no such model, or the file does not describe a servo of the X series.
    """
    if str(name).endswith(".toml"):
        return _read(Path(name))
    if str(name) not in MODELS:
        raise ConfigError(
            f"expected as servo model one of {', '.join(MODELS)}, or a file that ends in .toml, "
            f"found {name}{nearest(str(name), MODELS)}"
        )
    return MODELS[str(name)]


def model_name(number: int | None) -> str:
    """Name of a shipped model, or its number if it is not known."""
    found = MODELS_BY_NUMBER.get(number) if number is not None else None
    return found.name if found else f"model {number}"


def _read(path: Path) -> ServoModel:
    """The model in a file."""
    table = _table_of(path, ())
    where = str(path)
    known = _checked(table, where, _HEAD)
    entries = {name: _register(name, entry, where) for name, entry in known["registers"].items()}
    for group in known.get("indirect", []):
        entries |= _indirect_registers(_checked(group, f"{where}: indirect", _INDIRECT))
    registers = {row.name: row for row in sorted(entries.values(), key=lambda row: row.address)}
    _require_layout(registers, where)
    registers["model_number"] = replace(registers["model_number"], default=known["number"])
    data = {
        row.address: registers[name.replace("data", "address")].address
        for name, row in registers.items()
        if name.startswith("indirect_data")
    }
    return ServoModel(
        number=known["number"],
        name=known["name"],
        source=known["source"],
        firmware=known["firmware"],
        fast_read_firmware=known["fast_read_firmware"],
        modes=frozenset(known["modes"]),
        registers=registers,
        indirect=data,
        rating=_rating(known["rating"], registers, where),
    )


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


def _table_of(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    """What stands in a file, over what stands in the model that it is `like`."""
    if path.resolve() in above:
        raise ConfigError(f"{path}: expected a model that is like another, found one like itself")
    table = dict(_shipped_table(path) if path.parent == _FOLDER else read_toml(path, _LARGEST_FILE))
    like, removed = table.pop("like", None), table.pop("without", [])
    if like is None:
        return table
    if not isinstance(like, str) or not isinstance(removed, list):
        raise ConfigError(f"{path}: expected a name as `like`, and a list as `without`")
    base = path.parent / like if like.endswith(".toml") else _FOLDER / f"{like}.toml"
    if not like.endswith(".toml") and not base.exists():
        names = sorted(file.stem for file in _FOLDER.glob("*.toml"))
        raise ConfigError(f"{path}: like: expected one of {', '.join(names)}, found {shown(like)}")
    found = _over(_table_of(base, (*above, path.resolve())), table)
    registers = dict(found["registers"])
    for name in removed:
        if registers.pop(name, None) is None:
            raise ConfigError(
                f"{path}: without: expected a register of {like}, found {shown(name)}"
            )
    return found | {"registers": registers}


@functools.cache
def _shipped_table(path: Path) -> dict[str, Any]:
    """What stands in one of our files, read once; nobody changes it."""
    return read_toml(path, _LARGEST_FILE)


def _over(base: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Nested tables: the values of `table` over those of `base`."""
    both = {key: (base.get(key), value) for key, value in table.items()}
    return base | {
        key: _over(old, new) if isinstance(old, dict) and isinstance(new, dict) else new
        for key, (old, new) in both.items()
    }


def _checked(table: Any, where: str, keys: Mapping[str, type]) -> dict[str, Any]:
    """A table that has these keys, with values of these types, and no others."""
    if not isinstance(table, dict):
        raise ConfigError(f"{where}: expected a table, found {shown(table)}")
    known = {key.rstrip("?"): kind for key, kind in keys.items()}
    for key, value in table.items():
        if key not in known:
            raise ConfigError(f"{where}: unknown key {shown(key)}{nearest(key, known)}")
        whole = known[key] is int and isinstance(value, bool)
        if whole or not isinstance(value, known[key]):
            kind = _KINDS[known[key]]
            raise ConfigError(f"{where}: {key}: expected {kind}, found {shown(value)}")
    if missing := [key for key in keys if not key.endswith("?") and key not in table]:
        raise ConfigError(f"{where}: expected the key {missing[0]}, found none")
    return table


_KINDS = {
    int: "a whole number",
    float: "a number",
    str: "a text",
    list: "a list",
    dict: "a table",
    bool: "true or false",
}


def _register(name: str, entry: Any, where: str) -> Register:
    where = f"{where}: registers.{name}"
    given = _checked(entry, where, _ENTRY)
    low, high = _range(given.get("range", []), where)
    register = Register(
        name,
        given["address"],
        given["size"],
        given["access"],
        given.get("unit", ""),
        given.get("default"),
        low,
        high,
        given.get("signed", False),
    )
    if register.size not in (1, 2, 4) or not 0 <= register.address <= 0xFFFF - register.size:
        raise ConfigError(
            f"{where}: expected an address from 0 to 65535 and a size of 1, 2 or 4, found "
            f"{register.address} and {register.size}"
        )
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


def _range(bounds: list[Any], where: str) -> tuple[int | None, int | None]:
    if not bounds:
        return None, None
    if [type(bound) for bound in bounds] != [int, int] or bounds[0] > bounds[1]:
        raise ConfigError(
            f"{where}: range: expected the least and the largest value, found {shown(bounds)}"
        )
    return bounds[0], bounds[1]


def _indirect_registers(group: dict[str, Any]) -> dict[str, Register]:
    """Indirect addresses and indirect data of some bytes, numbered from the first."""
    rows: list[Register] = []
    for n in range(group["count"]):
        number, data = group["first"] + n, group["data"] + n
        at, last = group["address"] + 2 * n, group["last"]
        rows += [
            Register(f"indirect_address_{number}", at, 2, "RW", "", data, EEPROM_END, last, False),
            Register(f"indirect_data_{number}", data, 1, "RW", "", 0, 0, 255, False),
        ]
    return {row.name: row for row in rows}


def _require_layout(registers: Mapping[str, Register], where: str) -> None:
    """Check that no two registers overlap, and that the common ones lie where all models have them.

    The XC430-W240 says where.
    """
    end, before = 0, ""
    for row in registers.values():
        if row.address < end:
            raise ConfigError(f"{where}: registers.{row.name}: overlaps {before}")
        end, before = row.address + row.size, row.name
    for name, row in _layout().items():
        found = registers.get(name)
        if found is None:
            raise ConfigError(f"{where}: expected the register {name} of the X series, found none")
        for what in ("address", "size", "unit", "signed"):
            wanted, there = getattr(row, what), getattr(found, what)
            if wanted != there:
                raise ConfigError(
                    f"{where}: registers.{name}: {what}: expected {shown(wanted)}, as all servos "
                    f"of the X series have it, found {shown(there)}"
                )
    current = [registers[n].unit for n in ("present_current", "goal_current") if n in registers]
    if any(not re.fullmatch(r"\d+(\.\d+)? mA", unit) for unit in current) or len({*current}) > 1:
        raise ConfigError(
            f"{where}: expected one unit such as 2.69 mA of currents, found {current}"
        )
    if "present_load" not in registers and "present_current" not in registers:
        raise ConfigError(f"{where}: expected present_load or present_current, found neither")


@functools.cache
def _layout() -> dict[str, Register]:
    """Registers that all models have at the same place, from the table of the XC430-W240."""
    table = _shipped_table(_FOLDER / "xc430-w240.toml")["registers"]
    rows = (_register(name, entry, "xc430-w240") for name, entry in table.items())
    return {r.name: r for r in rows if r.address < _COMMON_END and r.name != "present_load"}


def _rating(table: Any, registers: Mapping[str, Register], where: str) -> Rating:
    where = f"{where}: rating"
    given = _checked(table, where, dict.fromkeys(_UNITS, dict))
    values: dict[str, float] = {}
    for name, entry in given.items():
        place = f"{where}.{name}"
        _checked(entry, place, {"value": object, "unit": str, "source": str})
        value, unit, wanted = entry["value"], entry["unit"], _UNITS[name]
        scale = {wanted: 1.0, **({"rev/min": _REV_PER_MIN} if wanted == "rad/s" else {})}.get(unit)
        if scale is None:
            raise ConfigError(f"{place}: unit: expected {wanted}, found {shown(unit)}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        least = 0.0 if name in ("friction", "load_friction", "standby_current") else 1e-12
        if not (number and math.isfinite(value) and value >= least):
            bound = "from 0 on" if least == 0.0 else "above 0"
            raise ConfigError(f"{place}: value: expected a number {bound}, found {shown(value)}")
        values[name] = float(value) * scale
    sources = {name: entry["source"] for name, entry in given.items()}
    return Rating(
        **values, p_gain=float(registers["position_p_gain"].default or 0), sources=sources
    )


def _shipped() -> Iterator[tuple[str, ServoModel]]:
    for path in sorted(_FOLDER.glob("*.toml")):
        yield path.stem, _read(path)


MODELS: dict[str, ServoModel] = dict(_shipped())
"""The models that we ship, by the name of their file."""
MODELS_BY_NUMBER = {model.number: model for model in MODELS.values()}
XC430_W240, XL330_M288 = MODELS["xc430-w240"], MODELS["xl330-m288"]
XL430_W250 = MODELS["xl430-w250"]
