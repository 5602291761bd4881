"""The help of a command: a short page of two screens, and a long one with every option."""

from __future__ import annotations

import shutil
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from antennate.cli.options import Option, fields_of, first_line, flag_of
from antennate.messages import COMMAND_GROUPS, command_words, typed
from antennate.params.base import meaning
from antennate.params.faults import group_of

_WIDEST, _NARROWEST = 100, 40
_COLUMN = 26
"""Column in which the meaning of an option begins."""
_LEAST_TEXT = 24
"""Fewest columns for it beside a long flag."""
SHORT_LINES = 46
"""Most lines of the short page: two screens of 24, less a prompt on each."""

_LATER = ("--calibration-right", "--reach", "--sensor-id", "--insecure-udp", "--key")
_LATER += ("--view", "--foxglove", "--video", "--slurm", "--shard", "--no-config")
_LATER += ("--readings", "--knows")
"""Options that nobody uses first: they come last on the short page."""


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


def short_page(command: Command) -> str:
    """What people use first: options outside all groups, names first, and the groups' names.

    Where there is no room for all, parameters and the other options have half of it each, or what
    the other half leaves.
    """
    outside = (option for option in command.parameters if len(option.path) == 1)
    top = sorted(outside, key=lambda each: (_rank(each), not each.metavar.startswith("NAME")))
    head = _usage(command, command.description.split("\n\n")[0])
    tail = [*_groups(command.model, command.parameters), "", *_lists(command), *_parts(command)]
    tail.append(f"`{typed(command.name, '--help-all')}` shows every option.")
    room = SHORT_LINES - len(head) - len(tail)
    others = sorted(command.others, key=_rank)
    others.sort(key=lambda option: not option.positional)
    needed = len(_section("options:", others))
    parameters = _cut("parameters:", top, max(room // 2, room - needed))
    options = _cut("options:", others, room - len(parameters))
    return "\n".join([*head, *parameters, *options, *tail]) + "\n"


def _rank(option: Option) -> int:
    """Place among those that come last, -1 of all others."""
    found = (i for i, name in enumerate(_LATER) if option.offered.startswith(name))
    return next(found, -1)


def _cut(title: str, options: Sequence[Option], room: int) -> list[str]:
    """A section in so many lines; a last one counts the options for which there is no room."""
    lines = _section(title, options)
    if len(lines) <= room:
        return lines
    kept, shown = lines[:2], 0
    for option in options:
        block = _block(option)
        if len(kept) + len(block) >= room:
            break
        kept += block
        shown += 1
    return [*kept, f"  and {len(options) - shown} more"]


def long_page(command: Command) -> str:
    """Every option, group by group."""
    lines = [*_usage(command, command.description), *_section("options:", command.others)]
    by_group: dict[tuple[str, ...], list[Option]] = {}
    for option in command.parameters:
        by_group.setdefault(option.path[:-1], []).append(option)
    for group, options in by_group.items():
        lines += _section(_title(command.model, group), options)
    return "\n".join([*lines, "", *_lists(command), *_parts(command)]).rstrip() + "\n"


def width() -> int:
    """Columns to fill."""
    return max(_NARROWEST, min(_WIDEST, shutil.get_terminal_size().columns))


def paragraphs(text: str) -> list[str]:
    """The lines of a text, filled paragraph by paragraph."""
    blocks = [textwrap.fill(" ".join(part.split()), width()) for part in text.strip().split("\n\n")]
    return "\n\n".join(blocks).split("\n")


def _usage(command: Command, description: str) -> list[str]:
    free = "".join(f" {option.free}" for option in command.others if option.free)
    usage = f"usage: antennate {command_words(command.name)}{free} [OPTIONS]"
    return [usage, "", *paragraphs(description)]


def _lists(command: Command) -> list[str]:
    """How a list is given, if the command takes one."""
    many = any(option.many for option in [*command.others, *command.parameters])
    return ["A list (...) is words separated by spaces."] if many else []


def _parts(command: Command) -> list[str]:
    """The commands that are typed behind the name of this one."""
    names = [command_words(name) for name in COMMAND_GROUPS.get(command.name, ())]
    return [f"Further commands: {', '.join(f'`antennate {name}`' for name in names)}."] * bool(
        names
    )


def _section(title: str, options: Sequence[Option]) -> list[str]:
    lines = [line for option in options for line in _block(option)]
    return ["", *textwrap.wrap(title, width()), *lines] if lines else []


def _block(option: Option) -> list[str]:
    """An option in one line or more."""
    head = option.free or option.offered
    if not option.positional and option.metavar:
        head += f" {option.metavar}{'...' if option.many else ''}"
    text = "; ".join(filter(None, [option.meaning, option.limits]))
    if option.default and option.metavar:
        text += f" (default: {option.default})"
    elif option.default:
        text = f"turns off: {text}"
    return _two_columns(head, text)


def _two_columns(head: str, text: str) -> list[str]:
    column = min(_COLUMN, width() // 3)
    start, rest = f"  {head}  ".ljust(column), " " * column
    above = [] if len(start) + _LEAST_TEXT <= width() else [start.rstrip()]
    lines = textwrap.wrap(
        text,
        width(),
        initial_indent=rest if above else start,
        subsequent_indent=rest,
        break_on_hyphens=False,
    )
    return above + (lines or [start.rstrip()])


def _groups(model: type, parameters: Iterable[Option]) -> list[str]:
    """The groups of parameters, each with its number of options."""
    counts = Counter(option.path[0] for option in parameters if len(option.path) > 1)
    lines = ["", "groups, with their number of options:"] if counts else []
    for name, count in counts.items():
        start = f"  {flag_of((name,))}.*".ljust(_COLUMN - 1)
        text = f"{start} {count:>3}  {_meaning(model, (name,))}"
        lines.append(text if len(text) <= width() else text[: width() - 3] + "...")
    return lines


def _title(model: type, group: tuple[str, ...]) -> str:
    return f"{flag_of(group)}.*  {_meaning(model, group)}" if group else "parameters:"


def _meaning(model: Any, group: tuple[str, ...]) -> str:
    """What a group is, by its description or its docstring."""
    text = ""
    for part in group:
        text = meaning(model, part)
        model = group_of(fields_of(model)[part].annotation)
        text = text or first_line(model)
    return text
