"""Ctrl-C, SIGTERM and the loss of the terminal, while servos have torque."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

STOPS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""What asks a program to end; a terminal that goes away, as of a lost connection, sends SIGHUP."""


class StopOnce:
    """Inside the block the first of them raises KeyboardInterrupt, and no other is heard.

    Whoever presses Ctrl-C twice must not keep torque on.

    Attributes:
        deaf: None is heard any more.
    """

    def __init__(self) -> None:
        self.deaf = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnce:
        if threading.current_thread() is threading.main_thread():  # others get no signals
            self._before = {number: signal.signal(number, self._hear) for number in STOPS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if not self.deaf:
            self.deaf = True
            raise KeyboardInterrupt
