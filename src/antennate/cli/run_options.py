"""The flags that say where trials are run, and the workers that they ask for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.options import option
from antennate.cli.results import ResultOptions
from antennate.errors import ConfigError
from antennate.messages import shortened, typed
from antennate.studies.engines import BATCHED, EVERYWHERE, LOCAL, make_engine
from antennate.studies.pool import TIMEOUT, Workers, core_count


@dataclass(frozen=True)
class RunOptions(ResultOptions):
    """How to run; nothing here changes a result, but for another engine."""

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
    )
    shard: str | None = option(None, "run one of N parts, for `antennate study merge`", "I/N")
    slurm: tuple[str, ...] = option(
        (), "what SLURM is asked for, as timeout_min=60", "NAME=VALUE", needs=["--engine slurm"]
    )
    trial_timeout: float | None = option(
        None,
        f"give a trial up after this time [s], else {TIMEOUT:g}; unless said, one worker waits on",
        gt=0,
    )


def workers_of(options: RunOptions, closed: bool, apart: bool) -> Workers:
    """The workers that are asked for; see `Workers`. They are given the store later.

    Raises:
        ConfigError: The engine or the shard is nothing of the kind.
        MissingPackageError: The package of the engine is not installed.
    """
    shard, engine = _shard(options.shard), make_engine(options.engine, options.slurm)
    how: dict[str, Any] = {"timeout": options.trial_timeout, "retry": options.retry}
    count = options.workers or core_count()
    return Workers(count, engine, shard=shard, closed=closed, apart=apart, **how)


OF_WORKERS = ("workers", "engine", "slurm", "shard", "resume", "retry", "trial_timeout")
"""Options that only trials on workers have."""
_MOST_SHARDS = 999_999
_SAID_ANEW = {"--out": 1, "--overwrite": 0, "--no-overwrite": 0, "--resume": 0, "--no-resume": 0}
"""Flags that are left out of the words that go on, and how many values each has."""


def go_on(command: str, argv: Sequence[str], folder: Path) -> str:
    """The whole command that goes on with the interrupted run of a folder, ready to be pasted.

    Args:
        command: Name of the command.
        argv: Words that it was given.
        folder: The folder of the run.
    """
    kept: list[str] = []
    values = 0
    for word in argv:
        name, given, _ = word.partition("=")
        count = _SAID_ANEW.get(name.replace("_", "-"))
        if count is not None:
            values = 0 if given else count
        elif values:
            values -= 1
        else:
            kept.append(word)
    return typed(command, *kept, "--out", str(folder), "--resume")


def _shard(text: str | None) -> tuple[int, int] | None:
    """The part that is carried out, and of how many."""
    shard = None if text is None else shard_of(text)
    if text is not None and shard is None:
        raise ConfigError(
            f"--shard: expected I/N, I from 1 to N, N up to {_MOST_SHARDS}, found {shortened(text)}"
        )
    return shard


def shard_of(text: str) -> tuple[int, int] | None:
    """Which part, and of how many, I/N names; None if it names none."""
    found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
    number, count = (int(found[1]), int(found[2])) if found else (0, 0)
    return (number, count) if 1 <= number <= count else None
