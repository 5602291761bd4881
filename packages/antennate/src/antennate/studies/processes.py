"""The engine of this machine: worker processes, each of which is known to hold certain tasks.

So the task that kills a worker, or does not end, is found, and the others go on. Each worker has a
pipe of its own: pools that share one break as a whole when a process dies (CONTRIBUTING.md). Each
result is sent at once. Processes are started fresh (spawn), leave Ctrl-C to the parent, and end
when the parent is gone.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.spawn import get_preparation_data
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError, in_one_line
from antennate.lookup import NotSent
from antennate.sim.engine_setup import dropped
from antennate.studies.sending import Packed, added_objects, sendable, take_added
from antennate.studies.work import Call, Failure, Work, processor

_GUARD = (
    '; a script that uses several workers needs `if __name__ == "__main__":` around what it runs'
)
"""What a worker that ended with code 1 most often lacks: it raised while it imported the script."""
_POLL = 0.1
"""How long results that are on their way are waited for after Ctrl-C [s]."""
_IMPORT = 60.0
"""Time that a worker has to import what its first tasks need [s]; it counts for no task."""
_LONGEST_WAIT = 1.0
"""Most that is waited at once [s]."""
_MOST_FAILED_STARTS = 10
"""Workers in a row that may end before they are ready, as somebody kills them."""
_READY, _BEGUN, _FAILED, _RESULT = range(4)
"""Kinds of messages of a worker."""
_LAST_WORDS = 1.0
"""Time that a worker whose connection has ended has to end by itself, with its own code [s]."""


class Processes:
    """Worker processes of this machine.

    Args:
        stay: Whether those that live serve the next call too; then `end` ends them.
    """

    name = "local"

    def __init__(self, stay: bool = False) -> None:
        self._stay = stay
        self._workers: list[_Worker] = []

    def run(self, call: Call, count: int) -> None:
        """Run the tasks on `count` processes; see `Engine`."""
        _require_children()
        tasks = sendable(call.work.tasks)
        if isinstance(tasks, NotSent):
            raise WorkerError(tasks.reason)
        call.saw(processor())
        pool = _Pool(call, self._workers)
        stays = False
        try:
            pool.run(min(count, len(call)))
            stays = self._stay
        except KeyboardInterrupt:
            pool.take_what_came()
            raise
        finally:
            if not stays:
                self.end()

    def end(self) -> None:
        """End all workers."""
        while self._workers:
            self._workers.pop().kill()


class _Pool:
    """One call: parts that wait, and the workers that carry them out, as many as are needed."""

    def __init__(self, call: Call, workers: list[_Worker]) -> None:
        self._call, self._workers = call, workers
        self._added = added_objects()
        self._failed_starts = 0

    def run(self, count: int) -> None:
        while self._call or any(worker.places for worker in self._workers):
            busy = sum(bool(worker.places) for worker in self._workers)
            while len(self._workers) < min(count, busy + len(self._call)):
                self._workers.append(_Worker(self._added))
            for worker in self._workers:
                if worker.ready and not worker.places and self._call:
                    worker.give(self._call.work.only(self._call.next()))
            end = min(worker.deadline for worker in self._workers)
            left = min(max(0.0, end - time.monotonic()), _LONGEST_WAIT)
            owners: dict[Any, _Worker] = {
                each: worker
                for worker in self._workers
                for each in (worker.connection, worker.process.sentinel)
            }
            ready = {owners[each]: None for each in wait(list(owners), left)}
            dead = {worker: None for worker in self._workers if not worker.process.is_alive()}
            for worker in ready | dead:
                self._receive(worker)
            for worker in [each for each in self._workers if time.monotonic() > each.deadline]:
                self._remove(worker, hung=True)

    def _receive(self, worker: _Worker) -> None:
        """Take what a worker sent; remove it if it has died."""
        ended = not worker.process.is_alive()
        try:
            while worker.connection.poll():
                self._take(worker, *worker.connection.recv())
        except (EOFError, OSError):
            worker.process.join(_LAST_WORDS)
            ended = True
        if ended:
            self._remove(worker)

    def _take(self, worker: _Worker, kind: int, place: int, content: Any) -> None:
        worker.answered(self._call.work)
        if kind == _READY:
            worker.ready, self._failed_starts = True, 0
        elif kind != _BEGUN:
            worker.places.remove(place)
            (self._call.emit if kind == _RESULT else self._call.fail)(place, content)

    def _remove(self, worker: _Worker, hung: bool = False) -> None:
        worker.kill()
        self._workers.remove(worker)
        code, left = worker.process.exitcode, worker.places
        if not worker.ready:
            self._failed_starts += 1
            if code == 1 or self._failed_starts > _MOST_FAILED_STARTS:
                guard = _GUARD if code == 1 else ""
                raise WorkerError(f"a worker process ended with code {code} before its work{guard}")
        if not left:
            return
        why = Failure("crashed", f"a worker process ended with code {code} in its work")
        if hung:
            why = Failure("hung", f"no result within {self._call.work.timeout:g} s")
        self._call.lost(left, self._call.work.together, why, final=hung)

    def take_what_came(self) -> None:
        """Take the results that are on their way."""
        for worker in self._workers:
            with contextlib.suppress(EOFError, OSError):
                while worker.connection.poll(_POLL):
                    self._take(worker, *worker.connection.recv())


class _Worker:
    """One worker process.

    Attributes:
        ready: Whether it has started.
        places: Those that it holds and has not answered.
        deadline: When it is given up.
    """

    def __init__(self, added: Packed) -> None:
        context = multiprocessing.get_context("spawn")
        try:
            self.connection, theirs = context.Pipe()
            # a parent that ends ends those that are daemons; others it would wait for
            self.process = context.Process(target=_serve, args=(theirs, added), daemon=True)
            with on_ctrl_c(signal.SIG_IGN):  # they inherit it, so that none dies half begun
                self.process.start()
        except OSError as error:
            raise WorkerError(
                f"expected to start a worker process, found: {error.strerror}; use fewer workers "
                "or raise the limits that `ulimit -a` shows"
            ) from None
        theirs.close()
        self.ready = False
        self.places: list[int] = []
        self.deadline = float("inf")

    def give(self, work: Work) -> None:
        self.places = list(work.tasks)
        self.answered(work)
        self.deadline += _IMPORT
        with contextlib.suppress(OSError):  # it has died: that is noticed next
            self.connection.send(work)

    def answered(self, work: Work) -> None:
        """Begin the time until the next answer."""
        count = len(self.places) if work.together else 1
        self.deadline = time.monotonic() + work.timeout * count if count else float("inf")

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


def _require_children() -> None:
    """Check that this process may begin workers, and that they can import the program."""
    if multiprocessing.current_process().daemon:
        raise WorkerError(
            "expected a process that may begin others, found a daemonic one, as of a pool of "
            "multiprocessing; call it in the main process"
        )
    try:
        program = get_preparation_data("").get("init_main_from_path")
    except OSError as error:
        raise WorkerError(
            f"expected a working directory, found: {error.strerror}; change to one that exists"
        ) from None
    if program is not None and not Path(program).exists():
        raise WorkerError(
            f"expected a program in a file, which workers import, found {Path(program).name}; save "
            "it, or use one worker"
        )


@contextlib.contextmanager
def on_ctrl_c(handler: Any) -> Iterator[None]:
    """Handle Ctrl-C in this way for a while; programs that begin then inherit if it is ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _serve(connection: Connection, added: Packed) -> None:
    """What a worker process does until it is ended."""
    multiprocessing.current_process().daemon = False  # so that a trial may start processes too
    take_added(added)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.dup2(2, 1)  # what a user's code prints belongs to no result of the driver's
    threading.Thread(target=_end_with_parent, daemon=True).start()
    connection.send((_READY, 0, None))

    def emit(place: int, result: Any) -> None:
        try:
            connection.send((_RESULT, place, result))
        except (TypeError, AttributeError, pickle.PicklingError) as error:
            fail(place, Failure("failed", f"a result that cannot be sent: {in_one_line(error)}"))

    def fail(place: int, failure: Failure) -> None:
        connection.send((_FAILED, place, Failure(failure.status, failure.reason)))

    with dropped(), contextlib.suppress(EOFError):
        while True:
            part: Work = connection.recv()
            connection.send((_BEGUN, 0, None))  # what it needs is imported by now
            part.carry_out(emit, fail)


def _end_with_parent() -> None:
    """End this worker once its parent is gone, also if that was killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
