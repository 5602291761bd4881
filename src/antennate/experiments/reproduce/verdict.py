"""A claim of the paper, and what our runs make of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from antennate.studies.statistics import wilson95

Verdict = Literal["reproduced", "conditional", "not_reproduced", "undecided"]
VERDICTS: Mapping[Verdict, str] = {name: name.replace("_", " ") for name in get_args(Verdict)}
"""Verdicts and what people read."""


def judged(holds: bool, conditionally: bool = False) -> Verdict:
    """The verdict on a claim that holds, or holds under a condition."""
    return "reproduced" if holds else "conditional" if conditionally else "not_reproduced"


def agrees(
    value: float, interval: tuple[float, float] | None, paper: float, tolerance: float
) -> Verdict:
    """The verdict on a number that we could have chosen to meet: `conditional` at most.

    Undecided if its interval reaches the paper's number and is wider than what is tolerated to
    both sides: few trials then decide nothing, for or against the claim. Undecided without one.

    Args:
        value: Our number.
        interval: Its 95 % interval, None if it has none.
        paper: The paper's number.
        tolerance: Distance from the paper's number that still agrees.
    """
    if interval is None:
        return "undecided"
    low, high = interval
    if high - low > 2 * tolerance and low <= paper + tolerance and high >= paper - tolerance:
        return "undecided"
    return judged(False, abs(value - paper) <= tolerance)


def above(interval: tuple[float, float], limit: float) -> Verdict:
    """The verdict on a number that shall exceed a limit: `conditional` at most, as for `agrees`.

    Undecided if the limit lies within the interval.

    Args:
        interval: Its 95 % interval.
        limit: What it shall exceed.
    """
    low, high = interval
    return "undecided" if low <= limit < high else judged(False, low > limit)


def share_of(row: Mapping[str, Any], key: str = "successes") -> tuple[float, tuple[float, float]]:
    """Share of valid trials [%] with its 95 % interval."""
    valid = row["trials"] - row["invalid"]
    low, high = wilson95(row[key], valid)
    return 100.0 * row[key] / max(valid, 1), (100.0 * low, 100.0 * high)


def counted(row: Mapping[str, Any], word: str = "", key: str = "successes") -> str:
    """The count in words with the interval of its share, as "16 of 20 jam (58 to 92 %)"."""
    valid = row["trials"] - row["invalid"]
    if not valid:
        return "no valid trial"
    low, high = share_of(row, key)[1]
    return f"{row[key]} of {valid}{' ' if word else ''}{word} ({low:.0f} to {high:.0f} %)"


@dataclass(frozen=True, slots=True)
class Bar:
    """One number of a claim's figure.

    Attributes:
        label: Whose number it is.
        interval: Its 95 % interval, None without one.
    """

    label: str
    value: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Finding:
    """What our runs say of a claim.

    Attributes:
        ours: Our numbers, in words.
        reason: Why, and for `conditional` under which condition.
        bars: The paper's numbers and ours, in the claim's unit; the paper's first.
    """

    ours: str
    verdict: Verdict
    reason: str
    bars: tuple[Bar, ...]


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim.

    Attributes:
        name: Short name; file name of its figure.
        claim: What is claimed, in our words.
        paper: The paper's numbers.
        rule: What has to hold for which verdict; a condition that we chose allows `conditional` at
            most.
        experiment: Experiment that tests it.
        unit: Unit of the figure's numbers.
        judge: From the results to a finding.
    """

    name: str
    claim: str
    paper: str
    rule: str
    experiment: str
    unit: str
    judge: Callable[[Mapping[str, Any]], Finding]


def claim(
    experiment: str, unit: str, paper: str, rule: str
) -> Callable[[Callable[[Mapping[str, Any]], Finding]], Claim]:
    """Make a function that judges the claim which its docstring states; the claim has its name."""

    def made(judge: Callable[[Mapping[str, Any]], Finding]) -> Claim:
        text = (judge.__doc__ or "").removesuffix(".")
        return Claim(judge.__name__, text, paper, rule, experiment, unit, judge)

    return made


@dataclass(frozen=True, slots=True)
class Row:
    """A judged claim: a row of claims.csv and of `claims` in result.json."""

    claim: str
    paper: str
    ours: str
    verdict: Verdict
    reason: str
    command: str
