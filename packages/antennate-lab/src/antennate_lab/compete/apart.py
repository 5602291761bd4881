"""A controller in a process of its own: its judge looks from outside at the time that it takes.

The judge begins a warden, and that the controller. On Linux the warden is a subreaper: whatever the
controller begins, in however many steps, stays below it, and is counted and found there. So no
clock of the controller's decides, and what works between two decisions counts for the later one,
as all that its process does there is to wait. Decisions come back as plain arrays. Limits of the
system would not do: RLIMIT_CPU counts each process alone, and a cgroup needs rights.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import io
import os
import pickle
import resource
import signal
import socket
import stat
import struct
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NoReturn

from antennate.control.knowledge import Kind, Knowing, Knowledge
from antennate.errors import FAILURES, ConfigError, ControllerError, raised
from antennate.types import AntennaFrame, Bools, Controller, Floats, Ints, JointCommand

WAITING = 20.0
"""How many times as long a decision may take on the clock as on the processor; the first one may
take so long on the processor, too."""
_LOOK = 0.005
"""Time between two looks at what works for a decision [s]."""
_LARGEST = 2**26
"""Most bytes of an answer."""
_HEAD = struct.Struct("!I")
"""What an answer begins with: how many bytes follow."""
_SUBREAPER, _DIES_WITH_PARENT = 36, 1
"""Numbers of prctl(2)."""
_END = signal.SIGRTMIN + 7 if hasattr(signal, "SIGRTMIN") else signal.SIGXCPU
"""Signal by which the judge ends the warden; a cluster sends others to all processes of a job."""
_MOST = 64
"""Most processes of a controller, ended ones too: they are looked at in every decision."""
_STOPPED = 0.5
"""Time between two looks from which on the judge itself was stopped, as by Ctrl-Z [s]: it does not
count on the clock."""
_PATIENCE = 2.0
"""Time in which the warden ends all [s]."""
_PLAIN = {("numpy", name) for name in ("ndarray", "dtype", "_reconstruct", "_frombuffer", "scalar")}
_PLAIN |= {("antennate", "JointCommand")}
"""What an answer may hold beside plain values: a package and a name in it."""


class Apart:
    """A controller whose decisions must not take longer than a limit, in a process of its own.

    It ends with the thread that made it, too.

    Args:
        make: Makes the controller there.
        limit: Processor time of a step [s].

    Attributes:
        knows, needs: What it could use and needed when it was made: that it is given, whatever it
            says later.
        maneuver, contact, level: Those of a `Controller`, of the last step.
    """

    maneuver: Ints
    contact: Ints
    level: Floats
    void_decisions: Ints | None = None

    def __init__(self, make: Callable[[], Controller], limit: float) -> None:
        self._limit, self._begun = limit, False
        self._seen, self._used, self._answered = dict[int, float](), 0.0, 0.0
        self._pipe, theirs = socket.socketpair()
        with warnings.catch_warnings():  # of threads, from Python 3.12 on; a judge's hold no lock
            warnings.simplefilter("ignore", DeprecationWarning)
            self._warden = os.fork()
        if not self._warden:
            self._pipe.close()
            _guard(theirs, make)
        theirs.close()
        self.knows: tuple[Kind, ...]
        self.needs: tuple[Kind, ...]
        try:
            self.knows, self.needs = self._ask(float("inf"), "make")
        except BaseException:
            self.close()
            raise

    def know(self, knowledge: Knowledge) -> None:
        """Tell the controller what it knows; see `Knowing`."""
        self._ask(self._decision_limit, "know", knowledge)

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows of the controller anew; see `Controller`."""
        self._ask(WAITING * self._limit, "reset", rows, phase)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """Answer of the controller to a frame; see `Controller`."""
        found = self._ask(self._decision_limit, "step", frame)
        command, self.maneuver, self.contact, self.level, void = found
        self.void_decisions = void
        self._begun = True
        return command

    def close(self) -> None:
        """End it, and all that it began: that does the warden, also when the judge is killed."""
        self._pipe.close()
        with contextlib.suppress(OSError):
            os.kill(self._warden, _END)
            os.kill(self._warden, signal.SIGCONT)
            end = time.monotonic() + _PATIENCE
            while not os.waitpid(self._warden, os.WNOHANG)[0]:
                if time.monotonic() > end:
                    _kill_below(self._warden)
                    os.kill(self._warden, signal.SIGKILL)
                time.sleep(1e-3)

    @property
    def _decision_limit(self) -> float:
        """Processor time of a part of the next decision [s]; the first one loads libraries."""
        return self._limit * (1.0 if self._begun else WAITING)

    def _ask(self, limit: float, *call: Any) -> Any:
        """What it answers; refused if it took longer on the processor [s], or waits for long."""
        longest = WAITING * (self._limit if limit < float("inf") else limit)
        before = self._answered
        try:
            self._pipe.settimeout(WAITING * self._limit)
            self._pipe.sendall(pickle.dumps(call, pickle.HIGHEST_PROTOCOL))
            wrong, answer, told = _Plain(io.BytesIO(self._answer(longest))).load()
        except TimeoutError:
            self._give_up(call[0], f"{WAITING * self._limit:g} s on the clock")
        except (EOFError, OSError):
            raise ControllerError(f"its process ended in {call[0]}") from None
        except ControllerError:
            raise
        except Exception as error:  # noqa: BLE001  (it may send anything)
            raise ControllerError(f"expected plain arrays, found {error}") from None
        programs = self._look(told)
        self._answered = self._used
        if wrong:
            raise (ConfigError if wrong == "ConfigError" else ControllerError)(answer)
        if self._used - before > limit:
            self._give_up(call[0], f"{1e3 * limit:g} ms of the processor")
        if programs:
            raise ControllerError("a program that it began runs on after a decision")
        return answer

    def _answer(self, longest: float) -> bytes:
        """The bytes of an answer, looked for so long [s]."""
        self._pipe.settimeout(_LOOK)
        data, size, last = bytearray(), _HEAD.size, time.monotonic()
        end = last + longest
        while len(data) < size:
            now = time.monotonic()
            if now - last > _STOPPED:
                end += now - last
            if now > end:
                raise TimeoutError
            last = now
            try:
                if not (piece := self._pipe.recv(2**16)):
                    raise EOFError
                data += piece
            except TimeoutError:
                self._look()
            if size == _HEAD.size <= len(data):
                size += _HEAD.unpack_from(data)[0]
            if size > _LARGEST:
                raise ControllerError(f"expected an answer of at most {_LARGEST} bytes")
        return bytes(data[_HEAD.size :])

    def _look(self, told: float = 0.0) -> bool:
        """Note the processor time used by now; whether there is another process beside its own.

        A program is counted in that of who waited for its end, or as far as it was seen. Where
        nothing can be seen counts what its process says of itself [s].
        """
        below = [*descendants(self._warden)]
        if len(below) > _MOST:
            raise ControllerError(f"it began more than {_MOST} programs that it did not wait for")
        clocks = {pid: _clock(pid) for pid in below}
        self._seen |= clocks
        ended = sum(map(_ended, [self._warden, *below]))
        self._used = max(told, sum(clocks.values()) + ended, sum(self._seen.values()))
        return len(below) > 1 and sum(map(_runs, below)) > 1

    def _give_up(self, call: str, limit: str) -> NoReturn:
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._warden, signal.SIGCONT)  # where the controller stopped it
        what = {"step": "a decision", "reset": "a reset"}.get(call, call)
        raise ControllerError(f"{what} took longer than {limit}")


