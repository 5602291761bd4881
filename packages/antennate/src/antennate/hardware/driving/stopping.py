"""What stops a drive from outside: a key that is let go, arrival.

A key that is held lets the robot walk. A terminal does not report its release. A key that is held
repeats its character, after a first pause of 0.25 s (Linux console) to 0.66 s (X server). So a key
counts as held once a second character has followed quickly: a single press never lets a robot walk.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from antennate.params.hardware import DeadManParams

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


class DeadMan:
    """Whether a key is held.

    Args:
        params: How long the key may be released.
        pressed: Whether a character has come since the last call.

    Attributes:
        released: The key is not held: the robot has to stand.
        over: It has not been held for so long that the torque has to go off.
    """

    def __init__(self, params: DeadManParams, pressed: Callable[[], bool]) -> None:
        self._params, self._pressed = params, pressed
        self._last = -math.inf
        self._held_at: float | None = None
        self.released, self.over = True, False

    def step(self, now: float, torque: bool) -> None:
        """Look at the key, once a tick.

        Args:
            now: Time [s].
            torque: Whether the servos have torque; before that nothing is over.
        """
        quick = now - self._last <= self._params.release
        if self._pressed():
            self.released = self.released and not quick
            self._last = now
        elif not quick:
            self.released = True
        if self._held_at is None or not torque or not self.released:
            self._held_at = now
        self.over = now - self._held_at >= self._params.off
