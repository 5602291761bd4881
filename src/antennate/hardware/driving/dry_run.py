"""When the dry run is over, and whether torque may come on then."""

from __future__ import annotations

import math

from antennate.hardware.safety.causes import OF_CONTROLLER, Cause, Outputs, State
from antennate.hardware.safety.signal_quality import SignalQuality

_SKIP = "; --no-touch-check arms without the check"
_EXPECTED = OF_CONTROLLER | {Cause.NOT_ARMED, Cause.NOT_READY, Cause.RELEASED}
"""Causes that stand before the check is over on a robot that is well."""


class DryRun:
    """Lasts `length`, and longer until antennae are checked and the supervisor allows torque.

    Args:
        quality: With the check of the antennae.
        length: Shortest duration [s].
        patience: Longest extension for the check, and again for the supervisor [s].
        arm: Whether torque is wanted afterwards.
        duration: Time from torque on to off [s].

    Attributes:
        over: When torque was last asked for [s], inf while it may not come on.
        end: When all is over [s], inf if not known yet.
        asks: Whether torque is asked for; the supervisor reacts to the change to True only.
        refusal: Why torque has not come on although it was wanted.
    """

    def __init__(
        self, quality: SignalQuality, length: float, patience: float, arm: bool, duration: float
    ) -> None:
        self._quality, self._length, self._patience = quality, length, patience
        self._waits, self._duration = arm, duration
        self._first = math.inf
        self.over = math.inf
        self.end = math.inf if arm else length
        self.asks = False
        self.refusal = ""

    def step(self, t: float, out: Outputs | None) -> None:
        """Look at antennae and supervisor, at a time since the beginning [s], once a tick."""
        if not self._waits:
            return
        if latched := latched_causes(out):
            self._give_up(t, latched)
        elif self.asks:
            self._follow(t, out)
        elif self._first < math.inf:
            self._ask(t)
        elif self._quality.refused or (
            t >= self._length + self._patience and self._quality.objections
        ):
            wire = self._quality.broken
            ill = [] if wire or self._quality.refused else _ill(out)
            skip = "" if ill or wire else _SKIP  # these forbid torque anyway
            self._give_up(t, "; ".join(ill or self._quality.objections) + skip)
        elif t >= self._length and not self._quality.objections:
            self._first = t
            self._ask(t)

    def _ask(self, t: float) -> None:
        self.asks, self.over, self.end = True, t, t + self._duration

    def _follow(self, t: float, out: Outputs | None) -> None:
        """Torque comes on in this tick, or is asked for again in the next but one."""
        if out is None or out.arming:
            self._waits, self.refusal = False, ""
            return
        self.asks = False
        self.refusal = "; ".join(a.text for a in out.causes if a.cause in out.refusal)
        if t >= self._first + self._patience:
            self._give_up(t, self.refusal)

    def _give_up(self, t: float, why: str) -> None:
        self._waits, self.refusal, self.end = False, why, t


def latched_causes(out: Outputs | None) -> str:
    """A hardware error, which keeps torque off until a reboot; empty if there is none."""
    found = () if out is None or out.torque else out.causes
    return "; ".join(a.text for a in found if a.present and a.cause is Cause.SERVO_ERROR)


def _ill(out: Outputs | None) -> list[str]:
    """What is wrong with the robot itself, as a board that fell silent during the check."""
    found = () if out is None else (a for a in out.causes if a.present)
    return [a.text for a in found if a.cause.severity >= State.HOLD and a.cause not in _EXPECTED]
