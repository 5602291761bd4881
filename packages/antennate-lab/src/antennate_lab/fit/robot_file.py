"""The file of a fitted robot: that of the robot before, with what was fitted and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import Table

from antennate_lab.fit.estimates import Estimate
from antennate_lab.fit.parameters import nested


def written(text: str, base: str, found: Sequence[Estimate], logs: Sequence[str]) -> str:
    """Text of the file: tables and comments of the one before stay.

    Args:
        text: The file before; empty for a robot that is known by name.
        base: Name of the robot that the text is empty for.
        found: What was found.
        logs: Names of the logs.
    """
    document = tomlkit.parse(text)
    robot: Any = document["robot"] if "robot" in document else document
    source = f"measured: fit of {', '.join(logs)}"
    told = [each for each in found if each.told]
    _set(robot, nested(told_values(found)), source)
    robot["fitted"] = _fitted(told, source)
    lines = tomlkit.dumps(document)
    named = f'# The robot {base}, fitted: give it as `--robot`.\n' if not text else ""
    return named + lines


def told_values(found: Sequence[Estimate]) -> Mapping[str, Any]:
    """Values by their path; of a list all of its entries, those that are not told as before."""
    values: dict[str, Any] = {}
    for each in found:
        path, place = each.parameter.path, each.parameter.place
        rounded = float(f"{each.value:.6g}")
        if place is None:
            if each.told:
                values[path] = rounded
        else:
            values.setdefault(path, []).append(rounded)
    lists = {each.parameter.path for each in found if each.told}
    return {path: value for path, value in values.items() if path in lists}


def _set(table: Any, values: Mapping[str, Any], source: str) -> None:
    """Set values in tables, each with its source as a comment."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            if name not in table:
                table[name] = tomlkit.table()
            _set(table[name], value, source)
            continue
        item = tomlkit.item(value)
        item.comment(source)
        if name in table:
            table[name] = item
        elif isinstance(table, Table) or not _first_table(table):
            table.append(name, item)
        else:
            table.insert(0, name, item)


