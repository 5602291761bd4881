"""Wording of messages: values as found, on one line, and a hint at the nearest valid choice."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")
_LONGEST = 80
"""Most characters of a found value that are shown."""
_SIMILAR = 0.7
"""Least similarity of a word to the choice that is hinted at, from 0 to 1."""


def one_line(text: str) -> str:
    """The text without line breaks and control characters."""
    return " ".join(_CONTROL.sub(" ", text).split())


def shown(value: Any) -> str:
    """A value as Python writes it, in one short line."""
    text = one_line(repr(value))
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint at the choice that was perhaps meant, or nothing."""
    close = get_close_matches(word.lower(), list(known), n=1, cutoff=_SIMILAR)
    return f" (did you mean {close[0]}?)" if close else ""
