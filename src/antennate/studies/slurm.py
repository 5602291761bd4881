"""The engine of SLURM, through submitit."""

from __future__ import annotations

import contextlib
import getpass
import hashlib
import json
import os
import pickle
import platform
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.errors import BadInputError, ConfigError, OutputError, WorkerError, in_one_line
from antennate.files import write_whole
from antennate.messages import shortened
from antennate.studies.codec import decoded, dumped, encoded
from antennate.studies.identity import environment
from antennate.studies.processes import Processes, added_objects
from antennate.studies.store import Store, parsed, read_store
from antennate.studies.submitted import require_package, require_same, work_apart
from antennate.studies.work import Emit, Fail, Failure, Part, Waiting, Work

_LOOK = 0.5
"""How often the driver looks for what the jobs of SLURM have finished [s]."""
_ANSWER = 60.0
"""Time within which squeue has to answer [s]."""
_LATER = (signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)
"""What SLURM may send to all processes of a job some time before it ends it."""


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
        executor = self._executor(files.folder)
        todo = [place for part in parts for place in part]
        running, todo = files.take_old(todo, earlier_jobs(files.folder))
        size = max(1, -(-len(todo) // count))  # as many lists as jobs: each job waits in a queue
        waiting = Waiting([todo[i : i + size] for i in range(0, len(todo), size)])
        try:
            while waiting or running:
                while waiting and len(running) < count:
                    job = files.job(waiting.next())
                    future = executor.submit(job.call)
                    running[future] = job
                    files.note(job, self._cluster, future.job_id)
                for future in list(running):
                    ended, job = future.done(), running[future]
                    files.take(job)
                    if ended:
                        del running[future]
                        job.note.unlink(missing_ok=True)
                        self._end(future, job, waiting, at_once, fail)
                time.sleep(_LOOK if running else 0.0)
        finally:
            for future in running:
                future.cancel()

    def _end(self, future: Any, job: _Job, waiting: Waiting, at_once: int, fail: Fail) -> None:
        """What becomes of the tasks that an ended job did not finish.

        Of more than run at once the first is what it was at.
        """
        if not job.left:
            job.file.unlink(missing_ok=True)
            return
        text = str(future.exception())
        if WorkerError.__name__ in text:
            line = next(x for x in reversed(text.splitlines()) if WorkerError.__name__ in x)
            raise WorkerError(f"slurm: {line.partition(': ')[2]}")
        if (given_up := waiting.lost(job.left, len(job.left) <= at_once)) is not None:
            last = text.strip().splitlines()[-1] if text.strip() else "it was cancelled"
            fail(given_up, Failure("crashed", shortened(f"its job ended: {last}")))

    def _executor(self, folder: Path) -> Any:
        import submitit

        try:
            executor = submitit.AutoExecutor(folder, cluster=self._cluster)
            executor.update_parameters(**self._options)
        except NameError as error:
            raise WorkerError(
                "--slurm: expected names of submitit, such as timeout_min, mem_gb or "
                f"slurm_partition; it says: {str(error).partition(chr(10))[0]}"
            ) from None
        except (RuntimeError, ValueError, TypeError) as error:
            raise WorkerError(f"slurm: cannot be used: {in_one_line(error)}") from None
        return executor


class _Files:
    """The files that the jobs of one driver write, and those of an earlier one."""

    def __init__(self, folder: Path, work: Work, at_once: int, emit: Emit, fail: Fail) -> None:
        self.folder, self._work, self._emit, self._fail = folder, work, emit, fail
        self._at_once = at_once
        content = pickle.dumps((work.function, list(work.tasks)))
        digest = hashlib.sha256(content).hexdigest()
        self._identity = {**(work.shared or environment()), "work": digest}
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
            if self._is_ours(file):
                left -= set(job.left)
                self.take(job)
                if future is not None and job.left:
                    running[future] = job
                    continue
                left |= set(job.left)
            if future is not None:
                future.cancel()
                job.note.unlink(missing_ok=True)
        return running, sorted(left)

    def _is_ours(self, file: Path) -> bool:
        """Whether a file or, before its job has begun, the note beside it is of this work."""
        with contextlib.suppress(BadInputError):
            return read_store(file)[0] == self._identity
        with contextlib.suppress(OSError, ValueError, KeyError):
            return json.loads(_Job(file, []).note.read_text())["identity"] == self._checksum()
        return False

    def _checksum(self) -> str:
        return hashlib.sha256(dumped(self._identity).encode()).hexdigest()

    def job(self, places: list[int]) -> _Job:
        """A new job for some tasks."""
        file = self.folder / f"{time.time_ns()}.jsonl"
        part = self._work.part(places)
        call = Resumable(str(file), self._identity, part, added_objects(), self._at_once)
        return _Job(file, places, call)

    def note(self, job: _Job, cluster: str, number: str) -> None:
        """Keep what a job was given, and its number, for a driver after this one."""
        told = {"cluster": cluster, "job": number, "host": platform.node(), "places": job.left}
        write_whole(job.note, dumped({**told, "identity": self._checksum()}).encode())

    def take(self, job: _Job) -> None:
        """Take the lines that have come to the file of a job since it was last read."""
        if not job.file.exists() or job.file.stat().st_size == job.read:
            return
        with job.file.open("rb") as file:
            file.seek(job.read)
            data = file.read()
        whole = data[: data.rfind(b"\n") + 1]
        job.read += len(whole)
        records = parsed(whole)[1]
        for place in [place for place in job.left if str(place) in records]:
            job.left.remove(place)
            record = records[str(place)]
            if "failure" in record:
                self._fail(place, Failure(*record["failure"]))
            else:
                self._emit(place, decoded(record["result"], self._packages))


@dataclass
class _Job:
    """What a job was given and has not finished, and how far its file was read [bytes]."""

    file: Path
    left: list[int]
    call: Resumable | None = None
    read: int = 0

    @property
    def note(self) -> Path:
        """What says its number."""
        return self.file.with_suffix(".job")


def earlier_jobs(folder: Path) -> dict[Path, tuple[Any, list[int]]]:
    """Jobs of an earlier driver that still wait or run, by their files, and what they were given.

    Raises:
        WorkerError: SLURM does not say which jobs there are.
    """
    found: dict[Path, tuple[Any, list[int]]] = {}
    queue: set[str] | None = None
    for note in sorted(folder.glob("*.job")):
        try:
            told = json.loads(note.read_text())
            number, places = str(told["job"]), list(told["places"])
            cluster, host = told["cluster"], told["host"]
        except (OSError, ValueError, KeyError, TypeError):
            continue  # torn: it was about to be written
        if cluster == "local":
            future: Any = LocalJob(int(number), host)
            alive = not future.done()
        else:
            from submitit import SlurmJob

            queue = _queue() if queue is None else queue
            future, alive = SlurmJob(folder, number), number in queue
        if alive:
            found[note.with_suffix(".jsonl")] = future, places
        else:
            note.unlink(missing_ok=True)
    return found


def _queue() -> set[str]:
    """Numbers of the jobs of this user that wait or run."""
    words = ["squeue", "--noheader", "--format=%A", f"--user={getpass.getuser()}"]
    try:
        said = subprocess.run(  # noqa: S603  (fixed words)
            words, capture_output=True, text=True, check=True, timeout=_ANSWER
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise WorkerError(
            "slurm: expected squeue to say which jobs of an earlier command still run, found: "
            f"{in_one_line(error)}"
        ) from None
    return set(said.stdout.split())


class LocalJob:
    """A job of this machine that another process began: submitit knows its own ones only."""

    def __init__(self, process: int, host: str) -> None:
        self._process, self._here = process, host == platform.node()

    def done(self) -> bool:
        """Whether its process has ended; one of another machine counts as ended."""
        if not self._here:
            return True
        try:
            os.kill(self._process, 0)
            words = Path(f"/proc/{self._process}/cmdline")
            return words.exists() and b"submitit" not in words.read_bytes()  # its number was reused
        except OSError:
            return True

    def cancel(self) -> None:
        """End it, and with it the process that it started."""
        with contextlib.suppress(OSError):
            if not self.done():
                os.kill(self._process, signal.SIGINT)

    def exception(self) -> str:
        """Why it ended before its work."""
        return "it ended"


class Resumable:
    """What a job calls; SLURM may begin it again, with what it was first given.

    The trials run in a process beside it, so one that crashes or hangs is found as on one machine.
    """

    def __init__(
        self,
        file: str,
        identity: Mapping[str, Any],
        part: Part,
        added: Mapping[str, Any],
        at_once: int = 1,
    ) -> None:
        self._file, self._identity, self._part, self._added = file, identity, part, added
        self._at_once = at_once

    def __call__(self) -> int:
        """Carry out what is not in its file yet; how many tasks that was."""
        require_same({k: v for k, v in self._identity.items() if k != "work"}, Path())
        store = Store(Path(self._file))
        store.begin(self._identity)
        left = {k: task for k, task in self._part.tasks.items() if str(k) not in store.records}

        places = list(left)

        def emit(index: int, result: Any) -> None:
            store.append(str(places[index]), {"result": encoded(result)})

        def fail(index: int, failure: Failure) -> None:
            store.append(str(places[index]), {"failure": [failure.status, failure.reason]})

        part = Part(self._part.function, left, self._part.together, self._part.timeout)
        indices, size = range(len(left)), self._at_once
        parts = [indices[i : i + size] for i in indices[::size]]
        if left:
            work = work_apart(part, Path.cwd(), self._added, _LATER)
            Processes().run(work, parts, 1, emit, fail)
        store.close()
        return len(left)

    def checkpoint(self) -> Any:
        """What submitit submits when the job is preempted or has run out of time: the same."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


def _setting(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    if not name.isidentifier() or not value:
        raise ConfigError(f"--slurm: expected NAME=VALUE, found {text}")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value
