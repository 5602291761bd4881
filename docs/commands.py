"""Write the list of docs/commands.md from the commands themselves; with --check only compare it.

What stands before the mark is written by hand. An option that is the same in several commands and
explained there is named alone where a command takes it.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from generated import finish, heads, row

from antennate.cli import LOG_COMMANDS, ROBOT_COMMANDS, commands, described
from antennate.cli.help import Command
from antennate.cli.options import Option
from antennate.experiments import is_ours
from antennate.messages import command_words

MARK = "<!-- commands: python docs/commands.py -->"
SHARED = "[Options of a run](#options-of-a-run): "
GROUPS = "Groups of further options, each described in [Parameters](parameters.md): "
_SHOWN = 40
"""Longest default that is shown whole."""
_MANY = 3
"""Least number of commands that have an option, the same in all, that is named alone."""


def options(page: Command) -> dict[str, str]:
    """Options on a command's first level, and the row of each."""
    top = [option for option in page.parameters if len(option.path) == 1]
    others = sorted(page.others, key=lambda option: not option.positional)
    return {option.free or option.offered: line(option) for option in [*others, *top]}


def section(page: Command, shared: set[str]) -> Iterator[str]:
    """The lines of one command; rows that are shared are named alone."""
    free = "".join(f" {option.free}" for option in page.others if option.free)
    name = command_words(page.name)
    yield f"## `antennate {name}`"
    yield page.description
    yield f"```sh\nuv run antennate {name}{free} [OPTIONS]\n```"
    rows = options(page)
    if own := [text for text in rows.values() if text not in shared]:
        yield "\n".join([heads("option", "default", "meaning"), *own])
    if common := [f"`{flag}`" for flag, text in rows.items() if text in shared]:
        yield SHARED + ", ".join(common) + "."
    counts = Counter(option.path[0] for option in page.parameters if len(option.path) > 1)
    if counts:
        named = (f"`--{group.replace('_', '-')}.*` ({n})" for group, n in counts.items())
        yield GROUPS + ", ".join(named) + "."


def line(option: Option) -> str:
    """The row of an option."""
    head = option.free or option.offered
    if option.metavar and not option.positional:
        metavar = "NAME" if option.choices else option.metavar
        head += f" {metavar}{'...' if option.many else ''}"
    default = option.default if option.metavar else ""
    default = default if len(default) <= _SHOWN else f"{default[:_SHOWN]}…"
    choices = ", ".join(f"`{choice}`" for choice in option.choices)
    meaning = "; ".join(filter(None, [option.meaning, option.limits, choices]))
    if option.default and not option.metavar:
        meaning = f"turns off: {meaning}"
    return row(f"`{head}`", f"`{default}`" if default else "", meaning)


def is_own(name: str) -> bool:
    """Whether a command is of this package."""
    return name == "study merge" or is_ours(name.split()[-1])


def index(title: str, named: dict[str, str]) -> str:
    """A table of commands."""
    rows = (row(f"[`{n}`](#antennate-{n.replace(' ', '-')})", what) for n, what in named.items())
    return "\n".join([f"**{title}**\n", heads("command", "what it does"), *rows])


def main() -> None:
    """Write the page, or compare it."""
    others = ROBOT_COMMANDS | LOG_COMMANDS
    studies = {n: what for n, what in commands().items() if is_own(n) and n not in others}
    pages = [described(name) for name in studies | others]
    rows = [pair for page in pages for pair in options(page).items()]
    counts = Counter(text for _, text in rows)
    begin, _, _ = Path(__file__).with_suffix(".md").read_text(encoding="utf-8").partition(MARK)
    shared = {text for name, text in rows if counts[text] >= _MANY and f"`{name}" in begin}
    lists = [index("Simulation and study", studies), index("Robot, twin, logs", others)]
    parts = [begin, MARK, *lists, *(part for page in pages for part in section(page, shared))]
    finish(__file__, "\n\n".join(part.strip() for part in parts) + "\n")


if __name__ == "__main__":
    main()
