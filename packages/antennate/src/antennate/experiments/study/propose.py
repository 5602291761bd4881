"""The proposals of Optuna's sampler: a function of the seed and of the results so far, in order.

Its storage is in memory and only proposes. A study of its own is made for each batch, and told all
results in order, so that what it proposes does not depend on how often a search was interrupted.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from antennate.errors import MissingPackageError
from antennate.messages import extra
from antennate.studies.plan import Axes, Point, Range

_SAMPLER = {"multivariate": True, "group": True, "constant_liar": True}
"""Parameters are drawn together, lists of each length by themselves, designs of a batch apart."""
_CANDIDATES = 100
"""Draws of which the sampler proposes the best; its own default of 24 finds a bowl's bottom a third
as well."""
Drawn = dict[str, int | float]
"""What the sampler draws: a number, the place of a choice, the entries of a list one by one."""
Goal = Literal["maximize", "minimize"]


@dataclass(frozen=True)
class Proposal:
    """What was drawn, and what became of it.

    Attributes:
        values: Each objective, None if it has no value; None if the design failed.
    """

    drawn: Drawn
    values: Sequence[float | None] | None


def package() -> Any:
    """Optuna."""
    try:
        return importlib.import_module("optuna")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "optuna":
            raise
        raise MissingPackageError(
            "plan: expected the package optuna, which proposes, found none; install it with "
            f"{extra('design')}"
        ) from None


def point_of(space: Axes, drawn: Drawn) -> Point:
    """The values of the parameters that were drawn."""
    point: Point = {}
    for name, axis in space.items():
        if not isinstance(axis, Range):
            point[name] = axis[int(drawn[name])]
        elif axis.entries is None:
            point[name] = drawn[name]
        else:
            values = [drawn[_entry(name, i)] for i in range(int(drawn[_count(name)]))]
            point[name] = sorted(values) if axis.rising else values
    return point


def propose(
    space: Axes, past: Sequence[Proposal], goals: Sequence[Goal], count: int, seed: int
) -> list[Drawn]:
    """The next proposals.

    Args:
        space: What is searched.
        past: All proposals before, in order.
        goals: Of each objective.
        count: How many are wanted.
        seed: Seed of the search.
    """
    optuna = package()
    number = int(np.random.SeedSequence([seed, len(past)]).generate_state(1)[0])
    with _quiet(optuna):
        sampler = optuna.samplers.TPESampler(seed=number, n_ei_candidates=_CANDIDATES, **_SAMPLER)
        study = optuna.create_study(directions=list(goals), sampler=sampler)
        worst = _worst(past, goals)
        for proposal in past:
            study.add_trial(_finished(optuna, space, proposal, worst))
        proposals: list[Drawn] = []
        for _ in range(count):
            trial = study.ask()
            _walk(optuna, space, functools.partial(_suggested, trial))
            proposals.append(dict(trial.params))
        return proposals


@contextlib.contextmanager
def _quiet(optuna: Any) -> Iterator[None]:
    """Without Optuna's own messages, and its remark that such a sampler is an experiment."""
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(before)


def _walk(optuna: Any, space: Axes, draw: Callable[[str, Any], int | float]) -> None:
    """Go through what is drawn: draw(name, distribution) -> number. How many follow may depend."""
    for name, axis in space.items():
        kind = _kind(optuna, axis)
        if isinstance(axis, Range) and axis.entries is not None:
            count = draw(_count(name), optuna.distributions.IntDistribution(*axis.entries))
            for i in range(int(count)):
                draw(_entry(name, i), kind)
        else:
            draw(name, kind)


def _kind(optuna: Any, axis: Sequence[Any] | Range) -> Any:
    """The distribution of one number, or of the place of a choice."""
    if not isinstance(axis, Range):
        return optuna.distributions.CategoricalDistribution(list(range(len(axis))))
    if axis.whole:
        return optuna.distributions.IntDistribution(int(axis.low), int(axis.high), log=axis.log)
    return optuna.distributions.FloatDistribution(axis.low, axis.high, log=axis.log)


def _suggested(trial: Any, name: str, kind: Any) -> Any:
    if hasattr(kind, "choices"):
        return trial.suggest_categorical(name, kind.choices)
    suggest = trial.suggest_float if isinstance(kind.low, float) else trial.suggest_int
    return suggest(name, kind.low, kind.high, log=kind.log)


def _worst(past: Sequence[Proposal], goals: Sequence[Goal]) -> list[float]:
    """The worst value known of each objective.

    It is told of a proposal without a value: Optuna takes no NaN, and with an infinite value it no
    longer weighs what lies on the front.
    """
    columns = zip(*(p.values for p in past if p.values is not None), strict=True)
    known = [[value for value in column if value is not None] for column in columns]
    known = known or [[] for _ in goals]
    return [
        (max if goal == "minimize" else min)(values, default=0.0)
        for goal, values in zip(goals, known, strict=True)
    ]


def _finished(optuna: Any, space: Axes, proposal: Proposal, worst: Sequence[float]) -> Any:
    """A proposal and its values as Optuna keeps them."""
    kinds: dict[str, Any] = {}

    def look(name: str, kind: Any) -> int | float:
        kinds[name] = kind
        return proposal.drawn[name]

    _walk(optuna, space, look)
    came = {"state": optuna.trial.TrialState.FAIL}
    if proposal.values is not None:
        pairs = zip(proposal.values, worst, strict=True)
        came = {"values": [least if value is None else value for value, least in pairs]}
    return optuna.trial.create_trial(params=proposal.drawn, distributions=kinds, **came)


def _count(name: str) -> str:
    return f"{name}.entries"


def _entry(name: str, i: int) -> str:
    return f"{name}[{i}]"
