"""The run directory: everything about one run in one place, and nothing half written.

Files are written whole. While a run goes on, finished trials are appended to
`trials.partial.jsonl`, and what a run needs to be resumed to `trials.store.jsonl`. A directory that
holds a run is left alone unless told otherwise; then the files of that run go first, so that
nothing old stands beside the new. Only a calibration stays until the next one replaces it, so that
a robot is never without.

```python
with RunDirectory.create("tunnel", "runs/mine") as run:
    run.describe(config)
    run.finish(outcome.result(), outcome.rows)
RunDirectory.open("runs/mine").rows()
```
"""

from __future__ import annotations

import contextlib
import json
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

from antennate.errors import BadInputError, OutputError
from antennate.files import decoded, read_limited, writing_whole
from antennate.params.base import Params
from antennate.params.reading import Config, read_file
from antennate.studies import dates
from antennate.studies.formats import from_csv, to_csv, to_json, to_line, to_toml
from antennate.studies.processor import processor
from antennate.studies.run_files import (
    COMMAND,
    CONFIG,
    ENDINGS,
    FIGURES,
    LARGEST,
    LOGS,
    PARTIAL,
    REPORT,
    RESULT,
    ROOM,
    TABLE,
    VERSIONS,
    files_of,
    free,
    holds_run,
    is_finished,
    is_folder,
    outdated,
)
from antennate.studies.store import STORE, Store, open_store
from antennate.telemetry.header import versions

_KEPT_FREE = 1 << 16
"""Size of the file that keeps room for the result [bytes]: eight times that of a drive."""


