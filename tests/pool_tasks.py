"""Tasks for test_pool.py, in a module of their own that fresh worker processes can import."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def halves(number: int, by: int) -> tuple[int, int]:
    return divmod(number, by)


def die(task: int) -> None:
    os._exit(3)


def tell_and_wait(task: int) -> None:
    os.write(1, f"{os.getpid()}\n".encode())
    time.sleep(120.0)


def beside(tasks: list[tuple[str, int]], emit: Callable[[int, Any], None]) -> None:
    """Of each task the numbers that are carried out with it."""
    for place in range(len(tasks)):
        emit(place, [number for _, number in tasks])


def trouble(number: int, folder: str) -> int:
    """Note that it runs; 3 kills its worker, 5 never ends, 6 and 8 raise."""
    with (Path(folder) / str(number)).open("a") as file:
        file.write("x")
    if number == 3:
        os._exit(9)
    if number == 5:
        time.sleep(120.0)
    if number == 6:
        raise ValueError("six")
    if number == 8:
        raise RuntimeError("eight")
    return number * number


def trouble_together(tasks: list[tuple[int, str]], emit: Callable[[int, Any], None]) -> None:
    for i, (number, folder) in enumerate(tasks):
        emit(i, trouble(number, folder))
