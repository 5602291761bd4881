"""The experiment `wall`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.antenna.statics import about
from antennate.experiments.wall import measures
from antennate.experiments.wall import run as wall
from antennate.experiments.wall.config import WallConfig
from antennate.experiments.wall.outcome import WallTrial
from antennate.sim.chain import require_solver
from antennate.studies.experiment import Experiment, Trials
from antennate.studies.measures import Table, few, successes


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The profiles, and the reference against each other one."""
    profiles = Table.of(
        "Profiles",
        result["profiles"],
        measures.PROFILE,
        f"Seed {result['seed']}, gravity {result['gravity']}. `after` leaves out the first "
        f"{1e3 * result['start_m']:g} mm of travel.\nMedians over trials; invalid trials are left "
        "out of them.",
        about(result["profiles"]),
    )
    pairs = Table.of(
        f"{wall.REFERENCE} (first) against each, trial by trial",
        {name.split("-")[1]: pair for name, pair in result["paired"].items()},
        measures.PAIR,
        "McNemar's test, exact, two-sided.",
    )
    return (profiles, pairs) if result["paired"] else (profiles,)


def sentence(result: Mapping[str, Any]) -> str:
    """Which profiles passed, how sure it is, and what it depends on."""
    profiles = result["profiles"]
    so_few = few(row["trials"] - row["invalid"] for row in profiles.values())
    text = f"Walls passed (95 % interval): {successes(profiles)}. {_border(result)}"
    return f"{text} {so_few}".strip()


def _border(result: Mapping[str, Any]) -> str:
    at, below, above = (result["border"][key] for key in ("at_mm", "below_mm", "above_mm"))
    if below is None and above is None:
        return "No trial is valid, so nothing is known of jams."
    if below is None or above is None:
        lagged = "every trial the tip lagged" if below is None else "no trial did the tip lag"
        return f"In {lagged} more than {at:g} mm, the limit that counts as a jam."
    return (
        f"A trial is a jam if the base moves {at:g} mm while the tip stays. The nearest trials: "
        f"{at - below:.1f} mm below and {above - at:.1f} mm above this limit."
    )


def _none_valid(result: Mapping[str, Any]) -> bool:
    """Whether a profile has trials, and all of them are invalid."""
    return any(0 < p["trials"] == p["invalid"] for p in result["profiles"].values())


CAPTIONS = {
    "wall": "Outcomes of the trials of each profile, over the whole travel and after the start.",
    "sticks": "The longest stick of every valid trial, and the border beyond which one is a jam.",
    "passages": "The first trial of each profile: advance of the tip, and shapes of "
    "the antenna along the wall.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, WallConfig, wall.run, tables, sentence),
    filmed=True,
    trials=Trials("profile", wall.every, wall.run_rows, 1, WallTrial),
    measures=measures.PROFILE,
    viewed=lambda config, on_step, on_row, view, logs: wall.run(config, 1, on_step, on_row, view),
    check=require_solver,
    failed=_none_valid,
    captions=CAPTIONS,
    explained="docs/results.md",
)
