"""The door: the only place that talks to people.

`antennate COMMAND ...` ends with 0 when done, 2 on bad input and 130 when interrupted. Bad input is
answered with one line on stderr. What a command needs is imported when it runs.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence

from antennate import __version__

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130

ROBOT_COMMANDS = {
    "twin": "serve a simulated robot as real bytes: an antenna board and a bus of 19 servos",
    "doctor": "examine the real robot, or its twin: what is wrong, and the cure",
    "record": "antenna readings to a CSV file that calibrate takes",
    "drive": "let a controller walk the real robot, or its twin",
    "replay": "let a controller decide again upon the log of a drive",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after the program's name; those of this process by default.

    Returns:
        The exit code.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(_usage())
        return OK if words else BAD_INPUT
    if words[0] == "--version":
        sys.stdout.write(f"antennate {__version__}\n")
        return OK
    try:
        return _run(words[0], words[1:])
    except KeyboardInterrupt:
        sys.stderr.write(f"antennate {words[0]}: interrupted\n")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read stdout has gone; nothing more can be said there
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK


def _run(command: str, argv: list[str]) -> int:
    from antennate import experiments
    from antennate.cli.messages import nearest, one_line
    from antennate.errors import AntennateError, BadInputError

    name = "antennate"
    try:
        if command in ROBOT_COMMANDS:
            name = f"antennate {command}"
            return importlib.import_module(f"antennate.cli.{command}").command(argv)
        if command in experiments.names():
            from antennate.cli.experiment import command as carry_out

            name = f"antennate {command}"
            return carry_out(experiments.load(command), argv)
        commands = [*experiments.names(), *ROBOT_COMMANDS]
        known = ", ".join(commands) + nearest(command, commands)
        raise BadInputError(f"expected a command ({known}), found {command}")
    except AntennateError as error:
        sys.stderr.write(f"{name}: error: {one_line(str(error))}\n")
        return BAD_INPUT


def _usage() -> str:
    from antennate import experiments

    groups = {"experiments": experiments.summaries(), "the robot and its twin": ROBOT_COMMANDS}
    width = max(len(name) for commands in groups.values() for name in commands)
    return "\n".join(
        [
            "usage: antennate COMMAND [OPTIONS]",
            "",
            "Simulate and study a pair of tactile antennae on a many-legged robot.",
            "",
            *(
                line
                for title, commands in groups.items()
                for line in (
                    f"{title}:",
                    *(f"  {name:<{width}}  {what}" for name, what in commands.items()),
                    "",
                )
            ),
            "`antennate COMMAND --help` lists every option with its unit and default;",
            "`antennate --version` prints the version.",
            "",
        ]
    )
