"""The run directory: everything about one run in one place, and nothing half written.

Files are written whole, and listed in `files.txt`. While a run goes on, finished trials are
appended to `trials.partial.jsonl`, and what a run needs to be resumed to `trials.store.jsonl`,
which stays where more trials may follow. A directory that
holds a run is left alone unless told otherwise; then it is renamed to NAME.old first.

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
import os
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from antennate import checks
from antennate.errors import BadInputError, OutputError
from antennate.files import writing_whole
from antennate.params.base import Config, Params, read_file
from antennate.studies import formats
from antennate.studies.claim import Claim, claim, give_back
from antennate.studies.run_files import (
    COMMAND,
    CONFIG,
    FIGURES,
    FILES,
    LOGS,
    PARTIAL,
    REPORT,
    RESULT,
    ROOM,
    TABLE,
    VERSIONS,
    add_to_list,
    begun_line,
    files_of,
    inside,
    listed,
    read_as,
    remove_described,
    remove_run,
    trim_list,
    with_end,
    writing,
)
from antennate.studies.store import Tasks
from antennate.studies.work import processor
from antennate.telemetry.header import versions

_KEPT_FREE = 1 << 16
"""Size of the file that keeps room for the result [bytes]: eight times that of a drive."""


class RunDirectory:
    """The directory of one run; as a context it removes itself if it ends without anything to keep.

    Attributes:
        path: Where it is.
        store: Its finished trials if it can be resumed, None otherwise.
        keeps_store: Whether they stay when the run is complete.
        untouched: Whether it was finished already, and no file of it was missing so far.
        old: The new name of the folder that it replaces, None if it replaces none.
    """

    def __init__(self, taken: Claim):
        self.path, self.store, self.keeps_store = taken.path, taken.store, False
        self._finished, self.untouched = taken.finished, taken.finished
        self._created, self.old, self._lock = taken.created, taken.old, taken.lock
        self._partial = taken.partial
        self._kept = taken.partial is None
        self._described: dict[str, str] = {}
        self._spent: Path | None = None
        self._listed = set(listed(taken.path) or ())

    @classmethod
    def create(
        cls,
        command: str,
        path: str | Path | None = None,
        overwrite: bool = False,
        identity: Mapping[str, Any] | None = None,
        resume: bool | None = False,
        retry: bool = False,
        tasks: Tasks | None = None,
    ) -> RunDirectory:
        """Claim a directory for a run of `command`.

        Args:
            command: Name of the experiment or command.
            path: The directory; the next free `runs/COMMAND-N` if not given.
            overwrite: If it holds a run, rename it to NAME.old first, or to NAME.old2 and so on
                where there is one. If the new run leaves nothing, the name is given back.
            identity: What is run, by `antennate.studies.identity`, for a run that can be resumed.
            resume: Go on with the run that it holds, if there is one. Of one that is finished only
                files that are missing are written, and the report with them. None if `command`
                goes on with none.
            retry: Whether trials that failed are run again, so that no run is finished.
            tasks: What each task is, of a configuration as JSON has it, so that a run goes on with
                more trials than it was begun with; None if it does not.

        Raises:
            BadInputError: The run that is to go on is another one, the path is none, or the command
                has a name that no folder can have.
            OutputError: It cannot be made or written to, it holds another run, or another process
                works on it; or, to overwrite it, it holds no run.
        """
        return cls(claim(command, path, overwrite, identity, resume, retry, tasks))

    @classmethod
    def open(cls, path: str | Path) -> RunDirectory:
        """A directory that a run has left, to read.

        Raises:
            BadInputError: It holds no run, or the path is none.
        """
        place = checks.path("path", path)
        if not any((place / name).exists() for name in (RESULT, PARTIAL, CONFIG)):
            raise BadInputError(f"{place}: expected the folder of a run, found no {RESULT}")
        return cls(Claim(place))

    def result(self) -> dict[str, Any]:
        """The content of result.json.

        Raises:
            BadInputError: There is none, or it is damaged.
        """
        return read_as(self.path / RESULT, json.loads)

    def rows(self) -> list[dict[str, Any]]:
        """The finished trials: those of trials.csv, or of a run that was stopped.

        Raises:
            BadInputError: The file is damaged.
        """
        if (self.path / TABLE).exists():
            return read_as(self.path / TABLE, formats.from_csv)
        if (self.path / PARTIAL).exists():
            return read_as(self.path / PARTIAL, formats.from_lines)
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
            BadInputError: The file is damaged, or no file of a run has such a name.
        """
        path = inside(self.path, name)
        decode = formats.sound_json if name.endswith(".json") else str
        return read_as(path, decode) if path.exists() else ""

    def made(self, folder: str, ending: str) -> list[Path]:
        """Files of the run in a folder of it; of a run of an older version all that are there."""
        files = sorted((self.path / folder).glob(f"*{ending}"))
        own = files_of(self.path)
        return [file for file in files if file in own or not own]

    def describe(self, config: Params, command: Sequence[str] = ()) -> None:
        """Write what is known before the run: configuration, versions and command.

        Args:
            config: The configuration.
            command: Words of the command line, if it was one.

        Raises:
            ConfigError: The configuration is none.
            OutputError: It cannot be written.
        """
        checks.instance("config", config, Params)
        self._described = {CONFIG: formats.to_toml(config), VERSIONS: self._versions()}
        if command:
            resumed = self.store is not None and self.store.holds_trials
            self._described[COMMAND] = f"{shlex.join(command)}\n{begun_line(resumed)}"
        for name, text in self._described.items():
            self.write(name, text)

    def _versions(self) -> str:
        """Versions of what the numbers depend on, and the models of the processors."""
        identity = self.store.identity if self.store is not None else None
        models = self.store.processors if self.store is not None else []
        known = versions() if identity is None else identity["versions"]
        return formats.to_json({**known, "processor": " and ".join(models or [processor()])})

    def without_trials(self) -> None:
        """Say that this run has none, so that no empty file of them is left if it is killed.

        Room for the result is kept, so that a disk that fills meanwhile does not cost it.
        """
        self._drop_partial()
        with writing(self.path / ROOM):
            (self.path / ROOM).write_bytes(bytes(_KEPT_FREE))

    def append(self, row: Any) -> None:
        """Keep one finished trial, a dataclass or a mapping, at once.

        Raises:
            ConfigError: The row is neither, or holds what is no number, text, list or dictionary.
            OutputError: It cannot be written, or the run is finished.
        """
        if self._finished:
            return
        if self._partial is None:
            raise OutputError(f"{self.path}: expected a run that goes on, found a finished one")
        promised = self.store.promised() if self.store is not None else contextlib.nullcontext()
        with promised, writing(self.path / PARTIAL):
            self._partial.write(formats.to_line(formats.as_mapping(row)))
            self._partial.flush()
        self.keep()

    def finish(self, result: Mapping[str, Any], rows: Iterable[Any] = ()) -> None:
        """Write the result and, if there are rows, their table; then drop the partial file.

        What `describe` wrote is written again where somebody removed it meanwhile.

        Raises:
            ConfigError: The result is no dictionary, or a row is neither that nor a dataclass.
            OutputError: Something cannot be written.
        """
        checks.mapping("result", result)
        checks.instance("rows", rows, Iterable)
        table = formats.to_csv(formats.as_mapping(row) for row in rows)
        if table:
            self.write(TABLE, table)
        self._give_room()
        for name, text in self._described.items():
            if not (self.path / name).exists():
                self.write(name, text)
        if not self._finished and self.text(VERSIONS) not in ("", self._versions()):
            self.write(VERSIONS, self._versions())
        self.write(RESULT, formats.to_json(result))
        if text := self.text(COMMAND):
            self.write(COMMAND, with_end(text))
        self.keep()
        self._drop_partial()
        if not result.get("interrupted") and self.store is not None:
            self._spent = None if self.keeps_store else self.store.path
            self._close_store()

    def keep(self) -> None:
        """Let it stay when the run ends."""
        self._kept = True

    def keep_trials(self) -> None:
        """Let the store of finished trials stay, so that what is missing can still be written."""
        self._spent = None

    def keep_logs(self) -> None:
        """Let it stay when the run ends if it holds logs, even if none of the trials has ended."""
        self._kept = self._kept or any(path.parent.name == LOGS for path in files_of(self.path))

    def discard(self) -> None:
        """Let nothing stay of a run whose trials are all in other files."""
        self._kept = False

    def write(self, name: str, content: str | bytes | Iterator[str]) -> None:
        """Put one file into the directory, whole or not at all; a long text comes in pieces.

        Of a finished run, one that is there stays; but the report tells of those that were missing.

        Raises:
            ConfigError: The name leads out of the directory, or the content is neither text nor
                bytes nor pieces of text.
            OutputError: It cannot be written.
        """
        path = inside(self.path, name)
        if self._finished and path.exists() and (name != REPORT or self.untouched):
            return
        self.untouched = False
        self.claim_names([name])
        with writing(path):
            path.parent.mkdir(exist_ok=True)
        with writing_whole(path, overwrite=True) as file:
            file.writelines(formats.pieces(content))

    def claim_names(self, names: Iterable[str]) -> None:
        """Put names into the list of files of this run, before these files are made.

        Raises:
            OutputError: There is such a file, which this run has not made.
        """
        new = [name for name in names if name not in self._listed]
        self.require_free(new)
        if new:
            with writing(self.path / FILES):
                add_to_list(self.path, new)
            self._listed.update(new)

    def require_free(self, names: Iterable[str]) -> None:
        """Find out, before a run, whether names that it will write are those of somebody else.

        Raises:
            OutputError: There is such a file, which this run has not made.
        """
        for name in names:
            if name not in self._listed and os.path.lexists(self.path / name):
                raise OutputError(
                    f"{self.path}: expected no file {name} but of this run, found one of somebody "
                    "else; move it, or choose another folder"
                )

    def folder(self, name: str) -> Path:
        """A folder in the directory for files of the run, made if it is not there.

        Raises:
            ConfigError: The name leads out of the directory.
            OutputError: It cannot be made.
        """
        path = inside(self.path, name)
        with writing(path):
            path.mkdir(exist_ok=True)
        return path

    def write_figures(self, figures: Mapping[str, Any]) -> None:
        """Put figures of matplotlib into the directory, each as svg and png, by name.

        Raises:
            ConfigError: One is no figure.
            OutputError: One cannot be written.
        """
        from antennate.figures import render

        for name, figure in checks.mapping("figures", figures).items():
            for suffix, data in render(figure).items():
                self.write(f"{FIGURES}/{name}.{suffix}", data)

    def _drop_partial(self) -> None:
        if self._partial is None:
            return
        with writing(self.path / PARTIAL):
            self._partial.close()
            (self.path / PARTIAL).unlink(missing_ok=True)
        self._partial = None

    def _close_store(self, remove: bool = False) -> None:
        if self.store is not None:
            self.store.close(remove)
            self.store = None

    def _give_room(self) -> None:
        with writing(self.path / ROOM):
            (self.path / ROOM).unlink(missing_ok=True)

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None and self._spent is not None:  # else what is missing can be written again
            with contextlib.suppress(OSError):
                self._spent.unlink()
        stays = self._kept or (self.store is not None and self.store.holds_trials)
        self._close_store(remove=not stays)
        if stays:
            if self._partial is not None:
                with contextlib.suppress(OSError):
                    self._partial.close()
        else:
            with contextlib.suppress(OSError, OutputError):
                self._drop_partial()
                self._give_room()
                (remove_described if self.old is None else remove_run)(self.path)
                give_back(self.path, self._created, self.old)
        if self._lock is not None:
            if stays:
                with contextlib.suppress(OSError):
                    trim_list(self.path, self._lock)
            os.close(self._lock)
            self._lock = None
