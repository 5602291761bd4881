"""When a run was begun, resumed and ended, as it stands below its command; and times in words."""

from __future__ import annotations

import re
from datetime import UTC, datetime

_DATE = "%Y-%m-%d %H:%M:%S UTC"
_DATES = re.compile(r"^# (begun|resumed|ended) (.*)$", re.MULTILINE)


def date_line(what: str) -> str:
    """The line of a run that is `begun`, `resumed` or `ended` now."""
    return f"# {what} {datetime.now(UTC).strftime(_DATE)}\n"


def when_run(text: str) -> str:
    """When, and for how long; empty if it does not tell."""
    try:
        dates = {what: datetime.strptime(when, _DATE) for what, when in _DATES.findall(text)}
    except ValueError:
        return ""
    for what, words, it in (("begun", "Run on", "it"), ("resumed", "Resumed on", "the rest")):
        if what in dates:
            took = dates["ended"] - dates[what] if "ended" in dates else None
            day = f"{words} {dates[what]:%Y-%m-%d at %H:%M} UTC"
            return f"{day}." if took is None else f"{day}; {it} took {span(took.total_seconds())}."
    return ""


def span(seconds: float) -> str:
    """A time [s] in words, in the unit that suits it."""
    minutes, hours = seconds / 60, seconds / 3600
    if seconds < 1:
        return "less than 1 s"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{minutes:.0f} min" if minutes < 100 else f"{hours:.1f} h"
