r"""What stops a drive from outside: signals, a key that is let go, arrival.

Signals are Ctrl-C, Ctrl-\, SIGTERM and the loss of the terminal. A controller with a bare `except`,
a destructor or a callback may swallow the exception. So the signal is also kept, and the loop looks
at it.

A key that is held lets the robot walk. A terminal does not report its release. A key that is held
repeats its character, after a first pause of 0.25 s (Linux console) to 0.66 s (X server). So a key
counts as held once a second character has followed quickly: a single press never lets a robot walk.
"""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the command line imports this file for every command
    from antennate.params.hardware import DeadManParams

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
        numbers: The signals.

    Attributes:
        received: A signal came, even if its exception was swallowed.
        insists: Every signal raises, not only the first; for code that may swallow one.
        within: Signals raise only while this function runs, so that of several at once none
            interrupts what the first has begun; None for everywhere.
        closed: Signals do not raise any more; set by the code that owns the block.
    """

    def __init__(self, last: bool = False, numbers: Sequence[int] = STOPS) -> None:
        self.received = self.closed = False
        self.insists = not last
        self._last, self._numbers = last, numbers
        self.within: Callable[..., object] | None = None
        self._before: dict[int, Any] = {}

    def __enter__(self) -> StopOnce:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self.receive) for number in self._numbers}
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
