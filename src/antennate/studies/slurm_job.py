"""What a job of SLURM does."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError
from antennate.studies.codec import encoded
from antennate.studies.processes import Processes
from antennate.studies.store import Store
from antennate.studies.submitted import require_same, work_apart
from antennate.studies.work import Failure, Packed, Part

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
        self, file: str, identity: Mapping[str, Any], part: Part, added: Packed, at_once: int = 1
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
        """Carry out what is not in its file yet; how many tasks that was.

        Raises:
            WorkerError: The driver has other versions or other code, or nothing can be run here.
        """
        file = Path(self._file)
        if not file.exists():
            return 0
        require_same(self._identity, Path())
        store = Store(file)
        store.begin(self._identity)
        left = {k: task for k, task in self._part.tasks.items() if str(k) not in store.records}

        def keep(place: int, content: Mapping[str, Any]) -> None:
            if not file.exists():
                raise WorkerError("expected a driver that reads what this job finishes, found none")
            store.append(str(place), content)

        def emit(place: int, result: Any) -> None:
            keep(place, {"result": encoded(result)})

        def fail(place: int, failure: Failure) -> None:
            keep(place, {"failure": [failure.status, failure.reason]})

        part, places, size = replace(self._part, tasks=left), list(left), self._at_once
        parts = [places[i : i + size] for i in range(0, len(places), size)]
        if left:
            work = work_apart(part, Path.cwd(), self._added, store.saw, _WARNINGS)
            Processes().run(work, parts, 1, emit, fail)
        store.close()
        return len(left)

    def checkpoint(self) -> Any:
        """What submitit submits when the job is preempted or has run out of time: the same."""
        from submitit.helpers import DelayedSubmission

        return DelayedSubmission(self)
