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
from antennate.errors import OutputError
from antennate.params.base import Params
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.pool import core_count
from antennate.studies.run_directory import LOGS, RunDirectory


@dataclass(frozen=True)
class Options(ResultOptions):
    """How to run; nothing here changes a result."""

    workers: int | None = option(None, "processes to use, else one for each core", "INT", ge=1)
    no_figures: bool = option(False, "draw no figures")


@dataclass(frozen=True)
class LogOptions(Options):
    """The same where trials can be logged."""

    log: bool = option(False, "keep the log of every trial, in logs/CONTROLLER-TRIAL.mcap")


def command(experiment: Experiment[Any, Any], argv: Sequence[str]) -> int:
    """Run the command of an experiment and return its exit code.

    Raises:
        AntennateError: As below, or something given cannot be used.
    """
    kind = Options if experiment.logged is None else LogOptions
    config, options = parse(experiment.name, experiment.description, experiment.config, argv, kind)
    experiment.check(config)
    return carry_out(experiment, argv, config, options)


def carry_out(
    experiment: Experiment[Any, Any], argv: Sequence[str], config: Params, options: Options
) -> int:
    """Run what has been parsed.

    Raises:
        AntennateError: The physics became invalid, a worker died, or a file could not be written;
            what was measured is kept and shown first.
    """
    with folder_for(experiment.name, options, config, argv) as run:
        with progress(experiment.parts) as step, stop_signals():
            how = (config, options.workers or core_count(), step, run.append)
            if isinstance(options, LogOptions) and options.log and experiment.logged is not None:
                outcome = experiment.logged(*how, run.folder(LOGS))
            else:
                outcome = experiment.run(*how)
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
    if interrupted:
        return INTERRUPTED
    return BAD_INPUT if experiment.failed(result) else OK


def _keep(
    experiment: Experiment[Any, Any], outcome: Outcome, options: Options, run: RunDirectory
) -> OutputError | None:
    """Write files, rows, result and figures; the error that ended it, if any."""
    try:
        for name, content in experiment.files(outcome).items():
            run.write(name, content)
        run.finish(outcome.result(), outcome.rows)
        if not options.no_figures:
            run.write_figures(experiment.figures(outcome))
    except OutputError as error:
        return error
    return None
