"""The engine of Dask: the workers of a scheduler, or as many as are asked for on this machine."""

from __future__ import annotations

import contextlib
import logging
import math
import multiprocessing
import re
import secrets
import socket
import struct
import threading
import time
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from typing import Any

from antennate.errors import WorkerError, in_one_line
from antennate.lookup import require_package
from antennate.studies.processes import Processes
from antennate.studies.sending import Packed
from antennate.studies.submitted import NO_PLACE, Submitted, folder_of, require_same, work_apart
from antennate.studies.work import Call, Processor, Work, processor

CONNECT = 10.0
"""Time within which a scheduler has to answer, or to come back [s]."""
_ASK = 1.0
"""How often the scheduler is asked for its workers [s]."""
_PATIENCE = 60.0
"""Time without any worker of our own, which Dask starts anew, after which a run ends [s]."""
_STAY = 60.0
"""How long a process beside a worker waits for its next part [s]."""
_LENGTH, _LONGEST_GREETING = struct.Struct("<Q"), 1 << 20
"""The greeting of a scheduler begins with its length; it is never so long [bytes]."""
_UNWATCHED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "10s",
}
"""For a cluster of our own: trials run beside its workers, so watching these takes time alone."""
_NOTE = logging.getLogger(__name__)
_NOISY = ("distributed", "tornado.application")
"""Loggers that tell a lost connection as tracebacks."""


class Dask:
    """Workers of Dask: those of a scheduler, or as many as are asked for on this machine.

    Workers may join and leave at any time. Each runs its trials in a process beside it, so that a
    trial that crashes or hangs is found as on one machine, and the worker lives on. A part whose
    worker died is tried again by Dask itself on others, and then as every engine does.

    Args:
        address: HOST:PORT of a scheduler; None starts one here.
    """

    name = "dask"

    def __init__(self, address: str | None = None) -> None:
        self._address = address
        require_package("distributed", "dask", "engine")

    def run(self, call: Call, count: int) -> None:
        """Carry out the parts of a call; see `Engine`."""
        from distributed import KilledWorker

        run = secrets.token_hex(8)
        with _quiet(), self._started(count) as (client, cluster, place):

            def submit(function: Any, *arguments: Any) -> Any:
                return client.submit(carry_out_apart, *arguments, run, pure=False)

            workers = _Workers(client, place, count, cluster is not None)
            try:
                Submitted(self.name, submit, (KilledWorker,), workers=workers).run(call, count)
            except WorkerError as error:
                if client.status == "running" and not isinstance(error.__cause__, CancelledError):
                    raise
                raise WorkerError(
                    f"dask: expected the scheduler at {place} until the end, found it gone; what "
                    "has ended is kept, and the same command goes on (with --resume, where it is "
                    "no study or search)"
                ) from None

    @contextlib.contextmanager
    def _started(self, count: int) -> Iterator[tuple[Any, Any, str]]:
        """A client, our own cluster if it is one, and where its scheduler is."""
        from dask import config
        from distributed import Client, LocalCluster

        with contextlib.ExitStack() as stack:
            cluster: Any = None
            if self._address is None:
                stack.enter_context(config.set(_UNWATCHED))
                cluster = stack.enter_context(
                    LocalCluster(
                        n_workers=count,
                        threads_per_worker=1,
                        memory_limit=None,
                        dashboard_address="127.0.0.1:0",
                        silence_logs=50,
                    )
                )
            place = f"tcp://{self._address}" if cluster is None else cluster.scheduler_address
            try:
                if cluster is None:
                    _require_scheduler(place)
                with _mismatches_in_a_line():
                    client = Client(
                        place if cluster is None else cluster, timeout=CONNECT, set_as_default=False
                    )
            except (OSError, ImportError) as error:
                other = "none" if isinstance(error, OSError) else "one of other versions"
                raise WorkerError(
                    f"dask: expected a scheduler at {place}, found {other}: {in_one_line(error)}"
                ) from None
            yield stack.enter_context(client), cluster, place


