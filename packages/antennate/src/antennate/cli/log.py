"""`antennate log`: what a log holds, the log in other forms, and on a page: `log view`."""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli.arguments import parse
from antennate.cli.options import LiveOptions, option
from antennate.cli.pages import MODULE, place_of
from antennate.cli.results import ResultOptions, require_new, show_result
from antennate.cli.terminal import BAD_INPUT, OK, progress, stop_signals
from antennate.control.readings import condition
from antennate.errors import FAILURES, ConfigError
from antennate.files import remove_abandoned, require_room, write_whole, writing_whole
from antennate.messages import command_words, one_line, shown, typed
from antennate.params.base import Params, from_values
from antennate.studies.formats import csv_lines
from antennate.studies.parquet import require_parquet
from antennate.studies.report import command_of
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOGS, log_of
from antennate.studies.tables import Table
from antennate.telemetry import PAGE_PORT, FilmView
from antennate.telemetry.header import MOST_PARTS, RECOVERED, Header, part, parts
from antennate.telemetry.reader import LogReader, left_out, recover
from antennate.telemetry.survey import Survey
from antennate.telemetry.ticks import JOINTS
from antennate.telemetry.topics import EVENTS, MOTION

if TYPE_CHECKING:  # these import much, for a page and for films
    from antennate.sim.trial import TrialConfig
    from antennate.sim.world import World
    from antennate.telemetry.view.player import LogPlayer

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
_ACTIONS = ("info", *_ENDINGS)
_ROWS = 4096
"""Ticks that are written to a Parquet file at once."""
_SHOWN = 10
"""Most events that `info` prints at either end of a log."""

_WALKS = ("OK", "DEGRADED")
"""Begin of the events of a robot that can walk."""
_CAUSES = re.compile(r"(?<=; )(?:OFF|FAULT|HOLD|DEGRADED) (?=[A-Z_]+:)")
"""What each cause asks for, which is no error while a robot is not armed yet."""


@dataclass(frozen=True)
class LogOptions(ResultOptions):
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
    video_view: FilmView = option("above", "from where `film` looks")
    json: bool = option(False, "print what `info` finds as JSON")
    poses: Path | None = option(
        None, "table of motion capture, CSV or TRC, that `plot` draws beside the log", "FILE"
    )
    markers: tuple[str, ...] = option(
        (), "its markers at the rear of the head and in front, or one body", "NAME", ["--poses"]
    )
    unit: float | None = option(
        None, "its unit of length [m], else as it says", "FLOAT", ["--poses"], gt=0, le=1000
    )
    up: Literal["x", "y", "z"] | None = option(
        None, "its axis that points up, else found", needs=["--poses"]
    )
    mirrored: bool = option(False, "it is left-handed, or has y down as images", needs=["--poses"])


def command(argv: Sequence[str]) -> int:
    """Look at one log."""
    argv = _with_action(argv)
    _, options = parse("log", DESCRIPTION, Params, argv, LogOptions)
    if not options.log:
        raise ConfigError("expected the name of a log or of a run, found none")
    path = log_of(Path(options.log))
    if options.video_view != "above" and options.action != "film":
        raise ConfigError(f"--video-view: expected `film` beside it, found {options.action}")
    if options.poses is not None and options.action != "plot":
        raise ConfigError(f"--poses: expected `plot` beside it, found {options.action}")
    if options.action == "info":
        for flag, given in (("--out", options.out is not None), ("--overwrite", options.overwrite)):
            if given:
                raise ConfigError(f"{flag}: expected no file for `info`, found one")
        return _info(path, options)
    if options.json:
        raise ConfigError(f"--json: expected `info` beside it, found {options.action}")
    target = _target(path, options)
    require_new(target, options.overwrite)
    actions: Mapping[str, Callable[[Path, Path], LogReader]] = {
        "recover": _recover,
        "export": _export,
        "plot": _plot if options.poses is None else partial(_plot_poses, options=options),
        "film": partial(_film, view=options.video_view),
    }
    place = target.resolve()
    remove_abandoned(place.parent, place.name.__eq__)
    log = actions[options.action](path, target)
    recovered = options.action == "recover"
    more = f"; {left_out(log)}" if recovered else ""
    done = "drawn into" if options.action in ("plot", "film") else "written to"
    show_result({}, options, (), f"{log.ticks} ticks were {done} {target}{more}.")
    if recovered:
        say_unguarded("log", log)
        return OK
    return complain("log", log)


