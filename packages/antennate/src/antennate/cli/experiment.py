"""The command of an experiment: parse, run, keep, draw, print."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import as_typed, parse
from antennate.cli.options import ViewOptions, fields_of, flag_of, option
from antennate.cli.results import ResultOptions, drawn_table, folder_for, show_result
from antennate.cli.terminal import BAD_INPUT, INTERRUPTED, OK, progress, stop_signals, told
from antennate.errors import FAILURES, BadInputError, ConfigError, OutputError, raised
from antennate.experiments import FITTED, fitted, is_explained
from antennate.experiments.running import keep, names_of, require_films, write_films
from antennate.messages import command_words, shortened, typed
from antennate.params.base import Params
from antennate.robots.spec import ROBOTS
from antennate.studies.engines import (
    BATCHED,
    EVERYWHERE,
    FORMS,
    LOCAL,
    WARP,
    NoMore,
    make_engine,
)
from antennate.studies.experiment import Experiment, RunOutcome
from antennate.studies.formats import to_json
from antennate.studies.identity import code_named, differences, environment, identity
from antennate.studies.pool import TIMEOUT, ShardEnd, Workers, core_count
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import LOGS, RESULT, SHARD
from antennate.studies.tables import Interim, Table
from antennate.studies.trial_file import Content
from antennate.studies.work import package_of
from antennate.telemetry import FilmView

if TYPE_CHECKING:
    from antennate.telemetry.view.simulation import SimulationView


@dataclass(frozen=True)
class RunOptions(ResultOptions):
    """How to run; nothing among these changes a result, but for another engine."""

    workers: int | None = option(None, "processes to use, else one for each core", "INT", ge=1)
    no_figures: bool = option(False, "draw no figures")
    resume: bool = option(
        False, "go on with the run that the folder holds, if there is one", needs=["--out"]
    )
    retry: bool = option(
        False, "resume, and run crashed or hung trials again, if there are any", needs=["--out"]
    )
    engine: str = option(
        LOCAL,
        f"where the workers are: {', '.join(EVERYWHERE)}; for tunnel and studies of it "
        f"also {', '.join(BATCHED)}",
        "ENGINE",
        examples=[form for form in FORMS if ":" not in form],
    )
    shard: str | None = option(None, "run one of N parts, for `antennate study merge`", "I/N")
    slurm: tuple[str, ...] = option(
        (), "what SLURM is asked for, as timeout_min=60", "NAME=VALUE", needs=["--engine slurm"]
    )
    trial_timeout: float | None = option(
        None,
        f"give a trial up after this time [s]; else after {TIMEOUT:g}, with one worker never",
        gt=0,
    )
    video: bool = option(False, "film one trial of each condition, drawn without a display")
    video_trial: int = option(0, "trial that --video films", "INT", needs=["--video"], ge=0)
    video_view: FilmView = option("above", "from where --video looks", needs=["--video"])


@dataclass(frozen=True)
class Options(ViewOptions, RunOptions):
    """All options of experiments; `_without` says which of them one has not."""

    log: bool = option(False, "keep the log of every trial or walk, in the folder logs")
    trust_code: bool = option(False, "run code of its own that the file names, as FILE.py:NAME")


@dataclass(frozen=True)
class FittedOptions(Options):
    """Options where numbers were fitted to the paper."""

    config: Path | None = option(
        None,
        f"TOML file of parameters, or the word {FITTED}: numbers that the paper does not give, "
        "fitted to it; flags override it",
        "FILE",
        examples=[FITTED],
    )


@dataclass(frozen=True)
class StudyOptions(Options):
    """Options where a file says what is run."""

    config: Path | None = option(None, "TOML file of the study or search", "FILE", positional=True)


@dataclass(frozen=True)
class AntennaOptions(Options):
    """Options where a file may hold an antenna alone."""

    config: Path | None = option(
        None,
        "robot, by its name or TOML file, or a TOML file of an antenna or of parameters, or the "
        f"word {FITTED}: numbers that the paper does not give; flags override it",
        "FILE",
        positional=True,
        optional=True,
        examples=[*ROBOTS, FITTED],
    )


OF_WORKERS = ("workers", "engine", "slurm", "shard", "resume", "retry", "trial_timeout")
"""Options that only trials on workers have."""


def _without(experiment: Experiment[Any, Any]) -> Sequence[str]:
    """Fields of the options that this experiment has not."""
    has = {
        OF_WORKERS: experiment.workers != "none",
        ("engine", "slurm"): experiment.workers == "anywhere",
        ("video", "video_trial"): experiment.films is not None,
        ("video_view",): experiment.films is not None and "robot" in experiment.config.model_fields,
        ("video_trial",): "trials" in experiment.config.model_fields,
        tuple(fields_of(ViewOptions)): experiment.shown,
        ("log",): experiment.logs is not None,
        ("trust_code",): experiment.continued,
    }
    return [name for names, there in has.items() if not there for name in names]


def command(experiment: Experiment[Any, Any], argv: Sequence[str]) -> int:
    """Run the command of an experiment and return its exit code."""
    config, options = parsed(experiment, argv)
    if experiment.continued and options.config is None and "assumed" not in config.model_fields_set:
        raise ConfigError(
            f"expected a FILE that says what varies, as `{typed(experiment.name, 'FILE.toml')}`, "
            "found none"
        )
    config = experiment.settled(config, options.out if options.resume or options.retry else None)
    if options.video:
        require_films(experiment, config, options.video_trial)
    return carry_out(experiment, argv, config, options)


def parsed(experiment: Experiment[Any, Any], argv: Sequence[str]) -> tuple[Params, Options]:
    """Configuration and options of an experiment by the words of its command."""
    kind = FittedOptions if experiment.name in fitted() else Options
    kind = AntennaOptions if experiment.of_file else kind
    return parse(
        experiment.name,
        experiment.description,
        experiment.config,
        argv,
        StudyOptions if experiment.continued else kind,
        read=experiment.of_file,
        without=_without(experiment),
        file_of=lambda options: _file_of(experiment, options.config),
    )


def _file_of(experiment: Experiment[Any, Any], path: Path | None) -> Path | None:
    """The file to read; the word `fitted` is that of this package, if there is one."""
    if path is None or path != Path(FITTED):
        return path
    if (ours := fitted().get(experiment.name)) is None and not path.is_file():
        those = ", ".join(map(command_words, fitted()))
        raise ConfigError(
            f"expected a FILE, found {FITTED}, a word that only these take: {those}; "
            f"reproduce takes --setting {FITTED}"
        )
    if ours and path.is_file():
        raise ConfigError(
            f"--config: expected {FITTED} to be numbers of ours, found a file of that name, too; "
            "rename it, or run elsewhere"
        )
    return ours or path


def carry_out(
    experiment: Experiment[Any, Any],
    argv: Sequence[str],
    config: Params,
    options: Options,
    shards: Content | None = None,
) -> int:
    """Run what has been parsed, or put shards together that were run."""
    _require_possible(experiment, options, config)
    apart = experiment.continued or bool(code_named(config.model_dump(mode="json")))
    workers = _workers(options, apart) if shards is None else Workers(1, NoMore())
    kind = f"{experiment.name} --log" if options.log else experiment.name
    kind += " --engine warp" if options.engine.partition(":")[0] == WARP else ""
    what = identity(kind, config)
    if shards and (changes := differences(shards.identity, what)):
        hint = "; merge in the folder where the shards were run" if " is gone" in changes else ""
        raise BadInputError(f"expected shards of this version and code, found {changes}{hint}")
    with (
        stop_signals(),
        _view(options) as view,
        _folder(experiment, argv, config, options, what, shards) as run,
    ):
        if view is not None:
            view.results = str(run.path)
        films = options.video_trial if options.video else None
        run.require_free(names_of(experiment, config, not options.no_figures, films))
        run.keeps_trials = experiment.workers != "none"
        workers = replace(workers, trials=run.trials, shared=environment(kind, config))
        try:
            if shards and run.trials is not None:
                run.trials.take(shards)
            outcome = _outcome(experiment, config, options, workers, run, view)
        except KeyboardInterrupt:
            if shards is None and run.keeps_trials and run.can_go_on:
                again = _go_on(experiment.name, argv, run.path)
                sys.stderr.write(f"no result yet, but what has ended is kept\nto go on: {again}\n")
            raise
        except ShardEnd as end:
            part = {"shard": options.shard, "trials": end.count, "of": end.total}
            run.write(SHARD, to_json(part))
            run.kept = True
            sys.stderr.write(f"shard {options.shard}: {end.count} of {end.total} trials\n")
            return OK
        if view is not None:
            from antennate.cli.pages import say_by_hand  # as below

            say_by_hand(view.by_hand, run)
        return _end(experiment, config, options, run, outcome, None if shards else argv)


def _view(options: Options) -> contextlib.AbstractContextManager[SimulationView | None]:
    """The view that is wanted, None if none is.

    Raises:
        AntennateError: It cannot be served.
    """
    if not options.is_shown:
        return contextlib.nullcontext()
    from antennate.cli.pages import view_of  # imports much, for a page that few runs want

    return view_of(options)


def _require_possible(experiment: Experiment[Any, Any], options: Options, config: Params) -> None:
    """Refuse options that exclude one another, before the folder is touched.

    What is run beside a view is run in this process.
    """
    if options.is_shown:
        for name in OF_WORKERS:
            value = getattr(options, name)
            if value != fields_of(Options)[name].default and (name, value) != ("workers", 1):
                words = "one" if value is True else as_typed(value)
                raise ConfigError(
                    f"{flag_of((name,))}: expected none beside --view, --foxglove or --ros, "
                    f"which show one trial after the other, found {words}"
                )
    if options.shard is None:
        return
    finished = options.out is not None and (options.out / RESULT).exists()
    if finished and not options.overwrite:
        raise ConfigError(
            f"--shard: expected a folder without a finished run, found {RESULT} in {options.out}"
        )
    if why := experiment.unshared(config):
        raise ConfigError(f"--shard: {why}")


_MOST_SHARDS = 999_999


def shard_of(text: str) -> tuple[int, int] | None:
    """Which part, and of how many, I/N names; None if it names none."""
    match = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
    number, count = (int(match[1]), int(match[2])) if match else (0, 0)
    return (number, count) if 1 <= number <= count else None


def _workers(options: RunOptions, apart: bool) -> Workers:
    """The workers that are asked for; see `Workers`. They are given the file of trials later.

    Args:
        options: What is asked for.
        apart: Whether even one worker is a process of its own, which may crash or be killed.
    """
    shard = None if options.shard is None else shard_of(options.shard)
    if options.shard is not None and shard is None:
        raise ConfigError(
            f"--shard: expected I/N, I from 1 to N, N up to {_MOST_SHARDS}, found "
            f"{shortened(options.shard)}"
        )
    engine, count = make_engine(options.engine, options.slurm), options.workers or core_count()
    if apart and engine is None:
        from antennate.studies.processes import Processes  # only where there are some

        engine = Processes()
    return Workers(count, engine, shard, options.trial_timeout, options.retry)


def _folder(
    experiment: Experiment[Any, Any],
    argv: Sequence[str],
    config: Params,
    options: Options,
    identity: dict[str, Any],
    shards: Content | None,
) -> contextlib.AbstractContextManager[RunDirectory]:
    """The run directory; shards are put together in a new one."""
    how: dict[str, Any] = {}
    if shards:
        how = {"command": "merge"}
    elif experiment.workers != "none":
        resume = options.resume or options.retry or experiment.continued
        tasks = experiment.grows if options.shard is None else None
        how = {"resume": resume, "retry": options.retry, "tasks": tasks}
    return folder_for(experiment.view, options, config, argv, identity, **how)


def _outcome(
    experiment: Experiment[Any, Any],
    config: Params,
    options: Options,
    workers: Workers,
    run: RunDirectory,
    view: SimulationView | None,
) -> RunOutcome:
    """Run it: watched, logged, or neither."""
    how: dict[str, Any] = {} if view is None else {"view": view}
    if options.log and experiment.logs is not None:
        run.claim_names(f"{LOGS}/{name}" for name in experiment.logs(config))
        how["logs"] = run.path / LOGS
    interim = Interim(_conditions(config))

    def on_row(row: Any) -> None:
        run.append(row)
        interim.add(row)

    def table() -> Any:
        rows = interim.table()
        return None if rows is None else drawn_table(rows)

    with (
        progress(experiment.counted or experiment.name, table) as step,
        told(package_of(experiment.config)),
    ):
        return experiment.run(config, workers, step, on_row, **how)


def _conditions(config: Params) -> tuple[str, ...]:
    """Names of the conditions of a run in the order of its tables, if its configuration says."""
    values = (getattr(config, name, None) for name in ("conditions", "controllers", "profiles"))
    known = next((value for value in values if isinstance(value, tuple)), ())
    return tuple(map(str, known))


def _end(
    experiment: Experiment[Any, Any],
    config: Params,
    options: Options,
    run: RunDirectory,
    outcome: RunOutcome,
    argv: Sequence[str] | None,
) -> int:
    """Keep what came out, print it, and make the films; `argv` can be given again to go on."""
    found, title = experiment.placed(outcome.result(), run.path), experiment.view.title
    explained = "docs/results.md" if is_explained(experiment) else ""
    result = experiment.content(found)
    interrupted = bool(result.get("interrupted"))
    again = ""
    if argv is not None and interrupted and run.keeps_trials and run.can_go_on:
        again = f"to go on: {_go_on(experiment.name, argv, run.path)}\n"
    if interrupted and (options.shard is not None or not outcome.rows):
        sys.stderr.write(again)
        raise KeyboardInterrupt
    try:
        keep(experiment, config, outcome, result, run, figures=not options.no_figures)
    except OutputError:
        with contextlib.suppress(*FAILURES):
            show_result(result, options, *_shown(experiment, found), explained)
        raise
    show_result(result, options, *_shown(experiment, found), explained)
    if interrupted:
        number = len(outcome.rows)
        rest = f"kept {number} trial{'s' * (number != 1)}, all that had ended"
        sys.stderr.write(f"{title}: interrupted: {rest}\n{again}")
        return INTERRUPTED
    if options.video:
        try:
            with progress("% of the films") as step:
                write_films(experiment, config, options.video_trial, run, step, options.video_view)
        except KeyboardInterrupt:
            run.keeps_trials = True
            sys.stderr.write(f"{title}: interrupted: kept all but some films\n")
            return INTERRUPTED
    return BAD_INPUT if experiment.failed(found) else OK


def _shown(experiment: Experiment[Any, Any], result: Any) -> tuple[Sequence[Table], str]:
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


_GIVEN_AGAIN = {"--out": 1, "--overwrite": 0, "--no-overwrite": 0, "--resume": 0, "--no-resume": 0}
"""Flags that are left out of the words that go on, and how many values each has."""


def _go_on(command: str, argv: Sequence[str], folder: Path) -> str:
    """The whole command that goes on with the interrupted run of a folder, ready to be pasted."""
    words: list[str] = []
    values = 0
    for word in argv:
        name, given, _ = word.partition("=")
        count = _GIVEN_AGAIN.get(name.replace("_", "-"))
        if count is not None:
            values = 0 if given else count
        elif values:
            values -= 1
        else:
            words.append(word)
    return typed(command, *words, "--out", str(folder), "--resume")