class _Plain(pickle.Unpickler):
    """Reads an answer; it makes nothing but plain values, arrays and commands."""

    def find_class(self, module: str, name: str) -> Any:
        if (module.partition(".")[0], name) not in _PLAIN:
            raise pickle.UnpicklingError(f"{module}.{name}")
        return super().find_class(module, name)


def descendants(pid: int) -> Iterator[int]:
    """All processes that it began, and those these began; none where the system does not tell."""
    with contextlib.suppress(OSError):
        for thread in os.listdir(f"/proc/{pid}/task"):  # noqa: PTH208  (in every decision)
            for child in map(int, _text(f"/proc/{pid}/task/{thread}/children").split()):
                yield child
                yield from descendants(child)


def _clock(pid: int) -> float:
    """Processor time of a process with all its threads [s]: clock_getcpuclockid(3) of Linux."""
    with contextlib.suppress(OSError):
        return time.clock_gettime((~pid << 3) | 2)
    return 0.0


def _stat(pid: int) -> list[bytes]:
    """What the system tells of a process, from its state on: proc_pid_stat(5); empty of none."""
    with contextlib.suppress(OSError):
        return _text(f"/proc/{pid}/stat").rpartition(b")")[2].split()
    return []


def _ended(pid: int) -> float:
    """Processor time of the programs for whose end a process has waited [s]."""
    words = _stat(pid)
    return sum(map(int, words[13:15])) / os.sysconf("SC_CLK_TCK") if words else 0.0


