"""What workers are given, how they carry it out, and what becomes of tasks that fail."""

from __future__ import annotations

import contextlib
import functools
import operator
import os
import pickle
import platform
import re
import sys
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.spawn import prepare
from pathlib import Path
from typing import Any, Literal, Protocol

from antennate.errors import LogError, WorkerError, in_one_line
from antennate.lookup import ADDED, NotSent

CPUINFO = Path("/proc/cpuinfo")
"""Where Linux says what its processors are."""


_NUMBERS = ("cpu family", "model", "stepping", "CPU implementer", "CPU part", "CPU variant")
"""What tells processors apart that a virtual machine calls by one name, of Intel, AMD and ARM."""


@functools.cache
def processor() -> str:
    """Its model, as the system calls it, and the numbers of that model."""
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
Packed = Mapping[str, Mapping[str, bytes]]
"""Objects that were added to registries, by registry and name, each pickled."""
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


@dataclass(frozen=True)
class Work:
    """Tasks of one kind.

    Attributes:
        function: At the top of a module: function(*task) -> result; with `together`
            function(tasks, emit), which emits the index of a task and its result.
        tasks: Its arguments, by place.
        together: Whether several tasks are carried out at once.
        timeout: Time after which a task that has not ended is given up [s].
        folder: Run directory that it belongs to, None without.
        batched: batched(tasks, emit, fail, device) does the same on a GPU, None if nothing does;
            fail(index, failure) tells of a task that has no result.
        shared: What workers must share with this process, as of `environment`; None for no more
            than this package.
        saw: Takes the model of each processor that tasks are run on; engines call it.
    """

    function: Callable[..., Any]
    tasks: Sequence[tuple[Any, ...]] | Mapping[int, tuple[Any, ...]]
    together: bool
    timeout: float
    folder: Path | None = None
    batched: Callable[..., Any] | None = None
    shared: Mapping[str, Any] | None = None
    saw: Callable[[str], None] = lambda model: None

    def part(self, places: Sequence[int]) -> Part:
        """Some of it, to be sent to a worker."""
        tasks = {place: self.tasks[place] for place in places}
        return Part(self.function, tasks, self.together, self.timeout)


