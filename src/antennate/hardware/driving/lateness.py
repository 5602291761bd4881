"""Whether the computer itself was late while the robot walked, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from antennate.hardware.safety.causes import Cause

MUCH = 0.02
"""Share of ticks missed since the walk began above which the computer is named late (assumed)."""
_FOLLOW = (Cause.LATE_ANSWERS, Cause.SILENT_SERVO, Cause.WATCHDOG, Cause.PAUSE)
"""What a late computer may cause by itself."""


def late_sentence(result: Mapping[str, Any]) -> list[str]:
    """What a late computer did to a drive: one sentence, or none if it was not late.

    Args:
        result: The content of `result.json`.
    """
    walking, pace = result["walking"], result["pace"]
    if walking is None or pace is None or walking["missed_share"] <= MUCH:
        return []
    share, worst = 100.0 * walking["missed_share"], 1e3 * pace["worst_lateness_s"]
    following = [cause.name for cause in _FOLLOW if cause.name in result["why"]]
    may = (
        f" {' and '.join(following)} may come from that, not from the servos." if following else ""
    )
    return [
        f"The computer was late: {share:.1f} % of ticks missed since the walk began, at most "
        f"{worst:.0f} ms late; close other programs, see Pace in docs/hardware.md.{may}"
    ]
