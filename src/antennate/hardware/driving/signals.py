"""Ctrl-C, SIGTERM and the loss of the terminal, while servos have torque.

An exception alone would not do: a controller with a bare `except`, a destructor or a callback may
swallow it. So what was received is also kept, for the loop to look at.
"""

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
    """Inside the block each of them raises KeyboardInterrupt, until it is closed.

    Close it before the torque goes off: whoever presses Ctrl-C twice must not keep it on. Outside
    the main thread Python delivers no signals: whoever starts such a thread has to end it
    otherwise, as by `orders.stop`.

    Attributes:
        received: One came, whoever may have swallowed the exception.
        closed: None raises any more; for the block's owner to set.
    """

    def __init__(self) -> None:
        self.received = self.closed = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnce:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self.receive) for number in STOPS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal."""
        self.received = True
        if not self.closed:
            raise KeyboardInterrupt
