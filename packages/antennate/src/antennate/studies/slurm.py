"""The engine of SLURM: jobs that submitit submits, each of which keeps its trials in a file."""

from __future__ import annotations

import contextlib
import io
import json
import logging
import math
import signal
import tempfile
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from antennate.errors import ConfigError, WorkerError, in_one_line
from antennate.files import writing
from antennate.lookup import require_package
from antennate.messages import shortened
from antennate.studies.formats import decoded, encoded
from antennate.studies.identity import environment
from antennate.studies.processes import Processes, on_ctrl_c
from antennate.studies.run_files import JOBS
from antennate.studies.sending import Packed, added_objects, pack_whole
from antennate.studies.submitted import require_same, work_apart
from antennate.studies.trial_file import Content, TrialFile
from antennate.studies.work import Call, Failure, Work

_WARNINGS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)
"""What SLURM may send to all processes of a job some time before it ends it."""


class Resumable:
    """What a job calls; SLURM may begin it again, with what it was first given.

    The trials run in a process beside it, so one that crashes or hangs is found as on one machine.

    Args:
        file: Where it keeps what it has finished. The driver makes it, and removes it when it needs
            the job no more: without it the job does nothing.
        identity: The environment of the driver.
        part: Its tasks by place.
        added: Objects that were added to registries in the driver.
        at_once: How many tasks run together.
    """

    def __init__(
        self, file: str, identity: Mapping[str, Any], part: Work, added: Packed, at_once: int = 1
    ) -> None:
        self._file, self._identity, self._part, self._added = file, identity, part, added
        self._at_once = at_once

    def __call__(self) -> int | Exception:
        """Carry out what is not in its file yet; how many tasks that was.

        What no job will do better is returned, as submitit tells of what is raised its text alone.
        """
        from submitit.core.utils import UncompletedJobError

        try:
            return self.carry_out()
        except WorkerError as error:
            return error
        except UncompletedJobError:  # raised in the handler of the signal that says so
            return TimeoutError()

    def carry_out(self) -> int:
        """Carry out what is not in its file yet; how many tasks that was."""
        file = Path(self._file)
        if not file.exists():
            return 0
        require_same(self._identity, Path())
        trials = TrialFile(file)
        trials.begin(self._identity)
        left = {k: task for k, task in self._part.tasks.items() if str(k) not in trials.records}

        def keep(place: int, content: Mapping[str, Any]) -> None:
            if not file.exists():
                raise WorkerError("expected a driver that reads what this job finishes, found none")
            trials.append(str(place), content)

        def emit(place: int, result: Any) -> None:
            try:
                content = encoded(result)
            except TypeError as error:
                raise WorkerError(str(error)) from None
            keep(place, {"result": content})

        def fail(place: int, failure: Failure) -> None:
            keep(place, {"failure": [failure.status, failure.reason]})

        if left:
            part = self._part.only(list(left))
            work = work_apart(part, Path.cwd(), self._added, _WARNINGS)
            call = Call(work, [list(left)], emit, fail, trials)
            call.divide(self._at_once)
            Processes().run(call, 1)
        trials.close()
        return len(left)

    def checkpoint(self) -> Any:
        """What submitit submits when the job is preempted or has run out of time: the same."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


_LOOK = 0.5
"""How often the driver looks for what its jobs have finished [s]."""
_FAILED_STARTS = 3
"""So many jobs in a row that end before they have begun end the run."""
_OF_TASKS = ("nodes", "tasks_per_node", "ntasks_per_node")
_POSITIVE = ("timeout_min", "time", "mem_gb", "cpus_per_task", *_OF_TASKS)
"""What is asked of SLURM that no job can do without."""
_NOTE = logging.getLogger(__name__)


class Slurm:
    """Jobs of SLURM through submitit, on a file system that they share with the driver.

    A job appends each finished trial to a file of its own, which the driver reads while the job
    runs. So a job that is preempted and begins again goes on where it was, and one that is killed
    loses the trial that it was at. Whether a job has ended is what submitit says, by `sacct`.

    Jobs are cancelled when the driver ends. Where it is killed they go on until the next driver
    removes their files. Nobody reads what they finish meanwhile: it is run again.

    Args:
        cluster: slurm, or local for processes of this machine that are given the same.
        options: What SLURM is asked for, as submitit names it: `timeout_min=60`.
    """

    name = "slurm"

    def __init__(self, cluster: str, options: Sequence[str]) -> None:
        require_package("submitit", "slurm", "engine")
        self._cluster, self._options = cluster, dict(_setting(option) for option in options)
        with tempfile.TemporaryDirectory() as folder:  # what it refuses leaves nothing
            for warning in self._executor(Path(folder))[1]:
                _NOTE.warning("--slurm: submitit says: %s", warning.message)

    def run(self, call: Call, count: int) -> None:
        """Run the tasks on `count` jobs at once; see `Engine`."""
        if call.trials is None:
            raise WorkerError("slurm: expected a run directory that jobs can see, found none")
        folder = call.trials.path.parent / JOBS
        with writing(folder):
            folder.mkdir(exist_ok=True)
            for file in folder.glob("*.jsonl"):  # of jobs whose driver has ended
                file.unlink(missing_ok=True)
        _Driver(call, folder, self._executor(folder)[0]).run(count)

    def _executor(self, folder: Path) -> tuple[Any, list[warnings.WarningMessage]]:
        """What submits jobs, and what it warns of."""
        import submitit

        try:
            with warnings.catch_warnings(record=True) as caught:
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
        return executor, caught


@dataclass
class _Job:
    """A job, the tasks that it has not finished, and how far its file was read [bytes]."""

    handle: Any
    file: Path
    left: list[int]
    read: int = 0
    has_trials: bool = False


class _Driver:
    """One run: its jobs, and what they have finished."""

    def __init__(self, call: Call, folder: Path, executor: Any) -> None:
        self._call, self._folder, self._executor = call, folder, executor
        self._at_once = call.at_once
        self._failed_starts = 0  # in a row

    def run(self, count: int) -> None:
        self._call.divide(-(-len(self._call.places) // count))  # a list a job: each waits long
        running: list[_Job] = []
        try:
            while self._call or running:
                while self._call and len(running) < count:
                    running.append(self._submit(self._call.next()))
                time.sleep(_LOOK)
                for job in list(running):
                    ended = job.handle.done()
                    self._take_rows(job)
                    if ended:
                        running.remove(job)
                        self._end(job)
        except KeyboardInterrupt:
            for job in running:
                self._take_rows(job)
            raise
        finally:
            for job in running:  # without its file a job runs no further trial
                job.file.unlink(missing_ok=True)
            for job in running:
                with contextlib.suppress(OSError):
                    job.handle.cancel(check=False)

    def _submit(self, places: list[int]) -> _Job:
        file = self._folder / f"{time.time_ns()}.jsonl"
        identity = self._call.shared or environment()
        part = self._call.work.only(places)
        call = Resumable(str(file), identity, part, added_objects(pack_whole), self._at_once)
        try:
            file.touch()
            # submitit prints what it raises, and ends jobs of this machine by Ctrl-C, which they
            # would ignore if they came from a driver that a shell has started with `&`
            with contextlib.redirect_stderr(io.StringIO()), on_ctrl_c(signal.default_int_handler):
                handle = self._executor.submit(call)
        except (RuntimeError, OSError) as error:
            text = "; ".join(str(error).replace("sbatch: error: ", "").splitlines())
            raise WorkerError(f"slurm: expected a job to be taken, found: {text}") from None
        return _Job(handle, file, places)

    def _take_rows(self, job: _Job) -> None:
        """Take the lines that have come to the file of a job since it was last read."""
        with job.file.open("rb") as file:
            file.seek(job.read)
            data = file.read()
        data = data[: data.rfind(b"\n") + 1]
        if data:
            self._failed_starts = 0
        lines = Content().read(data)
        for model in lines.processors:
            self._call.saw(model)
        for place in [place for place in job.left if str(place) in lines.records]:
            record = lines.records[str(place)]
            job.has_trials = True
            job.left.remove(place)
            if "failure" in record:
                self._call.fail(place, Failure(*record["failure"]))
            else:
                self._call.emit(place, decoded(record["result"], self._call.work.packages))
        job.read += len(data)

    def _end(self, job: _Job) -> None:
        """What becomes of the tasks that an ended job did not finish.

        Of more than run at once the first is what it was at; of none, if it had not begun.
        """
        try:
            outcome = job.handle.result() if job.left else None
        except (RuntimeError, OSError) as error:
            outcome = error
        self._take_rows(job)  # which a network file system may show late
        job.file.unlink(missing_ok=True)
        if not job.left:
            return
        if isinstance(outcome, WorkerError):
            raise WorkerError(f"slurm: {outcome}")
        timed_out = isinstance(outcome, TimeoutError) or job.handle.state == "TIMEOUT"
        if timed_out and not job.has_trials:
            raise WorkerError(
                "slurm: expected a job to end a trial within its time limit, found none; ask for "
                "more with --slurm timeout_min=MINUTES, or for less with --trial-timeout"
            )
        if job.read:
            together = len(job.left) <= self._at_once
            why = Failure("crashed", f"its job ended: {_last_words(job)}")
            self._call.lost(job.left, together, why)
            return
        self._failed_starts += 1
        if self._failed_starts >= _FAILED_STARTS:
            raise WorkerError(
                f"slurm: expected jobs to begin, found {self._failed_starts} in a row that "
                f"ended before: {_last_words(job)}"
            )
        self._call.put_back(job.left)


def _last_words(job: _Job) -> str:
    """The state of a job that has ended, and the last line that it wrote to stderr."""
    lines: list[str] = []
    with contextlib.suppress(OSError):
        text = job.handle.paths.stderr.read_text(errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
    return shortened(", ".join([job.handle.state, *lines[-1:]]))


def _is_above_zero(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and 0 < value < math.inf


def _setting(text: str) -> tuple[str, Any]:
    name, _, value = text.partition("=")
    if not name.isidentifier() or not value:
        raise ConfigError(f"--slurm: expected NAME=VALUE, found {text}")
    setting: Any = value
    with contextlib.suppress(ValueError):
        setting = json.loads(value)
    kind = name.removeprefix("slurm_").removeprefix("local_")
    is_text = isinstance(setting, str) and kind == "time"  # as 1-12:00:00
    if kind in _POSITIVE and not is_text and not _is_above_zero(setting):
        raise ConfigError(f"--slurm: {name}: expected a number above 0, found {value}")
    if kind in _OF_TASKS and setting != 1:
        raise ConfigError(f"--slurm: {name}: expected 1, as jobs have one task, found {value}")
    return name, setting
