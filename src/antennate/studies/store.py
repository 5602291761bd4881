"""Finished trials on disk: one line of JSON each with a checksum, only ever appended.

The first line says what is run; a later one may say that it was continued with more trials, and
what the keys of those before are from there on. A line that a killed process left torn, or that was
damaged since, fails its checksum: its trial counts as not run. The file is locked while somebody
appends to it; the system frees the lock when that process ends, however it ends.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from antennate.errors import BadInputError, OutputError
from antennate.files import open_regular
from antennate.studies.formats import dumped
from antennate.studies.identity import but_trials, differences

STORE = "trials.store.jsonl"
Tasks = Callable[[Mapping[str, Any]], Sequence[Any]]
"""What each task of a configuration is, by its place: the same for any number of trials."""
_SYNC = 1.0
"""Time within which lines reach the disk itself, so that a power cut costs no more [s]."""
_HEAD = re.compile(rb'\{"crc":"([0-9a-f]{8})",')


class Store:
    """The finished trials of one run, open to add more.

    Args:
        path: The file; it is made if it is missing.

    Attributes:
        records: What was kept before, by key; of a key that comes twice the last counts.
        holds_trials: Whether it holds any that no other file has, kept before or now.
        processors: Models of the processors that they ran on.
        damaged: Lines that failed their checksum.
        was_empty: Whether the file held nothing before this process wrote to it.

    Raises:
        OutputError: It cannot be opened, or another process appends to it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise OutputError(f"expected to write {path}, found: {error.strerror}") from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._file)
            raise nobody_else(path.parent) from None
        except OSError:
            pass  # a file system without locks
        self.records: dict[str, Any] = {}
        self.identity: Mapping[str, Any] | None = None
        self._synced = 0.0
        self._end = 0
        self._running: list[str] = []
        self.damaged = self._read()
        self.holds_trials = bool(self.records)

    def _read(self) -> int:
        """Take what the file holds; how many lines are damaged."""
        data = _data(self.path)
        self.was_empty = not data
        content = parsed(data)
        self.identity, self.records = content.identity, content.records
        self.processors: list[str] = content.processors
        self._end = len(data)
        if data and not data.endswith(b"\n"):
            self._append(b"\n")
        return content.damaged

    def begin(self, identity: Mapping[str, Any], tasks: Tasks | None = None) -> None:
        """Say what is run, or find that it is what the file was begun with, or more trials of it.

        Args:
            identity: What is run.
            tasks: Of a configuration; None if there cannot be more trials.

        Raises:
            BadInputError: It is something else, or fewer trials; the text says what differs.
            OutputError: It cannot be written.
        """
        if self.identity is None and self.records:
            raise BadInputError(
                f"{self.path}: expected what is run in its first line, found that damaged, and "
                f"{len(self.records)} sound trials; choose another folder or give --overwrite"
            )
        if self.identity is None:
            self._append(line({"identity": identity}))
            self.identity = identity
        elif not (changes := differences(self.identity, identity)):
            return
        elif tasks is not None and but_trials(self.identity) == but_trials(identity):
            self._grow(identity, tasks(self.identity["config"]), tasks(identity["config"]), changes)
        else:
            raise BadInputError(
                f"{self.path.parent}: expected the run that it was begun with, found another: "
                f"{changes}; choose another folder or give --overwrite"
            )

    def _grow(
        self, identity: Mapping[str, Any], old: Sequence[Any], new: Sequence[Any], changes: str
    ) -> None:
        """Go on with more trials, of which each has another place."""
        places = {task: place for place, task in enumerate(new)}
        if len(new) < len(old):
            raise BadInputError(
                f"{self.path.parent}: expected no fewer trials than this run has, found {changes}; "
                "choose another folder for fewer"
            )
        moved = ((i, places[task]) for i, task in enumerate(old) if task in places)
        keys = {key_of(0, i): key_of(0, place) for i, place in moved}
        self._append(line({"identity": identity, "keys": keys}))
        self.identity, self.records = identity, _moved(self.records, keys)

    def holds_all(self, tasks: Tasks | None) -> bool:
        """Whether no trial of what is run is missing, as far as its tasks are known."""
        count = 0 if tasks is None or self.identity is None else len(tasks(self.identity["config"]))
        return all(key_of(0, place) in self.records for place in range(count))

    def append(self, key: str, content: Mapping[str, Any]) -> None:
        """Keep one trial.

        Raises:
            OutputError: The disk is full, or the like; what was kept before stays whole.
        """
        with self.promised():
            self._keep({"key": key, **content})
            self.holds_trials = True  # before the disk is waited for, where a signal may come
            self._sync()

    @contextlib.contextmanager
    def promised(self) -> Iterator[None]:
        """Say of what cannot be written meanwhile that the trials stay, if there are any.

        Raises:
            OutputError: Something cannot be written.
        """
        try:
            yield
        except OutputError as error:
            kept = "; what was finished is kept, and the run can be resumed"
            raise OutputError(f"{error}{kept if self.holds_trials else ''}") from None

    def saw(self, model: str) -> None:
        """Name the processor of the trials that come next; it is kept with the first of them."""
        if model not in [*self.processors, *self._running]:
            self._running.append(model)

    def take(self, records: Mapping[str, Any], processors: Sequence[str]) -> None:
        """Keep trials that stay in other files too, and the processors that they ran on."""
        for model in processors:
            self.saw(model)
        for key, content in records.items():
            self._keep({"key": key, **content})
            self._sync()
            self.records[key] = content

    def _keep(self, trial: Mapping[str, Any]) -> None:
        """Keep a trial and its processor, if that is a new one."""
        models = [{"processor": model} for model in self._running]
        self._write(b"".join(map(line, [*models, trial])))
        self.processors += self._running
        self._running.clear()

    def _append(self, data: bytes) -> None:
        self._write(data)
        self._sync()

    def _write(self, data: bytes) -> None:
        try:
            left = data
            while left:  # a disk that is almost full takes a part
                left = left[os.write(self._file, left) :]
            self._end += len(data)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._end)
            raise self._refused(error) from None

    def _sync(self) -> None:
        if time.monotonic() - self._synced > _SYNC:
            try:
                os.fsync(self._file)
            except OSError as error:
                raise self._refused(error) from None
            self._synced = time.monotonic()

    def _refused(self, error: OSError) -> OutputError:
        return OutputError(f"expected to write {self.path}, found: {error.strerror}")

    def close(self, remove: bool = False) -> None:
        """Let others append; `remove` deletes the file first."""
        with contextlib.suppress(OSError):
            if remove:
                self.path.unlink(missing_ok=True)
            elif self._end:
                os.fsync(self._file)
        with contextlib.suppress(OSError):
            os.close(self._file)


