"""The command of an experiment: parse, run, keep, draw, tell."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import parse
from antennate.cli.exit_codes import BAD_INPUT, INTERRUPTED, OK
from antennate.cli.options import fields_of, flag_of, found, option
from antennate.cli.progress import progress, stop_signals
from antennate.cli.results import drawn_table, folder_for, tell
from antennate.cli.run_options import OF_WORKERS, RunOptions, go_on, workers_of
from antennate.cli.view_options import ViewOptions, say_by_hand, view_of
from antennate.errors import (
    AntennateError,
    BadInputError,
    ConfigError,
    LogError,
    OutputError,
    WorkerError,
    raised,
)
from antennate.experiments.running import keep, require_films, write_films
from antennate.messages import typed
from antennate.params.base import Params
from antennate.studies.engines import WARP
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.formats import to_json
from antennate.studies.identity import code_named, differences, environment, identity
from antennate.studies.measures import Interim, Table
from antennate.studies.pool import ShardEnd, Workers
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOGS, RESULT, SHARD, files_of
from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class FilmOptions(RunOptions):
    """What is filmed."""

    video: bool = option(False, "film one trial of each condition, drawn without a display")
    video_trial: int = option(0, "trial that --video films", "INT", needs=["--video"], ge=0)


@dataclass(frozen=True)
class Options(ViewOptions, FilmOptions):
    """All that can be said of an experiment; `_without` tells what one of them has not."""

    log: bool = option(False, "keep the log of every trial or walk, in the folder logs")
    trust_code: bool = option(False, "run code of its own that the file names, as FILE.py:NAME")


@dataclass(frozen=True)
class StudyOptions(Options):
    """The same where a file says what is run."""

    config: Path | None = option(None, "TOML file of the study or search", "FILE", positional=True)


def _without(experiment: Experiment[Any, Any]) -> Sequence[str]:
    """Fields of the options that this experiment has not."""
    has = {
        OF_WORKERS: experiment.on_workers,
        ("shard",): experiment.in_shards,
        ("video", "video_trial"): experiment.films is not None,
        ("video_trial",): "trials" in experiment.config.model_fields,
        tuple(fields_of(ViewOptions)): experiment.viewed is not None,
        ("log",): experiment.logged is not None,
        ("trust_code",): experiment.continued,
    }
    return [name for names, there in has.items() if not there for name in names]


def _filmed(options: Options) -> int | None:
    """The trial to film, None for none."""
    return options.video_trial if options.video else None


def command(experiment: Experiment[Any, Any], argv: Sequence[str]) -> int:
    """Run the command of an experiment and return its exit code.

    Raises:
        AntennateError: As below, or something given cannot be used.
    """
    config, options = parse(
        experiment.name,
        experiment.description,
        experiment.config,
        argv,
        StudyOptions if experiment.continued else Options,
        without=_without(experiment),
    )
    if experiment.continued and options.config is None and "assumed" not in config.model_fields_set:
        raise ConfigError(
            f"expected a FILE that says what varies, as `{typed(experiment.name, 'FILE.toml')}`, "
            "found none"
        )
    experiment.check(config)
    trial = _filmed(options)
    if trial is not None:
        require_films(experiment, config, trial)
    return carry_out(experiment, argv, config, options)


@dataclass(frozen=True)
class Shards:
    """Trials of all shards: their folders, what was run, records by key, and where they ran."""

    folders: Sequence[Path]
    identity: dict[str, Any]
    records: dict[str, Any]
    processors: Sequence[str]


def carry_out(
    experiment: Experiment[Any, Any],
    argv: Sequence[str],
    config: Params,
    options: Options,
    shards: Shards | None = None,
) -> int:
    """Run what has been parsed, or put shards together that were run.

    Raises:
        AntennateError: The physics became invalid, a worker died, or a file could not be written;
            what was measured is kept and shown first.
    """
    if options.view or options.foxglove:
        _require_viewable(options, config)
    _require_unfinished(options)
    apart = experiment.continued or bool(code_named(config.model_dump(mode="json")))
    workers = workers_of(options, closed=shards is not None, apart=apart)
    kind = f"{experiment.name} --log" if options.log else experiment.name
    kind += " --engine warp" if options.engine.partition(":")[0] == WARP else ""
    what = identity(kind, config)
    if shards and (changes := differences(shards.identity, what)):
        hint = "; merge in the folder where the shards were run" if " is gone" in changes else ""
        raise BadInputError(f"expected shards of this version and code, found {changes}{hint}")
    with (
        stop_signals(),
        view_of(options) as view,
        _folder(experiment, argv, config, options, what, shards) as run,
    ):
        if view is not None:
            view.results = str(run.path)
        run.keeps_store = experiment.continued or experiment.grows is not None
        workers = replace(workers, store=run.store, shared=environment(kind, config))
        try:
            if shards and run.store is not None:
                run.store.take(shards.records, shards.processors)
            outcome = _outcome(experiment, config, options, workers, run, view)
        except (LogError, OutputError, WorkerError):
            if shards:
                run.discard()
            run.keep_logs()
            raise
        except ShardEnd as end:
            told = {"shard": options.shard, "trials": end.count, "of": end.total}
            run.write(SHARD, to_json(told))
            run.keep()
            sys.stderr.write(f"shard {options.shard}: {end.count} of {end.total} trials\n")
            return OK
        say_by_hand(() if view is None else view.by_hand, run)
        return _end(experiment, config, options, run, outcome, None if shards else argv)


def _folder(
    experiment: Experiment[Any, Any],
    argv: Sequence[str],
    config: Params,
    options: Options,
    identity: dict[str, Any],
    shards: Shards | None,
) -> contextlib.AbstractContextManager[RunDirectory]:
    """The run directory; shards are put together in a new one, apart from theirs."""
    if shards:
        reads = [file for folder in shards.folders for file in files_of(folder)]
        how: dict[str, Any] = {"command": "merge", "reads": reads}
    elif experiment.on_workers:
        resume = options.resume or options.retry or experiment.continued
        tasks = experiment.grows if options.shard is None else None
        how = {"resume": resume, "retry": options.retry, "tasks": tasks}
    else:
        how = {}
    return folder_for(experiment.view, options, config, argv, identity, **how)


def _require_viewable(options: Options, config: Params) -> None:
    """Check that what is run beside a view can be shown: by the engine, in this process."""
    for name in OF_WORKERS:
        value = getattr(options, name)
        if value != fields_of(Options)[name].default and (name, value) != ("workers", 1):
            raise ConfigError(
                f"{flag_of((name,))}: expected none beside --view or --foxglove, which show one "
                f"trial after the other, found {'one' if value is True else found(value)}"
            )
    if getattr(config, "solver", "mujoco") != "mujoco":
        raise ConfigError(
            "--solver: expected mujoco beside --view or --foxglove, as nothing else draws, "
            "found chain"
        )


def _require_unfinished(options: Options) -> None:
    """Refuse a shard of what is finished, before the folder is touched."""
    finished = options.out is not None and (options.out / RESULT).exists()
    if options.shard is not None and finished and not options.overwrite:
        raise ConfigError(
            f"--shard: expected a folder without a finished run, found {RESULT} in {options.out}"
        )


def _outcome(
    experiment: Experiment[Any, Any],
    config: Params,
    options: Options,
    workers: Workers,
    run: RunDirectory,
    view: SimulationView | None,
) -> Outcome:
    """Run it: watched, logged, or neither."""
    if options.log:
        run.claim_names(f"{LOGS}/{name}" for name in experiment.logs(config))
    logs = run.folder(LOGS) if options.log else None
    interim = Interim()

    def keep(row: Any) -> None:
        run.append(row)
        interim.add(row)

    def table() -> Any:
        found = interim.table()
        return None if found is None else drawn_table(found)

    with progress(experiment.parts, table) as step:
        if view is not None and experiment.viewed is not None:
            return experiment.viewed(config, step, keep, view, logs)
        if logs is not None and experiment.logged is not None:
            return experiment.logged(config, workers, step, keep, logs)
        return experiment.run(config, workers, step, keep)


def _end(
    experiment: Experiment[Any, Any],
    config: Params,
    options: Options,
    run: RunDirectory,
    outcome: Outcome,
    argv: Sequence[str] | None,
) -> int:
    """Keep what came out, tell it, and make the films; `argv` can be given again to go on."""
    result = outcome.result()
    interrupted = bool(result.get("interrupted"))
    holds_trials = run.store is not None and run.store.holds_trials
    again = ""
    if argv is not None and interrupted and holds_trials:
        again = go_on(experiment.name, argv, run.path)
    if interrupted and (options.shard is not None or not outcome.rows):
        sys.stderr.write(f"to go on: {again}\n" if again else "")
        raise KeyboardInterrupt
    failure = _keep(experiment, outcome, options, run)
    try:
        tell(result, options, *_words(experiment, result), experiment.explained)
    except AntennateError:
        if failure is None:
            raise
    if failure is not None:
        raise failure
    if interrupted:
        sys.stderr.write(
            f"{experiment.view.title}: interrupted: kept {len(outcome.rows)} trials, all "
            "that had ended\n" + (f"to go on: {again}\n" if again else "")
        )
    elif _film(experiment, config, options, run):
        return BAD_INPUT if experiment.failed(result) else OK
    return INTERRUPTED


def _words(experiment: Experiment[Any, Any], result: Any) -> tuple[Sequence[Table], str]:
    """Tables and sentence of a result, checked, as an experiment may be anybody's code."""
    try:
        tables, sentence = [*experiment.tables(result)], experiment.sentence(result)
        if isinstance(sentence, str) and all(isinstance(table, Table) for table in tables):
            return tables, sentence
        found = f"{type(tables).__name__} and {type(sentence).__name__}"
    except Exception as error:  # noqa: BLE001 an experiment of anybody may raise anything
        found = raised(error)
    raise BadInputError(
        f"{experiment.name}: expected tables to return a list of Table and sentence a text, "
        f"found {found}; what was measured is kept"
    )


def _film(
    experiment: Experiment[Any, Any], config: Params, options: Options, run: RunDirectory
) -> bool:
    """Make the films that are wanted; False if that was interrupted."""
    trial = _filmed(options)
    if trial is None:
        return True
    try:
        with progress("% of the films") as step:
            write_films(experiment, config, trial, run, step)
    except KeyboardInterrupt:
        sys.stderr.write(f"{experiment.view.title}: interrupted: kept all but some films\n")
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
