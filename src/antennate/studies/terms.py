"""What the statistics of a report mean, for who does not know them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from antennate.studies import page

_TERMS = {
    "wilson95": "Wilson 95 %: the true shares of success that could have given this count. Few "
    "trials make it wide; where the intervals of two conditions overlap much, their order is not "
    "known.",
    "restricted_mean_time_s": "Restricted mean time: the mean over all valid trials, where one "
    "that fails counts as the whole time limit. So giving up early does not look fast. Its "
    "interval also reaches for failures that so few trials may not have met.",
    "progress_per_time_m_s": "Progress over time: how far all valid trials came together, over "
    "their time together, so that failures count. Speed over successes: the mean of progress over "
    "time of each trial that succeeded.",
    "stuck": "Stuck episodes: how often the robot, for 5 s, did not gain 0.02 m on its best "
    "progress; it has recovered if it then did.",
    "hold": "Hold: the maneuver in which the robot stands still.",
    "mcnemar_p": "McNemar: two conditions meet the same trials, and only those trials count that "
    "one of them passes and the other does not. p is how often chance alone would split these so "
    "unevenly or more; below 0.05 is usually taken for a difference.",
    "wilcoxon_p": "Wilcoxon: the same question for how long the trials took, by the ranks of the "
    "differences trial by trial, with those of zero among the ranks (Pratt).",
}
"""Sentences by the names of numbers in a result."""


def explained(result: Mapping[str, Any]) -> str:
    """HTML on what of it is in a result; empty if nothing is."""
    there = {name for name, value in _numbers(result) if value is not None}
    found = [text for name, text in _TERMS.items() if name in there]
    text = page.paragraphs("\n\n".join(found))
    return f"<h2>How to read this</h2>{text}" if found else ""


def _numbers(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield str(name), part
            yield from _numbers(part)
    elif isinstance(value, list):
        for part in value:
            yield from _numbers(part)
