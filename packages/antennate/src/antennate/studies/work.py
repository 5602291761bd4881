"""What workers are given, how they carry it out, and what becomes of tasks that fail."""

from __future__ import annotations

import contextlib
import functools
import os
import platform
import re
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from antennate.errors import LogError, WorkerError, in_one_line

if TYPE_CHECKING:
    from antennate.studies.trial_file import TrialFile

CPUINFO = Path("/proc/cpuinfo")
"""Where Linux says what its processors are."""


_NUMBERS = ("cpu family", "model", "stepping", "CPU implementer", "CPU part", "CPU variant")
"""What tells processors apart that a virtual machine calls by one name, of Intel, AMD and ARM."""


@functools.cache
def processor() -> str:
    """Model of the processor, as the system calls it, and the numbers of that model."""
    try:
        first = CPUINFO.read_text().partition("\n\n")[0]
    except OSError:
        first = ""
    known = dict(re.findall(r"^(\S.*?)[ \t]*:[ \t]*(\S.*)$", first, re.M))
    model = known.get("model name") or platform.processor() or platform.machine()
    numbers = [f"{name.removeprefix('cpu ')} {known[name]}" for name in _NUMBERS if name in known]
    return " ".join([model.strip(), *([f"({' '.join(numbers)})"] if numbers else [])])


class Processor(str):
    """The model of the processor that trials ran on, where it comes among their results."""

    __slots__ = ()


Emit = Callable[[int, Any], None]
"""Takes the place of a task and its result."""
RETRIES = 2
"""How often a task is run again whose worker died."""


@dataclass(frozen=True)
class Failure:
    """Why a task has no result.

    Attributes:
        status: failed (it raised), crashed (its workers died) or hung (it did not end in time).
        reason: What happened, in one line.
        error: What it raised, if that was in this process.
    """

    status: Literal["failed", "crashed", "hung"]
    reason: str
    error: Exception | None = field(default=None, compare=False)

    def raised(self) -> Exception:
        """What ends a run in which it may not be."""
        words = "a worker failed: " if self.status == "failed" else ""
        return self.error or WorkerError(words + self.reason)


Fail = Callable[[int, Failure], None]
"""Takes the place of a task and why it has no result."""


def no_failure(place: int, failure: Failure) -> None:
    """Take a failure where there cannot be one."""


def package_of(each: Any) -> str:
    """The top-level package that a function or a class is of."""
    return each.__module__.partition(".")[0]


@dataclass(frozen=True)
class Together:
    """A function that carries out several tasks at once, for `gather`.

    Functions among these are at the top of a module, as workers are given them.

    Attributes:
        function: function(tasks, emit): emits the index of each task and its result.
        most: Most tasks that it is given at once.
        group: group(*task) -> what neighbouring tasks have in common that one call may hold. Groups
            take turns, so that each is known in part before the first is known in full.
        batched: batched(tasks, emit, fail, device) does the work on a GPU, None if nothing does;
            fail(index, failure) tells of a task that has no result.
        packages: Packages whose classes its results have, beside that of the function.
    """

    function: Callable[..., None]
    most: int
    group: Callable[..., Any] | None = None
    batched: Callable[..., None] | None = None
    packages: tuple[str, ...] = ()

    def __call__(self, tasks: Sequence[tuple[Any, ...]], emit: Emit) -> None:
        """Carry out some tasks."""
        self.function(tasks, emit)


@dataclass(frozen=True)
class Work:
    """Tasks of one kind, as a worker is given them.

    Attributes:
        function: function(*task) -> result, at the top of a module; or `Together`.
        tasks: Its arguments, by place.
        timeout: Time after which a task that has not ended is given up [s].
    """

    function: Callable[..., Any] | Together
    tasks: Mapping[int, tuple[Any, ...]]
    timeout: float

    @property
    def together(self) -> bool:
        """Whether several tasks are carried out at once."""
        return isinstance(self.function, Together)

    @property
    def packages(self) -> set[str]:
        """Packages whose classes results may have: no file may name classes of others."""
        if isinstance(self.function, Together):
            return {"antennate", package_of(self.function.function), *self.function.packages}
        return {"antennate", package_of(self.function)}

    def only(self, places: Sequence[int]) -> Work:
        """The tasks at these places alone."""
        return replace(self, tasks={place: self.tasks[place] for place in places})

    def carry_out(self, emit: Emit, fail: Fail) -> None:
        """Run the tasks; those that raise are told to `fail`, and the others go on.

        A log that cannot be written fails all that run beside it, as it is for the disk.
        """
        left = dict(self.tasks)
        emit_error: Exception | None = None
        back = _way_back()

        def take(place: int, result: Any) -> None:
            nonlocal emit_error
            try:
                emit(place, result)
            except Exception as error:
                emit_error = error
                raise
            del left[place]
            back()

        places = list(self.tasks)
        while left:
            now = list(left) if self.together and len(left) == len(places) else [next(iter(left))]
            try:
                if self.together:
                    tasks = [self.tasks[place] for place in now]
                    self.function(tasks, lambda i, result, now=now: take(now[i], result))
                    if missing := [place for place in now if place in left]:
                        raise WorkerError(f"expected {len(now)} results, {len(missing)} missing")
                else:
                    take(now[0], self.function(*self.tasks[now[0]]))
            except Exception as error:  # noqa: BLE001  (a trial may raise anything)
                if emit_error is not None:
                    raise emit_error from None
                known = isinstance(error, LogError | WorkerError)
                reason = str(error) if known else in_one_line(error)
                if len(now) == 1 or isinstance(error, LogError):  # a full disk is one for all
                    for place in [each for each in now if each in left]:
                        del left[place]
                        fail(place, Failure("failed", reason, error))
                else:
                    places = []  # one of them raised: from now on each is run alone
            finally:
                back()


