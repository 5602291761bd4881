"""The experiment `wall`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.wall import measures
from antennate.experiments.wall import run as wall
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table, successes


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The profiles, and the reference against each other one."""
    profiles = Table.of(
        "Profiles",
        result["profiles"],
        measures.PROFILE,
        f"Seed {result['seed']}, gravity {result['gravity']}. `after` leaves out the first "
        f"{1e3 * result['start_m']:g} mm of travel.\nMedians over trials; invalid trials are left "
        "out of them.",
    )
    pairs = Table.of(
        f"{wall.REFERENCE} (first) against each, trial by trial",
        {name.split("-")[1]: pair for name, pair in result["paired"].items()},
        measures.PAIR,
        "McNemar's test, exact, two-sided.",
    )
    return (profiles, pairs) if result["paired"] else (profiles,)


def sentence(result: Mapping[str, Any]) -> str:
    """Which profiles passed, and how sure it is."""
    return f"Walls passed (95 % interval): {successes(result['profiles'])}."


EXPERIMENT = Experiment.of_folder(
    __name__, wall.WallConfig, wall.run, tables, sentence, filmed=True
)
