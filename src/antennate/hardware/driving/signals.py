r"""Signals that end a drive: Ctrl-C, Ctrl-\, SIGTERM and the loss of the terminal.

A controller with a bare `except`, a destructor or a callback may swallow the exception. So the
signal is also kept, and the loop looks at it.
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
"""Signals that ask a program to end; a terminal whose connection is lost sends SIGHUP."""


class StopOnce:
    """Makes signals that ask to end raise KeyboardInterrupt inside the block, until it is closed.

    Close it before the torque goes off: a second Ctrl-C must not interrupt that. Python delivers
    signals to the main thread only; a drive in another thread has to be ended otherwise, as by
    `orders.stop`.

    Args:
        last: The program ends after the block: once a signal came, later ones are ignored, so that
            the report is written and shown.

    Attributes:
        received: A signal came, even if its exception was swallowed.
        insists: Every signal raises, not only the first; for code that may swallow one.
        within: Signals raise only while this function runs, so that of several at once none
            interrupts what the first has begun; None for everywhere.
        closed: Signals do not raise any more; set by the code that owns the block.
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
