"""Run the experiments that the claims need, one after the other, and judge every claim.

In the report the claims stand each with its criterion, its numbers and its figure.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Literal

from antennate import experiments
from antennate.experiments import FITTED, fitted
from antennate.messages import command_words
from antennate.params.base import Params, number, put_over, read_file
from antennate.params.control import ConditioningParams
from antennate.studies.columns import tabular
from antennate.studies.experiment import Experiment
from antennate.studies.pool import Workers, workers_from
from antennate.studies.run_files import REPORT
from antennate.studies.tables import Table
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate_lab.reproduce.antenna_claims import ANTENNA
from antennate_lab.reproduce.robot_claims import ROBOT
from antennate_lab.reproduce.verdict import (
    MEANINGS,
    VERDICTS,
    Claim,
    Finding,
    Row,
)

CLAIMS: tuple[Claim, ...] = (*ANTENNA, *ROBOT)
"""All claims, in the order of the page."""
_CALIBRATE = {"averaging_time": ConditioningParams().averaging_time}
"""The paper averages readings; a controller of ours does it over this time by default."""
QUICK: Mapping[str, Mapping[str, Any]] = {
    "antenna": {},
    "calibrate": _CALIBRATE,
    "force": {"profiles": ("descending",), "traverses": 6},
    "touch": {"profiles": ("descending",), "speeds": (0.1,), "trials": 2},
    "sweep": {"profiles": ("descending",)},
    "gait": {"cycles": 2, "settling_cycles": 1, "sweep_points": 8},
    "wall": {"trials": 6},
    "tunnel": {"trials": 10},
}
"""Settings of each experiment with `quick`."""
FULL: Mapping[str, Mapping[str, Any]] = {
    **{name: {} for name in QUICK},
    "calibrate": _CALIBRATE,
    "tunnel": {"trials": 100},
}
"""Settings of each experiment without `quick`: defaults, and more tunnels."""
_FULL_FITTED: Mapping[str, Mapping[str, Any]] = {"wall": {"trials": 200}, "tunnel": {"trials": 200}}
"""Settings beside numbers that were fitted; other experiments have those of FULL."""
_WORK = {"calibrate": 2, "force": 1, "touch": 4, "sweep": 28, "gait": 3, "wall": 16, "tunnel": 86}
"""Processor time of each experiment with `quick` [s]: what a bar counts; of others at most 1."""
_MORE = {"force": 8, "touch": 22, "sweep": 5, "gait": 3, "wall": 3, "tunnel": 10}
"""How many times as long an experiment takes without `quick`."""
_MORE_FITTED = {"wall": 33, "tunnel": 20}
"""How many times as long with fitted numbers."""
_WITHOUT_CHANCE = {"gait"}
"""Takes a seed only for draws of what is not known, and draws nothing here."""
_LOOK = {
    "reproduced": "good",
    "conditional": "fair",
    "fitted": "muted",
    "not_reproduced": "bad",
    "undecided": "muted",
}


Setting = Literal["default", "fitted"]


class ReproduceConfig(Params):
    """Everything that decides the outcome of `antennate reproduce`."""

    quick: bool = number(False, "1", "assumed: all trials")
    """Few trials: minutes in place of half an hour, and wider intervals."""
    setting: Setting = number("default", "1", "assumed: as anybody runs them")
    """Numbers that the paper does not give: our defaults, or fitted to it where a part has some."""
    seed: int = number(7, "1", "assumed: any; nothing was chosen on it", ge=0)
    """Seed of all chance, in every experiment."""


@tabular
class ReproduceResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "reproduce"
    quick: bool
    """Whether there were few trials."""
    setting: Setting
    """Numbers that the paper does not give: `default`, or `fitted` to it where a part has some."""
    seed: int
    """Seed of all chance."""
    interrupted: bool
    """Whether claims are missing because it was stopped."""
    verdicts: dict[str, int]
    """Claims with each verdict: `reproduced`, `conditional`, `fitted`, `not_reproduced` and
    `undecided`."""
    claims: list[Row]
    """Each claim that was judged."""


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
                claim=claim.claim,
                criterion=claim.criterion,
                rival=claim.rival,
                paper=claim.paper,
                ours=finding.ours,
                verdict=claim.verdict(finding),
                reason=claim.reason(finding),
                command=command(claim.experiment, self.config),
            )
            for claim, finding in self.judged
        ]

    def result(self) -> ReproduceResult:
        """What they come to."""
        counts = Counter(row.verdict for row in self.rows)
        return ReproduceResult(
            quick=self.config.quick,
            setting=self.config.setting,
            seed=self.config.seed,
            interrupted=self.interrupted,
            verdicts={name: counts[name] for name in VERDICTS},
            claims=self.rows,
        )


def claims(config: ReproduceConfig) -> tuple[Claim, ...]:
    """All claims, with what they can be at best at this setting."""
    return tuple(c.when_fitted() if is_fitted(c.experiment, config) else c for c in CLAIMS)


def is_fitted(name: str, config: ReproduceConfig) -> bool:
    """Whether an experiment runs with numbers that were fitted to the paper."""
    return config.setting == FITTED and name in fitted()


def configured(name: str, config: ReproduceConfig) -> Params:
    """The configuration of an experiment."""
    flags, base = _settings(name, config)
    return experiments.load(name).config.model_validate(put_over(base, flags))


def _settings(name: str, config: ReproduceConfig) -> tuple[dict[str, Any], dict[str, Any]]:
    """Flags of an experiment, and its fitted numbers, over which no flag stands."""
    model, base = experiments.load(name).config, dict[str, Any]()
    flags = dict((QUICK if config.quick else FULL).get(name, {}))
    if is_fitted(name, config):
        base = read_file(fitted()[name], model).model_dump(exclude_unset=True)
        flags |= {} if config.quick else _FULL_FITTED.get(name, {})
        flags = {key: value for key, value in flags.items() if key not in base}
    chance = "seed" in model.model_fields and name not in _WITHOUT_CHANCE
    return flags | ({"seed": config.seed} if chance else {}), base


def judge(name: str, result: Any, config: ReproduceConfig) -> list[tuple[Claim, Finding]]:
    """What the result of an experiment says of its claims."""
    own = (claim for claim in claims(config) if claim.experiment == name)
    return [(c, c.judge(result, *(configured(n, config) for n in c.beside))) for c in own]


def command(name: str, config: ReproduceConfig) -> str:
    """The command that runs this part alone."""
    file = ["--config", FITTED] if is_fitted(name, config) else []
    flags = _flags(_settings(name, config)[0])
    return shlex.join(["antennate", *command_words(name).split(), *file, *flags])


def _flags(values: Mapping[str, Any], prefix: str = "--") -> list[str]:
    words: list[str] = []
    for key, value in values.items():
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
    """Run everything and judge it. What was judged before an interruption is kept."""
    judged: list[tuple[Claim, Finding]] = []
    more = {n: (_MORE_FITTED if is_fitted(n, config) else _MORE).get(n, 1) for n in QUICK}
    work = {n: _WORK.get(n, 1) * (1 if config.quick else more[n]) for n in QUICK}
    before, every = 0, claims(config)
    for name, own in work.items():
        experiment = experiments.load(name)

        def step(done: int, total: int, before: int = before, own: int = own) -> None:
            on_step(100 * (before + own * done // total) // sum(work.values()), 100)

        setting = configured(name, config)
        try:
            result = experiment.run(setting, workers_from(workers), step, no_row).result()
        except KeyboardInterrupt:
            result = None
        if result is None or getattr(result, "interrupted", False):
            return ReproduceOutcome(config, tuple(judged), interrupted=True)
        step(1, 1)
        before += own
        new = judge(name, result, config)
        judged += new
        for row in ReproduceOutcome(config, tuple(new), interrupted=False).rows:
            on_row(row)
    judged.sort(key=lambda pair: every.index(pair[0]))
    return ReproduceOutcome(config, tuple(judged), interrupted=False)


def tables(result: ReproduceResult) -> Sequence[Table]:
    """All claims with their verdicts."""
    rows = [
        (row.claim, [row.criterion, row.paper, row.ours, VERDICTS[row.verdict]])
        for row in result.claims
    ]
    note = f"Reasons and figures: {REPORT}. Seed {result.seed}{_with(result)}."
    return (Table("Claims", ["criterion", "paper", "ours", "verdict"], rows, note),)


def sentence(result: ReproduceResult) -> str:
    """How many claims hold."""
    few = " With --quick the intervals are wide." if result.quick else ""
    unjudged = len(CLAIMS) - len(result.claims)
    left = f", {unjudged} not judged" if unjudged else ""
    return f"Of {len(CLAIMS)} claims{_with(result)}: {_counts(result)}{left}.{few}"


def _with(result: ReproduceResult) -> str:
    """With which numbers, if these are not our defaults."""
    fits = result.setting == FITTED
    return ", with numbers fitted to the paper where a part has some" if fits else ""


def _counts(result: ReproduceResult) -> str:
    """How many claims have each verdict."""
    return ", ".join(f"{result.verdicts.get(name, 0)} {text}" for name, text in VERDICTS.items())


def body(result: ReproduceResult, figures: Mapping[str, str]) -> str:
    """HTML of a result, with the figure of each claim by its name."""
    summary = _counts(result)
    how = "few trials (--quick)" if result.quick else "all trials"
    names = {claim.claim: claim for claim in CLAIMS}
    words = "".join(f"<dt>{VERDICTS[name]}</dt><dd>{MEANINGS[name]}</dd>" for name in VERDICTS)
    rows = [(row, names.get(row.claim)) for row in result.claims]
    index = "".join(_line(row, claim.name if claim else "") for row, claim in rows)
    sections = "".join(
        _section(row, claim.name, _as_judged(claim, row).rule, figures.get(claim.name, ""))
        for row, claim in rows
        if claim is not None
    )
    return (
        "<h2>The paper, claim by claim</h2>"
        "<p>A Robust Antenna Provides Tactile Feedback in a Multi-legged Robot, "
        "arXiv:2603.07795, beside what antennate finds in simulation. Claims are in our words.</p>"
        f"<p><strong>{summary}.</strong></p>"
        f'<p class="muted">{how}, seed {result.seed}{_with(result)}. '
        f"Intervals are 95 %.</p><dl>{words}</dl>"
        "<table><thead><tr><th>claim</th><th class=wide>criterion</th><th class=wide>paper</th>"
        "<th class=wide>ours</th>"
        f"<th>verdict</th></tr></thead><tbody>{index}</tbody></table>{sections}"
    )


def _as_judged(claim: Claim, row: Row) -> Claim:
    """The claim with what it could be at best in a row of a result."""
    return claim.when_fitted() if f"--config {FITTED}" in row.command else claim


def _verdict(row: Row) -> str:
    """A verdict in its colour."""
    return f'<span class="{_LOOK[row.verdict]}">{VERDICTS[row.verdict]}</span>'


def _line(row: Row, name: str) -> str:
    """A line of the table, which leads to the claim's section."""
    return (
        f'<tr><td><a href="#{name}">{escape(row.claim)}</a></td>'
        f"<td class=wide>{escape(row.criterion)}</td>"
        f"<td class=wide>{escape(row.paper)}</td><td class=wide>{escape(row.ours)}</td>"
        f"<td>{_verdict(row)}</td></tr>"
    )


def _section(row: Row, name: str, rule: str, figure: str) -> str:
    """All that is said of a claim, with its figure."""
    facts = {
        "criterion": escape(rule),
        "paper": escape(row.paper),
        "ours": escape(row.ours),
        "verdict": _verdict(row),
        "why": escape(row.reason),
    }
    words = "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in facts.items())
    return (
        f'<section id="{name}"><h2>{escape(row.claim)}</h2>'
        f"<dl>{words}</dl>"
        f"<div>{figure}<p><code>{escape(row.command)}</code></p></div></section>"
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    ReproduceConfig,
    run,
    tables,
    sentence,
    result=ReproduceResult,
    row=Row,
    body=body,
    counted="% of reproduce",
    captions={claim.name: f"{claim.claim}." for claim in CLAIMS},
)
