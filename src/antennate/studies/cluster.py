"""Engines on a cluster: Dask, and SLURM through submitit."""

from __future__ import annotations

import contextlib
import faulthandler
import hashlib
import json
import pickle
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.errors import (
    BadInputError,
    ConfigError,
    MissingPackageError,
    OutputError,
    WorkerError,
    in_one_line,
)
from antennate.messages import shortened
from antennate.studies.codec import decoded, encoded
from antennate.studies.identity import environment
from antennate.studies.processes import added_objects, take_added
from antennate.studies.store import Store, parsed, read_store
from antennate.studies.submitted import Submitted, carry_out, require_same
from antennate.studies.work import Emit, Fail, Failure, Part, Waiting, Work

_CONNECT = 10.0
"""Time within which a Dask scheduler has to answer [s]."""
_LOOK = 0.5
"""How often the driver looks for what the jobs of SLURM have finished [s]."""
_TOGETHER = 12
"""Most tasks that run at once; of a longer list the first is what its job was at."""


class Dask:
    """Workers of Dask: those of a scheduler, or as many as are asked for on this machine.

    Workers may join and leave at any time. A task whose worker died is tried again by Dask itself
    on others (its `allowed-failures`), and then as every engine does.

    Args:
        address: HOST:PORT of a scheduler; None starts one here.
    """

    name = "dask"

    def __init__(self, address: str | None = None) -> None:
        self._address = address
        _require("distributed", "dask")

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks at these places; see `Engine`."""
        from distributed import KilledWorker

        with self._client(count) as client:

            def submit(function: Any, *arguments: Any) -> Any:
                return client.submit(carry_out_watched, *arguments, pure=False)

            threads = sum(client.nthreads().values())
            Submitted(self.name, submit, (KilledWorker,)).run(
                work, parts, max(count, threads), emit, fail
            )

    @contextlib.contextmanager
    def _client(self, count: int) -> Iterator[Any]:
        from distributed import Client, LocalCluster

        with contextlib.ExitStack() as stack:
            place: Any = f"tcp://{self._address}"
            if self._address is None:
                place = stack.enter_context(
                    LocalCluster(
                        n_workers=count,
                        threads_per_worker=1,
                        dashboard_address="127.0.0.1:0",
                        silence_logs=50,
                    )
                )
            try:
                yield stack.enter_context(Client(place, timeout=_CONNECT, set_as_default=False))
            except OSError as error:
                raise WorkerError(
                    f"dask: expected a scheduler at {place}, found none: {in_one_line(error)}"
                ) from None


class Slurm:
    """Jobs of SLURM through submitit, on a file system that they share with the driver.

    A job appends what it has finished to a file of its own, which the driver reads. So a job that
    is preempted and begins again, with the tasks it was first given, goes on where it was; a job
    that is killed loses the trial that it was at; and a driver that was killed finds what its jobs
    have finished since.

    Args:
        cluster: slurm, or local for processes of this machine that are told the same.
        options: What SLURM is asked for, as submitit names it: `timeout_min=60`.
    """

    name = "slurm"

    def __init__(self, cluster: str, options: Sequence[str]) -> None:
        _require("submitit", "slurm")
        self._cluster, self._options = cluster, dict(_setting(each) for each in options)

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks on `count` jobs at once; see `Engine`."""
        if work.folder is None:
            raise WorkerError("slurm: expected a run directory that jobs can see, found none")
        files = _Files(work.folder / self.name, work, emit, fail)
        todo = files.take_old([place for part in parts for place in part])
        size = max(1, -(-len(todo) // count))  # as many lists as jobs: each job waits in a queue
        waiting = Waiting([todo[i : i + size] for i in range(0, len(todo), size)])
        running: dict[Any, _Job] = {}
        executor = self._executor(files.folder)
        try:
            while waiting or running:
                while waiting and len(running) < count:
                    job = files.job(waiting.next())
                    running[executor.submit(job.call)] = job
                for future in list(running):
                    ended, job = future.done(), running[future]
                    files.take(job)
                    if ended:
                        del running[future]
                        self._end(future, job, work, waiting, fail)
                time.sleep(_LOOK if running else 0.0)
        finally:
            for future in running:
                future.cancel()

    def _end(self, future: Any, job: _Job, work: Work, waiting: Waiting, fail: Fail) -> None:
        """What becomes of the tasks that an ended job did not finish."""
        if not job.left:
            job.file.unlink(missing_ok=True)
            return
        text = str(future.exception())
        if WorkerError.__name__ in text:
            line = next(x for x in reversed(text.splitlines()) if WorkerError.__name__ in x)
            raise WorkerError(f"slurm: {line.partition(': ')[2]}")
        together = work.together and len(job.left) <= _TOGETHER
        if (given_up := waiting.lost(job.left, together)) is not None:
            last = text.strip().splitlines()[-1] if text.strip() else "it was cancelled"
            fail(given_up, Failure("crashed", shortened(f"its job ended: {last}")))

    def _executor(self, folder: Path) -> Any:
        import submitit

        try:
            executor = submitit.AutoExecutor(folder, cluster=self._cluster)
            executor.update_parameters(**self._options)
        except (RuntimeError, ValueError, TypeError, NameError) as error:
            raise WorkerError(f"slurm: cannot be used: {in_one_line(error)}") from None
        return executor


class _Files:
    """The files that the jobs of one driver write, and those of an earlier one."""

    def __init__(self, folder: Path, work: Work, emit: Emit, fail: Fail) -> None:
        self.folder, self._work, self._emit, self._fail = folder, work, emit, fail
        content = pickle.dumps((work.function, list(work.tasks)))
        self._identity = {**environment(), "work": hashlib.sha256(content).hexdigest()}
        self._packages = {"antennate", work.function.__module__.partition(".")[0]}
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"expected to write {folder}, found: {error.strerror}") from None

    def take_old(self, todo: list[int]) -> list[int]:
        """Take what jobs of a driver that was killed have finished; the places still to do."""
        left = set(todo)
        for file in sorted(self.folder.glob("*.jsonl")):
            job = _Job(file, sorted(left))
            with contextlib.suppress(BadInputError):
                if read_store(file)[0] == self._identity:
                    self.take(job)
                    left = set(job.left)
        return sorted(left)

    def job(self, places: list[int]) -> _Job:
        """A new job for some tasks."""
        file = self.folder / f"{time.time_ns()}.jsonl"
        call = Resumable(str(file), self._identity, self._work.part(places), added_objects())
        return _Job(file, places, call)

    def take(self, job: _Job) -> None:
        """Take what has come to the file of a job since it was last read."""
        size = job.file.stat().st_size if job.file.exists() else 0
        if size == job.size:
            return
        job.size = size
        records = parsed(job.file.read_bytes())[1]
        for place in [place for place in job.left if str(place) in records]:
            job.left.remove(place)
            record = records[str(place)]
            if "failure" in record:
                self._fail(place, Failure(*record["failure"]))
            else:
                self._emit(place, decoded(record["result"], self._packages))


@dataclass
class _Job:
    """What a job was given and has not finished, and its file as it was last read [bytes]."""

    file: Path
    left: list[int]
    call: Resumable | None = None
    size: int = 0


class Resumable:
    """What a job calls; SLURM may begin it again, with what it was first given."""

    def __init__(
        self, file: str, identity: Mapping[str, Any], part: Part, added: Mapping[str, Any]
    ) -> None:
        self._file, self._identity, self._part, self._added = file, identity, part, added

    def __call__(self) -> int:
        """Carry out what is not in its file yet; how many tasks that was."""
        require_same({k: v for k, v in self._identity.items() if k != "work"})
        take_added(self._added)
        store = Store(Path(self._file))
        store.begin(self._identity)
        left = {k: task for k, task in self._part.tasks.items() if str(k) not in store.records}

        def fail(place: int, failure: Failure) -> None:
            store.append(str(place), {"failure": [failure.status, failure.reason]})

        part = Part(self._part.function, left, self._part.together, self._part.timeout)
        with _watched(part):
            part.carry_out(lambda p, r: store.append(str(p), {"result": encoded(r)}), fail)
        store.close()
        return len(left)

    def checkpoint(self) -> Any:
        """What submitit submits when the job is preempted or has run out of time: the same."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


@contextlib.contextmanager
def _watched(part: Part) -> Iterator[None]:
    """End this process if a part does not end in time, whatever it is doing."""
    faulthandler.dump_traceback_later(part.timeout * max(1, len(part.tasks)), exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def carry_out_watched(part: Part, *told: Any) -> list[tuple[int, Any]]:
    """As `carry_out`, in a worker process that may be ended."""
    with _watched(part):
        return carry_out(part, *told)


def _setting(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    if not name.isidentifier() or not value:
        raise ConfigError(f"--slurm: expected NAME=VALUE, found {text}")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _require(package: str, extra: str) -> None:
    from importlib.util import find_spec

    if find_spec(package) is None:
        raise MissingPackageError(
            f"engine: expected the package {package}, found none; install it with "
            f"`pip install 'antennate[{extra}]'`"
        )