def _with_action(argv: Sequence[str]) -> Sequence[str]:
    """The words of the command with `info` where a log stands first."""
    word, *more = argv or ["-"]
    if word in _ACTIONS or word.startswith("-"):
        return argv
    if word.endswith(".mcap") or "/" in word or Path(word).exists():
        return ["info", *argv]
    if more and not more[0].startswith("-"):
        return argv
    raise ConfigError(
        f"expected a log, the folder of a run, or one of {', '.join(_ACTIONS)}, found {shown(word)}"
    )


def _target(path: Path, options: LogOptions) -> Path:
    """The file to write."""
    endings = _ENDINGS[options.action]
    stem = f"{path.stem}{RECOVERED}" if options.action == "recover" else path.stem
    stem += "" if options.poses is None else "-poses"
    target = options.out or path.with_name(stem + endings[0])
    if target.suffix not in endings:
        raise ConfigError(f"--out: expected a name with {' or '.join(endings)}, found {target}")
    if target.exists() and any(p.exists() and target.samefile(p) for p in parts(path)):
        raise ConfigError(f"--out: expected another file than the log, found {target}")
    if _would_continue(target, path):
        raise ConfigError(
            f"--out: expected a name that does not continue the log {path}, found {target}"
        )
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
        kinds = (*JOINTS[1:], *MOTION)
        measured = {name for tick in log for name in kinds if getattr(tick, name)}
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
    arrow, parquet = require_parquet(str(target), ", or write a .csv")
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


def _plot_poses(path: Path, target: Path, options: LogOptions) -> LogReader:
    from antennate.figures import render  # slow to import
    from antennate.telemetry.figure import path_of
    from antennate.telemetry.mocap import poses_of

    table = options.poses or path
    poses = poses_of(path, table, options.markers, options.unit, options.up, options.mirrored)
    show_result({}, options, (), poses.sentence())
    for warning in poses.warnings():
        sys.stderr.write(f"antennate log: warning: {table}: {warning}\n")
    figure = path_of(poses)
    write_whole(target, render(figure)[target.suffix.removeprefix(".")], overwrite=True)
    return poses.log.reader


def _film(path: Path, target: Path, view: FilmView) -> LogReader:
    from antennate.telemetry.film import PICTURE_SIZE, encoded, require_video  # slow to import
    from antennate.telemetry.log_film import film_of

    with LogReader(path) as log:
        require_video()
        film = film_of(log, arena_of(path, log.header), path.name).seen_from(view)
    require_room(target, PICTURE_SIZE * len(film.t))
    with (
        progress("pictures of the film") as step,
        stop_signals(),
        writing_whole(target, overwrite=True) as file,  # opened before anything is drawn
    ):
        file.write(encoded(film, step))
    return log


def _info(path: Path, options: LogOptions) -> int:
    with LogReader(path) as log:
        result = _result(log, log.survey())
    show_result(result, options, [_table(result)], _sentence(result))
    return complain("log", log)


def _result(log: LogReader, survey: Survey) -> dict[str, Any]:
    header = log.header
    events = ((time, EVENTS.decode(data)["msg"]) for time, data in survey.events)
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
        "duration_s": 1e-9 * (survey.last - survey.first),
        "messages": {topic.name: count for topic, count in survey.messages.items()},
        "events": [{"time_ns": time, "text": text} for time, text in events],
        "missing": log.missing,
        "damaged": log.bad,
        "closed": log.end is not None,
        "guarded": log.guarded,
    }


def _table(result: Mapping[str, Any]) -> Table:
    events, start = result["events"], result["start_ns"]
    walks = [e["text"].startswith(_WALKS) for e in events]
    begun = walks.index(True) if True in walks else 0
    lines = [
        f"before it could walk, {_line(e, start, _CAUSES.sub('', e['text']))}"
        for e in events[:begun]
    ]
    lines += [_line(e, start, e["text"]) for e in events[begun:]]
    if (hidden := len(events) - 2 * _SHOWN) > 0:
        lines[_SHOWN:-_SHOWN] = [f"... {hidden} more events; --json has all"]
    rows = [(name, [str(count)]) for name, count in result["messages"].items()]
    if begun:
        lines.insert(0, f"At the end: {_line(events[-1], start, events[-1]['text'])}")
    note = "\n".join(map(one_line, lines))
    return Table(f"Log of {one_line(result['controller'])}", ["messages"], rows, note)


def _line(event: Mapping[str, Any], start: int, text: str) -> str:
    """When something happened, and what."""
    return f"{1e-9 * (event['time_ns'] - start):.2f} s {text}"


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


