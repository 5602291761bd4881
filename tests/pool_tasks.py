"""Tasks for test_pool.py, in a module of their own that fresh worker processes can import."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any


def divmod_task(task: tuple[int, int], emit: Callable[[Any], None]) -> None:
    for part in divmod(*task):
        emit(part)


def die(task: int, emit: Callable[[Any], None]) -> None:
    os._exit(3)


def tell_and_wait(task: int, emit: Callable[[Any], None]) -> None:
    os.write(1, f"{os.getpid()}\n".encode())
    time.sleep(120.0)
