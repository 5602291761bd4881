"""`antennate report`: a run as one page, or two side by side."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli.arguments import parse
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import write_whole
from antennate.params.base import Params
from antennate.studies.report import View, command_of, compare, report
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import REPORT, files_of, is_same, listed

DESCRIPTION = """\
Write a run as one HTML page that needs nothing else: what was run, what came out with its
intervals, figures, films, parameters, versions and the command. Every run writes it already; this
writes it again, or elsewhere.

--compare sets two runs of one command side by side: the parameters and versions that differ, and
each line of the tables below that of the other."""
COMPARISON = "comparison.html"
_COMMANDS = ("drive", "teleop", "replay", "doctor", "robot")
"""Commands beside the experiments that leave runs."""


@dataclass(frozen=True)
class Options:
    """Which runs, and where the page goes."""

    run: Path | None = option(None, "folder of a run", "RUN", positional=True)
    compare: tuple[Path, ...] = option((), "two runs of one command, side by side", "RUN")
    out: Path | None = option(
        None, f"the page; else {REPORT} in the run, {COMPARISON} here of two", "FILE"
    )
    overwrite: bool = option(False, "replace another file", needs=["--out", "--compare"])


def command(argv: Sequence[str]) -> int:
    """Write the page.

    Raises:
        AntennateError: A folder is no run, the runs cannot be compared, or nothing can be written.
    """
    _, options = parse("report", DESCRIPTION, Params, argv, Options)
    if options.compare and options.run is not None:
        raise ConfigError(f"--compare: expected no other run beside it, found {options.run}")
    if options.compare:
        text, place = _compared(options.compare), options.out or Path(COMPARISON)
        own = False
        runs = list(options.compare)
    elif options.run is not None:
        run = RunDirectory.open(options.run)
        text = _made(run, lambda view: report(run, view))
        place = options.out or run.path / REPORT
        own = options.out is None
        runs = [options.run]
    else:
        raise ConfigError("expected the folder of a run, or --compare RUN RUN, found none")
    _require_no_source(place, runs)
    if options.run is not None and own and listed(options.run) is not None:
        RunDirectory.open(options.run).claim_names([REPORT])
    write_whole(place, text.encode(), overwrite=own or options.overwrite)
    sys.stderr.write(f"written to {place}\n")
    return OK


def _require_no_source(place: Path, runs: Sequence[Path]) -> None:
    """Check that a page takes the place of no file of a run, but of its page."""
    files = (file for run in runs for file in files_of(run) if file.name != REPORT)
    if any(is_same(place, file) for file in files):
        raise OutputError(f"--out: expected no file that the page is made of, found {place}")


def _compared(paths: Sequence[Path]) -> str:
    if len(paths) != 2:
        raise ConfigError(f"--compare: expected 2 runs, found {len(paths)}")
    first, second = map(RunDirectory.open, paths)
    names = [command_of(run) for run in (first, second)]
    if names[0] != names[1]:
        raise BadInputError(
            f"--compare: expected two runs of one command, found {names[0]} in {first.path} and "
            f"{names[1]} in {second.path}"
        )
    _require_shown(first)
    _require_shown(second)
    return _made(first, lambda view: compare([first, second], view))


def _require_shown(run: RunDirectory) -> None:
    """Check that a run can be shown, so that the one of two that cannot is named."""
    _made(run, lambda view: f"{view.tables(run.result())} {view.sentence(run.result())}")


def _made(run: RunDirectory, make: Callable[[View], str]) -> str:
    """A page by the view of the command of a run."""
    name = command_of(run)
    if name in _COMMANDS:
        view = importlib.import_module(f"antennate.cli.{name}").VIEW
    elif name in experiments.names():
        view = experiments.load(name).view
    else:
        raise BadInputError(
            f"{run.path}: expected the run of a command that is known, found {name}"
        )
    try:
        return make(view)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        if isinstance(error, BadInputError):
            raise
        raise BadInputError(
            f"{run.path}: expected a result of this version's {name}, found another form "
            f"({type(error).__name__}: {error})"
        ) from None
