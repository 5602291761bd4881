"""Write docs/options.md from the commands themselves.

An option that is the same in several commands and explained in docs/commands.md is named alone
where a command takes it, or with others as a set. What a command has in common with an earlier one
is named alone, too.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from generated import finish, heads, row

from antennate.cli import LOG_COMMANDS, ROBOT_COMMANDS, commands, described
from antennate.cli.options import Command, Option
from antennate.experiments import names
from antennate.messages import command_words

HEAD = """\
# Options of commands

What holds for every command: [Commands](commands.md).
"""
SHARED = "[Options of a run](commands.md#options-of-a-run): "
SETS = {
    "results": "--out --overwrite --json",
    "trials": "--workers --resume --retry --engine --slurm --shard --trial-timeout",
    "page": "--view --view-port --foxglove --foxglove-port --ros --ros-domain --ros-network",
    "pace": "--view-paused --view-speed",
    "board": "--esp32 --key --insecure-udp",
    "curves": "--calibration --calibration-right --sensor-id --sensor-id-right --reach "
    "--reach-right",
}
"""Shared options that go together, by what the page calls them."""
GROUPS = "Groups ([Parameters](parameters.md)): "
_SHOWN = 40
"""Longest default that is shown whole."""
_MANY = 3
"""Least number of commands that have an option, the same in all, that is named alone."""


def options(page: Command) -> dict[str, str]:
    """Options on a command's first level, and the row of each."""
    top = [option for option in page.parameters if len(option.path) == 1]
    every = sorted([*page.others, *top], key=lambda option: not option.positional)
    return {option.free or option.offered: line(option) for option in every}


def section(page: Command, shared: set[str], before: Sequence[Command]) -> Iterator[str]:
    """The lines of one command; rows that are shared are named alone."""
    every = [*page.others, *page.parameters]
    free = "".join(f" {option.usage}" for option in every if option.free)
    name = command_words(page.name)
    yield f"## `antennate {name}`"
    yield page.description
    if free:
        yield f"```sh\nuv run antennate {name}{free} [OPTIONS]\n```"
    rows = options(page)
    own = {flag: text for flag, text in rows.items() if text not in shared}
    other, same = likest(own, before)
    if left := [text for flag, text in own.items() if flag not in same]:
        yield "\n".join([heads("option", "default", "meaning"), *left])
    if same:
        words = command_words(other)
        yield f"Of [`{words}`](#{anchor(words)}): {', '.join(f'`{flag}`' for flag in same)}."
    if common := named_alone([flag for flag, text in rows.items() if text in shared]):
        yield SHARED + ", ".join(common) + "."
    counts = Counter(option.path[0] for option in page.parameters if len(option.path) > 1)
    if counts:
        named = (f"`--{group.replace('_', '-')}.*` ({n})" for group, n in counts.items())
        yield GROUPS + ", ".join(named) + "."


def likest(rows: dict[str, str], before: Sequence[Command]) -> tuple[str, list[str]]:
    """The earlier command with the most of these rows, at least `_MANY`, and their flags."""
    best: tuple[str, list[str]] = "", []
    for page in before:
        known = options(page)
        same = [flag for flag, text in rows.items() if known.get(flag) == text]
        if len(same) > max(len(best[1]), _MANY - 1):
            best = page.name, same
    return best


def named_alone(flags: list[str]) -> list[str]:
    """Shared options, those that go together by the name of their set."""
    names = list[str]()
    for name, words in SETS.items():
        if set(words.split()) <= set(flags):
            names.append(f"*{name}*")
            flags = [flag for flag in flags if flag not in words.split()]
    return names + [f"`{flag}`" for flag in flags]


def anchor(words: str) -> str:
    """Where a command stands on the page."""
    return f"antennate-{words.replace(' ', '-')}"


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
    """Whether a command is an experiment, or one that belongs to them."""
    return name in ("study merge", "parameters") or name.split()[-1] in names()


def index(title: str, named: dict[str, str]) -> str:
    """A table of commands."""
    rows = (row(f"[`{n}`](#{anchor(n)})", what) for n, what in named.items())
    return "\n".join([f"**{title}**\n", heads("command", "what it does"), *rows])


def main() -> None:
    """Write the page."""
    others = ROBOT_COMMANDS | LOG_COMMANDS
    studies = {n: what for n, what in commands().items() if is_own(n) and n not in others}
    pages = [described(name) for name in studies | others]
    rows = [pair for page in pages for pair in options(page).items()]
    counts = Counter(text for _, text in rows)
    told = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    shared = {text for name, text in rows if counts[text] >= _MANY and f"`{name}" in told}
    lists = [index("Simulation and study", studies), index("Robot, twin, logs", others)]
    sections = (section(page, shared, pages[:i]) for i, page in enumerate(pages))
    parts = [HEAD, *lists, *(part for parts in sections for part in parts)]
    finish(__file__, "\n\n".join(part.strip() for part in parts) + "\n", name="options.md")


if __name__ == "__main__":
    main()
