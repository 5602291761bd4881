"""The file of trials: one line of JSON each with a checksum, only ever appended.

| line | says |
|---|---|
| `identity` | what is run; with `keys`, that there are more trials, and the keys of those before |
| `processor` | a model of processor, on which trials that follow ran |
| `key`, `result` | one trial: what its worker returned, with every bit, and its rows (`rows`) |
| `key`, `rows` | a row that belongs to no trial, by its number (`row.0`) |

Rows of a trial are `result` or `first` where the result, or the first part of it, is the row, so
that it stands there once; else they are listed.

A line that a killed process left torn, or that was damaged since, fails its checksum: its trial
counts as not run. The file is locked while somebody appends to it; the system frees the lock when
that process ends, however it ends.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Any

from antennate.errors import BadInputError, OutputError
from antennate.files import lock, read_limited, writing
from antennate.studies.formats import as_mapping, decoded, dumped, encoded, strict
from antennate.studies.identity import but_trials, differences

TRIALS = "trials.jsonl"
Tasks = Callable[[Mapping[str, Any]], Sequence[Any]]
"""What each task of a configuration is, by its place: the same for any number of trials."""
_SYNC = 1.0
"""Time within which lines reach the disk itself, so that a power cut costs no more [s]."""
_HEAD = re.compile(rb'\{"crc":"([0-9a-f]{8})",')
_ROW = "row."
"""Begins the key of a row that belongs to no trial."""


@dataclass
class Content:
    """What the lines of a file say.

    Attributes:
        identity: What is run, None where no sound line says it.
        records: Trials, and rows of none, by key; of a key that comes twice the last counts.
        processors: Models of the processors that they ran on.
        damaged: Lines that failed their checksum.
    """

    identity: Any = None
    records: dict[str, Any] = field(default_factory=dict)
    processors: list[str] = field(default_factory=list)
    damaged: int = 0

    def read(self, data: bytes) -> Content:
        """Take lines."""
        for content in map(_sound, filter(None, data.split(b"\n"))):
            match content:
                case None:
                    self.damaged += 1
                case {"identity": identity}:
                    self._turn_to(identity, content.get("keys"))
                case {"key": key}:
                    self.records[key] = content
                case {"row": number, "values": values}:  # as versions before kept it
                    self.records[f"{_ROW}{number}"] = {"key": f"{_ROW}{number}", "rows": [values]}
                case {"processor": model}:
                    self.processors.append(model)
                case _:
                    pass
        return self

    def _turn_to(self, identity: Any, keys: Mapping[str, str] | None) -> None:
        """Go on with what is run from here on; trials of before that it holds have other keys.

        Without keys it is the beginning: trials before that are of nothing that is known, and go.
        """
        self.identity = identity
        self.processors = [] if keys is None else self.processors
        moved = {new: self.records[old] for old, new in (keys or {}).items() if old in self.records}
        self.records = {key: {**record, "key": key} for key, record in moved.items()}

    def rows(self) -> list[dict[str, Any]]:
        """Rows of all trials, as a table has them, and those of none.

        A trial that was first shown on a page, which keeps its row alone, is a trial since.
        """
        found, others = list[dict[str, Any]](), list[dict[str, Any]]()
        for key, record in self.records.items():
            match record:
                case {"rows": "result", "result": row}:
                    found.append(strict(decoded(row, None)))
                case {"rows": "first", "result": {"of": [row, *_]}}:
                    found.append(strict(decoded(row, None)))
                case _:
                    (others if key.startswith(_ROW) else found).extend(record.get("rows", ()))
        return [*found, *(row for row in others if row not in found)]


class TrialFile(Content):
    """The trials of one run, open to add more.

    Args:
        path: The file; it is made if it is missing.

    Attributes:
        holds_trials: Whether it holds any that no other file has, kept before or now.
        calls: Numbers the calls of `gather`, by which their tasks are kept.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path, self.calls = path, itertools.count()
        with writing(path):
            self._file = locked(path, os.O_CREAT | os.O_APPEND)
        self._synced, self._seen, self._count = 0.0, list[str](), 0
        self._rows: list[Any] | None = None
        data = read_limited(path, sys.maxsize)
        self._end = len(data)
        self.read(data)
        self.holds_trials = bool(self.records)
        if data and not data.endswith(b"\n"):
            self._write(b"\n")  # what a killed process left is a line of its own

    def begin(self, identity: Mapping[str, Any], tasks: Tasks | None = None) -> None:
        """Say what is run, or find that it is what the file was begun with, or more trials of it.

        Args:
            identity: What is run.
            tasks: Of a configuration; None if there cannot be more trials.
        """
        before, where = self.identity, "choose another folder or give --overwrite"
        if before is None and self.records:
            raise BadInputError(
                f"{self.path}: expected what is run in its first line, found that damaged, and "
                f"{len(self.records)} sound trials; {where}"
            )
        keys = None
        if before is not None:
            if not (changes := differences(before, identity)):
                return
            grows = tasks is not None and but_trials(before) == but_trials(identity)
            old, new = (tasks(of["config"]) if tasks and grows else () for of in (before, identity))
            if not grows or len(new) < len(old):
                raise BadInputError(
                    f"{self.path.parent}: expected the run that it was begun with, or more trials "
                    f"of it, found another: {changes}; {where}"
                )
            places = {task: key_of(0, place) for place, task in enumerate(new)}
            keys = {key_of(0, i): places[task] for i, task in enumerate(old) if task in places}
        self._write(line({"identity": identity, **({} if keys is None else {"keys": keys})}))
        self._turn_to(identity, keys)

    def holds_all(self, tasks: Tasks | None) -> bool:
        """Whether no line is damaged and no trial missing, as far as the tasks are known."""
        count = 0 if tasks is None or self.identity is None else len(tasks(self.identity["config"]))
        return not self.damaged and all(key_of(0, i) in self.records for i in range(count))

    @contextlib.contextmanager
    def trial(self, key: str, result: Any, **more: Any) -> Iterator[None]:
        """Keep a trial once the block has ended, however it ends, and its rows from the block.

        Args:
            key: The key of the trial.
            result: What its worker returned.
            more: What else its line says.
        """
        content = {**more, "result": encoded(result)}
        with self.known() as rows:
            try:
                yield
            finally:
                self.append(key, content | ({"rows": _rows(rows, result)} if rows else {}))

    @contextlib.contextmanager
    def known(self) -> Iterator[list[Any]]:
        """Rows that are added within the block are those of a trial, which has a line already."""
        self._rows = rows = list[Any]()
        try:
            yield rows
        finally:
            self._rows = None

    def append(self, key: str, content: Mapping[str, Any]) -> None:
        """Keep one trial, and its processor, if that is a new one.

        Args:
            key: Its key.
            content: What else its line says.
        """
        lines = [*({"processor": model} for model in self._seen), {"key": key, **content}]
        self._write(b"".join(map(line, lines)), is_trial=True)
        self.processors += self._seen
        self._seen.clear()

    def add_row(self, row: Any) -> None:
        """Keep a row, a dataclass or a mapping: within a trial with it, else in a line of its own.

        One that the file has from a process before is not written again.
        """
        if self._rows is not None:
            self._rows.append(row if is_dataclass(row) else as_mapping(row))
            return
        key, self._count = f"{_ROW}{self._count}", self._count + 1
        content = {"key": key, "rows": [strict(as_mapping(row))]}
        if self.records.get(key) != content:
            self._write(line(content), is_trial=True)
        self.records[key] = content

    def saw(self, model: str) -> None:
        """Name the processor of the trials that come next; it is kept with the first of them."""
        if model not in [*self.processors, *self._seen]:
            self._seen.append(model)

    def take(self, content: Content) -> None:
        """Keep trials that stay in other files too, and the processors that they ran on."""
        self.processors, self.records = [*dict.fromkeys(content.processors)], content.records
        lines = [*({"processor": model} for model in self.processors), *self.records.values()]
        self._write(b"".join(map(line, lines)))

    def _write(self, data: bytes, is_trial: bool = False) -> None:
        try:
            left = data
            while left:  # a disk that is almost full takes a part
                left = left[os.write(self._file, left) :]
            self._end += len(data)
            self.holds_trials |= is_trial  # before the disk is waited for, where a signal may come
            if time.monotonic() - self._synced > _SYNC:
                os.fsync(self._file)
                self._synced = time.monotonic()
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._end)
            kept = "; what was finished is kept, and the run can be resumed"
            raise OutputError(
                f"expected to write {self.path}, found: {error.strerror}"
                f"{kept if self.holds_trials else ''}"
            ) from None

    def close(self, remove: bool = False) -> None:
        """Let others append; `remove` deletes the file first."""
        with contextlib.suppress(OSError):
            if remove:
                self.path.unlink(missing_ok=True)
            elif self._end:
                os.fsync(self._file)
        with contextlib.suppress(OSError):
            os.close(self._file)


