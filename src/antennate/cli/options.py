"""The flags of a command, made from its models, and the values that words give them.

Each field of a model is a flag: its path with dots, hyphens for underscores. Nothing is checked
here but the flags themselves and how many values they take; the models check the values. argparse
is not used: it takes values such as -1e-3 and -inf for flags, and answers in words of its own.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

from antennate.errors import ConfigError
from antennate.messages import nearest, shortened, shown
from antennate.params.base import meaning
from antennate.params.faults import group_of

_METAVARS = {int: "INT", float: "FLOAT", str: "TEXT", Path: "FILE"}
_WITH_COMMAS = frozenset({"FILE", "NAME=VALUE"})
"""What stands for values in which a comma may be."""
_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def option(
    default: Any, meaning: str, metavar: str = "", needs: Sequence[str] = (), **more: Any
) -> Any:
    """Declare one option of a command that is no physical number.

    Args:
        default: Its default.
        meaning: What it does.
        metavar: What stands for its value in the help, such as FILE.
        needs: Flags of which one must be given beside it, as `--video`; with the begin of its value
            where not all do, as `--engine slurm`.
        more: As for pydantic's Field; `positional` is for a value without a flag.
    """
    extra: dict[str, Any] = {"metavar": metavar} if metavar else {}
    if more.pop("positional", False):
        extra["positional"] = True
    if needs:
        extra["needs"] = list(needs)
    return Field(default, description=meaning, json_schema_extra=extra, **more)


@dataclass(frozen=True)
class Option:
    """One flag.

    Attributes:
        path: Field that it sets, within the model.
        metavar: What stands for a value in the help; empty for a switch.
        kinds: Types that a word is tried as, beside text.
        model: Group that the field belongs to.
        examples: Known values among others, for completion.
        many: Whether it takes several values.
        choices: All valid values, if they are few.
        limits: Bounds in words, such as `at least 1`.
        default: Its default in words, empty if there is none to tell.
        positional: Whether it is given without a flag.
        needs: Flags of which one must be given beside it.
    """

    path: tuple[str, ...]
    metavar: str
    kinds: frozenset[type]
    model: type
    examples: tuple[str, ...]
    many: bool = False
    choices: tuple[Any, ...] = ()
    limits: str = ""
    default: str = ""
    positional: bool = False
    needs: tuple[str, ...] = ()

    def is_beside(self, options: Any) -> bool:
        """Whether these options have one that it needs, if it needs any."""
        for need in self.needs:
            flag, _, begin = need.partition(" ")
            value = getattr(options, flag.removeprefix("--").replace("-", "_"))
            if value and str(value).startswith(begin):
                return True
        return not self.needs

    @property
    def flag(self) -> str:
        """The flag, such as `--tunnel.free-width`."""
        return flag_of(self.path)

    @property
    def free(self) -> str:
        """What stands for it in the usage of its command, if it is given without a flag."""
        return f"{self.metavar}{'...' if self.many else ''}" if self.positional else ""

    @property
    def meaning(self) -> str:
        """What the field means, with its unit; of a named group its choice."""
        kind = group_of(fields_of(self.model)[self.path[-1]].annotation)
        return getattr(kind, "choice", "") or meaning(self.model, self.path[-1])

    @property
    def offered(self) -> str:
        """The flag that help and completion show; of a switch the one that changes its default."""
        return self.flags[-1] if self.default and not self.metavar else self.flag

    @property
    def flags(self) -> tuple[str, ...]:
        """The flag; of a switch also the one that turns it off."""
        if self.metavar:
            return (self.flag,)
        head, _, name = self.flag.removeprefix("--").rpartition(".")
        return self.flag, f"--{head}{'.' if head else ''}no-{name}"

    def value(self, word: str) -> Any:
        """The value of a word; what fits no type stays text and is refused by the model.

        Raises:
            ConfigError: It is empty and a path is wanted.
        """
        if not word and Path in self.kinds:
            raise ConfigError(f"{self.flag}: expected a path, found nothing")
        for choice in self.choices:
            if word == str(choice):
                return choice
        if word.lower() == "none" and NoneType in self.kinds:
            return None
        for kind in (int, float):
            if kind in self.kinds:
                try:
                    return kind(word)
                except ValueError:
                    pass
        return word


def flag_of(path: Sequence[int | str]) -> str:
    """`("tunnel", "segments", 0)` as `--tunnel.segments`."""
    return "--" + ".".join(part for part in path if isinstance(part, str)).replace("_", "-")


def fields_of(kind: Any) -> Mapping[str, FieldInfo]:
    """The fields of a model or of a pydantic dataclass."""
    return kind.model_fields if issubclass(kind, BaseModel) else kind.__pydantic_fields__


def options_of(default: Any, path: tuple[str, ...] = ()) -> Iterator[Option]:
    """An option for each field that a flag can set, group by group.

    A group whose class has `named(text)` is also an option of its own: a name or a file, which its
    `choice` describes.

    Args:
        default: A model or pydantic dataclass with its default values.
        path: Where it stands in the model of the command.
    """
    model = type(default)
    for name, field in fields_of(model).items():
        value = getattr(default, name)
        group = group_of(field.annotation)
        if group is None:
            option = _option((*path, name), model, value)
            if option is not None:
                yield option
        else:
            if hasattr(group, "choice"):
                known = tuple(map(str, field.examples or ()))
                yield Option((*path, name), "NAME|FILE", frozenset({str}), model, known)
            yield from options_of(group() if value is None else value, (*path, name))


def _option(path: tuple[str, ...], model: type, default: Any) -> Option | None:
    field = fields_of(model)[path[-1]]
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    types, many = _types(field.annotation)
    choices = tuple(c for kind in types if get_origin(kind) is Literal for c in get_args(kind))
    kinds = frozenset(kind for kind in types if isinstance(kind, type)) | {type(c) for c in choices}
    switch = bool in kinds
    if not switch and not kinds & {*_METAVARS}:
        return None  # a list of tables, for a file only
    known = next((text for kind, text in _METAVARS.items() if kind in kinds), "")
    known = "NAME" if field.examples and str in kinds else known
    metavar = "{" + ",".join(map(str, choices)) + "}" if choices else known
    return Option(
        path=path,
        metavar="" if switch else str(extra.get("metavar", metavar)),
        many=many,
        choices=choices,
        examples=tuple(map(str, field.examples or ())),
        model=model,
        limits=_limits(field),
        default=_words(default),
        kinds=kinds,
        positional=bool(extra.get("positional")),
        needs=tuple(map(str, needs)) if isinstance(needs := extra.get("needs"), list) else (),
    )


def first_line(group: type) -> str:
    """What a group is, by its docstring."""
    return (group.__doc__ or "").strip().split("\n")[0].rstrip(".")


def _types(annotation: Any) -> tuple[list[Any], bool]:
    """The types of one value, and whether there are several of them."""
    annotation = _bare(annotation)
    if get_origin(annotation) in (Union, UnionType):
        parts = [_types(part) for part in get_args(annotation)]
        return [kind for kinds, _ in parts for kind in kinds], any(many for _, many in parts)
    if get_origin(annotation) is tuple:
        items = [item for item in get_args(annotation) if item is not Ellipsis]
        return [kind for item in items for kind in _types(item)[0]], True
    return [annotation], False


def _bare(annotation: Any) -> Any:
    """An annotation without what `Annotated` adds."""
    return annotation.__origin__ if hasattr(annotation, "__metadata__") else annotation


def _limits(field: FieldInfo) -> str:
    """The bounds of a number, or of each number of a list."""
    annotation = _bare(field.annotation)
    inner = [m for item in get_args(annotation)[:1] for m in getattr(item, "__metadata__", ())]
    found = list(field.metadata)
    for each in inner:
        found += each.metadata if isinstance(each, FieldInfo) else [each]
    bounds = {key: getattr(each, key) for key in _BOUNDS for each in found if hasattr(each, key)}
    if bounds.keys() == {"ge", "le"}:
        return f"{bounds['ge']:g} to {bounds['le']:g}"
    return ", ".join(f"{_BOUNDS[key]} {value:g}" for key, value in bounds.items())


def _words(value: Any) -> str:
    """A default as it is typed; empty for none, nothing and off."""
    if isinstance(value, tuple):
        return " ".join(_words(item) for item in value)
    if value is None or value is False:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def read_words(argv: Sequence[str], options: Sequence[Option]) -> dict[tuple[str, ...], Any]:
    """Values by the path of their field.

    A list takes all words up to the next flag, and those of a flag given again besides. Of other
    flags given twice the last one counts.

    Raises:
        ConfigError: A flag is unknown, or has too few or too many values.
    """
    by_flag = {flag: option for option in options for flag in option.flags}
    values: dict[tuple[str, ...], Any] = {}
    free = [option for option in options if option.positional]
    for name, words in flags_and_words(argv):
        option = _named_by(name, by_flag)
        if option is None:
            rest = words
        elif not option.metavar:
            values[option.path] = name == option.flag
            rest = words
        elif not words:
            raise ConfigError(f"{name}: expected {_count(option)}, found none")
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
            first = free[0]
            if first.many:
                values[first.path] = (*values.get(first.path, ()), first.value(word))
            else:
                values[free.pop(0).path] = first.value(word)
    return values


def _refuse_commas(option: Option, words: Sequence[str]) -> None:
    """Refuse a list in one word."""
    listed = [word for word in words if "," in word and "/" not in word]
    if not listed or option.metavar in _WITH_COMMAS or Path in option.kinds:
        return
    parts = [part.strip() for part in ",".join(words).split(",") if part.strip()]
    how = "values separated by spaces"
    if option.kinds & {int, float}:
        how = "numbers separated by spaces, with decimal points"
    elif parts:
        how += f", as {option.flag} {shortened(shlex.join(parts))}"
    raise ConfigError(f"{option.flag}: expected {how}, found {shown(' '.join(words))}")


def require_text(flag: str, text: str) -> None:
    """Refuse words of the shell that no file of text can keep.

    Raises:
        ConfigError: They are not in UTF-8.
    """
    if text != text.encode(errors="replace").decode():
        raise ConfigError(f"{flag}: expected text in UTF-8, found {shown(text)}")


_ELSEWHERE = {
    "--knows": "only tunnel takes it: no robot knows what a simulation does",
    "--log": "tunnel, gait and twin take it; drive and drive teleop always keep a log",
    "--video": "tunnel, gait, calibrate, twin, bench wall, bench touch, bench sweep, bench force "
    "and antenna ringdown take it; "
    "`antennate log film` makes a film of any log",
    "--view": "tunnel, gait, bench wall, twin, drive, drive teleop and log replay take it; "
    "`antennate log view` shows any log",
}
"""Which commands have a flag that others could have, too."""


def _named_by(flag: str, by_flag: Mapping[str, Option]) -> Option | None:
    """The option of a flag, None of none."""
    if flag and flag not in by_flag:
        if flag in _ELSEWHERE:
            raise ConfigError(f"expected a flag of this command, found {flag}; {_ELSEWHERE[flag]}")
        raise ConfigError(f"expected a known flag{nearest(flag, by_flag)}, found {shown(flag)}")
    return by_flag.get(flag)


def flags_and_words(argv: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Each flag with the words up to the next one; first those before any flag, without one."""
    name, words = "", list[str]()
    for word in argv:
        if word.startswith("--"):
            yield name, words
            name, given, value = word.partition("=")
            name, words = name.replace("_", "-"), [value] if given else []
        else:
            words.append(word)
    yield name, words


def _count(option: Option) -> str:
    return "at least 1 value" if option.many else f"1 value, {option.metavar}"


def merged(base: Mapping[str, Any], values: Mapping[tuple[str, ...], Any]) -> dict[str, Any]:
    """Nested tables with values put over them."""
    result = dict(base)
    for path, value in values.items():
        table = result
        for part in path[:-1]:
            table[part] = dict(table.get(part) or {})
            table = table[part]
        table[path[-1]] = value
    return result


def found(value: Any) -> str:
    """A value as it was typed."""
    return shortened(" ".join(map(str, value)) if isinstance(value, tuple) else str(value))
