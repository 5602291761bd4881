"""From words and a TOML file to a valid configuration and the options of a command.

The file must be valid on its own; flags override it. Nothing is checked here but the flags, and how
many values they take; the models check the values, once.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from antennate.cli.options import Command, Option, fields_of, flag_of, option, options_of
from antennate.errors import ConfigError
from antennate.messages import command_words, nearest, shortened, shown
from antennate.params.base import Config, Params, changes, put_over, read_file, stated
from antennate.params.faults import describe, group_of


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


Options = TypeVar("Options")
Values = Mapping[tuple[str, ...], Any]
"""Values by the path of their field."""
_Model = TypeVar("_Model")


def parse(
    command: str,
    description: str,
    model: type[Config],
    argv: Sequence[str],
    options: type[Options],
    read: Callable[[Path], Config] | None = None,
    without: Sequence[str] = (),
    file_of: Callable[[Any], Path | None] = lambda options: options.config,
) -> tuple[Config, Options]:
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
    """
    parameters = list(options_of(model()))
    others = [option for option in options_of(options()) if option.path[0] not in without]
    unread = {option.flag for option in parameters if ".".join(option.path) in model.unread}
    parameters = [option for option in parameters if option.flag not in unread]
    _answer_questions(Command(command, description, model, parameters, others), argv, unread)
    values = read_words(argv, [*others, *parameters])
    names = fields_of(options).keys() - {*without}
    chosen = _filled(options, {}, {p: v for p, v in values.items() if p[0] in names})
    for flag in [*others, *parameters]:
        if flag.path in values:
            flag.require_others(chosen)
    base: Mapping[str, Any] = {}
    if isinstance(chosen, FromFile) and (file := file_of(chosen)) is not None:
        config = read_file(file, model) if read is None else read(file)
        base = config.model_dump(exclude_unset=True)
        _refuse_code(file, base, values)
    flags = {p: v for p, v in values.items() if p[0] not in names}
    for path, value in flags.items():
        text = " ".join(map(str, value)) if isinstance(value, tuple) else str(value)
        require_text(flag_of(path), text)
    config = _filled(model, base, flags)
    _refuse_unread(config, flags)
    return config, chosen


def _answer_questions(page: Command, argv: Sequence[str], unread: set[str]) -> None:
    """Raise what asks for help or for the options; refuse a flag of what the command reads not."""
    if list(argv) == [OptionsRequest.WORD]:
        raise OptionsRequest(page)
    for word in argv:
        if word in ("-h", "--help"):
            from antennate.cli.help import short_page  # only where it is asked for

            raise HelpRequest(short_page(page))
        if word == "--help-all":
            from antennate.cli.help import long_page

            raise HelpRequest(long_page(page))
        if (flag := word.partition("=")[0].replace("_", "-")) in unread:
            name = command_words(page.name)
            raise ConfigError(f"{flag}: expected a parameter that {name} reads, found this one")


def _refuse_unread(config: Params, flags: Values) -> None:
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


