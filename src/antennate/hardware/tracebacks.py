"""What a controller has failed with, and where, for the one who wrote it.

A failing one floods nothing, and its exceptions may themselves be broken.
"""

from __future__ import annotations

import math
import traceback
from collections import deque

from antennate.errors import in_one_line

EVERY = 1.0
"""Shortest time between two that are kept [s], so that one a tick floods nothing (assumed)."""
_KEPT = 16
_LONGEST_TEXT = 20_000
"""Characters; an exception may quote anything."""


class Tracebacks:
    """The newest tracebacks, at most one a second.

    Attributes:
        kept: Their texts, oldest first.
        left_out: Failures whose traceback was not kept.
    """

    def __init__(self) -> None:
        self.kept: deque[str] = deque(maxlen=_KEPT)
        self.left_out = 0
        self._last = -math.inf

    def keep(self, now: float, error: BaseException) -> None:
        """Keep that of an error at a time [s], unless there was one just now."""
        if now - self._last < EVERY:
            self.left_out += 1
            return
        self._last = now
        try:
            text = "".join(traceback.format_exception(error))
        except KeyboardInterrupt:
            raise
        except BaseException:  # noqa: BLE001 it asks the error for its notes, which may raise too
            text = in_one_line(error)
        self.kept.append(text[-_LONGEST_TEXT:])
