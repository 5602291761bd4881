"""Where the results of a command go: a folder, and standard output; and pages of runs.

`antennate report` writes the page of a run again, or sets two runs side by side.
"""

from __future__ import annotations

import contextlib
import importlib
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli.arguments import FromFile, flags_and_words, parse, require_text
from antennate.cli.options import option
from antennate.cli.terminal import OK, console, write_result
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import write_whole
from antennate.messages import command_words
from antennate.params.base import Params
from antennate.studies.formats import to_json
from antennate.studies.page import spaced
from antennate.studies.report import View, command_of, compare, report, write_report
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import REPORT, files_of, listed
from antennate.studies.tables import Table
from antennate.studies.trial_file import Tasks


@dataclass(frozen=True)
class ResultOptions(FromFile):
    """Where the results go."""

    out: Path | None = option(None, "folder for the results, else runs/COMMAND-N", "FOLDER")
    overwrite: bool = option(False, "first rename the folder to FOLDER.old", needs=["--out"])
    json: bool = option(False, "print the content of result.json and nothing else")


@contextlib.contextmanager
def folder_for(
    view: View,
    options: ResultOptions,
    config: Params,
    argv: Sequence[str],
    identity: Mapping[str, Any] | None = None,
    resume: bool | None = None,
    retry: bool = False,
    command: str = "",
    tasks: Tasks | None = None,
) -> Iterator[RunDirectory]:
    """A run directory with its configuration.

    Its report is written, and its path printed, when the run is complete.

    Args:
        view: How the result is shown.
        options: Where it goes.
        config: The configuration.
        argv: Words of the command.
        identity: What is run, if it can be resumed.
        resume: Go on with the run that the folder holds, if there is one; None if it never can.
        retry: Run its trials again that failed.
        command: Name of the command, if it is not that of the view.
        tasks: As for `RunDirectory.create`.
    """
    for flag, words in flags_and_words(argv):
        for word in words:
            require_text(flag or view.name, word)
    place = (view.name, options.out, options.overwrite, identity, resume, retry)
    with RunDirectory.create(*place, tasks=tasks) as folder:
        if identity is None:  # no experiment, which knows more names
            folder.require_free(view.figures)
        folder.describe(config, ["antennate", *command_words(command or view.name).split(), *argv])
        yield folder
        write_report(folder, view)
        done = "complete already; nothing was run:" if folder.untouched else "written to"
        before = f"; what it held before is in {folder.old}" if folder.old else ""
        sys.stderr.write(f"{done} {folder.path}{before}\n")


def require_new(path: Path, overwrite: bool) -> None:
    """Refuse a file that is there, unless it may be replaced."""
    if path.exists() and not overwrite:
        raise OutputError(
            f"{path}: expected no such file, found one; choose another with --out, or give "
            "--overwrite"
        )


def show_result(
    result: Mapping[str, Any],
    options: ResultOptions,
    tables: Iterable[Table],
    sentence: str,
    explained: str = "",
) -> None:
    """Print the result: as JSON, or a sentence, then its tables and the file that explains them."""
    if options.json:
        write_result(to_json(result))
        return
    from rich.text import Text  # slow to import

    output = console()
    output.print(Text(sentence), soft_wrap=not output.is_terminal)
    for i, table in enumerate(tables):
        if i == 0:
            output.print()
        print_table(table)
    if explained and (_CLONE / explained).exists():
        output.print(Text(f"What the rows mean: {explained}"), soft_wrap=True)


_CLONE = Path(__file__).parent / "../../../../.."
"""Where the folder docs is, if this is a clone and no installed package."""


