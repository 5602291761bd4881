"""A claim of the paper, what our runs make of it, and the rule that turns both into one word."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from antennate.studies.columns import Ends, tabular
from antennate.studies.statistics import Matched, wilson95
from antennate.studies.tables import Tried

Verdict = Literal["reproduced", "conditional", "fitted", "not_reproduced", "undecided"]
Best = Literal["reproduced", "conditional", "fitted"]
"""What a claim can be at best, decided before any result is seen."""
VERDICTS: Mapping[Verdict, str] = {name: name.replace("_", " ") for name in get_args(Verdict)}
"""Verdicts and what people read."""
MEANINGS: Mapping[Verdict, str] = {
    "reproduced": "the criterion is met, and no number that we chose decides it",
    "conditional": "the criterion is met, with a number of ours that the paper does not state",
    "fitted": "the criterion is met, but a number of ours was chosen so that it is: nothing is "
    "shown",
    "not_reproduced": "the criterion is not met; what we find instead is said",
    "undecided": "the 95 % interval holds both sides of the criterion, or there are too few trials "
    "for one",
}
"""The rule of the verdicts; `Claim.verdict` applies it."""
ENOUGH_TO_STAY = 20
"""Trials from which a largest value that stays below a limit says something: the paper's number."""
_Z95 = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""


def above(interval: Ends | None, limit: float) -> bool | None:
    """Whether a number exceeds a limit; None if the limit lies in its interval, or without one."""
    if interval is None:
        return None
    low, high = interval
    return None if low <= limit < high else low > limit


def agrees(value: float, interval: Ends | None, paper: float, tolerance: float) -> bool | None:
    """Whether a number agrees with the paper's.

    None without an interval, and if a limit of what agrees lies in it.

    Args:
        value: Our number.
        interval: Its 95 % interval, None if it has none.
        paper: The paper's number.
        tolerance: Distance from the paper's number that still agrees.
    """
    if interval is None:
        return None
    low, high = interval
    if any(low < limit < high for limit in (paper - tolerance, paper + tolerance)):
        return None
    return abs(value - paper) <= tolerance


def all_of(*parts: bool | None) -> bool | None:
    """Whether all parts of a criterion are met: one that is not decides, whatever the others."""
    return False if False in parts else None if None in parts else True


def lead(pair: Matched | None, first_is_ours: bool = True) -> Ends:
    """95 % interval of the difference of two success shares on the same trials [points].

    Adjusted Wald: Bonett and Price, Journal of Educational and Behavioral Statistics 37 (2012) 479.

    Args:
        pair: On how many of them only the first or only the second succeeded; None without any.
        first_is_ours: Whether the difference is that of the first less the second.
    """
    trials, one, two = (pair.trials, pair.only_first, pair.only_second) if pair else (0, 0, 0)
    n = trials + 2
    first, second = (one + 1) / n, (two + 1) / n
    difference = first - second if first_is_ours else second - first
    half = _Z95 * math.sqrt((first + second - difference**2) / n)
    return 100 * max(difference - half, -1.0), 100 * min(difference + half, 1.0)


def difference(
    first: float | None, first_95: Ends | None, second: float | None, second_95: Ends | None
) -> Ends | None:
    """95 % interval of a difference of two independent numbers; None without their intervals.

    From their own intervals: Zou and Donner, Statistics in Medicine 27 (2008) 1693.
    """
    if first is None or second is None or first_95 is None or second_95 is None:
        return None
    down = math.hypot(first - first_95[0], second_95[1] - second)
    up = math.hypot(first_95[1] - first, second - second_95[0])
    return first - second - down, first - second + up


def share_of(row: Tried, count: int | None = None) -> tuple[float, Ends]:
    """Share of a count, or of successes, in valid trials [%] with its 95 % interval."""
    valid, count = row.trials - row.invalid, row.successes if count is None else count
    low, high = wilson95(count, valid)
    return 100.0 * count / max(valid, 1), (100.0 * low, 100.0 * high)


