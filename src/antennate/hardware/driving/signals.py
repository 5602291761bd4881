r"""Ctrl-C, Ctrl-\, SIGTERM and the loss of the terminal, while servos have torque.

An exception alone would not do: a controller with a bare `except`, a destructor or a callback may
swallow it. So what was received is also kept, for the loop to look at.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

STOPS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGQUIT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)
)
"""What asks a program to end; a terminal that goes away, as of a lost connection, sends SIGHUP."""


class StopOnce:
    """Inside the block a signal that asks to end raises KeyboardInterrupt, until it is closed.

    Close it before the torque goes off: whoever presses Ctrl-C twice must not keep it on. Outside
    the main thread Python delivers no signals: whoever starts such a thread has to end it
    otherwise, as by `orders.stop`.

    Args:
        last: The program ends after the block: if a signal came, none is heard any more, so
            that the report is written and shown however often it is sent.

    Attributes:
        received: One came, whoever may have swallowed the exception.
        insists: Each of them raises, not the first alone; for code that may swallow one.
        within: They raise while this function runs and not else, so that of several at once none
            interrupts what the first has begun; None for everywhere.
        closed: None raises; for the block's owner to set.
    """

    def __init__(self, last: bool = False) -> None:
        self.received = self.closed = False
        self.insists = not last
        self._last = last
        self.within: Callable[..., object] | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnce:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self.receive) for number in STOPS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_IGN if self._last and self.received else handler)

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal."""
        first, self.received = not self.received, True
        if not self.closed and (first or self.insists) and self._inside(frame):
            raise KeyboardInterrupt

    def _inside(self, frame: FrameType | None) -> bool:
        """Whether `within` runs at this frame."""
        if self.within is None:
            return True
        code = getattr(self.within, "__code__", None)
        while frame is not None and frame.f_code is not code:
            frame = frame.f_back
        return frame is not None
