"""How far a run has come, on stderr: a bar for people, plain lines for files."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from antennate.hardware.driving.stopping import STOPS

_LINES = 10
"""Plain lines over a whole run."""


@contextlib.contextmanager
def progress(
    what: str, table: Callable[[], Any] = lambda: None
) -> Iterator[Callable[[int, int], None]]:
    """Yield a function to call after each step with how many of how many are done.

    Args:
        what: What is counted.
        table: What a terminal shows below the bar, renewed every second; None for nothing.
    """
    if not sys.stderr.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        yield _plain(what)
        return
    from rich.console import Console, Group  # slow to import
    from rich.live import Live
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    pace = _Pace()
    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
    )
    bar = Progress(*columns, TimeRemainingColumn())
    task = bar.add_task(what, total=None, rate="")

    def drawn() -> Any:
        below = table()
        return bar if below is None else Group(bar, below)

    def step(done: int, total: int) -> None:
        bar.update(task, completed=done, total=total, rate=pace.rate(done))

    console = Console(file=sys.stderr)
    with Live(console=console, transient=True, get_renderable=drawn, refresh_per_second=2):
        yield step


class _Pace:
    """How fast steps come; those that were there at the first call took no time."""

    def __init__(self) -> None:
        self._start, self._first = time.monotonic(), -1

    def rate(self, done: int) -> str:
        """Steps a second or a minute, in words; empty before there is one."""
        if self._first < 0:
            self._first = done if done > 1 else 0
        speed = self._speed(done)
        if done == self._first:
            return ""
        return f"{speed:.1f}/s" if speed >= 1.0 else f"{60 * speed:.1f}/min"

    def left(self, done: int, total: int) -> float:
        """Time until all are done [s]."""
        return (total - done) / max(self._speed(done), 1e-9)

    def _speed(self, done: int) -> float:
        return (done - self._first) / max(time.monotonic() - self._start, 1e-9)


def _plain(what: str) -> Callable[[int, int], None]:
    start, shown, pace = time.monotonic(), 0, _Pace()

    def step(done: int, total: int) -> None:
        nonlocal shown
        rate = pace.rate(done)
        if done * _LINES // total > shown:
            shown = done * _LINES // total
            seconds = time.monotonic() - start
            more = rate and done < total
            left = f", {rate}, {pace.left(done, total):.0f} s left" if more else ""
            sys.stderr.write(f"{what}: {done} of {total} after {seconds:.0f} s{left}\n")
            sys.stderr.flush()

    return step


@contextlib.contextmanager
def stop_signals(last: bool = False) -> Iterator[None]:
    """Let SIGTERM end the block as Ctrl-C does; a signal that is ignored stays so.

    Args:
        last: Whether all after the first are ignored, even when the block has ended.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {n: signal.getsignal(n) for n in STOPS if signal.getsignal(n) is not signal.SIG_IGN}
    stopped = False

    def stop(number: int, frame: Any) -> None:
        nonlocal stopped
        if not (stopped and last):
            stopped = True
            raise KeyboardInterrupt

    for number in before:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stopped and last else handler)
