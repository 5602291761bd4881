"""When a run began and ended, as comments below its command."""

from __future__ import annotations

import datetime
import re

_FORM = "%Y-%m-%d %H:%M:%S UTC"
_FOUND = re.compile(r"^# (begun|resumed|ended) (.*)$", re.MULTILINE)


def begun(resumed: bool = False) -> str:
    """The line of a run that begins now, or goes on."""
    return f"# {'resumed' if resumed else 'begun'} {_now()}\n"


def ended(text: str) -> str:
    """What was written, with the line of a run that ends now."""
    kept = (line for line in text.splitlines(True) if not line.startswith("# ended "))
    return f"{''.join(kept)}# ended {_now()}\n"


def sentence(text: str) -> str:
    """When, and for how long; empty if it does not tell."""
    try:
        found = {
            what: datetime.datetime.strptime(when, _FORM).replace(tzinfo=datetime.UTC)
            for what, when in _FOUND.findall(text)
        }
    except ValueError:
        return ""
    for what, told, it in (("begun", "Run on", "it"), ("resumed", "Resumed on", "the rest")):
        if what in found:
            took = found["ended"] - found[what] if "ended" in found else None
            day = f"{told} {found[what]:%Y-%m-%d at %H:%M} UTC"
            return f"{day}." if took is None else f"{day}; {it} took {_span(took.total_seconds())}."
    return ""


def _span(seconds: float) -> str:
    minutes, hours = seconds / 60, seconds / 3600
    if seconds < 1:
        return "less than 1 s"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{minutes:.0f} min" if minutes < 100 else f"{hours:.1f} h"


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).strftime(_FORM)
