"""A thread that serves twin servos on a pseudo-terminal, in real time, to any client."""

from __future__ import annotations

import os
import select
import termios
import threading
import time
import tty
from collections.abc import Callable
from typing import Any

from dynamixel_bus.servo_bus import ServoBus

_CHUNK = 4096


class PtyServer:
    """Serves a bus while it is entered.

    Args:
        bus: The servos; only the server touches them meanwhile, or whoever holds `lock`.
    """

    def __init__(self, bus: ServoBus) -> None:
        self.bus = bus
        self.lock = threading.Lock()
        self.path = ""
        self._master = self._slave = self._wake = self._waker = -1
        self._thread = threading.Thread(target=self._serve, name="twin-pty", daemon=True)
        self._begin = 0.0

    def __enter__(self) -> PtyServer:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._wake, self._waker = os.pipe()
        self._begin = time.monotonic()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._waker, b"x")
        self._thread.join()
        for handle in (self._master, self._slave, self._wake, self._waker):
            os.close(handle)

    def now(self) -> float:
        """Time of the servos [s]."""
        return time.monotonic() - self._begin

    def _serve(self) -> None:
        while True:
            due = self.bus.next_time()
            wait = None if due is None else max(due - self.now(), 0.0)
            ready, _, _ = select.select([self._master, self._wake], [], [], wait)
            if self._wake in ready:
                return
            with self.lock:
                if self._master in ready:
                    self.bus.receive(self.now(), os.read(self._master, _CHUNK))
                data = self.bus.transmit(self.now())
            if data:
                self._say(data)

    def _say(self, data: bytes) -> None:
        try:
            os.write(self._master, data)
        except BlockingIOError:
            return


def tried(call: Callable[[], Any], good: Any) -> Any:
    """What it returns, tried again and again: a busy machine may be slower than its patience."""
    found = None
    for _ in range(20):
        try:
            found = call()
        except RuntimeError as error:
            found = error
        if found == good:
            return found
        time.sleep(0.05)
    return found