def counted(row: Tried, word: str = "", count: int | None = None) -> str:
    """A count, or successes, in words with its interval, as "16 of 20 jam (58 to 92 %)"."""
    valid, count = row.trials - row.invalid, row.successes if count is None else count
    if not valid:
        return "no valid trial"
    low, high = share_of(row, count)[1]
    return f"{count} of {valid}{' ' if word else ''}{word} ({low:.0f} to {high:.0f} %)"


@dataclass(frozen=True, slots=True)
class Bar:
    """One number of a claim's figure.

    Attributes:
        label: Whose number it is.
        interval: Its 95 % interval, None without one.
    """

    label: str
    value: float
    interval: Ends | None = None


@dataclass(frozen=True, slots=True)
class Finding:
    """What our runs say of a claim.

    Attributes:
        ours: Our numbers, in words.
        holds: Whether the criterion is met; None if the trials decide neither.
        reason: Why, and for `conditional` under which condition.
        bars: The paper's numbers and ours, in the claim's unit; the paper's first.
        by_default: What is also said, but of our default settings alone.
    """

    ours: str
    holds: bool | None
    reason: str
    bars: tuple[Bar, ...]
    by_default: str = ""


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim.

    Attributes:
        name: Short name; file name of its figure.
        claim: What is claimed, in our words.
        paper: The paper's numbers.
        criterion: What has to hold, stated before the result.
        rival: What would meet the claim without being true, and is beaten or told beside it.
        best: What it can be at best.
        ceiling: Why it can be no more.
        experiment: Experiment that tests it.
        unit: Unit of the figure's numbers.
        judge: From the result to a finding.
        beside: Experiments whose configurations `judge` takes, too.
        fitted: Whether numbers that the paper does not give are those fitted to it.
    """

    name: str
    claim: str
    paper: str
    criterion: str
    rival: str
    best: Best
    ceiling: str
    experiment: str
    unit: str
    judge: Callable[..., Finding]
    beside: Sequence[str] = ()
    fitted: bool = False

    def when_fitted(self) -> Claim:
        """The claim with numbers that were fitted to the paper; its criterion stays."""
        why = "numbers that the paper does not give were fitted to it"
        return replace(self, best="fitted", ceiling=why, fitted=True)

    def reason(self, finding: Finding) -> str:
        """Why the verdict is what it is."""
        more = "Numbers were fitted." if self.fitted else finding.by_default
        return f"{finding.reason} {more}".strip()

    def verdict(self, finding: Finding) -> Verdict:
        """The verdict by what was found: undecided if the trials decide neither."""
        if finding.holds is None:
            return "undecided"
        return self.best if finding.holds else "not_reproduced"

    @property
    def rule(self) -> str:
        """Criterion, rival and what it can be at best, as the page states them."""
        most = f" At best {VERDICTS[self.best]}: {self.ceiling}." if self.ceiling else ""
        return f"{self.criterion}. Rival: {self.rival}.{most}"


def claim(
    experiment: str,
    unit: str,
    *,
    paper: str,
    criterion: str,
    rival: str,
    best: Best = "conditional",
    ceiling: str = "",
    beside: Sequence[str] = (),
) -> Callable[[Callable[..., Finding]], Claim]:
    """Make a function that judges the claim which its docstring states; the claim has its name."""

    def made(judge: Callable[..., Finding]) -> Claim:
        text = (judge.__doc__ or "").removesuffix(".")
        stated = judge.__name__, text, paper, criterion, rival, best, ceiling
        return Claim(*stated, experiment, unit, judge, beside)

    return made


@tabular
class Row:
    """A judged claim, all text."""

    claim: str
    """What is claimed, in our words."""
    criterion: str
    """What has to hold, stated before the result."""
    rival: str
    """What would meet the claim without its being true, stated before the result."""
    paper: str
    """Numbers of the paper."""
    ours: str
    """Our numbers."""
    verdict: Verdict
    """One of the five verdicts."""
    reason: str
    """Why it is this one."""
    command: str
    """Command that runs the experiment behind it alone; with `--config fitted` where numbers that
    the paper does not give were fitted to it."""
