"""What pydantic refuses, in one line: what was expected, what was found, where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from antennate.messages import nearest, one_line, shortened, shown

Place = tuple[int | str, ...]

_EXPECTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
    "finite_number": "a finite number",
    "literal_error": "one of {expected}",
    "too_short": "at least {min_length} values",
    "too_long": "at most {max_length} values",
    "missing": "a value",
    "string_pattern_mismatch": "text that matches {pattern}",
    "string_too_long": "text of at most {max_length} characters",
}
"""What pydantic's error types ask for."""

_KINDS = {
    "int": "a whole number",
    "float": "a number",
    "bool": "true or false",
    "string": "text",
    "tuple": "a list",
    "dict": "a table",
    "model": "a table",
}
"""What pydantic's families of error types ask for, by the first word of the type."""


_MOST_NAMED = 6
"""Most parameters or groups that are named in place of a parameter that nothing reads."""


class Unread(ValueError):
    """A parameter that nothing reads has a value of its own.

    Args:
        path: The parameter, dotted.
        why: Why nothing reads it.
        found: Its value.
        read: Parameters of the same configuration that are read, dotted.
    """

    def __init__(self, path: str, why: str, found: Any, read: Sequence[str] = ()) -> None:
        self.path, self.why, self.found, self.read = path, why, found, read
        super().__init__(self.text())

    def text(self, where: Callable[[Place], str] | None = None, inside: Place = ()) -> str:
        """What was expected and found.

        Args:
            where: How a place is written, with dots by default.
            inside: Place of the configuration that the path begins in.
        """
        spell = dotted if where is None else where
        names = [spell((*inside, *name.split("."))) for name in (self.path, *self._instead())]
        such = f", such as {', '.join(names[1:])}" if names[1:] else ""
        found = shortened(str(self.found))
        return f"{names[0]}: expected a parameter that is read{such}, found {found}, but {self.why}"

    def _instead(self) -> list[str]:
        """Parameters to name instead: read ones of this name, else of the group or one around it.

        Else groups with parameters that are read. None for a robot, whose parts are what they are.
        """
        top, group, name = (*self.path.partition(".")[:1], *self.path.rpartition(".")[::2])
        if top == "robot":
            return []
        read = [each.rpartition(".")[::2] for each in self.read if each.startswith(f"{top}.")]
        names = [f"{place}.{last}" for place, last in read if last == name]
        while not names and "." in group:
            names = [f"{place}.{last}" for place, last in read if place == group]
            group = group.rpartition(".")[0]
        return (names or list(dict.fromkeys(f"{p}.*" for p, _ in read if p != top)))[:_MOST_NAMED]


def dotted(path: Place) -> str:
    """`("tunnel", "segments", 0)` as `tunnel.segments[0]`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return one_line(text.lstrip("."))


def describe(
    error: ValidationError,
    model: type[Any],
    where: Callable[[Place], str] = dotted,
    found: Callable[[Any], str] = shown,
) -> str:
    """The first fault pydantic found, and how many more there are.

    Args:
        error: What it raised.
        model: The model or dataclass that was to be filled.
        where: How a place in it is written.
        found: How a value is written.
    """
    every = error.errors(include_url=False)
    inner = {fault["loc"][:n] for fault in every for n in range(len(fault["loc"]))}
    faults = [fault for fault in every if fault["loc"] not in inner]  # not what follows from one
    first = faults[0]
    kind, path, context = first["type"], first["loc"], first.get("ctx", {})
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if kind == "value_error":
        if isinstance(context["error"], Unread):
            return context["error"].text(where, path) + more
        spell = dotted if _keys(model, path) else where  # a group is no flag
        place = f"{spell(path)}: " if path else ""
        return f"{place}{context['error']}{more}"
    if kind == "extra_forbidden":
        key, group = str(path[-1]), dotted(path[:-1])
        known = _keys(model, path[:-1])
        former = {} if group else getattr(model, "former", {})
        what = f"a known key{f' of {group}' if group else ''}{nearest(key, known, former)}"
        return f"{where(path)}: expected {what}, found {shown(key)}{more}"
    place = where(path) if path else "the file"
    if kind == "json_invalid":
        return f"{place}: expected JSON, found {context['error']}".replace("EOF", "its end")
    if kind == "missing" and path and isinstance(path[-1], int):
        return _too_few(faults, path[:-1], where)
    value = "none" if kind == "missing" else found(first["input"])
    return f"{place}: expected {_expected(kind, context) or first['msg']}, found {value}{more}"


def _too_few(faults: Sequence[ErrorDetails], path: Place, where: Callable[[Place], str]) -> str:
    """A list at `path` that is too short: its first place is the first that is lacking."""
    lacking = [fault["loc"][-1] for fault in faults if fault["loc"][:-1] == path]
    most = max(place for place in lacking if isinstance(place, int)) + 1
    return f"{where(path)}: expected {most} values, found {most - len(lacking)}"


def _expected(kind: str, context: Mapping[str, Any]) -> str | None:
    if kind in _EXPECTED:
        text = _EXPECTED[kind].format(**context).replace("'", "")
        return text.removesuffix("s") if text.endswith(" 1 values") else text
    return _KINDS.get(kind.split("_")[0])


def group_of(annotation: Any) -> type[BaseModel] | None:
    """The model that an annotation names, alone or beside None; None if it names no model."""
    union = get_origin(annotation) in (Union, UnionType)
    for kind in get_args(annotation) if union else (annotation,):
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return kind
    return None


def _keys(model: type[BaseModel], path: Place) -> list[str]:
    """Keys of the group at `path`, then those of its groups with dots; none if it is not known."""
    for part in path:
        field = model.model_fields.get(str(part))
        group = None if field is None else group_of(field.annotation)
        if group is None:
            return []
        model = group
    return [*model.model_fields, *_deeper(model, "")]


def _deeper(model: type[BaseModel], start: str) -> Iterator[str]:
    """Keys of the groups within a group, with dots."""
    for name, field in model.model_fields.items():
        if (group := group_of(field.annotation)) is not None:
            yield from (f"{start}{name}.{key}" for key in group.model_fields)
            yield from _deeper(group, f"{start}{name}.")
