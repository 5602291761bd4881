"""Tasks over processes: each result at once, and nothing lost when somebody presses Ctrl-C.

A task gives each result to `emit`; it is sent to the parent at once, beside the executor,
which returns a task's value only at its end. Processes are started fresh (spawn) and leave Ctrl-C
to the parent. One worker means this process, without any start-up cost. Results come in no
particular order; sort them.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from antennate.errors import WorkerError, in_one_line
from antennate.lookup import ADDED, NotSent

Task = TypeVar("Task")
Result = TypeVar("Result")
Emit = Callable[[Any], None]
"""Takes one result."""

_GUARD = (
    '; a script that uses several workers needs `if __name__ == "__main__":` around what it runs'
)
"""What a worker that ended with code 1 most often lacks: it raised while it imported the script."""
_POLL = 0.1
"""How often the parent looks for finished tasks while it waits for results [s]."""
_results: Any = None
"""In a worker: the queue to the parent."""


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
        KeyboardInterrupt: After the results that had arrived by then were given to `on_result`.
    """
    if workers == 1 or len(tasks) <= 1:
        for task in tasks:
            function(task, on_result)
    else:
        _run_in_processes(function, tasks, min(workers, len(tasks)), on_result)


def _run_in_processes(
    function: Callable[[Task, Emit], None], tasks: Sequence[Task], count: int, on_result: Emit
) -> None:
    if isinstance(checked := _sendable(tasks), NotSent):
        raise WorkerError(checked.reason)
    added = {
        group: {name: _sendable(each) for name, each in objects.items()}
        for group, objects in ADDED.items()
    }
    context = multiprocessing.get_context("spawn")
    results = context.Queue()
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(results, added))
    with _deaf():
        futures = [pool.submit(_work, function, task) for task in tasks]
    crew = set(multiprocessing.active_children()) - others
    try:
        _collect(futures, results, on_result)
    except BrokenProcessPool:
        pool.shutdown()  # its thread waits for the processes too: codes are known after that
        codes = [p.exitcode for p in crew if p.exitcode not in (None, 0, -signal.SIGTERM)]
        raise WorkerError(
            f"a worker process ended with code {codes[0] if codes else 'unknown'} in the middle of "
            f"its work{_GUARD if codes[:1] == [1] else ''}"
        ) from None
    except KeyboardInterrupt:
        with contextlib.suppress(queue.Empty):
            while True:
                on_result(pickle.loads(results.get(timeout=_POLL)))  # noqa: S301  (as below)
        raise
    finally:
        if any(not future.done() for future in futures):
            for process in crew:
                process.terminate()
        pool.shutdown(cancel_futures=True)


def gather(
    function: Callable[..., Result],
    tasks: Sequence[tuple[Any, ...]],
    workers: int,
    on_step: Callable[[int, int], None],
    on_result: Callable[[Result], None] = lambda result: None,
    chunk: int = 1,
) -> list[Result]:
    """What function(*task) returns for every task, in the order of the tasks.

    Args:
        function: A module-level function.
        tasks: Its arguments, picklable.
        workers: As above.
        on_step: Called after each with how many of how many tasks are done.
        on_result: Called with each result as it comes, in no particular order.
        chunk: Tasks given to a process at once.
    """
    found: dict[int, Result] = {}

    def take(item: tuple[int, Result]) -> None:
        place, result = item
        found[place] = result
        on_result(result)
        on_step(len(found), len(tasks))

    numbered = list(enumerate(tasks))
    chunks = [(function, numbered[i : i + chunk]) for i in range(0, len(tasks), chunk)]
    run_tasks(_call, chunks, workers, take)
    return [found[place] for place in range(len(tasks))]


def _call(task: tuple[Callable[..., Any], list[tuple[int, Any]]], emit: Emit) -> None:
    function, numbered = task
    for place, arguments in numbered:
        emit((place, function(*arguments)))


def _collect(futures: Sequence[Future[int]], results: Any, on_result: Emit) -> None:
    """Hand on results until all tasks have ended and all that they emitted has arrived."""
    waiting, expected, received = set(futures), 0, 0
    while waiting or received < expected:
        with contextlib.suppress(queue.Empty):
            on_result(pickle.loads(results.get(timeout=_POLL)))  # noqa: S301  (our own worker's)
            received += 1
        done = {future for future in waiting if future.done()}
        waiting -= done
        for future in done:
            expected += future.result()


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Start workers deaf to Ctrl-C, which they inherit, so that none dies half begun."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _sendable(each: Any) -> Any:
    """The same object if it can be sent to a worker, else what says why not."""
    try:
        pickle.dumps(each)
    except Exception as error:  # noqa: BLE001  (an object's own code may raise anything)
        return NotSent(
            f"expected what can be sent to workers, found {in_one_line(error)}; an object of "
            "your own has to be defined at the top of a module, or run with one worker"
        )
    return each


def _begin(results: Any, added: dict[str, dict[str, Any]]) -> None:
    global _results
    _results = results
    for group, objects in added.items():
        ADDED.setdefault(group, {}).update(objects)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker once its parent is gone, also if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(function: Callable[[Any, Emit], None], task: Any) -> int:
    """Run one task in a worker; how many results it emitted."""
    count = 0

    def emit(result: Any) -> None:
        nonlocal count
        count += 1
        _results.put(pickle.dumps(result))  # here, so that what cannot be pickled is an error

    try:
        function(task, emit)
    except WorkerError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever it is, the parent must hear of it)
        raise WorkerError(f"a worker failed: {type(error).__name__}: {error}") from None
    return count
