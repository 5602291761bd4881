"""A search: what is asked is checked, then designs are proposed, run and judged."""

from __future__ import annotations

from antennate.errors import ConfigError
from antennate.experiments.design.config import Axis, DesignConfig
from antennate.experiments.design.designs import DesignOutcome
from antennate.experiments.design.evaluate import ends_of, evaluators
from antennate.experiments.design.propose import package
from antennate.experiments.design.search import Search
from antennate.studies.experiment import OnRow, OnStep, no_row, no_step
from antennate.studies.pool import Workers, workers_from


def check(config: DesignConfig) -> None:
    """Find what cannot be run before anything is.

    Raises:
        BadInputError: Nothing is searched or judged, a name is unknown, a value out of bounds, an
            objective stands twice, or its experiment has not got it.
        MissingPackageError: Optuna is not installed.
    """
    _check_objectives(config)
    if not config.search:
        raise ConfigError("search: expected parameters, found none: the space is empty")
    for name, axis in config.search.items():
        if not isinstance(axis, Axis) and not axis:
            raise ConfigError(f"search.{name}: expected values, found none: the space is empty")
    found = evaluators(config)
    for name, value in ends_of(config):
        for evaluator in found:
            evaluator.configured({name: value}, f"search.{name}: ")
    for name, point in config.reference.items():
        for evaluator in found:
            evaluator.configured(point, f"reference.{name}: ")
    first = next(iter(config.reference.values()), dict([next(ends_of(config))]))
    for evaluator in found:
        evaluator.check(first)
    package()


def _check_objectives(config: DesignConfig) -> None:
    if not config.evaluate:
        raise ConfigError("evaluate: expected experiments that evaluate a design, found none")
    names = [objective.name for objective in config.objectives()]
    for label, asked in config.evaluate.items():
        if not (asked.maximize or asked.minimize):
            raise ConfigError(
                f"evaluate.{label}: expected measures to maximize or minimize, found none"
            )
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"evaluate.{name}: expected an objective once, found it twice")


def run(
    config: DesignConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> DesignOutcome:
    """Evaluate the references, search, and validate.

    Raises:
        BadInputError: As for `check`; or the store was begun with another version of Optuna.
        WorkerError: The workers cannot run anything.
    """
    search = Search(config, workers_from(workers), on_step, on_row)
    interrupted = False
    try:
        with search.workers.stay() as search.workers:
            search.begin()
            while len(search.asked) < config.proposals:
                search.proceed()
            search.validate()
    except KeyboardInterrupt:
        interrupted = True
    return search.outcome(interrupted)
