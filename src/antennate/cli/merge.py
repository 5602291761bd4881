"""`antennate merge`: the shards of one run as the run that they are parts of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli.arguments import parse
from antennate.cli.experiment import Shards, carry_out
from antennate.cli.options import option
from antennate.cli.run_options import Options
from antennate.errors import BadInputError, ConfigError
from antennate.params.base import Params
from antennate.studies.identity import differences
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import SHARD, VERSIONS
from antennate.studies.store import STORE, read_store

DESCRIPTION = """\
Put the shards of one run together: the table and the result are the same as without shards.

Each shard is the folder of the same command with --shard I/N. All of them must be complete, of the
same configuration, versions and code."""


@dataclass(frozen=True)
class MergeOptions:
    """Which shards, and where the run goes."""

    shards: tuple[Path, ...] = option((), "folders of all shards", "SHARD")
    out: Path | None = option(None, "folder for the run, else runs/COMMAND-N", "FOLDER")
    overwrite: bool = option(False, "replace the results that the folder holds", needs=["--out"])
    json: bool = option(False, "print the content of result.json and nothing else")
    no_figures: bool = option(False, "draw no figures")


def command(argv: Sequence[str]) -> int:
    """Write the run.

    Raises:
        AntennateError: A folder is no shard, trials are missing, or nothing can be written.
    """
    _, options = parse("merge", DESCRIPTION, Params, argv, MergeOptions)
    if not options.shards:
        raise ConfigError("--shards: expected the folders of all shards, found none")
    shards = _gathered(options.shards)
    name = str(shards.identity["command"])
    if name not in experiments.names():
        raise BadInputError(f"{options.shards[0]}: expected trials of an experiment, found {name}")
    experiment = experiments.load(name)
    config = RunDirectory.open(options.shards[0]).config(experiment.config)
    asked = Options(
        out=options.out,
        overwrite=options.overwrite,
        json=options.json,
        no_figures=options.no_figures,
        workers=1,
    )
    return carry_out(experiment, argv, config, asked, shards)


def _gathered(shards: Sequence[Path]) -> Shards:
    """What all shards say is run, and their trials.

    Raises:
        BadInputError: One is incomplete or damaged, or of another run.
    """
    identity: Any = None
    records: dict[str, Any] = {}
    processors: list[str] = []
    for shard in shards:
        if not (shard / SHARD).is_file():
            raise BadInputError(f"{shard}: expected a complete shard, found no {SHARD}")
        for name in (SHARD, VERSIONS):
            RunDirectory.open(shard).text(name)  # one that was cut is refused
        found = read_store(shard / STORE)
        if identity is not None and (changes := differences(identity, found.identity)):
            raise BadInputError(
                f"{shard}: expected a shard of the same run as {shards[0]}, found {changes}"
            )
        identity = identity or found.identity
        records |= found.records
        processors += found.processors
    return Shards(identity, records, processors)
