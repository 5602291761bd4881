"""The command line: the only place that talks to people.

`antennate COMMAND ...` ends with 0 when done, 2 on bad input and 130 when interrupted. Bad input is
answered with one line on stderr. What a command needs is imported when it runs.
"""

from __future__ import annotations

import errno
import importlib
import sys
from collections.abc import Mapping, Sequence

from antennate import __version__
from antennate.cli.exit_codes import BAD_INPUT, INTERRUPTED, OK

ROBOT_COMMANDS = {
    "twin": "A simulated robot on two ports: an antenna board and a servo bus",
    "robot": "Joints, supply, wiring diagram and bill of materials of a robot",
    "doctor": "Examine the real robot, or its twin: what is wrong, and the cure",
    "setup": "From a box of servos to a robot, one servo at a time",
    "zero": "Zeros and directions of the joints, by hand",
    "jog": "Move one joint by small steps",
    "record": "Antenna readings to a CSV file that calibrate takes",
    "drive": "Let a controller walk the real robot, or its twin",
    "teleop": "Walk the real robot, or its twin, by keys",
    "log": "What a log holds; recover it, export it, plot it",
    "replay": "Let a controller decide again upon the log of a drive",
    "view": "A log, or that of a run, on a page of this computer",
    "report": "A run, or two side by side, as one page to read, print and send",
    "merge": "The shards of a run as the run that they are parts of",
}
_HELP = {"-h", "--help", "--help-all", "--completion", "--complete"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after the program's name; those of this process by default.

    Returns:
        The exit code.
    """
    from antennate.cli.output import safe_streams
    from antennate.sim.engine_setup import describe_only, dropped, keep_wish

    keep_wish()
    words = list(sys.argv[1:] if argv is None else argv)
    describe_only(not _HELP.isdisjoint(words))
    name = f"antennate {words[0]}" if words and _known(words[0]) else "antennate"
    with dropped(), safe_streams(result_alone="--json" in words) as output:
        try:
            code = _run(words, name)
        except KeyboardInterrupt:
            sys.stderr.write(f"{name}: interrupted\n")
            exec("")  # noqa: S102  CPython forgets that an earlier `exec` was interrupted
            return INTERRUPTED
        output.flush()
        if output.error is None or isinstance(output.error, BrokenPipeError):
            return code  # the reader of the pipe has ended, as `head` does
        from antennate.errors import reason

        why = reason(output.error)
        sys.stderr.write(f"{name}: error: standard output: expected to write, found: {why}\n")
        return BAD_INPUT


def commands() -> dict[str, str]:
    """What each command does, by name: the experiments first."""
    from antennate.experiments import summaries

    return summaries() | ROBOT_COMMANDS


def carry_out(name: str, argv: Sequence[str]) -> int:
    """Run a command on its words and return its exit code.

    Raises:
        AntennateError: Something given cannot be used, or the run failed.
    """
    if name in ROBOT_COMMANDS:
        return importlib.import_module(f"antennate.cli.{name}").command(list(argv))
    from antennate.cli.experiment import command
    from antennate.experiments import load

    return command(load(name), list(argv))


def _run(words: Sequence[str], name: str) -> int:
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(_usage())
        if words:
            return OK
        sys.stderr.write("antennate: error: expected a command, found none\n")
        return BAD_INPUT
    if words[0] == "--version":
        sys.stdout.write(f"antennate {__version__}\n")
        return OK
    from antennate.cli.arguments import HelpRequest
    from antennate.cli.output import write_result
    from antennate.errors import AntennateError, BadInputError, reason
    from antennate.messages import nearest, one_line, shortened

    try:
        if words[0] == "--completion":
            from antennate.cli.completion import script

            sys.stdout.write(script(words[1:], commands(), carry_out))
            return OK
        if not _known(words[0]):
            known = f"{nearest(words[0], commands())}, one of {', '.join(commands())}"
            raise BadInputError(f"expected a command{known}, found {shortened(words[0])}")
        return carry_out(words[0], words[1:])
    except HelpRequest as page:
        write_result(str(page))
        return OK
    except AntennateError as error:
        sys.stderr.write(f"{name}: error: {one_line(reason(error))}\n")
        return BAD_INPUT
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        found = shortened(str(error.filename))
        sys.stderr.write(f"{name}: error: expected a shorter name of a file, found {found}\n")
        return BAD_INPUT


def _known(word: str) -> bool:
    """Whether it is a command; other packages are asked only where it is none of ours."""
    from antennate.experiments import is_ours, names

    return word in ROBOT_COMMANDS or is_ours(word) or word in names()


def _usage() -> str:
    from antennate.experiments import summaries
    from antennate.messages import typed

    width = max(map(len, commands()))
    return "\n".join(
        [
            "usage: antennate COMMAND [OPTIONS]",
            "",
            "Simulate and study a pair of tactile antennae on a many-legged robot.",
            "",
            *_listed("experiments", summaries(), width),
            *_listed("the robot and its twin", ROBOT_COMMANDS, width),
            f"`{typed('COMMAND', '--help')}` shows its options, `--help-all` every one;",
            f"`{typed('--completion', 'bash')}` (zsh, fish) prints a script for the shell;",
            f"`{typed('--version')}` prints the version.",
            "",
        ]
    )


def _listed(title: str, named: Mapping[str, str], width: int) -> list[str]:
    return [f"{title}:", *(f"  {name:<{width}}  {what}" for name, what in named.items()), ""]
