"""Tables of results, and counts of successes in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

from antennate.control.readings import short_names
from antennate.jackknife import ENOUGH
from antennate.studies.columns import Column, Ends, columns, shown


class Tried(Protocol):
    """How the trials of a condition ended."""

    @property
    def trials(self) -> int:
        """All trials."""
        ...

    @property
    def invalid(self) -> int:
        """Trials that say nothing."""
        ...

    @property
    def successes(self) -> int:
        """Trials that succeeded."""
        ...

    @property
    def wilson95(self) -> Ends | None:
        """Interval of the share of successes among valid trials; None without any."""
        ...


def successes(conditions: Mapping[str, Tried]) -> str:
    """Successes of each condition by name, of its valid trials, with their interval."""
    return ", ".join(
        f"{name} {of_valid(each.successes, each.trials - each.invalid, each.wilson95)}"
        for name, each in conditions.items()
    )


def of_valid(
    count: int, valid: int, interval: Sequence[float] | None = None, word: str = ""
) -> str:
    """A count of valid trials in words, as `16 of 20 (0.58 to 0.92)`."""
    if not valid:
        return "without a valid trial"
    return f"{count} of {valid}{word}" + (f" ({shown(interval)})" if interval else "")


FEW = f"Fewer than {ENOUGH} trials decide nothing; their means have no interval."
FEW_PER_POINT = FEW.replace("trials", "trials per point")


def few(trials: Iterable[int], per_point: bool = False) -> str:
    """What is said where valid trials are too few for an interval of a mean; empty if they are not.

    Args:
        trials: Valid trials of each condition or point; those without any do not count.
        per_point: Whether they are those of a point of a study.
    """
    some = [count for count in trials if count]
    if not some or min(some) >= ENOUGH:
        return ""
    return FEW_PER_POINT if per_point else FEW


class Interim:
    """How the trials that have ended came out, while others run.

    Args:
        conditions: Names of the conditions in the order of their lines; others come behind.
    """

    def __init__(self, conditions: Iterable[str] = ()) -> None:
        self._counts: dict[str, Counter[str]] = {name: Counter() for name in conditions}

    def add(self, row: Any) -> None:
        """Count a row: a dataclass or a mapping with a condition and an outcome."""
        cells = row if isinstance(row, Mapping) else asdict(row)
        outcome = cells.get("outcome") or cells.get("status")
        if outcome is not None:
            condition = next((str(cells[c]) for c in _CONDITIONS if c in cells), _ANY)
            self._counts.setdefault(condition, Counter())[str(outcome)] += 1

    def table(self) -> Table | None:
        """A line for each condition with a trial; None if it tells no more than how many."""
        known = {name: counts for name, counts in self._counts.items() if counts}
        found = {outcome for counts in known.values() for outcome in counts}
        others = sorted(found - {"success"})
        judged = not found <= _STATUSES
        short = short_names(known)
        rows = [
            (
                short[name],
                [
                    *([_of_judged(counts)] if judged else []),
                    *(str(counts[outcome]) for outcome in others),
                ],
            )
            for name, counts in known.items()
        ]
        ended = sum(counts.total() for counts in known.values())
        tells = len(found) > 1 or any(name != _ANY for name in known)
        words = [*["successes"] * judged, *(_WORDS.get(outcome, outcome) for outcome in others)]
        return Table(f"So far, {ended} trials", words, rows) if tells else None


def _of_judged(counts: Counter[str]) -> str:
    """Successes of the trials that say something, as `1 of 2`."""
    valid = sum(count for outcome, count in counts.items() if outcome not in _STATUSES)
    return f"{counts['success']} of {valid}"


_CONDITIONS = ("controller", "profile")
"""Columns that tell a condition."""
_WORDS = {"timeout": "out of time", "left": "left the scene"}
"""Outcomes as tables of results name them."""
_STATUSES = {"ok", "nan", "invalid", "failed", "crashed", "hung"}
"""What stands in place of an outcome where a trial has none, or says nothing."""
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
        conditions: Mapping[str, Any],
        measures: Iterable[Column] | None = None,
        note: str = "",
        preface: str = "",
    ) -> Table:
        """A line for each column that has a label, a cell for each condition.

        Args:
            title: Above it.
            conditions: Summaries by name, of one class or mappings.
            measures: What is shown; None for all columns of the class of the summaries.
            note: Under it.
            preface: Before the title.
        """
        known = _measures(conditions, measures)
        lines = (line for m in known for line in ((m, m.ends) if m.interval else (m,)))
        rows = [(m.title, [m.cell(c) for c in conditions.values()]) for m in lines if m.label]
        return cls(title, list(conditions), rows, note, preface=preface)

    @classmethod
    def lines(
        cls,
        title: str,
        rows: Mapping[str, Any],
        measures: Iterable[Column] | None = None,
        note: str = "",
        preface: str = "",
    ) -> Table:
        """A line for each condition, a cell for each column that has a label; else as `of`."""
        named = [measure for measure in _measures(rows, measures) if measure.label]
        cells = [(name, [m.cell(row) for m in named]) for name, row in rows.items()]
        return cls(title, [m.title for m in named], cells, note, preface=preface)


def _measures(summaries: Mapping[str, Any], measures: Iterable[Column] | None) -> Iterable[Column]:
    """What is shown of summaries: these measures, else all columns of their class."""
    if measures is not None:
        return measures
    return columns(type(next(iter(summaries.values())))) if summaries else ()
