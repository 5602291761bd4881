"""From words and a TOML file to a valid configuration and the options of a run.

tyro makes one flag of every parameter but builds nothing: the values come back as plain dicts and
are checked once, by the model itself. The file must be valid on its own; flags override it.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar, cast

import tyro
from pydantic import BaseModel, ValidationError
from tyro.constructors import (
    ConstructorRegistry,
    StructConstructorSpec,
    StructFieldSpec,
    StructTypeInfo,
)

from antennate.cli.messages import describe, dotted, flag, nearest, one_line, shown
from antennate.errors import ConfigError
from antennate.params import Params
from antennate.params.base import GATHERED
from antennate.studies.pool import core_count

LARGEST_FILE = 1_000_000
"""Most bytes of a configuration file."""
_MOST_DOTS = 100
"""Most dots on a line of it; keys of thousands of parts would keep the reader busy for minutes."""

Config = TypeVar("Config", bound=Params)


@dataclass(frozen=True)
class FromFile:
    """Where parameters come from.

    Attributes:
        config: TOML file with the parameters below as keys and tables; flags override it
    """

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None


@dataclass(frozen=True)
class Options(FromFile):
    """How to run; nothing here changes a result.

    Attributes:
        config: TOML file with the parameters below as keys and tables; flags override it
        out: folder for the results, runs/COMMAND-N if not given
        overwrite: replace the results that the folder holds
        workers: processes to use, all cores if not given
        json: print the content of result.json and nothing else
        no_figures: draw no figures
    """

    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    overwrite: bool = False
    workers: Annotated[int | None, tyro.conf.arg(metavar="INT")] = None
    json: bool = False
    no_figures: bool = False

    @property
    def worker_count(self) -> int:
        """Processes to use."""
        return core_count() if self.workers is None else self.workers


Chosen = TypeVar("Chosen", bound=FromFile)


@dataclass(frozen=True)
class _Call(Generic[Config, Chosen]):
    options: Annotated[Chosen, tyro.conf.arg(name="")]
    parameters: Annotated[Config, tyro.conf.arg(name="")]


_registry = ConstructorRegistry()


@_registry.struct_rule
def _plain(info: StructTypeInfo) -> StructConstructorSpec | None:
    """A model becomes a dict of its fields, unchecked."""
    if not (isinstance(info.type, type) and issubclass(info.type, Params)):
        return None
    default = info.default if isinstance(info.default, info.type) else info.type()
    fields = tuple(
        StructFieldSpec(
            name=name,
            type=cast(Any, field.annotation),
            default=getattr(default, name),
            helptext=field.description,
        )
        for name, field in info.type.model_fields.items()
    )
    return StructConstructorSpec(instantiate=dict, fields=fields)


def parse(
    command: str, description: str, model: type[Config], argv: Sequence[str]
) -> tuple[Config, Options]:
    """Read the words of a command that runs a study.

    Raises:
        ConfigError: A flag, the file or a value cannot be used.
        SystemExit: Help was asked for and has been printed.
    """
    config, options = parse_with(command, description, model, argv, Options())
    if options.worker_count < 1:
        raise ConfigError(f"--workers: expected at least 1, found {options.workers}")
    return config, options


def parse_with(
    command: str,
    description: str,
    model: type[Config],
    argv: Sequence[str],
    options: Chosen,
    read: Callable[[Path], Config] | None = None,
) -> tuple[Config, Chosen]:
    """The same with options of another kind, given by their defaults.

    A file that holds more than this configuration is read by `read`.
    """
    call = _words(command, description, model(), argv, options)
    if (file := call.options.config) is not None:
        base = read_file(file, model) if read is None else read(file)
        call = _words(command, description, base, argv, options)
    try:
        return model.model_validate(call.parameters), call.options
    except ValidationError as error:
        raise ConfigError(describe(error, model, flag)) from None


def read_file(path: Path, model: type[Config]) -> Config:
    """A configuration from a TOML file with the model's keys.

    Raises:
        ConfigError: The file cannot be read, is no TOML, or holds what the model refuses.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise ConfigError(
            f"--config: expected a readable file, found {path}: {error.strerror}"
        ) from None
    if len(content) > LARGEST_FILE:
        raise ConfigError(f"{path}: expected at most {LARGEST_FILE} bytes, found more")
    try:
        text = content.decode("utf-8")
        for number, line in enumerate(text.splitlines(), 1):
            if line.count(".") > _MOST_DOTS:
                raise ConfigError(
                    f"{path}: line {number}: expected at most {_MOST_DOTS} dots, found more"
                )
        data = json.dumps(tomllib.loads(text), default=str)
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{path}: expected UTF-8 text, found byte {content[error.start]:#04x} at {error.start}"
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: expected TOML, found: {error}") from None
    except RecursionError:
        raise ConfigError(f"{path}: expected plain tables, found them nested too deeply") from None
    try:
        return model.model_validate_json(data, strict=True)
    except ValidationError as error:
        raise ConfigError(f"{path}: {describe(error, model, dotted)}") from None


def _words(
    command: str, description: str, default: Params, argv: Sequence[str], options: FromFile
) -> _Call[Any, Any]:
    with _refusals():
        call, unknown = tyro.cli(
            _Call[type(default), type(options)],
            prog=f"antennate {command}",
            description=description,
            args=_gathered(argv, set(_flags(type(default), (), gathered=True))),
            default=_Call(options, default),
            config=(tyro.conf.FlagCreatePairsOff,),
            registry=_registry,
            return_unknown_args=True,
        )
    if unknown:
        raise ConfigError(_unknown(unknown[0], type(default), options))
    return call


def _gathered(argv: Sequence[str], flags: set[str]) -> list[str]:
    """The words with each of these flags given once, with the values of all."""
    last: list[str] = []
    groups = [last]
    whole: dict[str, list[str]] = {}
    for word in argv:
        name, given, value = word.partition("=")
        name = name.replace("_", "-")
        if name in flags:
            if name not in whole:
                whole[name] = [name]
                groups.append(whole[name])
            if given:
                whole[name].append(value)
            last = whole[name]
        elif word.startswith("--"):
            last = [word]
            groups.append(last)
        else:
            last.append(word)
    return [word for group in groups for word in group]


@contextlib.contextmanager
def _refusals() -> Iterator[None]:
    """Turn tyro's boxes into errors of one line."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            yield
    except SystemExit as end:
        if end.code in (None, 0):
            raise
        raise ConfigError(_unbox(said.getvalue())) from None


def _unbox(box: str) -> str:
    """The message in one of tyro's boxes, as `flag: expected ..., found ...` where it is known."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", box)
    lines = [line.strip(" │|") for line in plain.splitlines()[1:-1]]
    ruled = "\n".join("" if re.fullmatch("[─-]+", line) else line for line in lines)
    message = one_line(ruled.split("\n\n")[0])
    if match := re.match(
        r"invalid choice '(.*)' for argument '(.*)'\. Expected one of (.*)\.", message
    ):
        choices = re.sub(r"[()']|,\)$", "", match[3])
        return f"{match[2]}: expected one of {choices}, found {shown(match[1])}"
    if match := re.match(r"Missing value for argument '(.*)'\. Expected (\d+) values?", message):
        return (
            f"{match[1]}: expected {match[2]} value{'s' if match[2] != '1' else ''}, found too few"
        )
    if match := re.match(r"Error parsing (\S+): (.*)", message):
        kind = re.search(rf"^{re.escape(match[1])} (\[?[A-Z]+)", ruled, re.MULTILINE)
        found = re.search(r"\[.*\]|'.*'$", match[2].split(" into ")[0])
        if kind and found:
            return f"{match[1]}: expected {kind[1].strip('[')}, found {one_line(found[0])}"
        return f"{match[1]}: {match[2]}"
    return message


def _unknown(word: str, model: type[Params], chosen: FromFile) -> str:
    if not word.startswith("-"):
        return f"expected flags only, found {shown(word)}"
    name = word.split("=")[0].replace("_", "-")
    options = [flag((option,)) for option in chosen.__dataclass_fields__]
    known = [*options, *_flags(model, ())]
    return f"expected a known flag{nearest(name, known)}, found {shown(word)}"


def _flags(model: type[BaseModel], path: tuple[str, ...], gathered: bool = False) -> Iterator[str]:
    """Flags of all parameters, or of those alone that gather their values."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Params):
            yield from _flags(field.annotation, (*path, name), gathered)
        elif not gathered or GATHERED in field.metadata:
            yield flag((*path, name))
