"""`antennate study merge`: the shards of a run put together."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence, Set
from pathlib import Path
from typing import NamedTuple

from pydantic.dataclasses import dataclass

from antennate import experiments
from antennate.cli.arguments import parse
from antennate.cli.experiment import Options, carry_out, shard_of
from antennate.cli.options import option
from antennate.cli.results import ResultOptions
from antennate.errors import BadInputError, ConfigError
from antennate.params.base import Params
from antennate.studies.identity import differences
from antennate.studies.pool import places_of
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import SHARD, read_as
from antennate.studies.trial_file import TRIALS, Content, read_trials

DESCRIPTION = """\
Put the shards of one run together: the table and the result are the same as without shards.

Each shard is the folder of the same command with --shard I/N. All of them must be complete, of the
same configuration, versions and code."""

_NAMED = 3
"""Most missing shards that an error names."""


@dataclass(frozen=True)
class MergeOptions(ResultOptions):
    """Which shards, and where the run goes."""

    shards: tuple[Path, ...] = option((), "folders of all shards", "SHARD", positional=True)
    no_figures: bool = option(False, "draw no figures")


def command(argv: Sequence[str]) -> int:
    """Write the run."""
    _, options = parse("merge", DESCRIPTION, Params, argv, MergeOptions, without=["config"])
    if not options.shards:
        raise ConfigError("merge: expected the folders of all shards, found none")
    shards = _gathered(options.shards)
    name = str(shards.identity["command"])
    if name not in experiments.names():
        raise BadInputError(f"{options.shards[0]}: expected trials of an experiment, found {name}")
    experiment = experiments.load(name)
    config = RunDirectory.open(options.shards[0]).config(experiment.config)
    how = {name: getattr(options, name) for name in ("out", "overwrite", "json", "no_figures")}
    return carry_out(experiment, argv, config, Options(**how, workers=1), shards)


class _Part(NamedTuple):
    """Part of a run that a shard holds: the I-th of N parts of all trials."""

    number: int
    parts: int
    trials: int

    @property
    def places(self) -> range:
        """Trials of the part."""
        return range(self.number - 1, self.trials, self.parts)


def _part(text: str) -> _Part:
    """What the file of a shard says."""
    match json.loads(text):
        case {"shard": str(name), "of": int(trials)} if (part := shard_of(name)) and trials >= 0:
            return _Part(*part, trials)
        case _:
            raise ValueError("no shard I/N of a number of trials")


def _gathered(shards: Sequence[Path]) -> Content:
    """What all shards say is run, and their trials."""
    found = Content()
    parts: list[_Part] = []
    for shard in shards:
        if not (shard / SHARD).is_file():
            raise BadInputError(f"{shard}: expected a complete shard, found no {SHARD}")
        parts.append(read_as(shard / SHARD, _part))
        RunDirectory.open(shard).versions()  # one that was cut is refused
        content = read_trials(shard / TRIALS)
        found.identity = found.identity or content.identity
        if changes := differences(found.identity, content.identity):
            raise BadInputError(
                f"{shard}: expected a shard of the same run as {shards[0]}, found {changes}"
            )
        _require_whole(shard, parts[-1], places_of(content.records))
        found.records |= content.records
        found.processors += content.processors
    _require_all(parts[0], places_of(found.records))
    return found


def _require_whole(shard: Path, part: _Part, trials: Set[int]) -> None:
    """Check that a shard, which was complete, has lost none of its trials."""
    sound = sum(place in part.places for place in trials)
    if sound < len(part.places):
        raise BadInputError(
            f"{shard / TRIALS}: expected {len(part.places)} finished trials, found {sound}: the "
            f"file is damaged; run this shard again, with --shard {part.number}/{part.parts} "
            f"--resume --out {shard}"
        )


def _require_all(part: _Part, trials: Set[int]) -> None:
    """Check that all shards are there, by one of them and the trials of all of them."""
    counts = Counter(place % part.parts for place in trials)
    missing = [
        f"{first + 1}/{part.parts}"
        for first in range(min(part.parts, part.trials))
        if counts[first] < len(range(first, part.trials, part.parts))
    ]
    if missing:
        named = ", ".join(missing[:_NAMED]) + (", …" if missing[_NAMED:] else "")
        raise BadInputError(
            f"merge: expected {part.trials} finished trials, found {len(trials)}: a shard is "
            f"missing: {named}"
        )