def _refuse_code(file: Path, base: Mapping[str, Any], flags: Values) -> None:
    """Run no code because a file of somebody else says so: a flag has to name it."""
    if flags.get((TRUST,)):
        return
    for path, name in _code_in(base, ()):
        if path in flags:
            continue
        names, cure = [name], flag_of((TRUST,))
        if len(path) == 1:
            value = base[path[0]]
            names = [value] if isinstance(value, str) else list(value)
            cure = shlex.join([flag_of(path), *names])
        raise ConfigError(
            f"{file}: {'.'.join(path)}: expected no code of its own in a file, found "
            f"{', '.join(map(shown, names))}; if you trust that code, add {cure}"
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


def _filled(model: type[_Model], base: Mapping[str, Any], values: Values) -> _Model:
    """The model with these values over those of a file, and both over groups that are named.

    A group that the file gives whole, as by a name of its own, gives way to the one that is named.
    """
    named = {path: table for path in values if (table := _table(model, path, values[path]))}
    plain = {path: value for path, value in values.items() if path not in named}
    for path, table in named.items():
        if _is_whole(base, path, table):
            base = _merged(base, {path: {}})
    try:
        whole = _merged(put_over(_merged({}, named), base), plain)
        return TypeAdapter(model).validate_python(whole)
    except ValidationError as error:
        raise ConfigError(describe(error, model, flag_of, as_typed)) from None


def _is_whole(base: Any, path: tuple[str, ...], table: Mapping[str, Any]) -> bool:
    """Whether nested tables hold, at a path, every plain value that a table has."""
    for part in path:
        base = base.get(part) if isinstance(base, dict) else None
    plain = {key for key, value in table.items() if not isinstance(value, dict)}
    return isinstance(base, dict) and plain <= base.keys()


def _table(model: Any, path: tuple[str, ...], value: Any) -> dict[str, Any] | None:
    """The table of a group that is given by its name, None if a plain value is given."""
    kind: Any = model
    for part in path:
        kind = group_of(fields_of(kind)[part].annotation)
    return None if kind is None else stated(kind.named(value))


def _merged(base: Mapping[str, Any], values: Values) -> dict[str, Any]:
    """Nested tables with values put over them."""
    result = dict(base)
    for path, value in values.items():
        table = result
        for part in path[:-1]:
            table[part] = dict(table.get(part) or {})
            table = table[part]
        table[path[-1]] = value
    return result


def as_typed(value: Any) -> str:
    """A value as it was typed."""
    return shortened(" ".join(map(str, value)) if isinstance(value, tuple) else str(value))


def require_text(flag: str, text: str) -> None:
    """Refuse words of the shell that no file of text can keep."""
    if text != text.encode(errors="replace").decode():
        raise ConfigError(f"{flag}: expected text in UTF-8, found {shown(text)}")


def read_words(argv: Sequence[str], options: Sequence[Option]) -> dict[tuple[str, ...], Any]:
    """Values by the path of their field.

    A list takes all words up to the next flag, and those of a flag given again besides. Of other
    flags given twice the last one counts.
    """
    by_flag = {flag: option for option in options for flag in option.flags}
    values: dict[tuple[str, ...], Any] = {}
    free = [option for option in options if option.positional]
    named, placed = set[tuple[str, ...]](), set[tuple[str, ...]]()
    for flag, words in flags_and_words(argv):
        option, rest = by_flag.get(flag), words
        named |= {option.path} if option else set()
        if option is None:
            _require_none(flag, by_flag)
        elif not option.metavar:
            values[option.path] = flag == option.flag
        elif not words:
            count = "at least 1 value" if option.many else f"1 value, {option.metavar}"
            raise ConfigError(f"{flag}: expected {count}, found none")
        elif option.many:
            _refuse_commas(option, words)
            values[option.path] = (*values.get(option.path, ()), *map(option.value, words))
            rest = []
        else:
            values[option.path] = option.value(words[0])
            rest = words[1:]
        for word in rest:
            if not free:
                meant = nearest(word, by_flag) if word.startswith("-") else ""
                raise ConfigError(f"expected flags only{meant}, found {shown(word)}")
            value = free[0].value(word)
            placed.add(free[0].path)
            if free[0].many:
                values[free[0].path] = (*values.get(free[0].path, ()), value)
            else:
                values[free.pop(0).path] = value
    if twice := [o for o in options if o.path in named & placed and not o.many]:
        raise ConfigError(f"{twice[0].flag}: expected it once, found also {twice[0].free} without")
    return values


def flags_and_words(argv: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Each flag with the words up to the next one; first those before any flag, without one."""
    flag, words = "", list[str]()
    for word in argv:
        if word.startswith("--"):
            yield flag, words
            flag, given, value = word.partition("=")
            flag, words = flag.replace("_", "-"), [value] if given else []
        else:
            words.append(word)
    yield flag, words


_WITH_COMMAS = frozenset({"FILE", "NAME=VALUE"})
"""What stands for values in which a comma may be."""


def _refuse_commas(option: Option, words: Sequence[str]) -> None:
    """Refuse a list in one word, but that of a parameter, as NAME+PARAMETER=[1, 2]."""
    bare = (re.sub(r"=\[[^][]*\]", "", word) for word in words)
    listed = [word for word in bare if "," in word and "/" not in word]
    if not listed or option.metavar in _WITH_COMMAS or Path in option.kinds:
        return
    parts = [part.strip() for part in ",".join(words).split(",") if part.strip()]
    how = "values separated by spaces"
    if option.kinds & {int, float}:
        how = "numbers separated by spaces, with decimal points"
    elif parts:
        how += f", as {option.flag} {shortened(shlex.join(parts))}"
    raise ConfigError(f"{option.flag}: expected {how}, found {shown(' '.join(words))}")


_ELSEWHERE = {
    "--readings": "tunnel and log replay take it; no other command changes what is read",
    "--knows": "only tunnel takes it: no robot knows what a simulation does",
    "--log": "tunnel, gait and twin take it; drive and drive teleop always keep a log",
    "--video": "tunnel, climb and twin take it; `antennate log film` makes a film of any log",
    "--view": "tunnel, gait, climb, bench wall, twin, drive, drive teleop and log replay take it; "
    "`antennate log view` shows any log",
}
"""Which commands have a flag that others could have, too."""


def _require_none(flag: str, known: Mapping[str, Option]) -> None:
    """Refuse a flag that the command has not."""
    if flag in _ELSEWHERE:
        raise ConfigError(f"expected a flag of this command, found {flag}; {_ELSEWHERE[flag]}")
    if flag:
        models = {option.model for option in known.values()}
        former = {k: v for model in models for k, v in getattr(model, "former", {}).items()}
        meant = nearest(flag, known, former)
        raise ConfigError(f"expected a known flag{meant}, found {shown(flag)}")
