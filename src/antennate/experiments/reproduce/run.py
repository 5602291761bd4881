"""Run the experiments that the claims need, one after the other, and judge every claim."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from antennate import experiments
from antennate.experiments.reproduce.bench_claims import ANTENNA
from antennate.experiments.reproduce.gait_claims import GAIT
from antennate.experiments.reproduce.tunnel_claims import TUNNEL
from antennate.experiments.reproduce.verdict import VERDICTS, Claim, Finding, Row, verdict
from antennate.experiments.reproduce.wall_claims import WALL
from antennate.messages import command_words
from antennate.params.base import Params, number
from antennate.params.control import ConditioningParams
from antennate.studies.experiment import OnRow, OnStep, no_row, no_step
from antennate.studies.pool import Workers, workers_from

CLAIMS: tuple[Claim, ...] = (*ANTENNA, *WALL, *GAIT, *TUNNEL)
"""All claims, in the order of the page."""
_CALIBRATE = {"averaging_time": ConditioningParams().averaging_time}
"""The paper averages readings; a controller of ours does it over this time by default."""
QUICK: Mapping[str, Mapping[str, Any]] = {
    "springs": {},
    "taper": {},
    "calibrate": _CALIBRATE,
    "force": {"profiles": ("descending",), "traverses": 6},
    "touch": {"profiles": ("descending",), "speeds": (0.1,), "trials": 2},
    "sweep": {"profiles": ("descending",)},
    "gait": {"cycles": 2, "settling_cycles": 1, "sweep_points": 8},
    "wall": {"trials": 6},
    "tunnel": {"trials": 10},
}
"""What each experiment is told with `quick`."""
FULL: Mapping[str, Mapping[str, Any]] = {
    **{name: {} for name in QUICK},
    "calibrate": _CALIBRATE,
    "tunnel": {"trials": 100},
}
"""What it is told otherwise: its defaults, and more tunnels."""
_WITHOUT_CHANCE = {"gait"}
"""Takes a seed only for draws of what is not known, and draws nothing here."""
_PARTS = 100


class ReproduceConfig(Params):
    """Everything that decides the outcome of `antennate reproduce`."""

    quick: bool = number(False, "1", "assumed: all trials")
    """Few trials: minutes in place of half an hour, and wider intervals."""
    seed: int = number(7, "1", "assumed: any; nothing was chosen on it", ge=0)
    """Seed of all chance, in every experiment."""


@dataclass(frozen=True, slots=True)
class ReproduceOutcome:
    """All claims that could be judged, with what was found."""

    config: ReproduceConfig
    judged: tuple[tuple[Claim, Finding], ...]
    interrupted: bool

    @property
    def rows(self) -> list[Row]:
        """One row a claim."""
        return [
            Row(
                *(c.claim, c.criterion, c.rival, c.paper, f.ours, verdict(f.holds, c.best)),
                *(f.reason, command(c.experiment, self.config)),
            )
            for c, f in self.judged
        ]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        found = Counter(row.verdict for row in self.rows)
        return {
            "schema": 1,
            "command": "reproduce",
            "quick": self.config.quick,
            "seed": self.config.seed,
            "interrupted": self.interrupted,
            "verdicts": {name: found[name] for name in VERDICTS},
            "claims": [asdict(row) for row in self.rows],
        }


def settings(name: str, config: ReproduceConfig) -> dict[str, Any]:
    """What an experiment is told."""
    told = dict((QUICK if config.quick else FULL)[name])
    fields = experiments.load(name).config.model_fields
    chance = "seed" in fields and name not in _WITHOUT_CHANCE
    return told | ({"seed": config.seed} if chance else {})


def command(name: str, config: ReproduceConfig) -> str:
    """The command that runs this part alone."""
    return shlex.join(["antennate", *command_words(name).split(), *_flags(settings(name, config))])


def _flags(told: Mapping[str, Any], prefix: str = "--") -> list[str]:
    words: list[str] = []
    for key, value in told.items():
        name = prefix + key.replace("_", "-")
        if isinstance(value, Mapping):
            words += _flags(value, f"{name}.")
        elif isinstance(value, tuple):
            words += [name, *map(str, value)]
        else:
            words += [name, str(value)]
    return words


def run(
    config: ReproduceConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> ReproduceOutcome:
    """Run everything and judge it. What was judged before an interruption is kept.

    Raises:
        AntennateError: An experiment failed.
    """
    judged: list[tuple[Claim, Finding]] = []
    names = list(QUICK)
    for i, name in enumerate(names):
        experiment = experiments.load(name)

        def step(done: int, total: int, before: int = _PARTS * i) -> None:
            on_step(before + _PARTS * done // total, _PARTS * len(names))

        told = experiment.config.model_validate(settings(name, config))
        try:
            result = experiment.run(told, workers_from(workers), step, no_row).result()
        except KeyboardInterrupt:
            return ReproduceOutcome(config, tuple(judged), interrupted=True)
        if result.get("interrupted"):
            return ReproduceOutcome(config, tuple(judged), interrupted=True)
        step(1, 1)
        new = [(claim, claim.judge(result)) for claim in CLAIMS if claim.experiment == name]
        judged += new
        for row in ReproduceOutcome(config, tuple(new), interrupted=False).rows:
            on_row(row)
    judged.sort(key=lambda pair: CLAIMS.index(pair[0]))
    return ReproduceOutcome(config, tuple(judged), interrupted=False)