class RunDirectory:
    """The directory of one run; as a context it removes itself if it ends without anything to keep.

    Attributes:
        path: Where it is.
        store: Its finished trials if it can be resumed, None otherwise.
        keeps_store: Whether they stay when the run is complete.
    """

    def __init__(
        self,
        path: Path,
        created: Sequence[Path] = (),
        partial: IO[str] | None = None,
        store: Store | None = None,
        finished: bool = False,
    ):
        self.path, self.store, self.keeps_store = path, store, False
        self._finished, self._completed = finished, False
        self._created = created
        self._partial = partial
        self._kept = partial is None

    @classmethod
    def create(
        cls,
        command: str,
        path: str | Path | None = None,
        overwrite: bool = False,
        identity: Mapping[str, Any] | None = None,
        resume: bool = False,
        retry: bool = False,
    ) -> RunDirectory:
        """Claim a directory for a run of `command`.

        Args:
            command: Name of the experiment or command.
            path: The directory; the next free `runs/COMMAND-N` if not given.
            overwrite: Remove the run that it holds.
            identity: What is run, by `antennate.studies.identity`, for a run that can be resumed.
            resume: Go on with the run that it holds, if there is one. Of one that is finished only
                files that are missing are written, and the report with them.
            retry: Whether trials that failed are run again, so that no run is finished.

        Raises:
            BadInputError: The run that is to go on is another one.
            OutputError: It cannot be made or written to, it holds another run, or another process
                works on it.
        """
        if path == "" or "\0" in str(path):
            found = "one with a zero byte" if path else "an empty one"
            raise OutputError(f"expected the name of a folder, found {found}")
        place = free(command) if path is None else Path(path)
        with _writing(place):
            missing = [p for p in (place, *place.parents) if not p.exists()]
            place.mkdir(parents=True, exist_ok=path is not None)
            for folder in ENDINGS:
                if (place / folder).is_symlink():
                    raise OutputError(f"expected {place / folder} within its run, found a link")
            held = files_of(place)
            goes_on = resume and not overwrite and (place / STORE) in held
            if held and not overwrite and not goes_on:
                raise holds_run(place, held, resume)
            try:
                store = open_store(place, identity, overwrite)
            except BaseException:
                for path in missing:
                    path.rmdir()
                raise
            sound = store is not None and not store.damaged
            finished = goes_on and not retry and sound and is_finished(place)
            for file in outdated(held, command, goes_on, finished):
                file.unlink()
            partial = None if finished else (place / PARTIAL).open("x", encoding="utf-8")
            return cls(place, missing, partial, store, finished)

    @classmethod
    def open(cls, path: str | Path) -> RunDirectory:
        """A directory that a run has left, to read.

        Raises:
            BadInputError: It holds no run.
        """
        place = Path(path)
        if not any((place / name).exists() for name in (RESULT, PARTIAL, CONFIG)):
            raise BadInputError(f"{place}: expected the folder of a run, found no {RESULT}")
        return cls(place)

    def result(self) -> dict[str, Any]:
        """The content of result.json.

        Raises:
            BadInputError: There is none, or it is damaged.
        """
        return self._decoded(RESULT, json.loads)

    def rows(self) -> list[dict[str, Any]]:
        """The finished trials: those of trials.csv, or of a run that was stopped.

        Raises:
            BadInputError: The file is damaged.
        """
        if (self.path / TABLE).exists():
            return self._decoded(TABLE, from_csv)
        if (self.path / PARTIAL).exists():
            return self._decoded(PARTIAL, lambda text: list(map(json.loads, text.splitlines())))
        return []

    def config(self, model: type[Config]) -> Config:
        """The configuration of the run.

        Raises:
            BadInputError: It is missing or damaged, or is of another command.
        """
        return read_file(self.path / CONFIG, model)

    def text(self, name: str) -> str:
        """The content of one of its text files; empty if there is none.

        Raises:
            BadInputError: The file is damaged.
        """
        decode = _sound_json if name.endswith(".json") else str
        return self._decoded(name, decode) if (self.path / name).exists() else ""

    def _decoded(self, name: str, decode: Any) -> Any:
        path = self.path / name
        text = decoded(path, read_limited(path, LARGEST))
        try:
            return decode(text)
        except ValueError as error:
            raise BadInputError(
                f"{path}: expected a whole file of this kind, found: {str(error).splitlines()[0]}"
            ) from None

    def describe(self, config: Params, command: Sequence[str] = ()) -> None:
        """Write what is known before the run: configuration, versions and command.

        Args:
            config: The configuration.
            command: Words of the command line, if it was one.
        """
        self.write(CONFIG, to_toml(config))
        self.write(VERSIONS, self._versions())
        if command:
            resumed = self.store is not None and self.store.holds_trials
            self.write(COMMAND, f"{shlex.join(command)}\n{dates.begun(resumed)}")

    def _versions(self) -> str:
        """Versions of what the numbers depend on, and the models of the processors."""
        told = self.store.identity if self.store is not None else None
        models = self.store.processors if self.store is not None else []
        known = versions() if told is None else told["versions"]
        return to_json({**known, "processor": " and ".join(models or [processor()])})

    def without_trials(self) -> None:
        """Say that this run has none, so that no empty file of them is left if it is killed.

        Room for the result is kept, so that a disk that fills meanwhile does not cost it.
        """
        self._drop_partial()
        with _writing(self.path / ROOM):
            (self.path / ROOM).write_bytes(bytes(_KEPT_FREE))

    def append(self, row: Any) -> None:
        """Keep one finished trial, a dataclass or a mapping, at once."""
        if self._finished:
            return
        if self._partial is None:
            raise OutputError(f"{self.path}: expected a run that goes on, found a finished one")
        with _writing(self.path / PARTIAL):
            self._partial.write(to_line(_plain(row)))
            self._partial.flush()
        self._kept = True

    def finish(self, result: Mapping[str, Any], rows: Iterable[Any] = ()) -> None:
        """Write the result and, if there are rows, their table; then drop the partial file."""
        table = to_csv(_plain(row) for row in rows)
        if table:
            self.write(TABLE, table)
        self._give_room()
        self.write(RESULT, to_json(result))
        if not self._finished and self.text(VERSIONS) not in ("", self._versions()):
            self.write(VERSIONS, self._versions())
        if text := self.text(COMMAND):
            self.write(COMMAND, dates.ended(text))
        self._kept = True
        self._drop_partial()
        if not result.get("interrupted"):
            self._close_store(remove=not self.keeps_store)

    def keep_logs(self) -> None:
        """Let it stay when the run ends if it holds logs, even if none of the trials has ended."""
        self._kept = self._kept or any(path.parent.name == LOGS for path in files_of(self.path))

    def discard(self) -> None:
        """Let nothing that was kept so far stay when the run ends."""
        self._kept = False
        if self.store is not None:
            self.store.holds_trials = False

    def write(self, name: str, content: str | bytes | Iterator[str]) -> None:
        """Put one file into the directory, whole or not at all; a long text comes in pieces.

        Of a finished run, one that is there stays; but the report tells of those that were missing.

        Raises:
            OutputError: It cannot be written.
        """
        path = self.path / name
        if self._finished and path.exists() and not (name == REPORT and self._completed):
            return
        self._completed = True
        with _writing(path):
            path.parent.mkdir(exist_ok=True)
        with writing_whole(path, overwrite=True) as file:
            for piece in (content,) if isinstance(content, str | bytes) else content:
                file.write(piece.encode() if isinstance(piece, str) else piece)

    def folder(self, name: str) -> Path:
        """A folder in the directory for files of the run, made if it is not there.

        Raises:
            OutputError: It cannot be made.
        """
        with _writing(self.path / name):
            (self.path / name).mkdir(exist_ok=True)
        return self.path / name

    def write_figures(self, figures: Mapping[str, Any]) -> None:
        """Put figures into the directory, each as svg and png, by name."""
        from antennate.figures import render

        for name, figure in figures.items():
            for suffix, data in render(figure).items():
                self.write(f"{FIGURES}/{name}.{suffix}", data)

    def _drop_partial(self) -> None:
        if self._partial is None:
            return
        with _writing(self.path / PARTIAL):
            self._partial.close()
            (self.path / PARTIAL).unlink(missing_ok=True)

    def _close_store(self, remove: bool = False) -> None:
        if self.store is not None:
            self.store.close(remove)
            self.store = None

    def _give_room(self) -> None:
        with _writing(self.path / ROOM):
            (self.path / ROOM).unlink(missing_ok=True)

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(self, *_: object) -> None:
        kept = self._kept or (self.store is not None and self.store.holds_trials)
        self._close_store(remove=not kept)
        if kept:
            if self._partial is not None:
                with contextlib.suppress(OSError):
                    self._partial.close()
            return
        with contextlib.suppress(OSError, OutputError):
            self._drop_partial()
            self._give_room()
            for file in files_of(self.path):
                if file.name in (CONFIG, VERSIONS, COMMAND) or file.parent == self.path / LOGS:
                    file.unlink()
            if is_folder(self.path / LOGS):
                (self.path / LOGS).rmdir()
            for path in self._created:
                path.rmdir()


def _sound_json(text: str) -> str:
    json.loads(text)
    return text


def _plain(row: Any) -> Mapping[str, Any]:
    return row if isinstance(row, Mapping) else asdict(row)


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(f"expected to write {path}, found: {error.strerror or error}") from None
