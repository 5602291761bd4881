"""Write docs/names.md from the public names of antennate."""

import enum
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from generated import finish, heads, row
from pydantic import BaseModel

import antennate

HEAD = """\
# Python names

All that `import antennate` gives, with units in brackets. [Use it from Python](api.md) shows how
the names go together. `help(antennate.run)` also says when each error is raised.
"""
PAGE = re.compile(r"docs/([\w-]+)\.md")
_WIDEST = 88
"""Longest call on one line."""
_SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Yields):$", re.MULTILINE)
_ENTRY = re.compile(r"^    (\S[^:]*): (.*(?:\n     .*)*)", re.MULTILINE)


def entries(name: str, body: str) -> str:
    """A section of a docstring as Markdown: a list where it has entries."""
    found = _ENTRY.findall(body)
    if name == "Raises":
        return f"**Raises** {', '.join(f'`{entry}`' for entry, _ in found)}."
    name = "Arguments" if name == "Args" else name
    if not found or name in ("Returns", "Yields"):
        return f"**{name}**: {' '.join(body.split())}"
    lines = (f"- `{entry}`: {' '.join(text.split())}" for entry, text in found)
    return "\n".join([f"**{name}**\n", *lines])


def described(text: str) -> str:
    """A docstring as Markdown."""
    plain, *parts = _SECTION.split(text)
    pairs = zip(parts[::2], parts[1::2], strict=True)
    return "\n\n".join([plain.strip(), *(entries(name, body) for name, body in pairs)])


def first(text: str) -> str:
    """The first paragraph of a docstring in one line."""
    return " ".join(text.split("\n\n")[0].split())


def signature(name: str, value: Any, wide: bool = False) -> str:
    """How it is called, one parameter a line where that is long and may not be wide."""
    found = inspect.signature(value)
    parts, last = list[str](), None
    for parameter in found.parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and last not in (
            parameter.KEYWORD_ONLY,
            parameter.VAR_POSITIONAL,
        ):
            parts.append("*")
        last = parameter.kind
        parts.append(_parameter(parameter))
    back = found.return_annotation
    end = "" if back is found.empty or inspect.isclass(value) else f" -> {_type(back)}"
    flat = f"{name}({', '.join(parts)}){end}"
    if wide or len(flat) <= _WIDEST:
        return flat
    return f"{name}(\n    " + ",\n    ".join(parts) + f",\n){end}"


def _parameter(parameter: inspect.Parameter) -> str:
    stars = {parameter.VAR_KEYWORD: "**", parameter.VAR_POSITIONAL: "*"}.get(parameter.kind, "")
    kind = "" if parameter.annotation is parameter.empty else f": {_type(parameter.annotation)}"
    if parameter.default is parameter.empty:
        return f"{stars}{parameter.name}{kind}"
    text = _default(parameter.default)
    return f"{parameter.name}{kind} = {text}"


def _default(value: Any) -> str:
    """A default as one would write it; `...` for what a function makes."""
    if isinstance(value, str | Path):
        return f'"{value}"'
    return "..." if callable(value) or repr(value).startswith("<") else repr(value)


def _type(annotation: Any) -> str:
    return annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)


def members(owner: type) -> Iterator[str]:
    """A row for each public method and property that is defined here and described."""
    for name, value in vars(owner).items():
        inner = value.__func__ if isinstance(value, classmethod | staticmethod) else value
        text = inspect.getdoc(inner)
        if name.startswith("_") or not text or isinstance(value, type):
            continue
        if isinstance(value, property):
            yield row(f"`{name}`", first(text))
        elif inspect.isfunction(inner):
            yield row(f"`{signature(name, inner, wide=True)}`", first(text))


def part(name: str) -> Iterator[str]:
    """The parts of one name."""
    value = getattr(antennate, name)
    yield f"## `{name}`"
    model = inspect.isclass(value) and issubclass(value, BaseModel)
    called = not inspect.isclass(value) or not (
        model or issubclass(value, enum.Enum | Exception) or getattr(value, "_is_protocol", False)
    )
    if called:
        yield f"```python\n{signature(name, value)}\n```"
    yield described(inspect.getdoc(value) or "")
    if not inspect.isclass(value):
        return
    if issubclass(value, enum.Enum):
        yield ", ".join(f"`{each.name}` {each.value}" for each in value) + "."
    if issubclass(value, antennate.RobotSpec | antennate.AntennaSpec):
        yield f"Its fields are in [Parameters](parameters.md#{name.lower()})."
    rows = list(members(value))
    if rows:
        yield "\n".join([heads("member", "what it is"), *rows])


def main() -> None:
    """Write the page."""
    names = [name for name in dir(antennate) if not name.startswith("_")]
    links = ", ".join(f"[`{name}`](#{name.lower()})" for name in names)
    parts = [HEAD, links, *(text for name in names for text in part(name))]
    text = "\n\n".join(each.strip() for each in parts) + "\n"
    finish(__file__, PAGE.sub(r"[\1](\1.md)", text), source="the docstrings")


if __name__ == "__main__":
    main()
