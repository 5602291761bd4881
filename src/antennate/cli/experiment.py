"""The command of an experiment: parse, run, keep, draw, tell."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import parse
from antennate.cli.exit_codes import BAD_INPUT, INTERRUPTED, OK
from antennate.cli.options import option
from antennate.cli.progress import progress, stop_signals
from antennate.cli.results import ResultOptions, folder_for, tell
from antennate.cli.view_options import ViewOptions, require_one_worker, tell_by_hand, view_of
from antennate.errors import ConfigError, OutputError
from antennate.experiments.running import keep, require_films, write_films
from antennate.params.base import Params
from antennate.studies.experiment import Experiment, OnStep, Outcome
from antennate.studies.pool import core_count
from antennate.studies.run_directory import LOGS, RunDirectory
from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class Options(ResultOptions):
    """How to run; nothing here changes a result."""

    workers: int | None = option(None, "processes to use, else one for each core", "INT", ge=1)
    no_figures: bool = option(False, "draw no figures")


@dataclass(frozen=True)
class LogOptions(Options):
    """The same where trials can be logged."""

    log: bool = option(False, "keep the log of every trial, in logs/CONTROLLER-TRIAL.mcap")


@dataclass(frozen=True)
class ShownOptions(ViewOptions, Options):
    """The same where it can be watched."""


@dataclass(frozen=True)
class FilmOptions(Options):
    """The same where something can be filmed."""

    video: bool = option(False, "film one trial of each condition, drawn without a display")


@dataclass(frozen=True)
class TrialFilmOptions(FilmOptions):
    """The same where there are trials to film."""

    video_trial: int = option(0, "trial that --video films", "INT", ge=0)


def _options(experiment: Experiment[Any, Any]) -> type[Options]:
    """What can be said of an experiment."""
    kinds: list[type[Options]] = []
    if experiment.logged is not None:
        kinds.append(LogOptions)
    if experiment.viewed is not None:
        kinds.append(ShownOptions)
    if experiment.films is not None:
        has_trials = "trials" in experiment.config.model_fields
        kinds.append(TrialFilmOptions if has_trials else FilmOptions)
    if not kinds:
        return Options
    chosen: Any = dataclass(frozen=True)(type("Chosen", tuple(kinds), {}))
    return chosen


def _filmed(options: Options) -> int | None:
    """The trial to film, None for none.

    Raises:
        ConfigError: A trial is named, but no film is wanted.
    """
    trial = getattr(options, "video_trial", 0)
    if isinstance(options, FilmOptions) and options.video:
        return trial
    if trial:
        raise ConfigError("--video-trial: expected --video beside it, found none")
    return None


def command(experiment: Experiment[Any, Any], argv: Sequence[str]) -> int:
    """Run the command of an experiment and return its exit code.

    Raises:
        AntennateError: As below, or something given cannot be used.
    """
    config, options = parse(
        experiment.name, experiment.description, experiment.config, argv, _options(experiment)
    )
    experiment.check(config)
    trial = _filmed(options)
    if trial is not None:
        require_films(experiment, config, trial)
    return carry_out(experiment, argv, config, options)


def carry_out(
    experiment: Experiment[Any, Any], argv: Sequence[str], config: Params, options: Options
) -> int:
    """Run what has been parsed.

    Raises:
        AntennateError: The physics became invalid, a worker died, or a file could not be written;
            what was measured is kept and shown first.
    """
    require_one_worker(options)
    with (
        view_of(options) as view,
        folder_for(experiment.view, options, config, argv) as run,
    ):
        with progress(experiment.parts) as step, stop_signals():
            outcome = _outcome(experiment, config, options, run, step, view)
        tell_by_hand(view, run)
        result = outcome.result()
        interrupted = bool(result.get("interrupted"))
        if interrupted and not outcome.rows:
            raise KeyboardInterrupt
        failure = _keep(experiment, outcome, options, run)
        tell(result, options, experiment.tables(result), experiment.sentence(result))
        if failure is not None:
            raise failure
        if interrupted:
            sys.stderr.write(
                f"antennate {experiment.name}: interrupted: kept {len(outcome.rows)} trials, all "
                "that had ended\n"
            )
        else:
            interrupted = not _film(experiment, config, options, run)
    if interrupted:
        return INTERRUPTED
    return BAD_INPUT if experiment.failed(result) else OK


def _outcome(
    experiment: Experiment[Any, Any],
    config: Params,
    options: Options,
    run: RunDirectory,
    step: OnStep,
    view: SimulationView | None,
) -> Outcome:
    """Run it: watched, logged, or neither."""
    logs = run.folder(LOGS) if isinstance(options, LogOptions) and options.log else None
    if view is not None and experiment.viewed is not None:
        return experiment.viewed(config, step, run.append, view, logs)
    how = (config, options.workers or core_count(), step, run.append)
    if logs is not None and experiment.logged is not None:
        return experiment.logged(*how, logs)
    return experiment.run(*how)


def _film(
    experiment: Experiment[Any, Any], config: Params, options: Options, run: RunDirectory
) -> bool:
    """Make the films that are wanted; False if that was interrupted."""
    trial = _filmed(options)
    if trial is None:
        return True
    try:
        with progress("% of the films") as step, stop_signals():
            write_films(experiment, config, trial, run, step)
    except KeyboardInterrupt:
        sys.stderr.write(f"antennate {experiment.name}: interrupted: kept all but some films\n")
        return False
    return True


def _keep(
    experiment: Experiment[Any, Any], outcome: Outcome, options: Options, run: RunDirectory
) -> OutputError | None:
    """Write what came out; the error that ended it, if any."""
    try:
        keep(experiment, outcome, run, figures=not options.no_figures)
    except OutputError as error:
        return error
    return None