@dataclass(frozen=True)
class Part:
    """Some tasks by place, as a worker is given them."""

    function: Callable[..., Any]
    tasks: dict[int, tuple[Any, ...]]
    together: bool
    timeout: float

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

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run the tasks at these places, given in parts, on so many workers.

        Raises:
            WorkerError: The workers cannot run anything.
        """
        ...


class Waiting:
    """Parts that wait for a worker, and what becomes of those whose worker died.

    A task that may have killed its worker is run again, alone, so that nothing else is lost with
    it; a task that kills RETRIES + 1 workers is given up.
    """

    def __init__(self, parts: Sequence[Sequence[int]]) -> None:
        self._parts = deque(list(part) for part in parts)
        self._deaths: Counter[int] = Counter()

    def __len__(self) -> int:
        return len(self._parts)

    def next(self) -> list[int]:
        """The next part."""
        return self._parts.popleft()

    def put_back(self, part: Sequence[int]) -> None:
        """Put back a part that nobody has begun."""
        self._parts.appendleft(list(part))

    def lost(self, left: Sequence[int], together: bool, final: bool = False) -> int | None:
        """Put back what a dead worker left; the task that is given up, if one is.

        Args:
            left: Places without a result, in order.
            together: Whether all of them ran, or the first alone.
            final: Whether one that ran alone has no further chance.
        """
        suspects, others = (list(left), []) if together else (list(left[:1]), list(left[1:]))
        if others:
            self._parts.appendleft(others)
        if len(suspects) == 1:
            self._deaths[suspects[0]] += 1
            if final or self._deaths[suspects[0]] > RETRIES:
                return suspects[0]
        self._parts.extendleft([place] for place in reversed(suspects))
        return None


class Here:
    """This process, one task after the other."""

    name = "here"

    def run(
        self, work: Work, parts: Sequence[Sequence[int]], count: int, emit: Emit, fail: Fail
    ) -> None:
        """Run all; a task that crashes or hangs takes this process with it."""
        work.saw(processor())
        for part in parts:
            work.part(part).carry_out(emit, fail)


def by_value() -> Callable[[Any], bytes] | None:
    """What packs an object that no worker can import, as one of a prompt, where it is installed."""
    try:
        from cloudpickle import dumps
    except ImportError:
        return None
    return dumps


def pack_whole(each: Any) -> bytes:
    """An object for workers that have not imported the program; with it where its file is."""
    dumps = by_value() or pickle.dumps
    path = os.path.abspath(getattr(sys.modules["__main__"], "__file__", None) or "")  # noqa: PTH100
    name = getattr(each, "__qualname__", None)  # an instance has none
    if getattr(each, "__module__", None) != "__main__" or not name or not Path(path).is_file():
        return dumps(each)
    program = _OfProgram(path, Path(path).read_bytes(), name, dumps(each))
    return pickle.dumps(program)


IMPORTING: list[str] = []
"""The program that this worker imports now: it may run nothing."""


@dataclass(frozen=True)
class _OfProgram:
    """An object of the program, which a process of our own imports as those of one machine do.

    So a trial may begin processes that find by name what it gives them.
    """

    path: str
    source: bytes
    name: str
    content: bytes

    def found(self, may_import: bool) -> Any:
        """It by name if the same program can be imported here, else a copy."""
        with contextlib.suppress(Exception, SystemExit):
            if may_import and Path(self.path).read_bytes() == self.source:
                IMPORTING.append(self.path)
                try:
                    prepare({"init_main_from_path": self.path})
                finally:
                    IMPORTING.clear()
            if getattr(sys.modules["__main__"], "__file__", None) == self.path:
                return operator.attrgetter(self.name)(sys.modules["__main__"])
        return pickle.loads(self.content)  # noqa: S301  (the driver wrote it)


def _pack(each: Any) -> bytes:
    """An object by its name, as workers that import the program find it; one of a prompt whole."""
    dumps = pickle.dumps if _has_file(each) else by_value()
    return (dumps or pickle.dumps)(each)


def _has_file(each: Any) -> bool:
    """Whether the module of an object can be imported elsewhere; that of a prompt cannot."""
    module = sys.modules.get(getattr(each, "__module__", None) or "")
    spec, file = getattr(module, "__spec__", None), getattr(module, "__file__", None)
    return module is None or spec is not None or (file is not None and Path(file).is_file())


def require_sent(names: Iterable[str]) -> None:
    """Check that the objects of these names that were added here can be sent to workers.

    Raises:
        WorkerError: One cannot.
    """
    named = set(names)
    for objects in ADDED.values():
        for name in sorted(objects.keys() & named):
            if isinstance(sent := sendable(objects[name]), NotSent):
                raise WorkerError(f"{name}: {sent.reason}")


def added_objects(dumps: Callable[[Any], bytes] = _pack) -> Packed:
    """Objects that were added to registries here, for workers; what cannot be sent says so.

    Each is packed apart, so that one that a worker cannot read costs no other.

    Args:
        dumps: What packs one: `cloudpickle.dumps` also packs what was typed at a prompt.
    """
    return {
        group: {name: dumps(sendable(each)) for name, each in objects.items()}
        for group, objects in ADDED.items()
    }


def take_added(added: Packed, may_import: bool = False) -> None:
    """In a worker: know the objects that were added in the driver.

    Args:
        added: Those objects.
        may_import: Whether this process may import the driver's program as its own.
    """
    for group, objects in added.items():
        objects_read = {name: _read(each, may_import) for name, each in objects.items()}
        ADDED.setdefault(group, {}).update(objects_read)


def _read(content: bytes, may_import: bool) -> Any:
    """In a worker: an object that was sent, or what says why it cannot be read here."""
    try:
        each = pickle.loads(content)  # noqa: S301  (the driver wrote it)
        return each.found(may_import) if isinstance(each, _OfProgram) else each
    except Exception as error:  # noqa: BLE001  (an object's own module may raise anything)
        return NotSent(
            f"expected an object of your own that workers can import, found {in_one_line(error)}"
        )


def sendable(each: Any) -> Any:
    """The same object if it can be sent to a worker, else what says why not."""
    try:
        pickle.dumps(each)
    except Exception as error:  # noqa: BLE001  (an object's own code may raise anything)
        return NotSent(
            f"expected what can be sent to workers, found {in_one_line(error)}; an object of "
            "your own has to be defined at the top of a module, or run with one worker"
        )
    if not _has_file(each) and (each.__module__ != "__main__" or by_value() is None):
        return NotSent(
            f"expected what workers can import, found it in {each.__module__} without a file, as "
            "in a notebook cell or after -c; put it in a file and import that, or use one worker"
        )
    return each