@contextlib.contextmanager
def _mismatches_in_a_line() -> Iterator[None]:
    """Tell other versions of packages at the scheduler in a line; Dask has a table of them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        text = str(warning.message)
        if text.startswith("Mismatched versions"):
            rows = re.findall(r"^\| (\S+) .*\|$", text, re.M)[1:]  # the first is the heading
            _NOTE.warning("dask: driver, scheduler or workers have other %s", ", ".join(rows))
        else:
            warnings.warn(text, warning.category, stacklevel=3)


def _require_scheduler(place: str) -> None:
    """Require that what answers there greets as a scheduler does; a client would wait for ever."""
    head, program = b"", "another program"
    host, _, port = place.removeprefix("tcp://").rpartition(":")
    with socket.create_connection((host.strip("[]"), int(port)), CONNECT) as connection:
        try:
            head = connection.makefile("rb").read(_LENGTH.size)
        except TimeoutError:
            program = f"a program that says nothing for {CONNECT:g} s"
    if len(head) < _LENGTH.size or _LENGTH.unpack(head)[0] > _LONGEST_GREETING:
        raise WorkerError(f"dask: expected a scheduler at {place}, found {program}")


class _Workers:
    """How many parts can run at once, asked for again and again; and what is done if none can."""

    def __init__(self, client: Any, place: str, count: int, own: bool) -> None:
        self._client, self._place, self._own = client, place, own
        self._count = self._found = count
        self._next, self._none_since, self._told = 0.0, math.inf, False

    def __call__(self) -> int:
        """Threads of all workers; the last number that is known while the scheduler is silent."""
        now = time.monotonic()
        if now < self._next or self._client.status != "running":
            return self._found
        self._next = now + _ASK
        with contextlib.suppress(OSError):
            threads = sum(self._client.nthreads().values())
            self._found = max(self._count, threads)
            self._none_since = math.inf if threads else min(self._none_since, now)
            if self._own and now - self._none_since > _PATIENCE:
                raise WorkerError(f"dask: expected workers, found none for {_PATIENCE:g} s")
            if not threads and not self._own and not self._told:
                _NOTE.warning("dask: waits for workers at %s", self._place)
            self._told = not threads
        return self._found


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Without the messages of Dask: what matters of them is told in one line."""
    import distributed  # sets its loggers up  # noqa: F401

    names = [
        name
        for name in logging.Logger.manager.loggerDict
        if any(f"{name}.".startswith(f"{noisy}.") for noisy in _NOISY)
    ]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def carry_out_apart(
    part: Work, theirs: Mapping[str, Any], added: Packed, run: str
) -> list[tuple[int, Any]]:
    """In a worker: results and failures by place, of trials that run in a process beside it.

    The model of its processor comes among them.

    That process serves one run alone, as it knows the user's code as it was at first.
    """
    folder = folder_of(theirs)
    require_same(theirs, folder)
    answers: list[tuple[int, Any]] = [(NO_PLACE, Processor(processor()))]

    def take(place: int, answer: Any) -> None:
        answers.append((place, answer))

    work = work_apart(part, folder, added)
    with _processes(run) as processes:
        processes.run(Call(work, [list(part.tasks)], take, take), 1)
    return answers


_IDLE: dict[Processes, tuple[str, threading.Timer]] = {}
"""Processes beside this worker that wait for a part of a run, and what ends them if none comes."""
_LOCK = threading.Lock()


@contextlib.contextmanager
def _processes(run: str) -> Iterator[Processes]:
    """A process beside this worker; it serves one part of a run after the other."""
    multiprocessing.current_process().daemon = False  # a worker under a nanny may then start one
    with _LOCK:
        processes = next((each for each, (of, _) in _IDLE.items() if of == run), None)
        if processes is not None:
            _IDLE.pop(processes)[1].cancel()
    processes = processes or Processes(stay=True)
    yield processes
    timer = threading.Timer(_STAY, _end, [processes])
    timer.daemon = True
    with _LOCK:
        _IDLE[processes] = run, timer
    timer.start()


def _end(processes: Processes) -> None:
    with _LOCK:
        idle = _IDLE.pop(processes, None)
    if idle is not None:
        processes.end()
