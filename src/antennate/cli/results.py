"""Where the results of a command go: a folder, and standard output; and which log a run left."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import FromFile
from antennate.cli.options import flags_and_words, option, require_text
from antennate.cli.output import write_result
from antennate.errors import BadInputError
from antennate.messages import command_words
from antennate.params.base import Params
from antennate.studies.formats import to_json
from antennate.studies.measures import Table
from antennate.studies.report import View, write_report
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOG, LOGS, require_apart
from antennate.studies.store import Tasks
from antennate.telemetry.recover import RECOVERED


@dataclass(frozen=True)
class ResultOptions(FromFile):
    """Where the results go."""

    out: Path | None = option(None, "folder for the results, else runs/COMMAND-N", "FOLDER")
    overwrite: bool = option(
        False, "first rename the folder to FOLDER.old, in place of an older one", needs=["--out"]
    )
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
    reads: Sequence[Path] = (),
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
        reads: Files that it reads, beside those that the configuration names.

    Raises:
        BadInputError: The run that is to go on is another one, or no file can keep the words.
        OutputError: It cannot be written, or it holds another run, or one that is read.
    """
    for flag, words in flags_and_words(argv):
        for word in words:
            require_text(flag or view.name, word)
    given = [] if options.config is None else [options.config]
    require_apart(options.out, options.overwrite, config.model_dump(), [*reads, *given])
    place = (view.name, options.out, options.overwrite, identity, resume, retry)
    with RunDirectory.create(*place, tasks=tasks) as folder:
        folder.describe(config, ["antennate", *command_words(command or view.name).split(), *argv])
        yield folder
        write_report(folder, view)
        told = "complete already; nothing was run:" if folder.untouched else "written to"
        before = f"; what it held before is in {folder.old}" if folder.old else ""
        sys.stderr.write(f"{told} {folder.path}{before}\n")


def log_of(path: Path) -> Path:
    """The log that is meant by its name, or by the folder of a run that has one.

    Raises:
        BadInputError: There is none, or more than one.
    """
    if not path.is_dir():
        return path
    every = sorted((path / LOGS).glob("*.mcap"))
    logs = [each for each in every if _original(each) not in every]
    logs = logs or [each for each in [path / LOG] if each.exists()]
    if not logs:
        raise BadInputError(
            f"{path}: expected a run with a log, found none; --log keeps those of a simulation"
        )
    if len(logs) > 1:
        names = ", ".join(str(each) for each in logs[:3])
        raise BadInputError(
            f"{path}: expected a run with one log, found {len(logs)}; name one of {names}, …"
        )
    return logs[0]


def _original(path: Path) -> Path | None:
    """The log that `log recover` made this one of, None if it did not."""
    stem = path.stem.removesuffix(RECOVERED)
    return None if stem == path.stem else path.with_stem(stem)


def tell(
    result: Mapping[str, Any],
    options: ResultOptions,
    tables: Iterable[Table],
    sentence: str,
    explained: str = "",
) -> None:
    """Print the result: as JSON, or as tables, where they are explained, and a closing sentence."""
    if options.json:
        write_result(to_json(result))
        return
    for table in tables:
        print_table(table)
    from rich.console import Console  # slow to import
    from rich.text import Text

    console = Console(file=sys.stdout, highlight=False)
    if explained:
        console.print(Text(f"What the rows mean: {explained}"), soft_wrap=True)
    console.print(Text(sentence), soft_wrap=not console.is_terminal)


def drawn_table(table: Table) -> Any:
    """A table as rich draws it."""
    from rich.box import SIMPLE_HEAD  # slow to import
    from rich.table import Table as Drawn
    from rich.text import Text

    drawn = Drawn(title=table.title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    drawn.add_column("", overflow="fold")
    for name in table.columns:
        parts = re.sub(r"(?<=[/:])", "\n", name) if ":" in name else name.replace("_", " ")
        drawn.add_column(Text(parts), justify="right", overflow="fold")
    for name, cells in table.rows:
        drawn.add_row(Text(name), *(Text(cell) for cell in cells))
    return drawn


def print_table(table: Table) -> None:
    """Print a table and its note; as a list where it is too wide for the terminal.

    Underscores of a name are shown as spaces; one with a colon may have a line for each part.
    """
    from rich.console import Console  # slow to import
    from rich.measure import Measurement
    from rich.text import Text

    drawn = drawn_table(table)
    console = Console(file=sys.stdout, highlight=False)
    if table.preface:
        console.print(Text(table.preface), soft_wrap=not console.is_terminal)
        console.print()
    unlimited = console.options.update(max_width=sys.maxsize)
    if Measurement.get(console, unlimited, drawn).minimum <= console.width:
        console.print(drawn)
    else:
        console.print(Text(table.title))
        for name, cells in table.rows:
            found = (f"{each} {cell}" for each, cell in zip(table.columns, cells, strict=True))
            console.print(Text(f"{name}: {', '.join(found)}"))
        console.print()
    if table.note:
        console.print(Text(table.note), soft_wrap=not console.is_terminal)
        console.print()
