"""The flags of a command, made from its models.

Each field of a model is a flag: its path with dots, hyphens for underscores. What a field means,
its unit and its bounds come from the model, which also checks the values.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

import pydantic.dataclasses
from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

from antennate.errors import ConfigError
from antennate.messages import shortened
from antennate.params.base import meaning
from antennate.params.faults import group_of
from antennate.telemetry import FOXGLOVE_PORT, LAST_DOMAIN, PAGE_PORT

_METAVARS = {int: "INT", float: "FLOAT", str: "TEXT", Path: "FILE"}
_BOUNDS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def option(
    default: Any, meaning: str, metavar: str = "", needs: Sequence[str] = (), **more: Any
) -> Any:
    """Declare one option of a command that is no physical number.

    Args:
        default: Its default.
        meaning: What it does.
        metavar: What stands for its value in the help, such as FILE.
        needs: Flags, one of which must be given beside it, as `--video`; with the begin of its
            value where not all do, as `--engine slurm`.
        more: As for pydantic's Field; `positional` is for a value without a flag, `optional` for
            one of these that may be left out.
    """
    extra = {"metavar": metavar, "needs": list(needs)}
    extra |= {name: more.pop(name, False) for name in ("positional", "optional")}
    return Field(
        default,
        description=meaning,
        json_schema_extra={name: value for name, value in extra.items() if value},
        **more,
    )


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
        default: Its default in words, empty if there is none to show.
        positional: Whether it is given without a flag.
        optional: Whether it may be left out then.
        needs: Flags, one of which must be given beside it.
    """

    path: tuple[str, ...]
    metavar: str
    kinds: frozenset[type]
    model: type
    examples: Collection[Any]
    many: bool = False
    choices: tuple[Any, ...] = ()
    limits: str = ""
    default: str = ""
    positional: bool = False
    optional: bool = False
    needs: tuple[str, ...] = ()

    @property
    def flag(self) -> str:
        """The flag, such as `--tunnel.free-width`."""
        return flag_of(self.path)

    @property
    def flags(self) -> tuple[str, ...]:
        """The flag; of a switch also the one that turns it off."""
        if self.metavar:
            return (self.flag,)
        head, dot, name = self.flag.removeprefix("--").rpartition(".")
        return self.flag, f"--{head}{dot}no-{name}"

    @property
    def offered(self) -> str:
        """The flag that help and completion show; of a switch the one that changes its default."""
        return self.flags[-1] if self.default and not self.metavar else self.flag

    @property
    def free(self) -> str:
        """What stands for it in the help, if it is given without a flag."""
        return f"{self.metavar}{'...' if self.many else ''}" if self.positional else ""

    @property
    def usage(self) -> str:
        """What stands for it in the usage of its command: in brackets if it may be left out."""
        return f"[{self.free}]" if self.optional else self.free

    @property
    def meaning(self) -> str:
        """What the field means, with its unit; of a named group its choice, unless it says more."""
        kind = group_of(fields_of(self.model)[self.path[-1]].annotation)
        own = meaning(self.model, self.path[-1])
        return own or getattr(kind, "choice", "")

    @property
    def values(self) -> list[str]:
        """Known values."""
        return [*map(str, self.choices or self.examples)]

    def value(self, word: str) -> Any:
        """The value of a word; what fits no type stays text and is refused by the model."""
        if not word and Path in self.kinds:
            raise ConfigError(f"{self.flag}: expected a path, found nothing")
        for choice in self.choices:
            if word == str(choice):
                return choice
        if word.lower() == "none" and NoneType in self.kinds:
            return None
        for kind in (int, float):
            if kind in self.kinds:
                with suppress(ValueError):
                    return kind(word)
        return word

    def require_others(self, options: Any) -> None:
        """Refuse it where it changes nothing, as without one of the flags that it needs."""
        others = []
        for need in self.needs:
            flag, _, begin = need.partition(" ")
            name = flag.removeprefix("--").replace("-", "_")
            value = getattr(options, name)
            if value and str(value).startswith(begin):
                return
            other = begin and value != fields_of(type(options))[name].default
            others += [f"{flag} {shortened(str(value))}"] if other else []
        if self.needs:
            needed, found = " or ".join(self.needs), " and ".join(others) or "none"
            raise ConfigError(f"{self.flag}: expected {needed} beside it, found {found}")


def flag_of(path: Sequence[int | str]) -> str:
    """`("tunnel", "segments", 0)` as `--tunnel.segments`."""
    return "--" + ".".join(part for part in path if isinstance(part, str)).replace("_", "-")


def fields_of(kind: Any) -> Mapping[str, FieldInfo]:
    """The fields of a model or of a pydantic dataclass."""
    return kind.model_fields if issubclass(kind, BaseModel) else kind.__pydantic_fields__


