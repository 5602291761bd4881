"""Tasks over processes: results at once, nothing lost when somebody presses Ctrl-C.

A task hands out results one by one through `emit`; they travel back at once. Processes are started
fresh (spawn) and leave Ctrl-C to the parent. One worker means this process, without any start-up
cost. Results come in no particular order; sort them.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import threading
from collections.abc import Callable, Sequence
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from antennate.errors import WorkerError

Task = TypeVar("Task")
Emit = Callable[[Any], None]
"""Takes one result."""

_POLL = 0.2
"""How often the parent looks for dead workers while it waits [s]."""


def core_count() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_tasks(
    function: Callable[[Task, Emit], None],
    tasks: Sequence[Task],
    workers: int,
    on_result: Emit,
) -> None:
    """Run function(task, emit) for every task.

    Args:
        function: A module-level function.
        tasks: Its first arguments, picklable.
        workers: Number of processes; 1 runs in this one.
        on_result: Called in this process with everything that was emitted.

    Raises:
        WorkerError: A worker died, or the function raised there.
        KeyboardInterrupt: After the results that had arrived by then were handed on.
    """
    if workers == 1 or len(tasks) <= 1:
        for task in tasks:
            function(task, on_result)
        return
    context = multiprocessing.get_context("spawn")
    todo: Any = context.Queue()
    done: Any = context.Queue()
    count = min(workers, len(tasks))
    for task in (*tasks, *[None] * count):
        todo.put(task)
    crew: list[BaseProcess] = [
        context.Process(target=_work, args=(function, todo, done), daemon=True)
        for _ in range(count)
    ]
    try:
        _start(crew)
        _collect(crew, done, on_result)
    except KeyboardInterrupt:
        while not done.empty():
            kind, value = done.get()
            if kind == "result":
                on_result(value)
        raise
    finally:
        for process in crew:
            if process.pid is not None:
                process.terminate()
        todo.cancel_join_thread()


def _start(crew: list[BaseProcess]) -> None:
    """Start all workers deaf to Ctrl-C, which they inherit, so that none dies half begun."""
    if threading.current_thread() is not threading.main_thread():
        for process in crew:
            process.start()
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        for process in crew:
            process.start()
    finally:
        signal.signal(signal.SIGINT, before)


def _work(function: Callable[[Any, Emit], None], todo: Any, done: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        for task in iter(todo.get, None):
            function(task, lambda result: done.put(("result", result)))
    except Exception as error:  # noqa: BLE001  (whatever it is, the parent must hear of it)
        done.put(("error", f"{type(error).__name__}: {error}"))
    done.put(("end", None))


def _collect(crew: list[BaseProcess], done: Any, on_result: Emit) -> None:
    running = len(crew)
    while running:
        try:
            kind, value = done.get(timeout=_POLL)
        except queue.Empty:
            dead = [p for p in crew if p.exitcode not in (None, 0)]
            if dead:
                raise WorkerError(
                    f"a worker process ended with code {dead[0].exitcode} in the middle of its work"
                ) from None
            continue
        if kind == "result":
            on_result(value)
        elif kind == "end":
            running -= 1
        else:
            raise WorkerError(f"a worker failed: {value}")
