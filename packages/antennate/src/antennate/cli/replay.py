"""`antennate log replay`: the readings of a log decided upon again."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import parse
from antennate.cli.log import arena_of, complain
from antennate.cli.options import ViewOptions, option
from antennate.cli.pages import page_of, say_by_hand
from antennate.cli.results import ResultOptions, folder_for, show_result
from antennate.cli.terminal import BAD_INPUT, OK
from antennate.control.readings import OWN, YOKED, Readings, condition, short_names
from antennate.errors import ConfigError
from antennate.messages import one_line, shortened
from antennate.studies.columns import Column, shown
from antennate.studies.formats import csv_lines
from antennate.studies.report import View
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import log_of
from antennate.studies.tables import Table
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import (
    ReplayConfig,
    Replayed,
    changed_readings,
    recorded_controller,
    replay,
)
from antennate.types import Maneuver

DESCRIPTION = """\
Let the controller of a log decide upon the recorded readings again, or another one in its place,
and compare. The same code decides the same, bit by bit. Damaged parts of a log are left out and
named; the exit code is 2 then, and where the controller fails."""
TICKS = "ticks.csv"
_NO_STATE = "none"
"""State of ticks without a supervisor, as in a simulation."""
COUNTS = (
    Column("different", "maneuvers that differ", form="d"),
    Column("different_commands", "commands that differ", form="d"),
    Column("failures", "failures", form="d"),
    Column("missing", "ticks missing", form="d"),
)


@dataclass(frozen=True)
class ReplayOptions(ViewOptions, ResultOptions):
    """Which log, and what to leave behind."""

    log: str = option("", "log, or the folder of a run with one", "RUN|LOG", positional=True)
    donor: str = option(
        "", "log, or the folder of a run with one, whose readings are given as yoked", "RUN|LOG"
    )
    out: Path | None = option(
        None, "folder for result.json, ticks.csv and a figure; none if not given", "FOLDER"
    )


def command(argv: Sequence[str]) -> int:
    """Replay one log."""
    config, options = parse("replay", DESCRIPTION, ReplayConfig, argv, ReplayOptions)
    if not options.log:
        raise ConfigError("expected the name of a log or of a run, found none")
    path = log_of(Path(options.log))
    if bool(options.donor) != (config.readings == YOKED):
        raise ConfigError(
            f"--readings {YOKED}: expected --donor with the log of another trial, found none"
            if config.readings == YOKED
            else f"--donor: expected --readings {YOKED} beside it, found {config.readings}"
        )
    log, replayed, by_hand = _replayed(path, config, options)
    log.require_ticks()
    result = _result(log, replayed, config)
    if options.out is not None:
        with folder_for(VIEW, options, config, argv) as folder:
            _keep(folder, path, replayed)
            say_by_hand(by_hand, folder)
            folder.finish(result)
    show_result(result, options, VIEW.tables(result), VIEW.sentence(result))
    return max(complain("replay", log), BAD_INPUT if replayed.failures else OK)


def _replayed(
    path: Path, config: ReplayConfig, options: ReplayOptions
) -> tuple[LogReader, Replayed, Sequence[str]]:
    """The log, what came of its replay, and what was changed by hand on a page."""
    page = page_of(options)
    if page is None:
        with LogReader(path) as log:
            controller = recorded_controller(log.header, config.controller)
            readings = _readings(log, config, options)
            return log, replay(log, controller, log.header, readings=readings), ()
    from antennate.telemetry import Restart
    from antennate.telemetry.view.player import ReplayPlayer

    with page:
        while True:
            with contextlib.suppress(Restart), LogReader(path) as log:
                player = ReplayPlayer(
                    page.channel,
                    log.header,
                    title=str(path),
                    speed=options.view_speed,
                    arena=arena_of(path, log.header),
                    name=config.controller,
                )
                player.state["paused"] = options.view_paused
                player.tell()
                ticks = player.ticks(log)
                readings = _readings(log, config, options)
                decide = (player.controller, log.header, player.decided)
                return log, replay(ticks, *decide, readings), player.by_hand


def _readings(log: LogReader, config: ReplayConfig, options: ReplayOptions) -> Readings:
    """What the controller is given upon a log."""
    if not options.donor:
        return changed_readings(log.header, config.readings, None)
    with LogReader(log_of(Path(options.donor))) as donor:
        return changed_readings(log.header, config.readings, donor, donor.header)


def _result(log: LogReader, replayed: Replayed, config: ReplayConfig) -> dict[str, Any]:
    header, ticks = log.header, max(1, log.ticks)
    name = config.controller or header.controller
    first = replayed.first
    return {
        "log": str(log.path),
        "parts": [part.name for part in log.parts],
        "version": header.version,
        "recorded_controller": condition(header.controller, header.readings),
        "controller": condition(
            name, header.readings if config.readings == OWN else config.readings
        ),
        "seed": header.seed,
        "trial": header.trial,
        "ticks": log.ticks,
        "duration_s": replayed.end - replayed.start,
        "recorded_shares": {m.name: replayed.recorded[m] / ticks for m in Maneuver},
        "shares": {m.name: replayed.maneuvers.count(m) / ticks for m in Maneuver},
        "states": {state or _NO_STATE: n / ticks for state, n in replayed.states.items()},
        "different": replayed.different,
        "first_difference": None
        if first is None
        else {
            "tick": first.number,
            "time_s": first.now,
            "recorded": Maneuver.label(first.recorded),
            "replayed": Maneuver.label(first.replayed),
        },
        "different_commands": replayed.commands,
        "failures": replayed.failures,
        "failure": replayed.failure,
        "missing": log.missing,
        "damaged": log.bad,
        "closed": log.end is not None,
    }


def _tables(result: Mapping[str, Any]) -> Sequence[Table]:
    then = {"shares": result["recorded_shares"], "states": result["states"]}
    now = {**result, "states": {}}
    done = [m.name for m in Maneuver if then["shares"][m.name] + now["shares"][m.name]]
    measures = [
        Column(f"shares.{name}", name, "% of ticks", form=".1f", scale=100.0) for name in done
    ]
    for name in () if set(result["states"]) == {_NO_STATE} else result["states"]:
        label = one_line(f"supervisor {name}")
        measures.append(Column(f"states.{name}", label, "% of ticks", form=".1f", scale=100.0))
    note = (
        f"{result['ticks']} ticks, {shown(result['duration_s'])} s, in "
        f"{one_line(', '.join(result['parts']))}.\n"
        f"Recorded by {one_line(result['recorded_controller'])}, antennate "
        f"{one_line(result['version'])}; "
        f"{_ending(result)}."
    )
    name = one_line(result["controller"])
    columns = {"recorded": then, short_names([name])[name]: now}
    return (Table.of("Replay", columns, (*measures, *COUNTS), note),)


def _ending(result: Mapping[str, Any]) -> str:
    """Whether all of the log is there."""
    if result["damaged"] or result["missing"]:
        return "the log is damaged"
    return "the log is complete" if result["closed"] else "not ended: its program was killed"


def _sentence(result: Mapping[str, Any]) -> str:
    """What came out, in one sentence."""
    ticks, different = result["ticks"], result["different"]
    if failures := result["failures"]:
        why = shortened(result.get("failure", "") or "an exception")
        return f"The controller failed in {failures} of {ticks} ticks, first by this: {why}."
    if different:
        first = result["first_difference"]
        return (
            f"The controller decided otherwise in {different} of {ticks} ticks, first in tick "
            f"{first['tick']} at {shown(first['time_s'])} s: {first['replayed']} for "
            f"{first['recorded']}."
        )
    if commands := result["different_commands"]:
        return (
            f"The controller decided as recorded in all {ticks} ticks, but its commands differ in "
            f"{commands} of them."
        )
    return f"The controller decided as recorded in all {ticks} ticks."


VIEW = View("replay", DESCRIPTION, ReplayConfig, _tables, _sentence)


def _keep(folder: RunDirectory, path: Path, replayed: Replayed) -> None:
    """Write the table and the figure, each in a further pass over the log."""
    from antennate.telemetry.figure import Course
    from antennate.telemetry.figure import replay as draw

    with LogReader(path) as log:
        ticks = zip(log, replayed.maneuvers, strict=True)
        rows = (tick.row(log.header.robot) | {"replayed": maneuver} for tick, maneuver in ticks)
        folder.write(TICKS, csv_lines(rows))
    if replayed.maneuvers:
        with LogReader(path) as log:
            figure = draw(Course.of(log, len(replayed.maneuvers), replayed.maneuvers))
        folder.write_figures({"replay": figure})
