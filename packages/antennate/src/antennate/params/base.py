"""A group of numbers: how one is declared, and how it is read from a file or from Python."""

from __future__ import annotations

import ast
import functools
import inspect
import json
import sys
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, cast

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from antennate.errors import BadInputError, ConfigError
from antennate.files import TOO_LONG, read_toml
from antennate.messages import nearest, shown
from antennate.params.faults import Unread, describe, group_of

LARGEST_SEED = 2**62
"""Largest seed: other programs read seeds as numbers of 64 bits."""
ROBOT = "robot"
"""This group is described whole: a file may hold what a command does not read, a flag may not."""
ALLOWED = "allowed"
"""In the context of a validation: parameters, dotted, that may differ though nothing reads them."""


class Strict(BaseModel):
    """Frozen values; unknown keys, NaN and infinities are errors.

    Attributes:
        refusal: The error of values that are refused in Python.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    refusal: ClassVar[type[BadInputError]] = ConfigError

    def __init__(self, /, **values: Any) -> None:
        """Check the values.

        Raises:
            BadInputError: Of the type `refusal`: one is unknown, missing, of the wrong type or out
                of bounds. The text is the same as of a file.
        """
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise self.refusal(describe(error, type(self))) from None

    # Without this, pydantic would call it for models within a model, and lose where a fault is.
    __init__.__pydantic_base_init__ = True  # pyright: ignore[reportFunctionMemberAccess]


class Params(Strict):
    """A group of numbers of a configuration.

    Attributes:
        unread: Parameters of its groups, dotted, that a command with this configuration does not
            read. They are no flags, and a value other than the default is an error.
        shared: Whether its file serves other commands too, and so may hold what is not read here.
        offered: Names that a field takes among others, by field, for help and completion. To list
            them may load the modules of all, so nothing else does.
        former: What fields were called in an earlier version, and their names of now.
    """

    unread: ClassVar[tuple[str, ...]] = ()
    shared: ClassVar[bool] = False
    offered: ClassVar[Mapping[str, Collection[str]]] = {}
    former: ClassVar[Mapping[str, Sequence[str]]] = {}

    def unread_here(self) -> Mapping[str, str]:
        """Further ones that nothing reads because of other values, and why. They are flags."""
        return {}

    def names_in_files(self) -> Iterable[str]:
        """What a file names that this names, where a run depends on it as on a value of this."""
        return ()

    @model_validator(mode="after")
    def _refuse_unread(self, info: ValidationInfo) -> Self:
        if self.shared:
            return self
        never = (path for path in self.unread if not path.startswith(f"{ROBOT}."))
        why = {**dict.fromkeys(never, "it is not read here"), **self.unread_here()}
        allowed = (info.context or {}).get(ALLOWED, ())
        for path, found in changes(self, why):
            if path not in allowed:
                raise self.unread_error(path, why[path], found)
        return self

    def unread_error(self, path: str, why: str, found: Any) -> Unread:
        """The error of a dotted parameter that nothing reads and that has a value of its own."""
        never = {*self.unread, *self.unread_here()}
        read = [name for name in paths_of(type(self)) if name not in never]
        return Unread(path, why, found, read)


def changes(config: Params, paths: Iterable[str]) -> Iterator[tuple[str, Any]]:
    """Parameters at these dotted paths that differ from their default, with their values."""
    for path in paths:
        *groups, name = path.split(".")
        group: Any = config
        for part in groups:
            group = getattr(group, part)
        if (value := getattr(group, name)) != type(group).model_fields[name].default:
            yield path, value


def paths_of(model: type[Params], path: str = "") -> tuple[str, ...]:
    """Every parameter of a group that stands at a dotted path."""
    paths: list[str] = []
    for name, field in model.model_fields.items():
        kind, deeper = field.annotation, f"{path}.{name}".lstrip(".")
        if isinstance(kind, type) and issubclass(kind, Params):
            paths += paths_of(kind, deeper)
        else:
            paths.append(deeper)
    return tuple(paths)


def require_default(config: Params, why: str, *paths: str) -> None:
    """Check that dotted parameters which nothing reads have their defaults."""
    for path, *_ in changes(config, paths):
        raise ValueError(f"{path}: expected the default, as {why}, found another")


def require_different(name: str, values: Sequence[Any]) -> None:
    """Check that no value stands twice in a list."""
    if len(set(values)) < len(values):
        raise ValueError(f"{name} must differ, found {', '.join(map(str, values))}")


def require_whole_steps(name: str, rate: float, timestep: float, share: int = 1) -> None:
    """Check that a period has a whole number of physics steps.

    Args:
        name: The parameter that is the rate.
        rate: Periods a second [Hz].
        timestep: Physics step [s].
        share: Into how many equal parts of whole steps a period is split.
    """
    steps = 1.0 / (rate * share * timestep)
    if steps < 0.5 or abs(steps - round(steps)) > 1e-6:
        part = f" 1/{share} of" if share > 1 else ""
        raise ValueError(
            f"{name} must be a whole fraction of{part} the physics rate {1 / timestep:g} Hz, found "
            f"{rate:g} Hz"
        )


def number(
    default: Any,
    unit: str,
    source: str,
    needs: Sequence[str] = (),
    metavar: str = "",
    **bounds: Any,
) -> Any:
    """Declare one parameter with its unit and source; the docstring below it is its meaning.

    Args:
        default: Its default.
        unit: Its unit, "1" if it has none.
        source: Where the default comes from.
        needs: Flags, one of which must be given beside its own.
        metavar: What stands for its value in the help, such as FILE; else its type.
        bounds: As for pydantic's Field.
    """
    extra: dict[str, Any] = {"unit": unit, "source": source}
    if metavar:
        extra["metavar"] = metavar
    if needs:
        extra["needs"] = list(needs)
    return Field(default, json_schema_extra=extra, **bounds)


def meaning(model: Any, name: str, unit: bool = True, listed: bool = True) -> str:
    """What a parameter is, as a phrase without a full stop; `{offered}` in it are `Params.offered`.

    Args:
        model: The group that it belongs to, or a pydantic dataclass.
        name: Its name.
        unit: Whether its unit is added in brackets.
        listed: Whether the names that it takes are listed; that may load the modules of all.
    """
    field = getattr(model, "__pydantic_fields__")[name]  # noqa: B009  # also of dataclasses
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    text = field.description or _docstrings(model).get(name, "")
    if "{offered}" in text:
        names = ", ".join(model.offered[name]) if listed else "NAME of ours"
        text = text.replace("{offered}", names)
    words = " ".join(text.split()).removesuffix(".")
    first = words.partition(" ")[0]
    phrase = first.lower() + words[len(first) :] if first.istitle() else words
    return f"{phrase} [{extra['unit']}]" if unit and extra.get("unit", "1") != "1" else phrase


@functools.cache
def _docstrings(model: type) -> dict[str, str]:
    """The docstring below each field, by name, those of base classes too.

    They are read from the source when they are asked for: pydantic's `use_attribute_docstrings`
    reads it whenever a class is made, which took a fifth of the time of a refused command.
    """
    texts: dict[str, str] = {}
    for kind in reversed(model.__mro__):
        if issubclass(kind, BaseModel) and not kind.__module__.startswith("pydantic"):
            texts |= docstrings(kind)
    return texts


@functools.cache
def docstrings(kind: type) -> dict[str, str]:
    """The docstring below each field that a class itself declares, by name."""
    texts: dict[str, str] = {}
    for field, text in pairwise(_body(kind)):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(ast.Constant(str(words))):
                texts[name] = inspect.cleandoc(words)
            case _:
                pass
    return texts


def _body(kind: type) -> list[ast.stmt]:
    """The statements of a class; none where it was made without a file."""
    try:
        node = _classes(kind.__module__).get(kind.__qualname__)
        tree = node or ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    except (OSError, TypeError):
        return []
    return tree.body if isinstance(tree, ast.ClassDef) else []


@functools.cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """The classes at the top of a module's file, which is read once.

    `inspect` would read it anew for each class: two fifths of the time of the shortest run.
    """
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (KeyError, OSError, TypeError):
        return {}  # as of a notebook
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


LARGEST_FILE = 1_000_000
"""Most bytes of a configuration file."""

Config = TypeVar("Config", bound=Params)


def own_file(flag: str, text: str, known: Collection[str], folder: Path = Path()) -> Path:
    """The file that stands in place of a known name; a relative path starts at the folder.

    Raises:
        ConfigError: It is no TOML file, and there is no such file.
    """
    path = folder / text
    if not text or (path.suffix != ".toml" and not path.exists()):
        raise ConfigError(
            f"{flag}: expected {', '.join(known)} or a TOML file{nearest(text, known)}, found "
            f"{shown(text) if text else 'nothing'}"
        )
    return path


def read_file(path: Path, model: type[Config]) -> Config:
    """A configuration from a TOML file with the model's keys.

    A group may have known names, such as a robot. In its place the file may hold such a name, the
    path of a file, or a table whose `base` is one; a path starts at the folder of the file that
    holds it.

    Args:
        path: The file.
        model: What it holds.
    """
    table = with_bases(read_toml(path, LARGEST_FILE), model, path.parent)
    try:
        text = json.dumps(table, default=str)
    except ValueError:  # of TOML's whole numbers in other bases
        raise ConfigError(f"{path}: {TOO_LONG}") from None
    try:
        return model.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise ConfigError(f"{path}: {describe(error, model)}") from None


def with_bases(table: Mapping[str, Any], model: type[BaseModel], folder: Path) -> dict[str, Any]:
    """The table with names and bases of known groups replaced by what they stand for."""
    result = dict(table)
    for name, field in model.model_fields.items():
        group, value = group_of(field.annotation), table.get(name)
        named = getattr(group, "named", None)
        if group is None:
            continue
        if named is not None and isinstance(value, str):
            value = {"base": value}
        if isinstance(value, dict):
            value = with_bases(cast("dict[str, Any]", value), group, folder)
            if named is not None and isinstance(base := value.get("base"), str):
                known = stated(named(base, folder))
                value = put_over(known, {k: v for k, v in value.items() if k != "base"})
            result[name] = value
    return result


def stated(group: BaseModel) -> dict[str, Any]:
    """Every value that a group writes, and of the groups in it what its file states."""
    written = group.model_dump()
    return {
        name: value.model_dump(exclude_unset=True) if isinstance(value, BaseModel) else value
        for name, value in group
        if name in written
    }


def put_over(base: Mapping[str, Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables: the values of `table` over those of `base`."""
    result = dict(base)
    for key, value in table.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            old, value = cast("dict[str, Any]", old), cast("dict[str, Any]", value)
            result[key] = put_over(old, value)
        else:
            result[key] = value
    return result


def from_values(model: type[Config], values: Mapping[str, Any]) -> Config:
    """A configuration from values given in Python."""
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        raise ConfigError(describe(error, model)) from None
