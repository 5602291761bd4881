"""The file of a fitted robot: that of the robot before, with what was fitted and how sure it is."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence

import tomlkit

from antennate.params.toml_text import Key, Value, edited
from antennate_lab.fit.estimates import Estimate

_DIGITS = 5
"""Digits of a value."""


def values_of(found: Sequence[Estimate]) -> dict[str, float | list[float]]:
    """What a robot's file says of what is told, by path; a list with all of its entries."""
    values: dict[str, float | list[float]] = {}
    for path in dict.fromkeys(each.parameter.path for each in found if each.told):
        own = [each for each in found if each.parameter.path == path]
        numbers = [float(f"{each.value:.{_DIGITS}g}") for each in own]
        values[path] = numbers[0] if own[0].parameter.place is None else numbers
    return values


def written(text: str, found: Sequence[Estimate], logs: Sequence[str]) -> str:
    """Text of the file: tables and comments of the one before stay.

    Args:
        text: The file before, of a robot or a `robot.toml` with a table of that name.
        found: What was found.
        logs: Names of the logs.
    """
    document = tomlkit.parse(text)
    within: tuple[str, ...] = ("robot",) if "robot" in document else ()
    robot = document.get("robot", document)
    if isinstance(robot, str):
        document["robot"] = {"base": robot}
    elif isinstance(robot, Mapping):
        robot.pop("fitted", None)  # type: ignore[attr-defined]
    changes: dict[Key, Value] = {}
    for path, value in values_of(found).items():
        changes[(*within, *path.split("."))] = value
    blocks = [edited(tomlkit.dumps(document), changes).rstrip() + "\n"]
    table = ".".join((*within, "fitted"))
    blocks += [_block(table, each, logs) for each in found if each.told]
    whole = "\n".join(blocks)
    tomllib.loads(whole)
    return whole


def _block(table: str, each: Estimate, logs: Sequence[str]) -> str:
    """The table of one number."""
    low, high = (float(f"{end:.{_DIGITS}g}") for end in each.interval)
    return (
        f"[[{table}]]\n"
        f'name = "{each.parameter.name}"\n'
        f"low = {low!r}\nhigh = {high!r}  # {each.parameter.scale.unit}, 90 %\n"
        f'source = "measured: fit of {", ".join(logs)}"\n'
    )