def _runs(pid: int) -> bool:
    """Whether a process has not ended; one that has is there until its parent asks for it."""
    return _stat(pid)[:1] not in ([], [b"Z"])


def _text(path: str) -> bytes:
    """What a file of /proc says; `open` takes three times as long."""
    file = os.open(path, os.O_RDONLY)
    try:
        text = os.read(file, 2**16)
        while more := os.read(file, 2**16):  # a page at a time, where there are many children
            text += more
        return text
    finally:
        os.close(file)


def _guard(pipe: socket.socket, make: Callable[[], Controller]) -> NoReturn:
    """What the warden does: it begins the controller, waits for all that is left to it, ends it."""
    ending, begun = list[int](), list[int]()

    def end(number: int, *_: object) -> None:
        ending.append(number)
        _kill_below(os.getpid(), begun)

    with contextlib.suppress(BaseException):
        os.setsid()  # a signal to its group stays there
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        _stay()
        signal.signal(_END, end)
        _prctl(_SUBREAPER)
        _prctl(_DIES_WITH_PARENT, _END)
        begun.append(os.fork())
        if not begun[0]:
            signal.signal(_END, signal.SIG_DFL)
            _prctl(_DIES_WITH_PARENT, signal.SIGKILL)
            _stay()
            _close_others(pipe.fileno())
            _serve(pipe, make)
        pipe.close()
        while True:
            os.wait()
            if ending:  # what was begun meanwhile
                end(*ending[:1])
    os._exit(0)


def _stay() -> None:
    """Let this process survive what a cluster sends to all of a job; what it begins does not."""
    own = os.getpid()

    def stay(number: int, *_: object) -> None:
        if os.getpid() != own:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)

    for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP):
        signal.signal(number, stay)


def _close_others(pipe: int) -> None:
    """Close the judge's files; what its modules have open to read alone, data of theirs, stays."""
    for file in map(int, os.listdir("/dev/fd")):  # noqa: PTH208
        with contextlib.suppress(OSError):
            kind, way = os.fstat(file).st_mode, fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE
            data = way == os.O_RDONLY and (stat.S_ISREG(kind) or stat.S_ISCHR(kind))
            if file > 2 and file != pipe and not data:
                os.close(file)


def _kill_below(pid: int, known: Iterable[int] = ()) -> None:
    """Kill all that a process began, or those that are known where the system does not tell.

    They are stopped first, so that none of them begins another one meanwhile.
    """
    for number in (signal.SIGSTOP, signal.SIGSTOP, signal.SIGKILL):
        for each in [*descendants(pid)] or known:
            with contextlib.suppress(ProcessLookupError):
                os.kill(each, number)


def _prctl(what: int, value: int = 1) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(what, value, 0, 0, 0)


def _serve(pipe: socket.socket, make: Callable[[], Controller]) -> None:
    """What the controller's process does: it answers each call."""
    made: Any = None
    calls = pipe.makefile("rb")
    while True:
        name, *values = pickle.load(calls)  # noqa: S301  (of its judge)
        wrong, answer = "", None
        try:
            if name == "make":
                made = make()
                knowing = isinstance(made, Knowing)
                answer = (tuple(made.knows), tuple(made.needs)) if knowing else ((), ())
            else:
                answer = getattr(made, name)(*values)
            if name == "step":
                void = getattr(made, "void_decisions", None)
                answer = answer, made.maneuver, made.contact, made.level, void
        except BaseException as error:  # noqa: BLE001  (it may raise anything)
            ours = isinstance(error, FAILURES)
            wrong = type(error).__name__
            answer = str(error) if ours else f"{name} raised {raised(error)}"
        ended = resource.getrusage(resource.RUSAGE_CHILDREN)
        told = time.process_time() + ended.ru_utime + ended.ru_stime
        data = pickle.dumps((wrong, answer, told), pickle.HIGHEST_PROTOCOL)
        pipe.sendall(_HEAD.pack(len(data)) + data)
