"""What is told of the trials of each profile, and of the reference against the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from antennate.experiments.wall.outcome import WallTrial
from antennate.studies import statistics
from antennate.studies.measures import Measure, largest, median, summarise

_COUNTS = {"successes": "success", "jams": "jam", "slips": "slip", "invalid": "invalid"}
"""Names of the counts, and the outcome that each counts."""
_WILSON = Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0)
PROFILE = (
    Measure("trials", "trials", form="d"),
    Measure("successes", "successes", form="d"),
    _WILSON,
    Measure("jams", "jams", form="d"),
    Measure("slips", "slips", form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("after_start.successes", "successes after", form="d"),
    Measure("after_start.wilson95", _WILSON.label, "%", form=".0f", scale=100.0),
    Measure("after_start.jams", "jams after", form="d"),
    Measure("after_start.slips", "slips after", form="d"),
    Measure("least_advance_mm", "least advance", "mm", of=median),
    Measure("longest_stick_mm", "longest stick", "mm", of=median, form=".1f"),
    Measure("longest_gap_s", "longest gap", "s", of=median),
    Measure("touched", of=median),
    Measure("force_mean_n", "contact force, mean", "N", of=median, form=".3f"),
    Measure("force_max_n", "contact force, largest", "N", of=largest),
    Measure("flex_max_deg", "flex, largest", "deg", of=largest, form=".0f"),
    Measure("hinge_max_deg", "angle of a hinge, largest", "deg", of=largest, form=".0f"),
)
_TEST = (
    ("only_first", "only the first succeeded", "d"),
    ("only_second", "only the second", "d"),
    ("mcnemar_p", "McNemar p", ".3g"),
)
PAIR = tuple(
    Measure(f"{part}{name}", f"{label}{after}", form=form)
    for part, after in (("", ""), ("after_start.", ", after"))
    for name, label, form in _TEST
)


def summary(rows: Sequence[WallTrial]) -> dict[str, Any]:
    """One profile in numbers, over the whole travel and after the start."""
    valid = [row for row in rows if row.outcome != "invalid"]
    return {
        **_counts([row.outcome for row in rows]),
        "after_start": _counts([row.outcome_after_start for row in rows]),
        **summarise(PROFILE, valid),
    }


def _counts(outcomes: Sequence[str]) -> dict[str, Any]:
    counts = {name: outcomes.count(outcome) for name, outcome in _COUNTS.items()}
    valid = len(outcomes) - counts["invalid"]
    wilson = statistics.wilson95(counts["successes"], valid) if valid else None
    return {"trials": len(outcomes), **counts, "wilson95": wilson}


def paired(reference: str, by_profile: Mapping[str, Sequence[WallTrial]]) -> dict[str, Any]:
    """The reference against every other profile, on trials valid in both, with both counts."""
    tests = {}
    for other, theirs in by_profile.items():
        pairs = [
            pair
            for pair in zip(by_profile.get(reference, ()), theirs, strict=False)
            if "invalid" not in (pair[0].outcome, pair[1].outcome)
        ]
        if other != reference and pairs:
            tests[f"{reference}-{other}"] = {
                "trials": len(pairs),
                **_mcnemar(pairs, "outcome"),
                "after_start": _mcnemar(pairs, "outcome_after_start"),
            }
    return tests


def border(jam_travel: float, rows: Sequence[WallTrial]) -> dict[str, Any]:
    """How near the sticks of valid trials come to the travel [m] that makes one a jam.

    Returns:
        `at_mm`, that travel; `below_mm` and `above_mm`, the longest stick that is no jam and the
        shortest that is one, None where there is none. With any travel between the two every trial
        jams or does not jam as it does now.
    """
    at = 1e3 * jam_travel
    sticks = [row.longest_stick_mm for row in rows if row.outcome != "invalid"]
    below = max((stick for stick in sticks if stick <= at), default=None)
    above = min((stick for stick in sticks if stick > at), default=None)
    return {"at_mm": at, "below_mm": below, "above_mm": above}


def _mcnemar(pairs: Sequence[tuple[WallTrial, WallTrial]], column: str) -> dict[str, Any]:
    succeeded = [[getattr(row, column) == "success" for row in pair] for pair in pairs]
    return asdict(statistics.mcnemar(np.array(succeeded)))
