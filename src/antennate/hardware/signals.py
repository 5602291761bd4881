"""Ctrl-C and SIGTERM while torque goes off."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Hear neither inside the block: whoever presses Ctrl-C twice must not keep torque on."""
    if threading.current_thread() is not threading.main_thread():  # others get no signals
        yield
        return
    before = {s: signal.signal(s, signal.SIG_IGN) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
