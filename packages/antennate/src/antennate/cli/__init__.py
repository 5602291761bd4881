"""The command line: the only place that talks to people.

`antennate COMMAND ...` ends with 0 when done, 2 on bad input and 130 when interrupted. Bad input is
answered with one line on stderr. What a command needs is imported when it runs.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from antennate import __version__
from antennate.messages import COMMAND_GROUPS, command_words

if TYPE_CHECKING:
    from antennate.cli.options import Command

ROBOT_COMMANDS = {
    "twin": "A simulated robot on two ports: an antenna board and a servo bus",
    "robot": "Joints, supply, wiring and parts of a robot; its MJCF and URDF",
    "doctor": "Examine the real robot, or its twin: what is wrong, and the cure",
    "setup": "From a box of servos to a robot, one servo at a time",
    "setup zero": "Zeros and directions of the joints, by hand",
    "setup jog": "Move one joint by small steps",
    "record": "Antenna readings to a CSV file that calibrate takes",
    "drive": "Let a controller walk the real robot, or its twin",
    "drive teleop": "Walk the real robot, or its twin, by keys",
}
LOG_COMMANDS = {
    "log": "What a log holds; recover it, export it, plot it",
    "log replay": "Let a controller decide again upon the log of a drive",
    "log view": "A log, or that of a run, on a page of this computer",
    "report": "A run, or two side by side, as one page to read, print and send",
}
_OTHERS = {
    "study merge": "The shards of a run as the run that they are parts of",
    "parameters": "Every number: its default, unit, meaning and source",
}
_FUNCTIONS = {
    "setup zero": "setup:zero",
    "setup jog": "setup:jog",
    "drive teleop": "drive:teleop",
    "log replay": "replay:command",
    "log view": "log:view",
    "report": "results:command",
    "study merge": "merge:command",
}
"""Module and function of the commands that are not `command` of a module of their name."""
_OWN = {**ROBOT_COMMANDS, **LOG_COMMANDS, **_OTHERS}
_GROUPS = {
    "bench": "An antenna before walls and posts",
}
"""Groups that are no command of their own."""
_FIRST = ("tunnel", "calibrate", "study", "twin", "drive")
_EXPERIMENTS = (
    *("tunnel", "compete", "gait", "geometry", "climb", "calibrate", "bench", "antenna"),
    *("study", "dataset", "reproduce", "tracks", "servo", "fit", "build"),
)
"""Commands and groups in the order in which they are listed; what else there is comes last."""
_HELP = {"-h", "--help", "--help-all", "--completion", "--complete"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after the program's name; those of this process by default.

    Returns:
        The exit code.
    """
    from antennate.cli.terminal import BAD_INPUT, INTERRUPTED, safe_streams
    from antennate.sim.engine_setup import describe_only, dropped, keep_wish

    keep_wish()
    if argv is None:  # a program of its own draws into files; a notebook's backend is elsewhere
        os.environ["MPLBACKEND"] = "agg"
    words = list(sys.argv[1:] if argv is None else argv)
    describe_only(not _HELP.isdisjoint(words))
    name, words = _divided(words)
    title = f"antennate {name}".strip()
    with dropped(), safe_streams(result_alone="--json" in words) as output:
        try:
            code = _run(name, words, title)
        except KeyboardInterrupt:
            sys.stderr.write(f"{title}: interrupted\n")
            exec("")  # noqa: S102  CPython forgets that an earlier `exec` was interrupted
            return INTERRUPTED
        output.flush()
        if output.error is None or isinstance(output.error, BrokenPipeError):
            return code  # the reader of the pipe has ended, as `head` does
        from antennate.errors import reason

        why = reason(output.error)
        sys.stderr.write(f"{title}: error: standard output: expected to write, found: {why}\n")
        return BAD_INPUT


def commands() -> dict[str, str]:
    """What each command does, by its name behind that of its group: the experiments first."""
    from antennate.experiments import summaries

    known = {command_words(name): text for name, text in summaries().items()} | _OTHERS
    listed = [name for entry in _EXPERIMENTS for name in (entry, *_parts(entry)) if name in known]
    return {n: known[n] for n in listed} | known | ROBOT_COMMANDS | LOG_COMMANDS


def carry_out(name: str, argv: Sequence[str]) -> int:
    """Run a command on its words and return its exit code."""
    if name in _OWN:
        module, _, function = _FUNCTIONS.get(name, f"{name}:command").partition(":")
        return getattr(importlib.import_module(f"antennate.cli.{module}"), function)(list(argv))
    from antennate.cli.experiment import command
    from antennate.experiments import load

    return command(load(name.split()[-1]), list(argv))


def described(name: str) -> Command:
    """What the help of a command is made from, which is asked for in place of a run."""
    from antennate.cli.arguments import OptionsRequest

    try:
        carry_out(name, [OptionsRequest.WORD])
    except OptionsRequest as request:
        return request.command
    raise AssertionError(f"{name} took {OptionsRequest.WORD} for an order")


def _described() -> Iterator[Command]:
    """Every command for its completion; one that cannot be loaded is told on stderr."""
    from antennate.errors import BadInputError

    for name in commands():
        try:
            yield described(name)
        except BadInputError as error:
            sys.stderr.write(f"antennate: warning: {error}\n")


def _divided(words: Sequence[str]) -> tuple[str, list[str]]:
    """The name of the command, behind that of its group, and its words; empty if there is none."""
    name = words[0] if words else ""
    if f"{name} {''.join(words[1:2])}" in _parts(name):
        return " ".join(words[:2]), list(words[2:])
    if name in _GROUPS or _is_command(name):
        return name, list(words[1:])
    return "", list(words)