def read_trials(path: Path) -> Content:
    """The content of a file; nobody need have ended it."""
    return Content().read(read_limited(path, sys.maxsize))


def key_of(call: int, place: int) -> str:
    """The key of a task: the number of the call that carries it out, and its place in that."""
    return f"{call}.{place}"


def line(content: Mapping[str, Any]) -> bytes:
    """One line with its checksum, which is that of the same JSON without it."""
    body = dumped(content).encode()
    return b'{"crc":"%08x",%b\n' % (zlib.crc32(body), body[1:])


def locked(path: Path, flags: int = 0) -> int:
    """The handle of a file of a run, locked: the system frees it when this process ends."""
    handle = os.open(path, os.O_RDWR | os.O_CLOEXEC | flags, 0o666)
    if lock(handle) is False:  # None on a file system without locks
        os.close(handle)
        raise OutputError(
            f"{path.parent}: expected a run that nobody works on, found another process at it"
        )
    return handle


def _rows(rows: Sequence[Any], result: Any) -> Any:
    """The rows of a trial, or where in its result its only one stands."""
    if len(rows) == 1 and is_dataclass(rows[0]):
        if rows[0] is result:
            return "result"
        if isinstance(result, tuple) and rows[0] is result[0]:
            return "first"
    return [strict(as_mapping(row)) for row in rows]


def _sound(text: bytes) -> dict[str, Any] | None:
    """The content of a line, None of one that is damaged."""
    head = _HEAD.match(text)
    body = b"{" + text[head.end() :] if head else b""
    return json.loads(body) if head and zlib.crc32(body) == int(head[1], 16) else None
