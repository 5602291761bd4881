"""Which late answers may still come from which servo, and what can be asked in spite of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from antennate.hardware.dynamixel.answers import Span


class PendingRequests:
    """For each id the lengths of its unanswered requests, each until its answer never comes [s]."""

    def __init__(self, patience: float, clock: Callable[[], float]) -> None:
        self._patience, self._clock = patience, clock
        self._until: dict[int, dict[int, float]] = {}

    def open(self, ids: Iterable[int], length: int) -> None:
        """These are about to be asked for so many bytes."""
        until = self._clock() + self._patience
        for servo in ids:
            self._until.setdefault(servo, {})[length] = until

    def close(self, ids: Iterable[int], length: int) -> None:
        """These have answered with so many bytes."""
        for servo in ids:
            self._until.get(servo, {}).pop(length, None)

    def holds(self, servo: int) -> bool:
        """A late answer of this servo may still come."""
        return bool(self._lengths(servo))

    def free(self, ids: Sequence[int], span: Span) -> int | None:
        """The shortest length that no late answer of these has; None if there is none."""
        taken = {length for servo in ids for length in self._lengths(servo)}
        allowed = range(span.length, span.length + span.spare + 1)
        return next((length for length in allowed if length not in taken), None)

    def longest(self) -> float:
        """Time until nothing late can come from anybody [s]."""
        latest = max((t for old in self._until.values() for t in old.values()), default=0.0)
        return latest - self._clock()

    def _lengths(self, servo: int) -> list[int]:
        now = self._clock()
        old = self._until.get(servo, {})
        for length in [length for length, until in old.items() if until <= now]:
            del old[length]
        return list(old)