def _is_command(name: str) -> bool:
    """Whether a word is a command; other packages are asked only where it is none of ours."""
    from antennate.experiments import is_ours, names

    if command_words(name) != name:
        return False
    return name in _OWN or is_ours(name) or name in names()


def _parts(name: str) -> list[str]:
    """The commands that are typed behind a name."""
    return [command_words(part) for part in COMMAND_GROUPS.get(name, ())]


def _page(name: str, words: Sequence[str]) -> str:
    """What is printed in place of a run, empty if that is wanted."""
    word = words[0] if words else None
    if name in _GROUPS and word in (None, "-h", "--help", "--help-all"):
        return _usage_of(name)
    if not name and word in (None, "-h", "--help"):
        return _usage()
    return f"antennate {__version__}\n" if not name and word == "--version" else ""


def _run(name: str, words: Sequence[str], title: str) -> int:
    from antennate.cli.terminal import BAD_INPUT, OK, write_result

    if page := _page(name, words):
        sys.stdout.write(page)
        if words:
            return OK
        sys.stderr.write(f"{title}: error: expected a command, found none\n")
        return BAD_INPUT
    from antennate.cli.arguments import HelpRequest
    from antennate.errors import FAILURES, reason, where_of
    from antennate.messages import one_line, shortened

    try:
        if not name and words[0] == "--completion":
            from antennate.cli.help import script

            sys.stdout.write(script(words[1:], commands(), _described()))
            return OK
        _refuse_names(name, words)
        return carry_out(name, words)
    except HelpRequest as page:
        write_result(str(page))
        return OK
    except FAILURES as error:
        sys.stderr.write(f"{title}: error: {one_line(reason(error))}\n")
        return BAD_INPUT
    except MemoryError:
        sys.stderr.write(f"{title}: error: expected more memory, found none left\n")
        return BAD_INPUT
    except OSError as error:
        where = f"{shortened(str(error.filename))}: " if error.filename is not None else ""
        place = where_of(error, in_packages=False)
        sys.stderr.write(f"{title}: error: {one_line(where + reason(error) + place)}\n")
        return BAD_INPUT


def _refuse_names(name: str, words: Sequence[str]) -> None:
    """Refuse words that name no command, or one that another does now."""
    from antennate.errors import BadInputError
    from antennate.messages import former, shortened

    if gone := former([*name.split(), *words]):
        raise BadInputError(gone)
    if name in ("", *_GROUPS):
        raise BadInputError(_unknown(name, words[0]))
    if words and (hint := _misspelt(name, words[0])):
        raise BadInputError(f"{hint}, found {shortened(words[0])}")


def _unknown(group: str, word: str) -> str:
    """What is said of a word that is no command, or the old name of one."""
    from antennate.experiments import ELSEWHERE, unknown
    from antennate.messages import nearest, shortened, typed

    if command_words(word) != word:
        return f"{word} is `{typed(word)}` now"
    if not group and word in ELSEWHERE:
        return unknown(word)
    known = COMMAND_GROUPS[group] if group else [*_top()]
    choices = f"{nearest(word, known)}, one of {', '.join(known)}"
    return f"expected a command{choices}, found {shortened(word)}"


def _misspelt(name: str, word: str) -> str:
    """What is expected in place of a word that is nearly a command of a group; else nothing."""
    from antennate.messages import nearest

    parts = COMMAND_GROUPS.get(name, ())
    if not parts or word.startswith("-") or Path(word).exists():
        return ""
    actions = ("info", "recover", "export", "plot", "film") if name == "log" else ()
    hint = "" if word in actions else nearest(word, (*parts, *actions))
    return f"expected a command or a file{hint}" if hint else ""


def _top() -> dict[str, str]:
    """What stands in the list of commands: those that are in no group, and the groups."""
    known = _GROUPS | commands()
    listed = [*_EXPERIMENTS, *ROBOT_COMMANDS, *LOG_COMMANDS, *known]
    return {name: known[name] for name in listed if name in known and " " not in name}


def _usage() -> str:
    from antennate.messages import typed

    top = _top()
    sections = {
        "start here": _FIRST,
        "simulation and study": [n for n in top if n not in {**ROBOT_COMMANDS, **LOG_COMMANDS}],
        "the robot and its twin": ROBOT_COMMANDS,
        "logs and runs": LOG_COMMANDS,
    }
    width = max(map(len, top))
    lines = ["usage: antennate COMMAND [OPTIONS]", ""]
    lines += ["Simulate, calibrate, drive and study tactile antennae on a many-legged robot.", ""]
    for title, names in sections.items():
        lines += [f"{title}:"]
        for name in (name for name in names if name in top):
            lines += [f"  {name:<{width}}  {top[name]}"]
            parts = COMMAND_GROUPS.get(name, ()) if title != "start here" else ()
            lines += [f"  {'':<{width}}  {', '.join(f'{name} {part}' for part in parts)}"] * bool(
                parts
            )
        lines += [""]
    return "\n".join(
        [
            *lines,
            f"`{typed('COMMAND', '--help')}` shows its options, `--help-all` every one;",
            f"`{typed('--completion', 'bash')}` (zsh, fish) prints a script for the shell;",
            f"`{typed('--version')}` prints the version.",
            "",
        ]
    )


def _usage_of(group: str) -> str:
    """The page of a group that is no command of its own."""
    known, width = commands(), max(map(len, _parts(group)))
    lines = [f"usage: antennate {group} COMMAND [OPTIONS]", "", f"{_GROUPS[group]}.", ""]
    lines += [f"  {name:<{width}}  {known[name]}" for name in _parts(group)]
    return "\n".join([*lines, ""])
