"""Parts of the work that are submitted to an executor, and what a worker elsewhere does with one.

An executor is an object with `submit(function, *arguments)` that returns something with `done()`
and `result()`, as those of concurrent.futures do. Results come back through it, so its workers need
not see the files of the driver; they do need the same versions and the same code.
"""

from __future__ import annotations

import os
import pickle
import platform
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from antennate.errors import WorkerError, in_one_line
from antennate.studies.identity import differences, environment, environment_here
from antennate.studies.sending import Packed, added_objects, pack_whole, take_added
from antennate.studies.work import Call, Failure, Processor, Together, Work, processor

NO_PLACE = -1
"""Place of what is no result."""
_FOLDER = "folder"
"""Where the driver tells its working folder, from which it names files."""
_POLL = 0.02
"""How often the driver looks for parts that have ended [s]."""


class Submitted:
    """Parts that are submitted to an executor of any kind.

    Args:
        name: What it is called in messages.
        submit: As of an executor.
        deaths: What a future raises whose worker died.
        ahead: Parts that are submitted at once, for each worker.
        workers: How many there are now, where that changes.
    """

    def __init__(
        self,
        name: str,
        submit: Callable[..., Any],
        deaths: tuple[type[BaseException], ...] = (BrokenExecutor,),
        ahead: int = 4,
        workers: Callable[[], int] | None = None,
    ) -> None:
        self.name, self._submit, self._deaths, self._ahead = name, submit, deaths, ahead
        self._workers = workers

    def run(self, call: Call, count: int) -> None:
        """Carry out the parts of a call; see `Engine`."""
        running = dict[Any, list[int]]()
        theirs = {**(call.shared or environment()), _FOLDER: _folder()}
        environs = (theirs, added_objects(pack_whole))
        try:
            while call or running:
                count = self._workers() if self._workers is not None else count
                while call and len(running) < count * self._ahead:
                    places = call.next()
                    running[self._submitted(call.work.only(places), *environs)] = places
                ended = [future for future in running if future.done()]
                for future in ended:
                    self._take(future, running.pop(future), call)
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

    def _take(self, future: Any, places: list[int], call: Call) -> None:
        try:
            answers = future.result()
        except self._deaths as error:
            why = Failure("crashed", f"its worker died: {in_one_line(error)}")
            call.lost(places, together=True, failure=why)
            return
        except Exception as error:
            raise WorkerError(f"{self.name}: {in_one_line(error)}") from error
        for place, answer in answers:
            if isinstance(answer, Processor):
                call.saw(answer)
            else:
                (call.fail if isinstance(answer, Failure) else call.emit)(place, answer)


def carry_out(part: Work, theirs: Mapping[str, Any], added: Packed) -> list[tuple[int, Any]]:
    """In a worker: results and failures by place, and the model of its processor."""
    require_same(theirs, Path())
    take_added(added)
    answers: list[tuple[int, Any]] = [(NO_PLACE, Processor(processor()))]

    def fail(place: int, failure: Failure) -> None:
        answers.append((place, Failure(failure.status, failure.reason)))

    part.carry_out(lambda place, result: answers.append((place, result)), fail)
    return answers


def work_apart(part: Work, folder: Path, added: Packed, ignored: Sequence[int] = ()) -> Work:
    """A part as work for a process beside this one, which needs nothing that this one imported.

    Args:
        part: Some tasks.
        folder: Where they are run.
        added: Objects that were added to registries in the driver.
        ignored: Signals that it ignores.
    """
    import cloudpickle  # which Dask and submitit need too; it sends what was typed at a prompt

    carried = _Carried(cloudpickle.dumps((part, str(folder), added, ignored)))
    function = Together(carried, len(part.tasks)) if part.together else carried
    return replace(part, function=function, tasks={place: (place,) for place in part.tasks})


class _Carried:
    """In the process beside the worker: what carries out tasks of a part, given by their places.

    It is unpacked when it is received, so that no import counts as time of a trial.
    """

    def __init__(self, content: bytes) -> None:
        self._content = content

    def __getstate__(self) -> bytes:
        return self._content

    def __setstate__(self, content: bytes) -> None:
        carried = pickle.loads(content)  # noqa: S301  (a worker of ours made it)
        self._part, folder, added, ignored = carried
        for number in ignored:
            signal.signal(number, signal.SIG_IGN)
        os.chdir(folder)
        take_added(added, may_import=True)

    def __call__(self, *arguments: Any) -> Any:
        """Run one task, or some together and emit their results."""
        part: Work = self._part
        if not part.together:
            return part.function(*part.tasks[arguments[0]])
        chosen, emit = arguments
        return part.function([part.tasks[place] for (place,) in chosen], emit)


def folder_of(theirs: Mapping[str, Any]) -> Path:
    """The folder of the driver, from which it names files; the present one if it is not seen."""
    folder = Path(theirs.get(_FOLDER, ""))
    return folder if folder.is_dir() else Path()


def _folder() -> str:
    try:
        return str(Path.cwd())
    except OSError:  # it is gone
        return ""


def require_same(theirs: Mapping[str, Any], folder: Path) -> None:
    """Check that this worker has the versions and the code of its driver.

    Args:
        theirs: The driver's environment.
        folder: Where the trials will run, from which files are named.
    """
    theirs = {key: value for key, value in theirs.items() if key != _FOLDER}
    if changes := differences(theirs, environment_here(theirs, folder)):
        raise WorkerError(
            f"expected workers with the driver's versions and code, found {changes} "
            f"(worker {os.getpid()} of {platform.node()})"
        )
