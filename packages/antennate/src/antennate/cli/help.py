"""What a command says of itself: a page of two screens, a long one, and scripts for shells.

`source <(antennate --completion bash)` for now, or keep the output in a file that the shell reads
when it starts.
"""

from __future__ import annotations

import shutil
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from antennate.cli.options import Command, Option, fields_of, flag_of
from antennate.errors import BadInputError
from antennate.messages import COMMAND_GROUPS, command_words, one_line, typed
from antennate.params.base import meaning
from antennate.params.faults import group_of

_WIDEST, _NARROWEST = 100, 40
_COLUMN = 26
"""Column in which the meaning of an option begins."""
_LEAST_TEXT = 24
"""Fewest columns for it beside a long flag."""
_SHORT_LINES = 46
"""Most lines of the short page: two screens of 24, less a prompt on each."""

_LATER = ("--calibration-right", "--reach", "--sensor-id", "--insecure-udp", "--key")
_LATER += ("--view", "--foxglove", "--ros", "--video", "--slurm", "--shard", "--no-config")
_LATER += ("--readings", "--knows", "--json", "--overwrite")
"""Options that nobody uses first: they come last on the short page."""
_FIRST = ("--config", "--esp32", "--bus", "--arm", "--until")
"""Options that the pages use: they come first on it, in this order."""


