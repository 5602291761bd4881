"""The command of an experiment: parse, run, keep, draw, tell."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from antennate.cli.arguments import Options, parse
from antennate.cli.exit_codes import INTERRUPTED, OK
from antennate.cli.progress import progress, terminate_as_interrupt
from antennate.cli.tables import print_table
from antennate.errors import OutputError
from antennate.params import Params
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.formats import to_json
from antennate.studies.run_directory import RunDirectory


def command(experiment: Experiment[Any, Any], argv: Sequence[str]) -> int:
    """Run the command of an experiment and return its exit code.

    Raises:
        AntennateError: As below, or something given cannot be used.
    """
    config, options = parse(experiment.name, experiment.description, experiment.config, argv)
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
    with RunDirectory.create(experiment.name, options.out, options.overwrite) as run:
        run.describe(config, ["antennate", experiment.name, *argv])
        outcome = _measure(experiment, config, options, run)
        result = outcome.result()
        interrupted = bool(result.get("interrupted"))
        if interrupted and not outcome.rows:
            raise KeyboardInterrupt
        failure = _keep(experiment, outcome, options, run)
        if options.json:
            sys.stdout.write(to_json(result))
        else:
            for table in experiment.tables(result):
                print_table(table)
            sys.stdout.write(f"{experiment.sentence(result)}\n")
        if failure is not None:
            raise failure
        if interrupted:
            sys.stderr.write(
                f"antennate {experiment.name}: interrupted: kept {len(outcome.rows)} trials, all "
                "that had ended\n"
            )
        sys.stderr.write(f"written to {run.path}\n")
    return INTERRUPTED if interrupted else OK


def _measure(
    experiment: Experiment[Any, Any], config: Params, options: Options, run: RunDirectory
) -> Outcome:
    with progress(experiment.parts) as step, terminate_as_interrupt():
        return experiment.run(config, options.worker_count, step, run.append)


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
