"""Words of the command of an experiment: its configuration, and how it is run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import parse
from antennate.cli.options import ViewOptions, fields_of, option
from antennate.cli.results import ResultOptions
from antennate.errors import ConfigError
from antennate.experiments import FITTED, fitted
from antennate.messages import command_words
from antennate.params.base import Params
from antennate.robots.spec import ROBOTS
from antennate.studies.engines import BATCHED, EVERYWHERE, FORMS, LOCAL
from antennate.studies.experiment import Experiment
from antennate.studies.pool import TIMEOUT
from antennate.telemetry import FilmView


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
