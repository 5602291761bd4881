"""The engine of SLURM, through submitit."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import logging
import pickle
import platform
import signal
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.errors import BadInputError, ConfigError, OutputError, WorkerError, in_one_line
from antennate.files import write_whole
from antennate.messages import shortened
from antennate.studies.codec import decoded, dumped, encoded
from antennate.studies.identity import environment
from antennate.studies.processes import added_objects, on_ctrl_c
from antennate.studies.slurm_job import Resumable, note_of, show_new
from antennate.studies.slurm_queue import Queue, QueuedJob, cancel, earlier_jobs
from antennate.studies.store import parsed, read_store
from antennate.studies.submitted import require_package
from antennate.studies.work import Emit, Fail, Failure, Waiting, Work

_LOOK = 0.5
"""How often the driver looks for what the jobs of SLURM have finished [s]."""
_FAILED_STARTS = 3
"""So many jobs in a row that end before they have begun end the run."""
_NOTE = logging.getLogger(__name__)


class Slurm:
    """Jobs of SLURM through submitit, on a file system that they share with the driver.

    A job appends what it has finished to a file of its own, which the driver reads. So a job that
    is preempted and begins again, with the tasks it was first given, goes on where it was; a job
    that is killed loses the trial that it was at. What a job was given is kept beside its file. So
    the next driver after one that was killed finds what its jobs have finished since, and takes
    over those that still wait or run.

    Args:
        cluster: slurm, or local for processes of this machine that are told the same.
        options: What SLURM is asked for, as submitit names it: `timeout_min=60`.
    """

    name = "slurm"

    def __init__(self, cluster: str, options: Sequence[str]) -> None:
        require_package("submitit", "slurm")
        self._cluster, self._options = cluster, dict(_setting(each) for each in options)

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks on `count` jobs at once; see `Engine`."""
        if work.folder is None:
            raise WorkerError("slurm: expected a run directory that jobs can see, found none")
        at_once = max(map(len, parts)) if work.together else 1
        files = _Files(work.folder / self.name, work, at_once, emit, fail)
        executor, queue = self._executor(files.folder), Queue()
        todo = [place for part in parts for place in part]
        running, todo = files.take_old(todo, earlier_jobs(files.folder, queue))
        size = max(1, -(-len(todo) // count))  # as many lists as jobs: each job waits in a queue
        waiting = Waiting([todo[i : i + size] for i in range(0, len(todo), size)])
        try:
            while waiting or running:
                while waiting and len(running) < count:
                    job = files.job(waiting.next())
                    future = self._submitted(executor, job.call, queue)
                    running[future] = job
                    files.note(job, self._cluster, future.job_id)
                show_new(files.folder)
                for future in list(running):
                    ended, job = future.done(), running[future]
                    files.take(job, ended)
                    if ended:
                        del running[future]
                        files.forget(job)
                        self._end(future, job, waiting, files, fail)
                queue.tell_waiting(running)
                time.sleep(_LOOK if running else 0.0)
        except KeyboardInterrupt:
            for job in running.values():
                files.take(job)
            raise
        finally:
            if not queue.silent:
                cancel(running)

    def _end(self, future: Any, job: _Job, waiting: Waiting, files: _Files, fail: Fail) -> None:
        """What becomes of the tasks that an ended job did not finish.

        Of more than run at once the first is what it was at; of none, if it had not begun.

        Raises:
            WorkerError: No job will do better.
        """
        if not job.left:
            return
        error = future.exception()
        error = future.result() if error is None else error
        if isinstance(error, WorkerError):
            raise WorkerError(f"slurm: {error}")
        if not job.held_trials and isinstance(error, TimeoutError):
            raise WorkerError(
                "slurm: expected a job to end a trial within its time limit, found none; ask for "
                "more with --slurm timeout_min=MINUTES, or for less with --trial-timeout"
            )
        if not job.read:
            files.failed_starts += 1
            if files.failed_starts >= _FAILED_STARTS:
                raise WorkerError(
                    f"slurm: expected jobs to begin, found {files.failed_starts} in a row that "
                    f"ended before: {_last(error)}"
                )
            waiting.put_back(job.left)
        elif (given_up := waiting.lost(job.left, len(job.left) <= files.at_once)) is not None:
            fail(given_up, Failure("crashed", shortened(f"its job ended: {_last(error)}")))

    def _executor(self, folder: Path) -> Any:
        import submitit

        try:
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                executor = submitit.AutoExecutor(folder, cluster=self._cluster)
                executor.update_parameters(**self._options)
        except (NameError, AssertionError) as error:
            raise WorkerError(
                "--slurm: expected names of submitit, such as timeout_min, mem_gb or "
                f"slurm_partition; it says: {str(error).partition(chr(10))[0]}"
            ) from None
        except (RuntimeError, ValueError, TypeError) as error:
            raise WorkerError(f"slurm: cannot be used: {in_one_line(error)}") from None
        for warning in told:
            _NOTE.warning("--slurm: submitit says: %s", warning.message)
        return executor

    def _submitted(self, executor: Any, call: Any, queue: Queue) -> Any:
        """A job that has been submitted.

        Raises:
            WorkerError: SLURM does not take it, or begins it more than once.
        """
        try:
            # submitit prints what it raises, and ends jobs of this machine by Ctrl-C, which they
            # would ignore if they came from a driver that a shell has started with `&`
            with contextlib.redirect_stderr(io.StringIO()), on_ctrl_c(signal.default_int_handler):
                job = executor.submit(call)
        except (RuntimeError, OSError) as error:
            text = "; ".join(str(error).replace("sbatch: error: ", "").splitlines())
            raise WorkerError(f"slurm: expected a job to be taken, found: {text}") from None
        if job.num_tasks > 1:
            cancel([job])
            raise WorkerError(f"--slurm: expected jobs of one task, found {job.num_tasks}")
        return QueuedJob(job, queue) if self._cluster == self.name else job


class _Files:
    """The files that the jobs of one driver write, and those of an earlier one.

    Attributes:
        at_once: How many tasks a job runs together.
        failed_starts: Jobs that ended before they had begun, since one did begin.
    """

    def __init__(self, folder: Path, work: Work, at_once: int, emit: Emit, fail: Fail) -> None:
        self.folder, self._work, self._emit, self._fail = folder, work, emit, fail
        self.at_once, self.failed_starts = at_once, 0
        self._identity = {**(work.shared or environment()), "work": _digest(work)}
        self._packages = {"antennate", work.function.__module__.partition(".")[0]}
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"expected to write {folder}, found: {error.strerror}") from None

    def take_old(
        self, todo: list[int], noted: Mapping[Path, tuple[Any, list[int]]]
    ) -> tuple[dict[Any, _Job], list[int]]:
        """Take what jobs of a driver that was killed have finished.

        Args:
            todo: Places without a result.
            noted: Jobs that still wait or run, by their files, each with its places.

        Returns:
            Those jobs that are at this work, and the places that nobody is at. Others are ended.
        """
        left, running = set(todo), dict[Any, _Job]()
        for file in sorted({*self.folder.glob("*.jsonl"), *noted}):
            future, places = noted.get(file, (None, sorted(left)))
            job = _Job(file, [place for place in places if place in left])
            if ours := self._is_ours(file):
                left -= set(job.left)
                self.take(job, again=self._work.retry)
                if future is not None and job.left:
                    running[future] = job
                    continue
                left |= set(job.left)
            if future is not None:
                cancel([future])
                note_of(file).unlink(missing_ok=True)
            elif ours:
                file.unlink(missing_ok=True)
        return running, sorted(left)

    def _is_ours(self, file: Path) -> bool:
        """Whether a file or, before its job has begun, the note beside it is of this work."""
        with contextlib.suppress(BadInputError):
            return read_store(file).identity == self._identity
        with contextlib.suppress(OSError, ValueError, KeyError):
            return json.loads(note_of(file).read_text())["identity"] == self._checksum()
        return False

    def _checksum(self) -> str:
        return hashlib.sha256(dumped(self._identity).encode()).hexdigest()

    def job(self, places: list[int]) -> _Job:
        """A new job for some tasks."""
        from cloudpickle import dumps  # submitit brings it

        file = self.folder / f"{time.time_ns()}.jsonl"
        told = (self._identity, self._work.part(places), added_objects(dumps), self.at_once)
        return _Job(file, places, Resumable(str(file), *told, noted=True))

    def note(self, job: _Job, cluster: str, number: str) -> None:
        """Keep what a job was given, and its number, for a driver after this one."""
        told = {"cluster": cluster, "job": number, "host": platform.node(), "places": job.left}
        content = {**told, "identity": self._checksum()}
        write_whole(note_of(job.file), dumped(content).encode())

    def forget(self, job: _Job) -> None:
        """Remove the files of a job that has ended; its results have been taken."""
        note_of(job.file).unlink(missing_ok=True)
        job.file.unlink(missing_ok=True)

    def take(self, job: _Job, ended: bool = False, again: bool = False) -> None:
        """Take the lines that have come to the file of a job since it was last read.

        Args:
            job: The job.
            ended: Whether it has; a network file system shows the last lines once it is opened.
            again: Whether tasks that failed are left, to be run again.
        """
        if not job.file.exists() or (job.file.stat().st_size == job.read and not ended):
            return
        with job.file.open("rb") as file:
            file.seek(job.read)
            data = file.read()
        whole = data[: data.rfind(b"\n") + 1]
        job.read += len(whole)
        found = parsed(whole)
        for model in found.processors:
            self._work.saw(model)
        records = found.records
        if whole:
            self.failed_starts = 0
        job.held_trials |= bool(records)
        for place in [place for place in job.left if str(place) in records]:
            record = records[str(place)]
            if "failure" not in record:
                self._emit(place, decoded(record["result"], self._packages))
            elif not again:
                self._fail(place, Failure(*record["failure"]))
            else:
                continue
            job.left.remove(place)


@dataclass
class _Job:
    """What a job was given and has not finished, and how far its file was read [bytes]."""

    file: Path
    left: list[int]
    call: Resumable | None = None
    read: int = 0
    held_trials: bool = False


def _digest(work: Work) -> str:
    """A checksum of what is run that is the same in each process.

    It is no pickle where that can be: the sets in one are in another order in each process.
    """
    known: dict[int, bytes] = {}  # points have many trials, which share a configuration

    def told(value: Any) -> bytes:
        if isinstance(value, tuple):
            return b"(%b)" % b",".join(map(told, value))
        if id(value) not in known:
            try:
                known[id(value)] = dumped(encoded(value)).encode()
            except TypeError:
                known[id(value)] = pickle.dumps(value)
        return known[id(value)]

    name = f"{work.function.__module__}:{work.function.__qualname__}"
    content = hashlib.sha256(name.encode())
    for task in work.tasks:
        content.update(told(task))
    return content.hexdigest()


def _last(error: object) -> str:
    """The last line of what submitit says of a job; of a trace that it quotes, if it does."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    ruled = [i for i, line in enumerate(lines) if set(line) == {"-"}]
    end = ruled[1] if len(ruled) > 1 else len(lines)
    return shortened(lines[end - 1]) if lines else "it was cancelled"


def _setting(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    if not name.isidentifier() or not value:
        raise ConfigError(f"--slurm: expected NAME=VALUE, found {text}")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value
