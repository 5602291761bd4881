"""A file whose existence means that the robot has arrived; a light gate may write it."""

from __future__ import annotations

import threading
from pathlib import Path
from types import TracebackType

_EVERY = 0.05
"""Time between two looks [s]: the width of a hand at walking speed (assumed)."""


class Arrival:
    """Looks for a file in a thread of its own, since a disk may be slow. A context manager.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._there = False
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._look, name="arrival", daemon=True)

    def __call__(self) -> bool:
        """Whether the file exists."""
        return self._there

    def __enter__(self) -> Arrival:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._end.set()

    def _look(self) -> None:
        while not self._end.wait(_EVERY):
            if self._path.exists():
                self._there = True
                return
