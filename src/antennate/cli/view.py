"""`antennate log view`: a log on a page, or that of a run."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli import view_server
from antennate.cli.arguments import parse
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.progress import stop_signals
from antennate.cli.results import log_of
from antennate.cli.view_options import FoxgloveOptions, foxglove_of
from antennate.errors import AntennateError, ConfigError
from antennate.params.base import Params
from antennate.params.reading import from_values
from antennate.sim.scenes.registry import SHIPPED
from antennate.sim.trial import TrialConfig, draw_trial, scene_of
from antennate.sim.world import World
from antennate.studies.report import command_of
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOGS
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.view import ports
from antennate.telemetry.view.pace import Restart
from antennate.telemetry.view.player import LogPlayer
from antennate.telemetry.view.process import ViewProcess

DESCRIPTION = """\
Show the log of a drive or of a simulation on a page of this computer: the robot, charts of what was
read and decided, and a map. It works without a network; over ssh, forward the port that it tells.

A run with several logs wants the name of one. Ctrl-C ends it."""


@dataclass(frozen=True)
class Options(FoxgloveOptions):
    """What to show, and where."""

    shown: Path | None = option(None, "a log, or the folder of a run", "RUN|LOG", positional=True)
    port: int = option(ports.PAGE, "port of the page, 0 takes any", "PORT", ge=0, le=65535)
    speed: float = option(
        1.0, "times real time at which it begins, 0 as fast as it goes", "FLOAT", ge=0, le=100
    )


def command(argv: Sequence[str]) -> int:
    """Show one log until Ctrl-C.

    Raises:
        AntennateError: There is no such log, or the page cannot be served, or not any more.
    """
    _, options = parse("view", DESCRIPTION, Params, argv, Options)
    if options.shown is None:
        raise ConfigError("expected a log or the folder of a run, found none")
    path = log_of(options.shown)
    with LogReader(path) as log:
        header = log.header
    with (
        stop_signals(last=True),
        contextlib.suppress(KeyboardInterrupt),  # that is how it ends
        ViewProcess(options.port, view_server.__name__, foxglove_of(options), "--port") as page,
    ):
        player = LogPlayer(page.channel, header, str(path), options.speed, arena_of(path, header))
        while not page.channel.closed:
            with contextlib.suppress(Restart), LogReader(path) as log:
                player.begin()
                player.play(log)
                _complain(player, log)
                player.rest()
        raise page.lost()
    return OK


def _complain(player: LogPlayer, log: LogReader) -> None:
    """Say on the page what of a log could not be read."""
    if log.bad or log.missing:
        player.say(f"damaged places in this log: {log.bad}; ticks missing: {log.missing}")
    if not log.guarded:
        player.say("no CRC guards this log: damage to its numbers is not noticed")


def arena_of(path: Path, header: Header) -> World | None:
    """The world of a trial as the log or its run has it, None where neither tells."""
    if header.trial is None:
        return None
    try:
        config = _trial_of(path, header)
        if config is None:
            return None
        gait, period = header.params.gait, header.params.period
        seed = config.seed if header.seed is None else header.seed
        config = config.model_copy(update={"seed": seed})
        scene = scene_of(config)
        return draw_trial(config, scene, header.trial, gait, period).world
    except AntennateError:
        return None  # the log is shown all the same, on a bare floor


def _trial_of(path: Path, header: Header) -> TrialConfig | None:
    """The configuration of a trial, None where nothing tells.

    A log may come from elsewhere, so that of a scene in code of its own only the run can tell.
    """
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
