"""The experiment `ringdown`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.ringdown.run import ANIMAL_CYCLE, REJECTED, RingdownConfig, run
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown

MODE = (
    Measure("natural_hz", "frequency without damping", "Hz", form=".3f"),
    Measure("swing_hz", "frequency of the swing", "Hz", form=".3f"),
    Measure("damping", "damping ratio", form=".3f"),
    Measure("cycle_s", "one cycle", "ms", form=".0f", scale=1e3),
    Measure("rejected", "rejected in the first cycle", "%", form=".1f", scale=100.0),
)
ANIMAL = (
    Measure("natural_hz", "frequency", "Hz", form=".0f"),
    Measure("damping", "damping ratio"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The first mode twice, chains beside a cone, and animals."""
    difference = result["difference"]
    swings = {"engine": result["engine"], "chain": result["chain"]}
    swings |= {f"chain of {row['name']}": row for row in result.get("beside", ())}
    note = (
        f"Engine over chain: frequency {100 * difference['natural_hz']:+.2f} %, damping "
        f"{100 * difference['damping']:+.2f} %.\nRejected within the {1e3 * ANIMAL_CYCLE:.0f} ms "
        f"of a cockroach's cycle: {100 * result['rejected_in_animal_cycle']:.0f} %."
    )
    cones = Table(
        "First frequency of a cone as a chain",
        ["over the closed form"],
        [(f"{row['hinges']} hinges", [shown(row["ratio"], ".4f")]) for row in result["cones"]],
    )
    animals = {row["name"]: _without_equal_ends(row) for row in result["animals"]}
    found = "\n".join(
        f"{row['name']}: {row['finding']} ({row['source']})" for row in animals.values()
    )
    return (
        Table.of("First mode", swings, MODE, note),
        cones,
        Table.of("What animals do", animals, ANIMAL, found),
    )


def _without_equal_ends(row: Mapping[str, Any]) -> dict[str, Any]:
    """An animal with one number in place of an interval whose ends are equal."""
    keys = ("natural_hz", "damping")
    single = {key: row[key][0] for key in keys if row[key] and row[key][0] == row[key][1]}
    return {**row, **single}


def sentence(result: Mapping[str, Any]) -> str:
    """How the antenna recovers, beside an animal."""
    engine = result["engine"]
    enough = engine["rejected"] > REJECTED and engine["cycle_s"] <= 1.2 * ANIMAL_CYCLE
    times = engine["cycle_s"] / ANIMAL_CYCLE
    beside = "as fast as a cockroach's" if enough else f"{times:.1f} times a cockroach's"
    if engine["rejected"] <= REJECTED:
        beside += f", which rejects over {100 * REJECTED:.0f} %"
    return (
        f"The tip rejects {100 * engine['rejected']:.0f} % of a deflection in its first cycle of "
        f"{1e3 * engine['cycle_s']:.0f} ms, {beside}; simulated, not measured."
    )


CAPTIONS = {
    "ringdown": "The swing of the antenna after it is let go, animals beside it, and a "
    "cone as a chain.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    RingdownConfig,
    lambda config, *_: run(config),
    tables,
    sentence,
    filmed=True,
    captions=CAPTIONS,
    explained="docs/results.md",
    on_workers=False,
)
