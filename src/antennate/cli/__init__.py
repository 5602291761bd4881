"""The door: the only place that talks to people.

`antennate COMMAND ...` ends with 0 when done, 2 on bad input and 130 when interrupted. Bad input is
answered with one line on stderr. What a command needs is imported when it runs.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

from antennate import __version__

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130

COMMANDS = {
    "tunnel": "walk robots through a corridor of loose cylinders, with and without touch",
    "gait": "walk on a flat floor: speed, turning and cost of the gait",
    "springs": "torsion springs: stiffness from wire and coils, and back",
    "taper": "stiffness along a tapering antenna, and the ladder of springs that follows it",
    "calibrate": "readings to bend: fit a recording, or push a simulated antenna",
    "wall": "pass a line of boulders with five antennae: success, jam or slip",
    "sensor": "flex to counts: curve, hysteresis, creep, noise and the best divider",
    "force": "how much of a contact's force the flex tells, with and without knowing the place",
    "sweep": "sweep an antenna beside walls: its shapes, and the distances that active touch tells",
    "twin": "serve a simulated robot as real bytes: an antenna board and a bus of 19 servos",
    "doctor": "examine the real robot, or its twin: what is wrong, and the cure",
    "record": "antenna readings to a CSV file that calibrate takes",
    "drive": "let a controller walk the real robot, or its twin",
    "replay": "let a controller decide again upon the log of a drive",
    "touch": "move an antenna along walls: sensed contact against true contact",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after the program's name; those of this process by default.

    Returns:
        The exit code.
    """
    from antennate.cli.output import safe_streams

    words = list(sys.argv[1:] if argv is None else argv)
    name = f"antennate {words[0]}" if words and words[0] in COMMANDS else "antennate"
    with safe_streams() as output:
        try:
            code = _run(words, name)
        except KeyboardInterrupt:
            sys.stderr.write(f"{name}: interrupted\n")
            return INTERRUPTED
        output.flush()
        if output.error is None or isinstance(output.error, BrokenPipeError):
            return code  # whoever read a pipe has seen enough
        reason = output.error.strerror or output.error
        sys.stderr.write(f"{name}: error: standard output: expected to write, found: {reason}\n")
        return BAD_INPUT


def _run(words: Sequence[str], name: str) -> int:
    if not words or words[0] in ("-h", "--help"):
        sys.stdout.write(_usage())
        return OK if words else BAD_INPUT
    if words[0] == "--version":
        sys.stdout.write(f"antennate {__version__}\n")
        return OK
    from antennate.cli.arguments import HelpRequest
    from antennate.errors import AntennateError, BadInputError
    from antennate.messages import nearest, one_line, shortened

    try:
        if words[0] == "--completion":
            from antennate.cli.completion import script

            sys.stdout.write(script(words[1:], COMMANDS))
            return OK
        if words[0] not in COMMANDS:
            known = f"{nearest(words[0], COMMANDS)}, one of {', '.join(COMMANDS)}"
            raise BadInputError(f"expected a command{known}, found {shortened(words[0])}")
        return importlib.import_module(f"antennate.cli.{words[0]}").command(list(words[1:]))
    except HelpRequest as page:
        sys.stdout.write(str(page))
        return OK
    except AntennateError as error:
        sys.stderr.write(f"{name}: error: {one_line(str(error))}\n")
        return BAD_INPUT


def _usage() -> str:
    width = max(len(name) for name in COMMANDS)
    return "\n".join(
        [
            "usage: antennate COMMAND [OPTIONS]",
            "",
            "Simulate and study a pair of tactile antennae on a many-legged robot.",
            "",
            "commands:",
            *(f"  {name:<{width}}  {what}" for name, what in COMMANDS.items()),
            "",
            "`antennate COMMAND --help` shows its options, `--help-all` every one;",
            "`antennate --completion bash` (zsh, fish) prints a script for the shell;",
            "`antennate --version` prints the version.",
            "",
        ]
    )
