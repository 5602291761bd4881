"""Measures of a study over many trials, each named once for JSON, tables and figures."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from antennate.jackknife import ENOUGH

NONE = "-"
"""Shown where there is no number."""
Of = Callable[[str, Sequence[Any]], Any]
"""of(name, rows): the value of a measure of this name over rows."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One number, or the ends of an interval.

    Attributes:
        name: Key in result.json; a dot leads into a part (`share.forward`). It ends with the unit.
        label: What tables and figures call it; a measure without one is not shown.
        unit: Its unit as shown.
        of: How rows make it; None if it is computed elsewhere.
        form: Its format.
        scale: Factor to the unit shown.
        join: Between two numbers, as the ends of an interval.
        least: What it cannot lie below.
        most: What it cannot exceed; text names the parameter that says so.
        interval: Key of its 95 % interval, beside its own; a line of the table below it.
    """

    name: str
    label: str = ""
    unit: str = ""
    of: Of | None = None
    form: str = ".2f"
    scale: float = 1.0
    join: str = " to "
    least: float = -math.inf
    most: float | str = math.inf
    interval: str = ""

    @property
    def ends(self) -> Measure:
        """Its interval."""
        path = self.name.rpartition(".")[0]
        name = f"{path}.{self.interval}" if path else self.interval
        return replace(self, name=name, label="  95 %", of=None, interval="")

    @property
    def title(self) -> str:
        """Label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def value(self, summary: Mapping[str, Any]) -> Any:
        """Its value in a summary; None where there is none."""
        value: Any = summary
        for part in self.name.split("."):
            value = value.get(part) if isinstance(value, Mapping) else None
        return value

    def cell(self, summary: Mapping[str, Any]) -> str:
        """Its value in a summary as a table shows it."""
        return shown(self.value(summary), self.form, self.scale, self.join)


def shown(value: Any, form: str = ".2f", scale: float = 1.0, join: str = " to ") -> str:
    """A number, an interval as `low to high`, a text, or a dash for what is not known."""
    if isinstance(value, str):
        return value
    if isinstance(value, Sequence | np.ndarray):
        if not np.isfinite(np.array(value, float)).all():  # None in result.json
            return NONE
        return join.join(_written(scale * end, form) for end in value)
    if value is None or value != value:
        return NONE
    return _written(scale * value if scale != 1.0 else value, form)


def _written(value: Any, form: str) -> str:
    """A number in digits; what rounds to zero has no sign."""
    text = format(value, form)
    return text if text.strip("-0.") else text.lstrip("-")


def summarise(measures: Iterable[Measure], rows: Sequence[Any]) -> dict[str, Any]:
    """Every measure that is made from rows, as an object of result.json."""
    summary: dict[str, Any] = {}
    for measure in measures:
        if measure.of is not None:
            *path, last = measure.name.split(".")
            place = summary
            for part in path:
                place = place.setdefault(part, {})
            place[last] = measure.of(measure.name.replace(".", "_"), rows)
    return summary


def mean(name: str, rows: Sequence[Any]) -> float | None:
    """Mean of a column; None without rows."""
    return float(np.mean([getattr(row, name) for row in rows])) if rows else None


def median(name: str, rows: Sequence[Any]) -> float | None:
    """Median of a column; None without rows."""
    return float(np.median([getattr(row, name) for row in rows])) if rows else None


def largest(name: str, rows: Sequence[Any]) -> float | None:
    """Largest value of a column; None without rows."""
    return max((getattr(row, name) for row in rows), default=None)


def smallest(name: str, rows: Sequence[Any]) -> float | None:
    """Smallest value of a column; None without rows."""
    return min((getattr(row, name) for row in rows), default=None)


def total(name: str, rows: Sequence[Any]) -> int:
    """Sum of a column."""
    return sum(getattr(row, name) for row in rows)


def count(column: str, value: Any) -> Of:
    """How many rows hold a value in a column."""
    return lambda name, rows: sum(getattr(row, column) == value for row in rows)


def successes(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """Successes of each condition by name, of its valid trials, with their interval."""
    return ", ".join(
        f"{name} {share(row['successes'], row['trials'] - row['invalid'], row['wilson95'])}"
        for name, row in summaries.items()
    )


def share(count: int, valid: int, interval: Sequence[float] | None = None, word: str = "") -> str:
    """A count of valid trials in words, as `16 of 20 (0.58 to 0.92)`."""
    if not valid:
        return "without a valid trial"
    return f"{count} of {valid}{word}" + (f" ({shown(interval)})" if interval else "")


FEW = f"Fewer than {ENOUGH} trials decide nothing; their means have no interval."


def few(trials: Iterable[int]) -> str:
    """What is said where valid trials are too few for an interval of a mean; empty if they are not.

    Args:
        trials: Valid trials of each condition or point; those without any do not count.
    """
    some = [count for count in trials if count]
    if not some or min(some) >= ENOUGH:
        return ""
    return FEW


class Interim:
    """How the trials that have ended came out, while others run."""

    def __init__(self) -> None:
        self._counts: dict[str, Counter[str]] = {}

    def add(self, row: Any) -> None:
        """Count a row: a dataclass or a mapping with a condition and an outcome."""
        columns = row if isinstance(row, Mapping) else asdict(row)
        outcome = columns.get("outcome") or columns.get("status")
        if outcome is not None:
            condition = next((str(columns[c]) for c in _CONDITIONS if c in columns), _ANY)
            self._counts.setdefault(condition, Counter())[str(outcome)] += 1

    def table(self) -> Table | None:
        """A line for each condition; None if it tells no more than how many."""
        found = {outcome for counts in self._counts.values() for outcome in counts}
        outcomes = sorted(found, key=lambda outcome: (outcome != "success", outcome))
        rows = [
            (name, [str(counts[outcome]) for outcome in outcomes])
            for name, counts in sorted(self._counts.items())
        ]
        ended = sum(counts.total() for counts in self._counts.values())
        tells = len(outcomes) > 1 or any(name != _ANY for name in self._counts)
        words = [_WORDS.get(outcome, outcome) for outcome in outcomes]
        return Table(f"So far, {ended} trials", words, rows) if tells else None


_CONDITIONS = ("controller", "profile")
"""Columns that tell a condition."""
_WORDS = {"success": "successes", "timeout": "out of time", "left": "left the scene"}
"""Outcomes as tables of results name them."""
_ANY = "trials"
"""Stands for all of them where there are no conditions."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table to be shown: measures are rows, so that it fits a narrow terminal.

    Attributes:
        title: Above it.
        preface: Before the title: what its columns are, a line each.
        columns: Names of the columns.
        rows: Name and cells of every row.
        note: Under it.
        leading: Cells that tell two rows apart in place of their names, from the first on.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[str]]]
    note: str = ""
    leading: int = 0
    preface: str = ""

    @classmethod
    def of(
        cls,
        title: str,
        columns: Mapping[str, Mapping[str, Any]],
        measures: Iterable[Measure],
        note: str = "",
        preface: str = "",
    ) -> Table:
        """The measures that have a label, for a summary in each column."""
        lines = (line for m in measures for line in ((m, m.ends) if m.interval else (m,)))
        rows = [(m.title, [m.cell(c) for c in columns.values()]) for m in lines if m.label]
        return cls(title, list(columns), rows, note, preface=preface)