def complain(command: str, log: LogReader) -> int:
    """Say on stderr what of a log could not be read: the exit code of the command."""
    say_unguarded(command, log)
    if not log.bad and not log.missing:
        return OK
    place = ""
    if log.bad:
        first = log.damage[0]
        place = f"; first at byte {first.offset} of {first.path.name}: {first.reason}"
    sys.stderr.write(
        f"antennate {command_words(command)}: error: {log.path}: expected an undamaged log, found "
        f"damaged places: {log.bad}; ticks missing: {log.missing}; ticks read: {log.ticks}{place}\n"
    )
    return BAD_INPUT


def say_unguarded(command: str, log: LogReader) -> None:
    """Say on stderr that bytes of a log may have changed unnoticed."""
    if not log.guarded:
        sys.stderr.write(
            f"antennate {command_words(command)}: {log.path}: written by another program without "
            "CRCs, so damage to its numbers is not noticed\n"
        )


VIEW_DESCRIPTION = """\
Show the log of a drive or of a simulation on a page of this computer: the robot, charts of what was
read and decided, and a map. It works without a network; over ssh, forward the port that it tells.

A run with several logs wants the name of one. Ctrl-C ends it."""


@dataclass(frozen=True)
class ShownOptions(LiveOptions):
    """What to show, and where."""

    shown: Path | None = option(None, "a log, or the folder of a run", "RUN|LOG", positional=True)
    port: int = option(PAGE_PORT, "port of the page, 0 takes any", "PORT", ge=0, le=65535)
    speed: float = option(
        1.0, "times real time at which it begins, 0 as fast as it goes", "FLOAT", ge=0, le=100
    )


def view(argv: Sequence[str]) -> int:
    """Show one log on a page until Ctrl-C."""
    _, options = parse("view", VIEW_DESCRIPTION, Params, argv, ShownOptions)
    if options.shown is None:
        raise ConfigError("expected a log or the folder of a run, found none")
    from antennate.telemetry import Restart
    from antennate.telemetry.view.player import LogPlayer
    from antennate.telemetry.view.process import ViewProcess

    path = log_of(options.shown)
    with LogReader(path) as log:
        header = log.header
    arena = arena_of(path, header)  # first, as an import may swallow a signal, and one alone counts
    with (
        stop_signals(last=True),
        contextlib.suppress(KeyboardInterrupt),  # that is how it ends
        ViewProcess(
            options.port, MODULE, options.port_for_foxglove, "--port", ros=place_of(options)
        ) as page,
    ):
        player = LogPlayer(page.channel, header, str(path), options.speed, arena)
        while not page.channel.closed:
            with contextlib.suppress(Restart), LogReader(path) as log:
                player.begin()
                player.play(log)
                _say_damage(player, log)
                player.rest()
        raise page.lost()
    return OK


def _say_damage(player: LogPlayer, log: LogReader) -> None:
    """Say on the page what of a log could not be read."""
    if log.bad or log.missing:
        player.say(f"damaged places in this log: {log.bad}; ticks missing: {log.missing}")
    if not log.guarded:
        player.say("no CRC guards this log: damage to its numbers is not noticed")


def arena_of(path: Path, header: Header) -> World | None:
    """The world of a trial as the log or its run has it, None where neither tells."""
    if header.trial is None:
        return None
    from antennate.sim.trial import draw_trial, scene_of  # slow to import

    try:
        config = _trial_of(path, header)
        if config is None:
            return None
        gait, period = header.params.gait, header.params.period
        seed = config.seed if header.seed is None else header.seed
        config = config.model_copy(update={"seed": seed})
        return draw_trial(config, scene_of(config), header.trial, gait, period).world
    except FAILURES:
        return None  # the log is shown all the same, on a bare floor


def _trial_of(path: Path, header: Header) -> TrialConfig | None:
    """The configuration of a trial, None where nothing tells.

    A log may come from elsewhere, so that of a scene in code of its own only the run can tell.
    """
    from antennate.sim.scenes.registry import SHIPPED  # slow to import
    from antennate.sim.trial import TrialConfig

    if header.arena.get("scene") in SHIPPED:
        return from_values(TrialConfig, {**header.arena, "robot": header.robot})
    if path.parent.name != LOGS:
        return None
    run = RunDirectory.open(path.parent.parent)
    name = command_of(run)
    model = experiments.load(name).config if name in experiments.names() else None
    if model is None or not issubclass(model, TrialConfig):
        return None
    return run.config(model)
