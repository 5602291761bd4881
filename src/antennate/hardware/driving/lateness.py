"""Whether the computer itself was late while the robot walked, in words."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from antennate.hardware.safety.causes import Cause

MUCH = 0.02
"""Share of ticks missed since the walk began above which the computer is named late (assumed)."""
SOME = 0.005
"""The same where more answers than ticks times MUCH were missed, too: on a computer that is not
late up to 0.3 % of ticks are (measured, docs/hardware.md)."""
_FOLLOW = (Cause.LATE_ANSWERS, Cause.SILENT_SERVO, Cause.WATCHDOG, Cause.PAUSE)
"""What a late computer may cause by itself."""


MANY = 5
"""Ticks missed within a second above which a live view is given up: half of what stops a robot, as
servos wait 0.1 s (assumed)."""
_SECOND = 1.0


class Recent:
    """Ticks that a loop missed within the last second."""

    def __init__(self) -> None:
        self._counts = deque[tuple[float, int]]()

    def step(self, now: float, missed: int) -> int:
        """Take how many it has missed by a time [s]; how many of them within the last second."""
        self._counts.append((now, missed))
        while self._counts[0][0] < now - _SECOND:
            self._counts.popleft()
        return missed - self._counts[0][1]


def late_sentence(result: Mapping[str, Any]) -> list[str]:
    """What a late computer did to a drive: one sentence, or none if it was not late.

    Args:
        result: The content of `result.json`.
    """
    walking, pace = result["walking"], result["pace"]
    if walking is None or pace is None:
        return []
    missed = result["missed_answers"]
    if walking["missed_share"] <= (SOME if missed > MUCH * pace["ticks"] else MUCH):
        return []
    share, worst = 100.0 * walking["missed_share"], 1e3 * pace["worst_lateness_s"]
    following = [cause.name for cause in _FOLLOW if cause.name in result["why"]]
    may = (
        f" {' and '.join(following)} may come from that, not from the servos." if following else ""
    )
    return [
        f"The computer was late: {share:.1f} % of ticks missed since the walk began, at most "
        f"{worst:.0f} ms late, and {missed} answers of servos missed; close other programs, see "
        f"Pace in docs/hardware.md.{may}"
    ]