def _way_back() -> Callable[[], None]:
    """Brings back the working folder that is the present one: a trial may leave it."""
    try:
        folder = Path.cwd()
    except OSError:  # it is gone
        return lambda: None

    def back() -> None:
        with contextlib.suppress(OSError):
            os.chdir(folder)

    return back


class Engine(Protocol):
    """Where tasks are run. See `antennate.studies.engines`."""

    name: str

    def run(self, call: Call, count: int) -> None:
        """Carry out the parts of a call on `count` workers."""
        ...


class Call:
    """Work in parts that wait for workers, and what takes their answers.

    A task that may have killed its worker is run again, alone, so that nothing else is lost with
    it; a task that kills RETRIES + 1 workers is given up.

    Args:
        work: What is carried out.
        parts: Its places in parts, each for a worker at once.
        emit: Takes a result.
        fail: Takes why a task has none.
        trials: Where the run keeps its trials, and the processors that they ran on; None to keep
            none.
        shared: What workers must share with this process, as of `environment`; None for no more
            than this package.
    """

    def __init__(
        self,
        work: Work,
        parts: Sequence[Sequence[int]],
        emit: Emit,
        fail: Fail,
        trials: TrialFile | None = None,
        shared: Mapping[str, Any] | None = None,
    ) -> None:
        self.work, self.emit, self.fail = work, emit, fail
        self.trials, self.shared = trials, shared
        self._parts = deque(list(part) for part in parts)
        self._deaths: Counter[int] = Counter()

    def __len__(self) -> int:
        """How many parts wait."""
        return len(self._parts)

    @property
    def places(self) -> list[int]:
        """All places that wait."""
        return [place for part in self._parts for place in part]

    @property
    def at_once(self) -> int:
        """Most tasks that are carried out at once."""
        return max(map(len, self._parts), default=1) if self.work.together else 1

    def saw(self, model: str) -> None:
        """Note the model of a processor that tasks are run on."""
        if self.trials is not None:
            self.trials.saw(model)

    def divide(self, size: int) -> None:
        """Divide what waits into parts of this size."""
        places = self.places
        self._parts = deque(places[i : i + size] for i in range(0, len(places), size))

    def next(self) -> list[int]:
        """The next part."""
        return self._parts.popleft()

    def put_back(self, part: Sequence[int]) -> None:
        """Put back a part that nobody has begun."""
        self._parts.appendleft(list(part))

    def lost(
        self, left: Sequence[int], together: bool, failure: Failure, final: bool = False
    ) -> None:
        """Put back what a dead worker left; a task that is given up fails.

        Args:
            left: Places without a result, in order.
            together: Whether all of them ran, or the first alone.
            failure: Why its worker is dead.
            final: Whether one that ran alone has no further chance.
        """
        suspects, others = (list(left), []) if together else (list(left[:1]), list(left[1:]))
        if others:
            self._parts.appendleft(others)
        if len(suspects) == 1:
            self._deaths[suspects[0]] += 1
            if final or self._deaths[suspects[0]] > RETRIES:
                self.fail(suspects[0], failure)
                return
        self._parts.extendleft([place] for place in reversed(suspects))


class Here:
    """This process, one task after the other."""

    name = "here"

    def run(self, call: Call, count: int) -> None:
        """Run all; a task that crashes or hangs takes this process with it."""
        call.saw(processor())
        while call:
            call.work.only(call.next()).carry_out(call.emit, call.fail)
