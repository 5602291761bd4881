"""What SLURM says of jobs: those of this driver, and those of an earlier one.

Only `squeue` and `scancel` are asked. `sacct` is not, as many clusters keep no accounts.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import platform
import signal
import subprocess
import time
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError, in_one_line
from antennate.messages import shortened

PATIENCE = 60.0
"""Time without an answer of SLURM after which a run ends [s]."""
_ASK = 5.0
"""How often SLURM is asked for its jobs [s]."""
_ANSWER = 30.0
"""Time within which a command of SLURM has to answer [s]."""
_QUIET = 15.0
"""How long all jobs may wait before it is said why [s]."""
_TIMEOUT = "TIMEOUT"
"""The state of a job that has reached its time limit."""
_ENDED = {
    *("BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL"),
    *("OUT_OF_MEMORY", "PREEMPTED", "REVOKED", _TIMEOUT),
}
"""States of jobs that have ended; one that SLURM begins again is PENDING."""
_NEVER = {
    *("AccountNotAllowed", "BadConstraints", "DependencyNeverSatisfied", "InvalidAccount"),
    *("InvalidQOS", "PartitionConfig", "PartitionNodeLimit", "PartitionTimeLimit"),
    *("QOSNotAllowed",),
}
"""Why jobs wait that no other job's end lets begin."""
_GONE = "GONE"
"""The state of a job that SLURM lists no more."""
_LOG = 4096
"""Most that is read of the end of what a job wrote to stderr [bytes]."""
_NOTE = logging.getLogger(__name__)


class Queue:
    """The jobs of this user, which SLURM is asked for now and then.

    Attributes:
        silent: Whether SLURM has not answered for so long that the run ends; its jobs go on.
    """

    def __init__(self) -> None:
        self.silent = False
        self._jobs: dict[str, tuple[str, str]] = {}
        self._asked = self._next = float("-inf")
        self._answered = self._ran = time.monotonic()
        self._told: set[str] = set()

    def ask(self) -> None:
        """Ask SLURM which jobs there are.

        Raises:
            WorkerError: It does not say.
        """
        begun = time.monotonic()
        words = ("--noheader", "--states=all", "--format=%A|%T|%r", f"--user={os.getuid()}")
        lines = [line.split("|", 2) for line in _said("squeue", *words).splitlines()]
        self._jobs = {each[0]: (each[1], each[2]) for each in lines if len(each) == 3}
        self._asked, self._answered = begun, time.monotonic()
        self._next = self._answered + _ASK

    def ended(self, number: str, since: float = float("-inf")) -> str:
        """How a job ended, in a word of SLURM; empty while it waits or runs, or is not known yet.

        Args:
            number: Its number.
            since: When it was submitted; what SLURM said before does not tell.

        Raises:
            WorkerError: SLURM has not answered for PATIENCE.
        """
        if time.monotonic() > self._next:
            self._ask_patiently()
        state = self._jobs.get(number, (_GONE, ""))[0]
        return state if self._asked > since and state in (*_ENDED, _GONE) else ""

    def _ask_patiently(self) -> None:
        try:
            self.ask()
        except WorkerError as error:
            silence = time.monotonic() - self._answered
            if silence > PATIENCE:
                self.silent = True
                raise WorkerError(
                    f"{error}, for {silence:.0f} s; what has ended is kept, its jobs go on, and "
                    "the same command takes them over (with --resume, where it is no study or "
                    "search)"
                ) from None
            self._tell("slurm: waits for SLURM: %s", str(error).removeprefix("slurm: "))
            self._next = time.monotonic() + _ASK

    def tell_waiting(self, jobs: Iterable[Any]) -> None:
        """Say why, once, if none of these jobs has run for a while.

        Raises:
            WorkerError: They would wait for ever.
        """
        found = [self._jobs.get(job.job_id) for job in jobs if isinstance(job, QueuedJob)]
        waiting = {each[1] for each in found if each is not None and each[0] == "PENDING"}
        now = time.monotonic()
        if not waiting or any(each is None or each[0] != "PENDING" for each in found):
            self._ran = now
        elif now - self._ran > _QUIET:
            if waiting <= _NEVER:
                raise WorkerError(
                    "--slurm: expected jobs that can begin, found that all wait: SLURM says "
                    f"{', '.join(sorted(waiting))}"
                )
            self._tell("slurm: all jobs wait: SLURM says %s", ", ".join(sorted(waiting)))

    def _tell(self, what: str, why: str) -> None:
        if what % why not in self._told:
            self._told.add(what % why)
            _NOTE.warning(what, why)


