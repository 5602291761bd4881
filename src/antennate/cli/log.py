"""`antennate log`: what a log holds, and the log in other forms."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, Literal

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import parse
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.progress import progress, stop_signals
from antennate.cli.replay import complain, say_unguarded
from antennate.cli.results import ResultOptions, log_of, tell
from antennate.control.readings import condition
from antennate.errors import ConfigError, MissingPackageError, OutputError, reason
from antennate.files import remove_abandoned, require_room, write_whole, writing_whole
from antennate.messages import extra, one_line, shortened, typed
from antennate.params.base import Params
from antennate.studies.formats import csv_lines
from antennate.studies.measures import Table
from antennate.telemetry.header import MOST_PARTS, part, parts
from antennate.telemetry.reader import RECOVERED, LogReader, left_out, recover
from antennate.telemetry.survey import Survey
from antennate.telemetry.ticks import JOINTS
from antennate.telemetry.topics import EVENTS

DESCRIPTION = """\
Look at the log of a drive or a simulation: `info` says what it holds; `recover` writes the log of a
killed program, and of all programs that followed it, to one file that other tools open; `export`
writes a row for each tick as CSV or Parquet; `plot` draws it; `film` makes a film of its first ten
minutes.

A log is an MCAP file of ROS 2 messages: Foxglove, Lichtblick, PlotJuggler, Rerun and `rosbags` open
it. The exit code is 2 if it is damaged; what can be read is read."""
_ENDINGS = {
    "recover": (".mcap",),
    "export": (".csv", ".parquet"),
    "plot": (".png", ".svg"),
    "film": (".mp4",),
}
_ROWS = 4096
"""Ticks that are written to a Parquet file at once."""
_SHOWN = 10
"""Most events that `info` prints at either end of a log."""


@dataclass(frozen=True)
class Options(ResultOptions):
    """What to do with which log."""

    action: Literal["info", "recover", "export", "plot", "film"] = option(
        "info", "what to do", positional=True
    )
    log: str = option("", "log, or the folder of a run with one", "RUN|LOG", positional=True)
    out: Path | None = option(
        None,
        "file to write, .mcap, .csv, .parquet, .png, .svg or .mp4; else beside the log",
        "FILE",
    )
    overwrite: bool = option(False, "replace that file")
    json: bool = option(False, "print what `info` finds as JSON")


def command(argv: Sequence[str]) -> int:
    """Look at one log.

    Raises:
        AntennateError: The log cannot be read, or the file not written.
    """
    _, options = parse("log", DESCRIPTION, Params, argv, Options)
    if not options.log:
        raise ConfigError("expected the name of a log or of a run, found none")
    path = log_of(Path(options.log))
    if options.action == "info":
        if options.out is not None:
            raise ConfigError("--out: expected no file for `info`, found one")
        if options.overwrite:
            raise ConfigError("--overwrite: expected no file for `info`, found one")
        return _info(path, options)
    if options.json:
        raise ConfigError(f"--json: expected `info` beside it, found {options.action}")
    target = _target(path, options)
    if target.exists() and not options.overwrite:
        raise OutputError(f"expected no such file, found {target}; choose --out or --overwrite")
    actions: Mapping[str, Callable[[Path, Path], LogReader]] = {
        "recover": _recover,
        "export": _export,
        "plot": _plot,
        "film": _film,
    }
    place = target.resolve()
    remove_abandoned(place.parent, place.name.__eq__)
    log = actions[options.action](path, target)
    recovered = options.action == "recover"
    more = f"; {left_out(log)}" if recovered else ""
    done = "drawn into" if options.action in ("plot", "film") else "written to"
    tell({}, options, (), f"{log.ticks} ticks were {done} {target}{more}.")
    if recovered:
        say_unguarded("log", log)
        return OK
    return complain("log", log)


def _target(path: Path, options: Options) -> Path:
    """The file to write."""
    endings = _ENDINGS[options.action]
    stem = f"{path.stem}{RECOVERED}" if options.action == "recover" else path.stem
    target = options.out or path.with_name(stem + endings[0])
    if target.suffix not in endings:
        raise ConfigError(f"--out: expected a name with {' or '.join(endings)}, found {target}")
    try:
        if target.exists() and any(p.exists() and target.samefile(p) for p in parts(path)):
            raise ConfigError(f"--out: expected another file than the log, found {target}")
        if _would_continue(target, path):
            raise ConfigError(
                f"--out: expected a name that does not continue the log {path}, found {target}"
            )
    except OSError as error:
        raise OutputError(
            f"--out: expected a name that can be written, found {shortened(str(target))}: "
            f"{reason(error)}"
        ) from None
    return target


def _would_continue(target: Path, path: Path) -> bool:
    """Whether a file of this name is read as a later part of a log."""
    names = {os.path.realpath(part(path, number)) for number in range(2, MOST_PARTS + 1)}
    return os.path.realpath(target) in names


def _recover(path: Path, target: Path) -> LogReader:
    with stop_signals():
        return recover(path, target, overwrite=True)


def _export(path: Path, target: Path) -> LogReader:
    with LogReader(path) as log:
        measured = {name for tick in log for name in JOINTS[1:] if getattr(tick, name)}
        log.require_ticks()
    with LogReader(path) as log:
        rows = (tick.row(log.header.robot, measured) for tick in log)
        if target.suffix == ".csv":
            with writing_whole(target, overwrite=True) as file:
                file.writelines(line.encode() for line in csv_lines(rows))
        else:
            _write_parquet(target, rows)
    return log


def _write_parquet(target: Path, rows: Iterator[Mapping[str, Any]]) -> None:
    """A Parquet file with a column for each number, written in groups of rows."""
    try:
        arrow: Any = import_module("pyarrow")
        parquet: Any = import_module("pyarrow.parquet")
    except ImportError:
        raise MissingPackageError(
            f"{target}: expected the package pyarrow, found none; install it with "
            f"{extra('parquet')}, or write a .csv"
        ) from None
    with writing_whole(target, overwrite=True) as file:
        first = arrow.Table.from_pylist(list(islice(rows, _ROWS)))
        with parquet.ParquetWriter(file, first.schema) as out:
            out.write_table(first)
            while held := list(islice(rows, _ROWS)):
                out.write_table(arrow.Table.from_pylist(held, schema=first.schema))


def _plot(path: Path, target: Path) -> LogReader:
    from antennate.figures import render  # slow to import
    from antennate.telemetry.figure import drawn

    log, figure = drawn(path)
    write_whole(target, render(figure)[target.suffix.removeprefix(".")], overwrite=True)
    return log


def _film(path: Path, target: Path) -> LogReader:
    from antennate.cli.view import arena_of  # slow to import
    from antennate.telemetry.film import PICTURE_SIZE, encoded, require_video
    from antennate.telemetry.log_film import film_of

    with LogReader(path) as log:
        require_video()
        film = film_of(log, arena_of(path, log.header), path.name)
    require_room(target, PICTURE_SIZE * len(film.t))
    with (
        progress("pictures of the film") as step,
        stop_signals(),
        writing_whole(target, overwrite=True) as file,  # opened before anything is drawn
    ):
        file.write(encoded(film, step))
    return log


def _info(path: Path, options: Options) -> int:
    with LogReader(path) as log:
        result = _result(log, log.survey())
    tell(result, options, [_table(result)], _sentence(result))
    return complain("log", log)


def _result(log: LogReader, found: Survey) -> dict[str, Any]:
    header = log.header
    events = ((time, EVENTS.decode(data)["msg"]) for time, data in found.events)
    return {
        "schema": 1,
        "command": "log",
        "log": str(log.path),
        "parts": [part.name for part in log.parts],
        "controller": condition(header.controller, header.readings),
        "joints": list(header.robot.joint_names),
        "seed": header.seed,
        "trial": header.trial,
        "start_ns": header.start,
        "calibrated": bool(header.calibration),
        "versions": dict(header.versions),
        "ticks": log.ticks,
        "duration_s": 1e-9 * (found.last - found.first),
        "messages": {topic.name: count for topic, count in found.messages.items()},
        "events": [{"time_ns": time, "text": text} for time, text in events],
        "missing": log.missing,
        "damaged": log.bad,
        "closed": log.end is not None,
        "guarded": log.guarded,
    }


def _table(result: Mapping[str, Any]) -> Table:
    events, start = result["events"], result["start_ns"]
    lines = [f"{1e-9 * (each['time_ns'] - start):.2f} s {each['text']}" for each in events]
    if (hidden := len(events) - 2 * _SHOWN) > 0:
        lines[_SHOWN:-_SHOWN] = [f"... {hidden} more events; --json has all"]
    rows = [(name, [str(count)]) for name, count in result["messages"].items()]
    note = "\n".join(map(one_line, lines))
    return Table(f"Log of {one_line(result['controller'])}", ["messages"], rows, note)


def _sentence(result: Mapping[str, Any]) -> str:
    """What it holds, in one sentence."""
    recovering = typed("log", "recover", result["log"])
    closed = "it is complete" if result["closed"] else f"it was not closed: {recovering}"
    if result["damaged"] or result["missing"]:
        closed = f"it is damaged: {recovering}"
    by = one_line(result["versions"].get("antennate", "of unknown version"))
    return (
        f"{result['ticks']} ticks in {result['duration_s']:.2f} s, in "
        f"{one_line(', '.join(result['parts']))}, by antennate {by}; {closed}."
    )