def key_of(call: int, place: int) -> str:
    """The key of a task: the number of the call that carries it out, and its place in that."""
    return f"{call}.{place}"


def nobody_else(place: Path) -> OutputError:
    """The error of a folder that another process works on."""
    return OutputError(f"{place}: expected a run that nobody works on, found another process at it")


def open_store(
    place: Path, identity: Mapping[str, Any] | None, tasks: Tasks | None = None
) -> Store | None:
    """The finished trials of a run that can be resumed; nobody else may work on them.

    Args:
        place: The run directory.
        identity: What is run; None for a run that cannot be resumed.
        tasks: As for `Store.begin`.

    Raises:
        BadInputError: They are of another run.
        OutputError: They cannot be opened, or another process appends to them.
    """
    if identity is None:
        (place / STORE).unlink(missing_ok=True)
        return None
    store = Store(place / STORE)
    try:
        store.begin(identity, tasks)
    except BaseException:
        store.close(remove=store.was_empty)
        raise
    return store


def _data(path: Path) -> bytes:
    try:
        with open_regular(path) as file:
            return file.read()
    except OSError as error:
        raise BadInputError(f"{path}: expected a readable file: {error.strerror}") from None


def line(content: Mapping[str, Any]) -> bytes:
    """One line with its checksum, which is that of the same JSON without it."""
    body = dumped(content).encode()
    return b'{"crc":"%08x",%b\n' % (zlib.crc32(body), body[1:])


class Parsed(NamedTuple):
    """What a file says is run, its trials by key, their processors, and how many lines are bad."""

    identity: Any
    records: dict[str, Any]
    processors: list[str]
    damaged: int


def parsed(data: bytes) -> Parsed:
    """The content of a file.

    Trials before the line that says what is run are of nothing that is known, and are left out.
    """
    identity: Mapping[str, Any] | None = None
    records: dict[str, Any] = {}
    processors: list[str] = []
    damaged = 0
    for content in _contents(data):
        if content is None:
            damaged += 1
        elif "identity" in content and identity is None:
            identity, records, processors = content["identity"], {}, []
        elif "identity" in content and "keys" in content:
            identity, records = content["identity"], _moved(records, content["keys"])
        elif "key" in content:
            records[content["key"]] = content
        elif "processor" in content:
            processors.append(content["processor"])
    return Parsed(identity, records, processors, damaged)


def _moved(records: Mapping[str, Any], keys: Mapping[str, str]) -> dict[str, Any]:
    """Records by new keys."""
    moved = {key: {**content, "key": keys[key]} for key, content in records.items() if key in keys}
    return {content["key"]: content for content in moved.values()}


def _contents(data: bytes) -> Iterator[dict[str, Any] | None]:
    for each in data.split(b"\n"):
        if not each:
            continue
        head = _HEAD.match(each)
        body = b"{" + each[head.end() :] if head else b""
        yield json.loads(body) if head and zlib.crc32(body) == int(head[1], 16) else None


def read_store(path: Path) -> Parsed:
    """The content of a file; nobody need have ended it.

    Raises:
        BadInputError: It cannot be read, or does not say what is run.
    """
    content = parsed(_data(path))
    if content.identity is None:
        raise BadInputError(f"{path}: expected finished trials, found no first line that is sound")
    return content
