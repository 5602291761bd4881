"""`antennate parameters`: every number with its default, unit, meaning and source, in Markdown."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from collections.abc import Collection, Sequence
from types import ModuleType
from typing import Any

from pydantic.dataclasses import dataclass

from antennate import experiments, params
from antennate.cli.arguments import parse
from antennate.cli.terminal import OK, write_result
from antennate.hardware import config as robot_file
from antennate.messages import command_words
from antennate.params.base import Params, meaning
from antennate.studies.formats import markdown_heads, markdown_row

DESCRIPTION = "Print every parameter: its default with its unit, what it means, and its source."
_HEAD = """\
# Parameters

Every physical number: its default with its unit, what it means and where it comes from. A source
begins with `paper` (arXiv:2603.07795), `datasheet`, `measured`, `fitted` or `assumed` (the paper
does not say).
"""
_ROBOTS = ("spec", "joints", "servos", "antenna", "imu")
"""Modules of `antennate.robots` that describe robots."""
_HARDWARE = (
    robot_file.RobotFile,
    robot_file.RobotConfig,
    robot_file.DoctorConfig,
    robot_file.DriveConfig,
    robot_file.RecordConfig,
)
_OTHERS = ("antennate.telemetry.replay", "antennate.twin.config")
"""Modules beside the experiments that hold the parameters of a command."""
_COMMANDS = """\
# Parameters of commands

The top level of each command's flags and configuration file; groups link to their tables.
"""


def _groups(module: ModuleType) -> list[type[Params]]:
    """Parameter classes that a module defines, in the order of the source."""
    return [
        group
        for name, group in vars(module).items()
        if inspect.isclass(group)
        and issubclass(group, Params)
        and group is not Params
        and group.__module__ == module.__name__
        and not name.startswith("_")
    ]


def _commands() -> list[type[Params]]:
    """Classes that hold the top level of a command's parameters."""
    known = experiments.loaded(lambda why: sys.stderr.write(f"parameters: warning: {why}\n"))
    found = [
        group for each in known.values() for group in _nested(each.config, experiments.home(each))
    ]
    found += _HARDWARE
    found += [group for name in _OTHERS for group in _groups(importlib.import_module(name))]
    return list(dict.fromkeys(found))


def _nested(config: type[Params], package: str) -> list[type[Params]]:
    """A configuration and its groups that belong to an experiment, or to its distribution."""
    distribution = package.partition(".")[0]
    package = package if distribution == "antennate" else distribution
    found = [config]
    for field in config.model_fields.values():
        default = field.get_default(call_default_factory=True)
        if isinstance(default, Params) and type(default).__module__.startswith(f"{package}."):
            found += _nested(type(default), package)
    return found


def _cells(group: type[Params], name: str) -> tuple[object, ...]:
    """Default with its unit, meaning and source of a number."""
    field = group.model_fields[name]
    extra: Any = field.json_schema_extra
    default = field.get_default(call_default_factory=True)
    value = f"{default:.6g}" if isinstance(default, float) else default
    unit = "" if extra["unit"] == "1" else f" {extra['unit']}"
    return f"`{value}`{unit}", meaning(group, name, unit=False), extra["source"]


def _table(group: type[Params], known: Collection[type[Params]], command: str = "") -> str:
    """A section: what the class says of itself, and a row for each number in it.

    Numbers that are those of a class on the page stand there. With the name of a command its
    section of the page of commands has default and meaning.
    """
    base = next((base for base in group.__mro__[1:] if base in known), None)
    rows, groups = list[str](), list[str]()
    for name, field in group.model_fields.items():
        default = field.get_default(call_default_factory=True)
        if isinstance(default, Params):  # its numbers have a table of their own
            kind = type(default).__name__
            groups.append(f"`{name}` [{kind}](#{kind.lower()})")
            continue
        found = _cells(group, name)
        if base and name in base.model_fields and found == _cells(base, name):
            continue
        rows.append(markdown_row(f"`{name}`", *(found[-1:] if command else found)))
    parts = [f"## {group.__name__}", inspect.getdoc(group) or ""]
    if command:
        words = command_words(command)
        place = f"[`antennate {words}`](options.md#antennate-{words.replace(' ', '-')})"
        parts.append(f"Default, unit and meaning: {place}.")
    if base:
        parts.append(f"All else as in [{base.__name__}](#{base.__name__.lower()}).")
    if rows:
        columns = ("name", "source") if command else ("name", "default", "meaning", "source")
        parts.append("\n".join([markdown_heads(*columns), *rows]))
    if groups:
        parts.append(f"Groups: {', '.join(groups)}.")
    return "\n\n".join(parts) + "\n"


def page(beside_commands: bool = False) -> str:
    """All tables, those of physical numbers first, then those of each command.

    Args:
        beside_commands: Whether docs/options.md stands beside it, which has default and meaning
            of each command's own parameters; here they then have name and source alone.
    """
    numbers = [
        f"antennate.params.{module.name}" for module in pkgutil.iter_modules(params.__path__)
    ]
    robots = [f"antennate.robots.{name}" for name in _ROBOTS]
    modules = map(importlib.import_module, numbers + robots)
    physical = [group for module in modules for group in _groups(module)]
    of_commands = _commands()
    known = [*physical, *of_commands]
    names = experiments.names() if beside_commands else ()
    own = {experiments.load(name).config: name for name in names}
    parts = [_table(group, known) for group in physical]
    tables = (_table(group, known, own.get(group, "")) for group in of_commands)
    return "\n".join([_HEAD, *parts, _COMMANDS, *tables]).rstrip("\n") + "\n"


@dataclass(frozen=True)
class _Options:
    """Nothing but the page can be asked for."""


def command(argv: Sequence[str]) -> int:
    """Print the page."""
    parse("parameters", DESCRIPTION, Params, argv, _Options)
    write_result(page())
    return OK
