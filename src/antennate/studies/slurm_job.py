"""What a job of SLURM does."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError
from antennate.studies.codec import encoded
from antennate.studies.processes import Packed, Processes
from antennate.studies.store import Store
from antennate.studies.submitted import require_same, work_apart
from antennate.studies.work import Failure, Part

_LATER = (signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)
"""What SLURM may send to all processes of a job some time before it ends it."""
NOTED = 60.0
"""Time within which a network file system shows a job the note of its driver [s]."""
_RESTARTS = "SLURM_RESTART_COUNT"
"""Where SLURM tells a job how often it was begun again."""
_POLL = 0.1
"""How often the note is looked for [s]."""


class Resumable:
    """What a job calls; SLURM may begin it again, with what it was first given.

    The trials run in a process beside it, so one that crashes or hangs is found as on one machine.

    Args:
        file: Where it keeps what it has finished.
        identity: What is run, and the environment of the driver.
        part: Its tasks by place.
        added: Objects that were added to registries in the driver.
        at_once: How many tasks run together.
        noted: Whether it does nothing without the note of its driver. A driver that was killed
            before it wrote the note gives its tasks to another job, and a driver removes the note
            of a job that has ended; SLURM may begin that once more, if it was asked to before.
    """

    def __init__(
        self,
        file: str,
        identity: Mapping[str, Any],
        part: Part,
        added: Packed,
        at_once: int = 1,
        noted: bool = False,
    ) -> None:
        self._file, self._identity, self._part, self._added = file, identity, part, added
        self._at_once, self._noted = at_once, noted

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
        """Carry out what is not in its file yet; how many tasks that was.

        Raises:
            WorkerError: The driver has other versions or other code, or nothing can be run here.
        """
        again = int(os.environ.get(_RESTARTS, "0")) > 0
        if self._noted and not _comes(note_of(Path(self._file)), 0.0 if again else NOTED):
            return 0
        require_same({k: v for k, v in self._identity.items() if k != "work"}, Path())
        store = Store(Path(self._file))
        store.begin(self._identity)
        left = {k: task for k, task in self._part.tasks.items() if str(k) not in store.records}

        def emit(place: int, result: Any) -> None:
            store.append(str(place), {"result": encoded(result)})

        def fail(place: int, failure: Failure) -> None:
            store.append(str(place), {"failure": [failure.status, failure.reason]})

        part, places, size = replace(self._part, tasks=left), list(left), self._at_once
        parts = [places[i : i + size] for i in range(0, len(places), size)]
        if left:
            work = work_apart(part, Path.cwd(), self._added, store.saw, _LATER)
            Processes().run(work, parts, 1, emit, fail)
        store.close()
        return len(left)

    def checkpoint(self) -> Any:
        """What submitit submits when the job is preempted or has run out of time: the same."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)


def note_of(file: Path) -> Path:
    """Where a driver notes the number of the job that writes a file, and what it was given."""
    return file.with_suffix(".job")


def show_new(folder: Path) -> None:
    """Let a network file system show what others have written in a folder a moment ago."""
    with contextlib.suppress(OSError):
        folder.chmod(folder.stat().st_mode)


def _comes(path: Path, within: float) -> bool:
    """Whether a file is there, or comes within some time [s]."""
    end = time.monotonic() + within
    while not path.exists():
        if time.monotonic() > end:
            return False
        time.sleep(_POLL)
        show_new(path.parent)
    return True