def drawn_table(table: Table) -> Any:
    """A table as rich draws it.

    Underscores of a name are shown as spaces; one with a colon may have a line for each part.
    """
    from rich.box import SIMPLE_HEAD  # slow to import
    from rich.table import Table as Drawn
    from rich.text import Text

    drawn = Drawn(title=table.title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    drawn.add_column("", overflow="fold")
    for name in table.columns:
        parts = re.sub(r"(?<=[/:])", "\n", name) if ":" in name else spaced(name)
        drawn.add_column(Text(parts), justify="right", overflow="fold")
    for name, cells in table.rows:
        drawn.add_row(Text(name), *(Text(cell) for cell in cells))
    return drawn


def print_table(table: Table) -> None:
    """Print a table and its note.

    One that is too wide for the terminal is printed some columns at a time; where not even one of
    them fits, as a list.
    """
    from rich.text import Text  # slow to import

    output = console()
    if table.preface:
        output.print(Text(table.preface), soft_wrap=not output.is_terminal)
        output.print()
    for part in _parts(table, output):
        if _width(part, output).minimum <= output.width:
            output.print(drawn_table(part))
            continue
        output.print(Text(part.title))
        for name, cells in part.rows:
            pairs = (f"{column} {cell}" for column, cell in zip(part.columns, cells, strict=True))
            output.print(Text(f"{name}: {', '.join(pairs)}"))
        output.print()
    if table.note:
        output.print(Text(table.note), soft_wrap=not output.is_terminal)
        output.print()


def _width(table: Table, output: Any) -> Any:
    """The columns of a terminal that a table fills at least, with broken lines, and at most."""
    from rich.measure import Measurement  # slow to import

    unlimited = output.options.update(max_width=sys.maxsize)
    return Measurement.get(output, unlimited, drawn_table(table))


def _parts(table: Table, output: Any) -> Iterator[Table]:
    """The table, or if it is too wide as many of its columns at a time as fit unbroken."""

    def part(columns: slice) -> Table:
        rows = [(name, cells[columns]) for name, cells in table.rows]
        return Table(table.title, table.columns[columns], rows)

    total = len(table.columns)
    if _width(table, output).minimum <= output.width:
        yield table
        return
    start = 0
    while start < total:
        ends = range(total, start, -1)
        fitting = (n for n in ends if _width(part(slice(start, n)), output).maximum <= output.width)
        end = next(fitting, start + 1)
        yield part(slice(start, end))
        start = end


DESCRIPTION = """\
Write a run as one HTML page that needs nothing else: what was run, what came out with its
intervals, figures, films, parameters, versions and the command. Every run writes it already; this
writes it again, or elsewhere.

--compare sets two runs of one command side by side: the parameters and versions that differ, and
each line of the tables below that of the other."""
_COMPARISON = "comparison.html"
_VIEWS = {
    "drive": "drive:VIEW",
    "teleop": "drive:TELEOP_VIEW",
    "replay": "replay:VIEW",
    "doctor": "doctor:VIEW",
    "robot": "robot:VIEW",
}
"""Where the views of the commands stand that leave runs, beside the experiments."""


@dataclass(frozen=True)
class ReportOptions:
    """Which runs, and where the page goes."""

    run: Path | None = option(None, "folder of a run", "RUN", positional=True)
    compare: tuple[Path, ...] = option((), "two runs of one command, side by side", "RUN")
    out: Path | None = option(
        None, f"the page; else {REPORT} in the run, {_COMPARISON} here of two", "FILE"
    )
    overwrite: bool = option(False, "replace another file", needs=["--out", "--compare"])


def command(argv: Sequence[str]) -> int:
    """Write the page of a run, or of two."""
    _, options = parse("report", DESCRIPTION, Params, argv, ReportOptions)
    if options.compare and options.run is not None:
        raise ConfigError(f"--compare: expected no other run beside it, found {options.run}")
    runs, own = list(options.compare), False
    if options.compare:
        text, place = _comparison(options.compare), options.out or Path(_COMPARISON)
    elif options.run is not None:
        run = RunDirectory.open(options.run)
        text = _page(run, lambda view: report(run, view))
        place, own, runs = options.out or run.path / REPORT, options.out is None, [options.run]
    else:
        raise ConfigError("expected the folder of a run, or --compare RUN RUN, found none")
    sources = (file for run in runs for file in files_of(run) if file.name != REPORT)
    if place.exists() and any(place.samefile(file) for file in sources):
        raise OutputError(f"--out: expected no file that the page is made of, found {place}")
    if own and listed(runs[0]) is not None:
        RunDirectory.open(runs[0]).claim_names([REPORT])
    require_new(place, own or options.overwrite)
    write_whole(place, text.encode(), overwrite=own or options.overwrite)
    sys.stderr.write(f"written to {place}\n")
    return OK


def _comparison(paths: Sequence[Path]) -> str:
    if len(paths) != 2:
        raise ConfigError(f"--compare: expected 2 runs, found {len(paths)}")
    first, second = map(RunDirectory.open, paths)
    names = [command_of(run) for run in (first, second)]
    if names[0] != names[1]:
        raise BadInputError(
            f"--compare: expected two runs of one command, found {names[0]} in {first.path} and "
            f"{names[1]} in {second.path}"
        )
    for run in (first, second):  # so that the one of two that cannot be shown is named
        _page(
            run, lambda view, run=run: f"{view.tables(run.result())} {view.sentence(run.result())}"
        )
    return _page(first, lambda view: compare([first, second], view))


def _page(run: RunDirectory, make: Callable[[View], str]) -> str:
    """A page by the view of the command of a run."""
    name = command_of(run)
    if name in _VIEWS:
        module, _, attribute = _VIEWS[name].partition(":")
        view = getattr(importlib.import_module(f"antennate.cli.{module}"), attribute)
    elif name in experiments.names() or name in experiments.ELSEWHERE:
        view = experiments.load(name).view
    else:
        raise BadInputError(
            f"{run.path}: expected the run of a command that is known, found {name}"
        )
    try:
        return make(view)
    except BadInputError:
        raise
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        raise BadInputError(
            f"{run.path}: expected a result of this version's {name}, found another form "
            f"({type(error).__name__}: {error}); run it again, or take the version that wrote it"
        ) from None