class QueuedJob:
    """A job of SLURM.

    Args:
        job: The same for submitit.
        queue: What is asked how it ended.
    """

    def __init__(self, job: Any, queue: Queue) -> None:
        self._job, self._queue, self._since = job, queue, time.monotonic()
        self.job_id: str = job.job_id

    def done(self) -> bool:
        """Whether it has left a result, or SLURM says that it has ended."""
        return self._has_result() or bool(self._queue.ended(self.job_id, self._since))

    def exception(self) -> Exception | None:
        """Why it ended before its work, None if it did not."""
        if self._has_result():
            return self._job.exception()
        state = self._queue.ended(self.job_id, self._since)
        told = "SLURM lists it no more" if state == _GONE else f"SLURM says {state}"
        kind = TimeoutError if state == _TIMEOUT else RuntimeError
        return kind(f"{told}{self._last_words()}")

    def result(self) -> Any:
        """What it returned, if it ended with its work."""
        return self._job.result()

    def _has_result(self) -> bool:
        return self._job.paths.result_pickle.exists()

    def _last_words(self) -> str:
        """The last line that it wrote to stderr, if there is one."""
        with contextlib.suppress(OSError):
            lines = self._job.paths.stderr.read_bytes()[-_LOG:].decode(errors="replace").split("\n")
            return next((f", {shortened(line)}" for line in reversed(lines) if line.strip()), "")
        return ""


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

    def exception(self) -> Exception:
        """Why it ended before its work."""
        return RuntimeError("it ended")


def cancel(jobs: Collection[Any]) -> None:
    """End jobs; a line says so if SLURM does not."""
    queued = [job.job_id for job in jobs if isinstance(job, QueuedJob)]
    for job in jobs:
        if not isinstance(job, QueuedJob):
            job.cancel()
    try:
        if queued:
            _said("scancel", *queued)
    except WorkerError as error:
        _NOTE.warning("%s; jobs that may still run: %s", error, ", ".join(queued))


def earlier_jobs(folder: Path, queue: Queue) -> dict[Path, tuple[Any, list[int]]]:
    """Jobs of an earlier driver that still wait or run, by their files, and what they were given.

    Raises:
        WorkerError: SLURM does not say which jobs there are.
    """
    found: dict[Path, tuple[Any, list[int]]] = {}
    asked = False
    for note in sorted(folder.glob("*.job")):
        try:
            told = json.loads(note.read_text())
            number, places = str(told["job"]), list(told["places"])
            cluster, host = told["cluster"], told["host"]
        except (OSError, ValueError, KeyError, TypeError):
            continue  # torn: it was about to be written
        if cluster == "local":
            job: Any = LocalJob(int(number), host)
            ended = job.done()
        else:
            from submitit import SlurmJob

            if not asked:
                queue.ask()
            asked, job = True, QueuedJob(SlurmJob(folder, number), queue)
            ended = bool(queue.ended(number))
        if ended:
            note.unlink(missing_ok=True)
        else:
            found[note.with_suffix(".jsonl")] = job, places
    return found


def _said(*words: str) -> str:
    """What a command of SLURM prints, whatever it is told by the environment to leave out.

    Raises:
        WorkerError: It fails, or does not answer in time.
    """
    known = {name: value for name, value in os.environ.items() if not name.startswith("SQUEUE_")}
    try:
        done = subprocess.run(  # noqa: S603  (fixed words)
            words, capture_output=True, env=known, timeout=_ANSWER, text=True, errors="replace"
        )
    except subprocess.TimeoutExpired:
        found = f"nothing within {_ANSWER:g} s"
    except OSError as error:
        found = in_one_line(error)
    else:
        if done.returncode == 0:
            return done.stdout
        told = " ".join(done.stderr.split()).removeprefix(f"{words[0]}: error: ")
        found = told.removeprefix("slurm_load_jobs error: ") or f"exit code {done.returncode}"
    raise WorkerError(f"slurm: expected {words[0]} to answer, found {shortened(found)}")
