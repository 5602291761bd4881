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

from antennate.hardware.driving.signals import STOPS

_LINES = 10
"""Plain lines over a whole run."""


@contextlib.contextmanager
def progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function to call after each step with how many of how many are done."""
    if not sys.stderr.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        yield _plain(what)
        return
    from rich.console import Console  # slow to import
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    console = Console(file=sys.stderr)
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _plain(what: str) -> Callable[[int, int], None]:
    start, shown = time.monotonic(), 0

    def step(done: int, total: int) -> None:
        nonlocal shown
        if done * _LINES // total > shown:
            shown = done * _LINES // total
            seconds = time.monotonic() - start
            sys.stderr.write(f"{what}: {done} of {total} after {seconds:.0f} s\n")
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
