"""The experiment `force`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.antenna.statics import about
from antennate.experiments.force import run as force
from antennate.experiments.force.loads import ForceConfig
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown

PARTS = {
    "at rest": "statics.frictionless",
    "with friction": "statics.friction",
    "dragged": "traverses",
}
"""Where a result holds each part."""
EXPLAINED = tuple(
    measure
    for name, path in PARTS.items()
    for place in ("known", "unknown")
    for measure in (
        Measure(f"{path}.{place}.flex.r2", f"{name}, place {place}"),
        Measure(f"{path}.{place}.flex.r2_95", "  95 %"),
    )
)
MEASURES = (Measure("force_max_n", "largest force", "N", form=".4f"), *EXPLAINED)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What flex explains, profile by profile."""
    shares = Table.of(
        "Share of the force that flex explains (R2)",
        result["profiles"],
        MEASURES,
        f"Places from {result['from_place']:g} of the length to the tip, hinges up to "
        f"{result['hinge_limit_deg']:g} deg; friction {result['friction']:g}.\n"
        "Place known: one curve for every place; unknown: one for all.\n"
        f"Intervals: over loads at rest and over {tested(result)} traverses, which served no fit, "
        "as if their overlaps\nwere drawn at random along the antenna. They are spread evenly: "
        "another seed moves R2 far less.",
        about(result["profiles"]),
    )
    return (shares,)


def tested(result: Mapping[str, Any]) -> int:
    """Traverses that the intervals of the dragged antenna are over."""
    each = (row["traverses"]["unknown"]["flex"] for row in result["profiles"].values())
    return min(row["groups"] for row in each)


def sentence(result: Mapping[str, Any]) -> str:
    """What flex explains at rest for the first profile of the paper."""
    profiles = result["profiles"]
    name = "descending" if "descending" in profiles else next(iter(profiles))
    rest = profiles[name]["statics"]["frictionless"]
    known, unknown = (rest[place]["flex"] for place in ("known", "unknown"))
    return (
        f"{name}: at rest, flex explains {shown(unknown['r2'])} of the force (95 % interval "
        f"{shown(unknown['r2_95'])}) where the place is unknown, {shown(known['r2'])} "
        f"({shown(known['r2_95'])}) where it is known."
    )


CAPTIONS = {
    "force": "Force over flex, at rest and on the move, and the share of the force "
    "that one reading explains.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    ForceConfig,
    force.run,
    tables,
    sentence,
    filmed=True,
    parts="profiles",
    captions=CAPTIONS,
    explained="docs/results.md",
)
