"""Where trials are run: processes of this machine, a Dask cluster, SLURM, or any executor.

An executor is an object with `submit(function, *arguments)` that returns something with `done()`
and `result()`, as those of concurrent.futures do. Results come back through it, so its workers need
not see the files of the driver; they do need the same versions and the same code.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from typing import Any

from antennate.errors import ConfigError, WorkerError, in_one_line
from antennate.messages import shown
from antennate.studies.identity import differences, environment
from antennate.studies.processes import added_objects, take_added
from antennate.studies.work import Emit, Engine, Fail, Failure, Part, Waiting, Work

LOCAL = "local"
WARP = "warp"
FORMS = (LOCAL, "dask", "dask://HOST:PORT", "slurm", "slurm-local", WARP, f"{WARP}:DEVICE")
"""How an engine is named; slurm-local starts what would be jobs as processes of this machine."""
_POLL = 0.02
"""How often the driver looks for parts that have ended [s]."""


def make_engine(name: Any, slurm: Sequence[str] = ()) -> Engine | None:
    """The engine of a name or of an object of the user; None is this machine.

    Args:
        name: One of FORMS, or an executor.
        slurm: What SLURM is asked for, each as NAME=VALUE.

    Raises:
        ConfigError: There is none, or SLURM is asked for something and another engine is named.
        MissingPackageError: Its package is not installed.
    """
    if slurm and name not in ("slurm", "slurm-local"):
        raise ConfigError("--slurm: expected --engine slurm beside it, found another engine")
    if name == LOCAL:
        return None
    if isinstance(name, str) and re.fullmatch(rf"{WARP}(:.+)?", name):
        return Device(name.partition(":")[2] or None)
    if isinstance(name, str):
        from antennate.studies import cluster  # needs packages that are optional

        if name in ("slurm", "slurm-local"):
            return cluster.Slurm("slurm" if name == "slurm" else "local", slurm)
        if name == "dask":
            return cluster.Dask()
        if re.fullmatch(r"dask://[^/\s]+:[0-9]{1,5}", name):
            return cluster.Dask(name.removeprefix("dask://"))
        raise ConfigError(f"engine: expected one of {', '.join(FORMS)}, found {shown(name)}")
    if not callable(getattr(name, "submit", None)):
        raise ConfigError(
            f"engine: expected a name or an object with submit, found {type(name).__name__}"
        )
    return Submitted("executor", name.submit)


class Device:
    """All tasks at once, as one batch on a GPU, in this process.

    Args:
        device: Name of a device of Warp, as cuda:0 or cpu; a GPU if not given.
    """

    name = WARP

    def __init__(self, device: str | None = None) -> None:
        self._device = device

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks at these places; see `Engine`.

        Raises:
            ConfigError: This work has no batch.
        """
        if work.batched is None:
            raise ConfigError("--engine warp: expected tunnel, which alone has batches on a GPU")
        places = [place for part in parts for place in part]
        tasks = [work.tasks[place] for place in places]
        work.batched(tasks, lambda i, result: emit(places[i], result), self._device)


class Submitted:
    """Parts that are submitted to an executor of any kind.

    Args:
        name: What it is called in messages.
        submit: As of an executor.
        deaths: What a future raises whose worker died.
        ahead: Parts that are submitted at once, for each worker.
    """

    def __init__(
        self,
        name: str,
        submit: Callable[..., Any],
        deaths: tuple[type[BaseException], ...] = (BrokenExecutor,),
        ahead: int = 4,
    ) -> None:
        self.name, self._submit, self._deaths, self._ahead = name, submit, deaths, ahead

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks at these places; see `Engine`."""
        waiting, running = Waiting(parts), dict[Any, list[int]]()
        told = (environment(), added_objects())
        try:
            while waiting or running:
                while waiting and len(running) < count * self._ahead:
                    places = waiting.next()
                    running[self._submitted(work.part(places), *told)] = places
                ended = [future for future in running if future.done()]
                for future in ended:
                    self._take(future, running.pop(future), work, waiting, emit, fail)
                if not ended:
                    time.sleep(_POLL)
        finally:
            for future in running:
                if callable(cancel := getattr(future, "cancel", None)):
                    cancel()

    def _submitted(self, *arguments: Any) -> Any:
        try:
            return self._submit(carry_out, *arguments)
        except Exception as error:
            raise WorkerError(f"{self.name}: cannot be given work: {in_one_line(error)}") from error

    def _take(
        self,
        future: Any,
        places: list[int],
        work: Work,
        waiting: Waiting,
        emit: Emit,
        fail: Fail,
    ) -> None:
        try:
            answers = future.result()
        except self._deaths as error:
            given_up = waiting.lost(places, together=True)
            if given_up is not None:
                fail(given_up, Failure("crashed", f"its worker died: {in_one_line(error)}"))
            return
        except Exception as error:
            raise WorkerError(f"{self.name}: {in_one_line(error)}") from error
        for place, answer in answers:
            (fail if isinstance(answer, Failure) else emit)(place, answer)


def carry_out(
    part: Part, theirs: Mapping[str, Any], added: Mapping[str, Any]
) -> list[tuple[int, Any]]:
    """In a worker: results and failures by place.

    Raises:
        WorkerError: The driver has other versions or other code.
    """
    require_same(theirs)
    take_added(added)
    answers: list[tuple[int, Any]] = []

    def fail(place: int, failure: Failure) -> None:
        answers.append((place, Failure(failure.status, failure.reason)))

    part.carry_out(lambda place, result: answers.append((place, result)), fail)
    return answers


def require_same(theirs: Mapping[str, Any]) -> None:
    """Check that this worker has the versions and the code of its driver.

    Raises:
        WorkerError: It has others.
    """
    if changes := differences(theirs, environment()):
        raise WorkerError(f"expected workers with the driver's versions and code, found {changes}")