def options_of(default: Any, path: tuple[str, ...] = ()) -> Iterator[Option]:
    """An option for each field that a flag can set, group by group.

    A group whose class has `named(text)` is also an option of its own: a name (its `known` are
    offered) or a file, which its `choice` describes.

    Args:
        default: A model or pydantic dataclass with its default values.
        path: Where it stands in the model of the command.
    """
    model = type(default)
    for name, field in fields_of(model).items():
        value, group = getattr(default, name), group_of(field.annotation)
        if group is None:
            yield from _option((*path, name), model, field, value)
            continue
        if hasattr(group, "choice"):
            known = tuple(getattr(group, "known", ()))
            yield Option(
                path=(*path, name),
                metavar="NAME|FILE",
                kinds=frozenset({str}),
                model=model,
                examples=known,
                positional=bool(_extra(field).get("positional")),
                optional=bool(_extra(field).get("optional")),
            )
        yield from options_of(group() if value is None else value, (*path, name))


def _option(path: tuple[str, ...], model: type, field: FieldInfo, default: Any) -> Iterator[Option]:
    """The option of a field; none of a list of tables, which only a file can hold."""
    extra = _extra(field)
    types, many = _types(field.annotation)
    choices = tuple(c for kind in types if get_origin(kind) is Literal for c in get_args(kind))
    kinds = frozenset(kind for kind in types if isinstance(kind, type)) | {type(c) for c in choices}
    known = next((text for kind, text in _METAVARS.items() if kind in kinds), "")
    if known or bool in kinds:
        offered = getattr(model, "offered", {}).get(path[-1], field.examples)
        known = "NAME" if offered is not None and str in kinds else known
        metavar = "{" + ",".join(map(str, choices)) + "}" if choices else known
        yield Option(
            path=path,
            metavar="" if bool in kinds else str(extra.get("metavar", metavar)),
            many=many,
            choices=choices,
            examples=() if offered is None else offered,
            model=model,
            limits=_limits(field),
            default=_words(default),
            kinds=kinds,
            positional=bool(extra.get("positional")),
            optional=bool(extra.get("optional")),
            needs=tuple(extra.get("needs", ())),
        )


def _extra(field: FieldInfo) -> dict[str, Any]:
    """What a field says of its flag."""
    return field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}


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
    limits = list(field.metadata)
    for item in get_args(annotation)[:1]:
        for limit in getattr(item, "__metadata__", ()):
            limits += limit.metadata if isinstance(limit, FieldInfo) else [limit]
    bounds = {key: getattr(x, key) for key in _BOUNDS for x in limits if hasattr(x, key)}
    if bounds.keys() == {"ge", "le"}:
        return f"{bounds['ge']:g} to {bounds['le']:g}"
    return ", ".join(f"{_BOUNDS[key]} {value:g}" for key, value in bounds.items())


def _words(value: Any) -> str:
    """A default as it is typed; empty for none, nothing and off."""
    if isinstance(value, tuple):
        return " ".join(map(_words, value))
    if value is None or value is False:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


class Command(NamedTuple):
    """What the help of a command is made from.

    Attributes:
        name: Its name.
        description: What it does; the short page shows what precedes the first empty line.
        model: Its configuration.
        parameters: Options of the configuration.
        others: Its other options.
    """

    name: str
    description: str
    model: type
    parameters: Sequence[Option]
    others: Sequence[Option]


@pydantic.dataclasses.dataclass(frozen=True)
class LiveOptions:
    """Whether other programs may read along."""

    foxglove: bool = option(
        False, "topics live for Foxglove and Lichtblick, without access control"
    )
    foxglove_port: int = option(
        FOXGLOVE_PORT,
        "port for these, 0 takes any",
        "PORT",
        needs=["--foxglove"],
        ge=0,
        le=65535,
    )

    ros: bool = option(False, "topics live for ROS 2, without access control")
    ros_domain: int | None = option(
        None,
        "domain of these, else ROS_DOMAIN_ID or 0",
        "DOMAIN",
        needs=["--ros"],
        ge=0,
        le=LAST_DOMAIN,
    )
    ros_network: bool = option(False, "these for other computers too", needs=["--ros"])

    @property
    def port_for_foxglove(self) -> int | None:
        """The port for Foxglove, None without it."""
        return self.foxglove_port if self.foxglove else None


@pydantic.dataclasses.dataclass(frozen=True)
class PageOptions(LiveOptions):
    """Where the page is."""

    view: bool = option(False, "show it on a page of this computer while it runs")
    view_port: int = option(
        PAGE_PORT, "port of that page, 0 takes any", "PORT", needs=["--view"], ge=0, le=65535
    )

    @property
    def is_shown(self) -> bool:
        """Whether anything is to be shown while it runs."""
        return self.view or self.foxglove or self.ros


@pydantic.dataclasses.dataclass(frozen=True)
class ViewOptions(PageOptions):
    """Where the page of a simulation is, and how fast it shows time."""

    view_paused: bool = option(False, "start paused, so that nothing is missed", needs=["--view"])
    view_speed: float = option(
        1.0,
        "times real time at which --view begins, 0 as fast as it goes",
        "FLOAT",
        needs=["--view", "--foxglove", "--ros"],
        ge=0,
        le=100,
    )