def short_page(command: Command) -> str:
    """What people use first: options outside all groups, names first, and the groups' names.

    Where there is no room for all, parameters have two thirds of it, or what the others
    leave.
    """
    outside = (option for option in command.parameters if len(option.path) == 1)
    top = sorted(outside, key=lambda o: (_rank(o), not o.metavar.startswith("NAME")))
    others = sorted(command.others, key=lambda o: (not o.positional, _rank(o)))
    head = _usage(command, command.description.split("\n\n")[0])
    tail = [*_groups(command), "", *_notes(command)]
    tail.append(f"`{typed(command.name, '--help-all')}` shows every option.")
    room = _SHORT_LINES - len(head) - len(tail)
    needed = len(_section("options:", others))
    parameters = _cut("parameters:", top, max(2 * room // 3, room - needed))
    options = _cut("options:", others, room - len(parameters))
    return "\n".join([*head, *parameters, *options, *tail]) + "\n"


def long_page(command: Command) -> str:
    """Every option, group by group."""
    lines = [*_usage(command, command.description), *_section("options:", command.others)]
    groups: dict[tuple[str, ...], list[Option]] = {}
    for option in command.parameters:
        groups.setdefault(option.path[:-1], []).append(option)
    for group, options in groups.items():
        title = f"{flag_of(group)}.*  {_meaning(command.model, group)}" if group else "parameters:"
        lines += _section(title, options)
    return "\n".join([*lines, "", *_notes(command)]).rstrip() + "\n"


def _rank(option: Option) -> int:
    """Place among those that come last, -1 of all others, less of those that come first."""
    if option.offered in _FIRST:
        return _FIRST.index(option.offered) - len(_FIRST) - 1
    places = (i for i, name in enumerate(_LATER) if option.offered.startswith(name))
    return next(places, -1)


def _cut(title: str, options: Sequence[Option], room: int) -> list[str]:
    """A section in so many lines; a last one counts the options for which there is no room."""
    lines = _section(title, options)
    if len(lines) <= room:
        return lines
    lines, count = lines[:2], 0
    for option in options:
        block = _block(option)
        if len(lines) + len(block) >= room:
            break
        lines += block
        count += 1
    return [*lines, f"  and {len(options) - count} more"]


def _width() -> int:
    """Columns to fill."""
    return max(_NARROWEST, min(_WIDEST, shutil.get_terminal_size().columns))


def _usage(command: Command, description: str) -> list[str]:
    options = [*command.others, *command.parameters]
    free = "".join(f" {option.usage}" for option in options if option.free)
    lines = [f"usage: antennate {command_words(command.name)}{free} [OPTIONS]"]
    for paragraph in description.strip().split("\n\n"):
        lines += ["", *textwrap.wrap(" ".join(paragraph.split()), _width())]
    return lines


def _notes(command: Command) -> list[str]:
    """How a list is given, if the command takes one, and what is typed behind its name."""
    lists = any(option.many for option in [*command.others, *command.parameters])
    lines = ["A list (...) is words separated by spaces."] * lists
    parts = [f"`antennate {command_words(part)}`" for part in COMMAND_GROUPS.get(command.name, ())]
    return lines + [f"Further commands: {', '.join(parts)}."] * bool(parts)


def _section(title: str, options: Sequence[Option]) -> list[str]:
    lines = [line for option in options for line in _block(option)]
    return ["", *textwrap.wrap(title, _width()), *lines] if lines else []


def _block(option: Option) -> list[str]:
    """An option in one line or more: the flag, and in a second column what it means."""
    head = option.free or option.offered
    if not option.positional and option.metavar:
        head += f" {option.metavar}{'...' if option.many else ''}"
    text = "; ".join(filter(None, [option.meaning, option.limits]))
    if option.default:
        text = f"{text} (default: {option.default})" if option.metavar else f"turns off: {text}"
    column = min(_COLUMN, _width() // 3)
    start, rest = f"  {head}  ".ljust(column), " " * column
    above = [] if len(start) + _LEAST_TEXT <= _width() else [start.rstrip()]
    lines = textwrap.wrap(
        text,
        _width(),
        initial_indent=rest if above else start,
        subsequent_indent=rest,
        break_on_hyphens=False,
    )
    return above + (lines or [start.rstrip()])


def _groups(command: Command) -> list[str]:
    """The groups of parameters, each with its number of options."""
    counts = Counter(option.path[0] for option in command.parameters if len(option.path) > 1)
    lines = ["", "groups, with their number of options:"] if counts else []
    for name, count in counts.items():
        start = f"  {flag_of((name,))}.*".ljust(_COLUMN - 1)
        text = f"{start} {count:>3}  {_meaning(command.model, (name,))}"
        lines.append(text if len(text) <= _width() else text[: _width() - 3] + "...")
    return lines


def _meaning(model: Any, group: tuple[str, ...]) -> str:
    """What a group is, by its description or its docstring."""
    text = ""
    for part in group:
        text = meaning(model, part)
        model = group_of(fields_of(model)[part].annotation)
        text = text or (model.__doc__ or "").strip().split("\n")[0].rstrip(".")
    return text


SHELLS = ("bash", "zsh", "fish")

_BASH = """\
_antennate() {
    local command=${COMP_WORDS[1]} current=${COMP_WORDS[COMP_CWORD]} flag= i words= parts=
    case "$command" in
%(parts)s
    esac
    if [ "$COMP_CWORD" -gt 2 ]; then
        case " $parts " in
            *" ${COMP_WORDS[2]} "*) command="$command ${COMP_WORDS[2]}"; parts=;;
        esac
    fi
    if [ "$COMP_CWORD" -eq 1 ]; then
        words='%(commands)s'
    else
        for ((i = COMP_CWORD - 1; i > 1; i--)); do
            case ${COMP_WORDS[i]} in --*) flag=${COMP_WORDS[i]}; break;; esac
        done
        case "$command $flag" in
%(values)s
        esac
        case "$current" in -*) words=;; esac
        if [ -z "$words" ]; then
            case "$command" in
%(flags)s
            esac
        fi
        [ "$COMP_CWORD" -ne 2 ] || words="$parts $words"
    fi
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _antennate antennate
"""
_ZSH = "autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"
_HELP = ("--help", "--help-all")
_OWN = ("--help", "--version", "--completion")


def script(words: Sequence[str], commands: Mapping[str, str], pages: Iterable[Command]) -> str:
    """The script with which a shell completes commands, flags and values.

    Args:
        words: Name of the shell.
        commands: What each command does, by name.
        pages: What the help of each is made from.
    """
    if len(words) != 1 or words[0] not in SHELLS:
        shell = one_line(" ".join(words)) or "none"
        raise BadInputError(f"--completion: expected one of {', '.join(SHELLS)}, found {shell}")
    options = {command_words(page.name): [*page.others, *page.parameters] for page in pages}
    if words[0] == "fish":
        return "".join(f"{line}\n" for line in _fish(commands, options))
    return (_ZSH if words[0] == "zsh" else "") + _bash(options)


def _bash(options: Mapping[str, Sequence[Option]]) -> str:
    values = [
        f"            '{command} {option.flag}') words='{' '.join(option.values)}';;"
        for command, own in options.items()
        for option in own
        if option.values
    ]
    flags = []
    for command, own in options.items():
        words = [w for o in own for w in (*(o.values if o.positional else ()), *_flags(o))]
        flags.append(f"                '{command}') words='{' '.join([*words, *_HELP])}';;")
    parts = [
        f"        {name}) parts='{' '.join(names)}';;" for name, names in COMMAND_GROUPS.items()
    ]
    names = " ".join([*dict.fromkeys(name.split()[0] for name in options), *_OWN])
    lines = {"parts": parts, "values": values, "flags": flags}
    return _BASH % {"commands": names, **{name: "\n".join(each) for name, each in lines.items()}}


def _flags(option: Option) -> Sequence[str]:
    """The flag that is offered, if any: a group has one, even where it may be given without."""
    return [option.offered] if option.metavar == "NAME|FILE" or not option.positional else []


def _fish(commands: Mapping[str, str], options: Mapping[str, Sequence[Option]]) -> Iterator[str]:
    start = "complete -c antennate -n"
    for name in dict.fromkeys(name.split()[0] for name in commands):
        meaning = commands.get(name, ", ".join(COMMAND_GROUPS.get(name, ())))
        yield f"{start} __fish_use_subcommand -xa {name} -d {_quoted(meaning)}"
    for command, own in options.items():
        group, _, part = command.partition(" ")
        seen = f"__fish_seen_subcommand_from {group}"
        others = " ".join(COMMAND_GROUPS.get(group, ()))
        if part:
            before = f"{seen}; and not __fish_seen_subcommand_from {others}"
            yield f"{start} {_quoted(before)} -xa {part} -d {_quoted(commands[command])}"
            seen += f"; and __fish_seen_subcommand_from {part}"
        elif others:
            seen += f"; and not __fish_seen_subcommand_from {others}"
        for option in own:
            values = " -r" * bool(option.metavar)
            if option.values:
                values = f" -xa {_quoted(' '.join(option.values))}"
            names = [""] if option.positional and option.values else []
            for name in (*names, *(f" -l {flag[2:]}" for flag in _flags(option))):
                yield f"{start} {_quoted(seen)}{name}{values} -d {_quoted(option.meaning)}"
        for flag in _HELP:
            yield f"{start} {_quoted(seen)} -l {flag[2:]}"


def _quoted(text: str) -> str:
    """A text as one word of fish."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
