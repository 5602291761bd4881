"""From words and a TOML file to a valid configuration and the options of a run.

The file must be valid on its own; flags override it. Values are checked once, by the models.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from antennate.cli.help import Command, long_page, short_page
from antennate.cli.options import (
    Option,
    fields_of,
    flag_of,
    found,
    merged,
    option,
    options_of,
    read_words,
    require_text,
)
from antennate.errors import ConfigError
from antennate.messages import command_words, shown
from antennate.params.base import Params, changes
from antennate.params.faults import describe, group_of
from antennate.params.reading import Config, put_over, read_file


class HelpRequest(Exception):
    """The words ask for help, which is the text of this exception."""


class OptionsRequest(Exception):
    """The words ask which options the `command` has."""

    WORD = "--complete"

    def __init__(self, command: Command) -> None:
        super().__init__()
        self.command = command


@dataclass(frozen=True)
class FromFile:
    """Where parameters come from."""

    config: Path | None = option(None, "TOML file of parameters; flags override it", "FILE")


Chosen = TypeVar("Chosen")


def parse(
    command: str,
    description: str,
    model: type[Config],
    argv: Sequence[str],
    options: type[Chosen],
    read: Callable[[Path], Config] | None = None,
    without: Sequence[str] = (),
    file_of: Callable[[Any], Path | None] = lambda chosen: chosen.config,
) -> tuple[Config, Chosen]:
    """Read the words of a command.

    Args:
        command: Name of the command.
        description: What it does; only `--help-all` shows what follows the first empty line.
        model: Its configuration.
        argv: Its words.
        options: Its other options.
        read: Reads a file that holds more than this configuration.
        without: Fields of the other options that this command has not.
        file_of: Which file is read, by the other options.

    Raises:
        ConfigError: A flag, the file or a value cannot be used.
        HelpRequest: Help was asked for.
    """
    every = list(options_of(model()))
    others = [option for option in options_of(options()) if option.path[0] not in without]
    unread = {option.flag for option in every if ".".join(option.path) in model.unread}
    parameters = [option for option in every if option.flag not in unread]
    page = Command(command, description, model, parameters, others)
    if list(argv) == [OptionsRequest.WORD]:
        raise OptionsRequest(page)
    for word in argv:
        if word in ("-h", "--help"):
            raise HelpRequest(short_page(page))
        if (name := word.partition("=")[0].replace("_", "-")) in unread:
            raise ConfigError(
                f"{name}: expected a parameter that {command_words(command)} reads, found this one"
            )
        if word == "--help-all":
            raise HelpRequest(long_page(page))
    values = read_words(argv, [*others, *parameters])
    names = fields_of(options).keys() - {*without}
    chosen = _filled(options, {}, {p: v for p, v in values.items() if p[0] in names})
    _refuse_alone([each for each in [*others, *parameters] if each.path in values], chosen)
    base: Mapping[str, Any] = {}
    if isinstance(chosen, FromFile) and (file := file_of(chosen)) is not None:
        config = read_file(file, model) if read is None else read(file)
        base = config.model_dump(exclude_unset=True)
        _refuse_code(file, base, values)
    given = {p: v for p, v in values.items() if p[0] not in names}
    for path, value in given.items():
        text = " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        require_text(flag_of(path), text)
    config = _filled(model, base, given)
    _refuse_unread(config, given)
    return config, chosen


def _refuse_alone(given: Iterable[Option], options: Any) -> None:
    """Refuse an option that says nothing without another one."""
    for each in given:
        if not each.is_beside(options):
            needed = " or ".join(each.needs)
            raise ConfigError(f"{each.flag}: expected {needed} beside it, found none")


def _refuse_unread(config: Params, flags: Mapping[tuple[str, ...], Any]) -> None:
    """Refuse a flag that nothing reads, though a file for several commands may hold its value."""
    why = config.unread_here() if config.shared else {}
    for path, value in changes(config, why):
        parts = tuple(path.split("."))
        if any(parts[:n] in flags for n in range(1, len(parts) + 1)):
            raise ConfigError(config.unread_error(path, why[path], value).text(flag_of))


_CODE = ("controller", "controllers", "scene", "experiment")
"""Parameters that may name code to run, as MODULE:NAME or FILE.py:NAME."""
TRUST = "trust_code"
"""Option of a command whose file may name code in deeper tables."""


def _refuse_code(file: Path, base: Mapping[str, Any], flags: Mapping[tuple[str, ...], Any]) -> None:
    """Run no code because a file of somebody else says so: a flag has to name it."""
    for path, name in () if flags.get((TRUST,)) else _code_in(base, ()):
        if path not in flags:
            deeper = len(path) > 1
            words = (
                flag_of((TRUST,)) if deeper else shlex.join([flag_of(path), *_names(base, path)])
            )
            raise ConfigError(
                f"{file}: {'.'.join(path)}: expected no code of its own in a file, found "
                f"{shown(name) if deeper else ', '.join(map(shown, _names(base, path)))}; if you "
                f"trust that code, add {words}"
            )


def _code_in(table: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Path and name of everything in nested tables that names code."""
    if isinstance(table, Mapping):
        for key, value in table.items():
            yield from _code_in(value, (*path, *str(key).split(".")))
    elif isinstance(table, list | tuple):
        for item in table:
            yield from _code_in(item, path)
    elif isinstance(table, str) and path and path[-1] in _CODE and ":" in table:
        yield path, table


def _names(base: Mapping[str, Any], path: tuple[str, ...]) -> tuple[str, ...]:
    value = base[path[0]]
    return (value,) if isinstance(value, str) else tuple(value)


_Model = TypeVar("_Model")


def _filled(
    model: type[_Model], base: Mapping[str, Any], values: Mapping[tuple[str, ...], Any]
) -> _Model:
    """The model with these values over those of a file, and both over groups that are named.

    A group that the file gives whole, as by a name of its own, gives way to the one that is named.
    """
    named = {path: table for path in values if (table := _table(model, path, values[path]))}
    plain = {path: value for path, value in values.items() if path not in named}
    for path, table in named.items():
        if _is_whole(base, path, table):
            base = merged(base, {path: {}})
    try:
        whole = merged(put_over(merged({}, named), base), plain)
        return TypeAdapter(model).validate_python(whole)
    except ValidationError as error:
        raise ConfigError(describe(error, model, flag_of, found)) from None


def _is_whole(base: Any, path: tuple[str, ...], table: Mapping[str, Any]) -> bool:
    """Whether nested tables hold, at a path, every key that a table has."""
    for part in path:
        base = base.get(part) if isinstance(base, dict) else None
    return isinstance(base, dict) and all(
        key in base and (not isinstance(value, dict) or _is_whole(base, (key,), value))
        for key, value in table.items()
    )


def _table(model: Any, path: tuple[str, ...], value: Any) -> dict[str, Any] | None:
    """The table of a group that is given by its name, None if a plain value is given."""
    kind: Any = model
    for part in path:
        kind = group_of(fields_of(kind)[part].annotation)
    return None if kind is None else kind.named(value).model_dump()
