"""The run directory: everything about one run in one place, and nothing half written.

Files are written whole, and listed in `files.txt`. While a run goes on, finished trials are
appended to `trials.jsonl`, which stays where more trials may follow. A directory that holds a run
is left alone unless told otherwise: with `--overwrite` NAME is renamed to NAME.old, and where there
is one to NAME.old2, and so on. The rename is one step, so a process that is killed at any moment
leaves the old run whole, under one of the two names.

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
from antennate.errors import FAILURES, BadInputError, OutputError
from antennate.files import writing, writing_whole
from antennate.params.base import Config, Params, read_file
from antennate.studies import formats, run_files
from antennate.studies.run_files import FILES, LOGS, REPORT, RESULT, ROOM, TABLE, date_line, read_as
from antennate.studies.trial_file import TRIALS, Tasks, TrialFile, locked, read_trials
from antennate.studies.work import processor
from antennate.telemetry.header import versions

_KEPT_FREE = 1 << 16
"""Size of the file that keeps room for the result [bytes]: eight times that of a drive."""


class RunDirectory:
    """The directory of one run; as a context it removes itself if it ends without anything to keep.

    Attributes:
        path: Where it is.
        trials: The file of its trials, None if there is none.
        keeps_trials: Whether that file stays when the run is complete.
        finished: Whether the run was finished already when it was taken.
        kept: Whether it stays when the run ends, though it may hold no trials.
        untouched: Whether no file of such a run was missing so far.
        old: The new name of the folder that it replaces, None if it replaces none.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.old, self.trials = path, None, None
        self.keeps_trials = self.finished = self.untouched = False
        self._created: Sequence[Path] = ()
        self._lock: int | None = None
        self.kept = self._complete = False
        self._described: tuple[str, str] | None = None

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
        run, before = cls(run_files.place_of(command, path)), False
        place = run.path
        with writing(place):
            run._created = [p for p in (place, *place.parents) if not p.exists()]
            place.mkdir(parents=True, exist_ok=path is not None)
            run_files.sweep(place)
            try:
                if overwrite and any(place.iterdir()):
                    run.old = run_files.set_aside(place)
                    place.mkdir()
                run.require_free(run_files.NAMES)
                before = run_files.goes_on(place, resume if identity is not None else None)
                run._begin(identity, tasks, before, retry)
            except BaseException:
                run._leave(stays=before)
                raise
        return run

    def _begin(
        self, identity: Mapping[str, Any] | None, tasks: Tasks | None, before: bool, retry: bool
    ) -> None:
        """Begin a run in a folder that is there, or go on with the one before."""
        place = self.path
        if not before:
            run_files.add_to_list(place, (TRIALS, ROOM))
        self._lock = locked(place / FILES)
        if identity is not None:
            self.trials = TrialFile(place / TRIALS)
            self.trials.begin(identity, tasks if before else None)
            whole = before and not retry and self.trials.holds_all(tasks)
            ended = whole and (place / RESULT).exists() and not self.result().get("interrupted")
            self.finished = self.untouched = self.kept = ended
        if before and not self.finished:
            run_files.remove_run(
                place,
                lambda file: (
                    file.parent.name == LOGS or file.name in (TRIALS, *run_files.LOG_PARTS)
                ),
            )

    @classmethod
    def open(cls, path: str | Path) -> RunDirectory:
        """A directory that a run has left, to read.

        Raises:
            BadInputError: It holds no run, or the path is none.
        """
        place = checks.path("path", path)
        if not any((place / name).exists() for name in (RESULT, TRIALS, run_files.CONFIG)):
            raise BadInputError(f"{place}: expected the folder of a run, found no {RESULT}")
        return cls(place)

    def result(self) -> dict[str, Any]:
        """The content of result.json.

        Raises:
            BadInputError: There is none, or it is damaged.
        """
        return read_as(self.path / RESULT, json.loads)

    def rows(self) -> list[dict[str, Any]]:
        """The finished trials: those of trials.csv, or of a run that was stopped.

        Raises:
            BadInputError: The file is damaged, or is of a run that a version before did not end.
        """
        if (self.path / TABLE).exists():
            return read_as(self.path / TABLE, formats.from_csv)
        if (self.path / TRIALS).exists():
            return read_trials(self.path / TRIALS).rows()
        old = [name for name in run_files.BEFORE if (self.path / name).exists()]
        if old and not (self.path / RESULT).exists():
            raise BadInputError(
                f"{self.path}: expected {TRIALS}, found {old[0]} of a version before; go on with "
                "that version, which writes its result"
            )
        return []

    def config(self, model: type[Config]) -> Config:
        """The configuration of the run.

        Raises:
            BadInputError: It is missing or damaged, or is of another command.
        """
        return read_file(self.path / run_files.CONFIG, model)

    def text(self, name: str) -> str:
        """The content of one of its text files; empty if there is none.

        Raises:
            BadInputError: The file is damaged, or no file of a run has such a name.
        """
        path = run_files.inside(self.path, name)
        return read_as(path, str) if path.exists() else ""

    def versions(self) -> dict[str, str]:
        """What versions.json says; empty if there is none.

        Raises:
            BadInputError: It is damaged.
        """
        path = self.path / run_files.VERSIONS
        found = read_as(path, json.loads) if path.exists() else {}
        return {name: str(value) for name, value in found.items()}

    def made(self, folder: str, ending: str) -> list[Path]:
        """Files of the run in a folder of it; of a run of an older version all that are there."""
        files = sorted((self.path / folder).glob(f"*{ending}"))
        own = run_files.files_of(self.path)
        return [file for file in files if file in own or not own]

    @property
    def can_go_on(self) -> bool:
        """Whether it holds trials with which a run can go on."""
        return self.trials is not None and self.trials.holds_trials

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
        line = date_line("resumed" if self.can_go_on else "begun")
        words = f"{shlex.join(command)}\n{line}" if command else ""
        self._described = formats.to_toml(config), words
        self._describe()

    def _describe(self, end: str = "") -> None:
        """Write what was described, with the models of the processors that are known by now."""
        if self._described is None:
            return
        trials, (config, words) = self.trials, self._described
        known = trials.identity["versions"] if trials and trials.identity else versions()
        models = (trials.processors if trials else []) or [processor()]
        text = formats.to_json({**known, "processor": " and ".join(models)})
        self.write(run_files.CONFIG, config)
        self.write(run_files.VERSIONS, text)
        if words:
            self.write(run_files.COMMAND, words + end)

    def keep_room(self) -> None:
        """Keep room for the result, so that a disk that fills meanwhile does not cost it."""
        with writing(self.path / ROOM):
            (self.path / ROOM).write_bytes(bytes(_KEPT_FREE))

    def append(self, row: Any) -> None:
        """Keep one finished trial, a dataclass or a mapping, at once.

        Raises:
            ConfigError: The row is neither, or holds what is no number, text, list or dictionary.
            OutputError: It cannot be written, or the run is finished.
        """
        if self._complete:
            raise OutputError(f"{self.path}: expected a run that goes on, found a finished one")
        if not self.finished:
            self.trials = self.trials or TrialFile(self.path / TRIALS)
            self.trials.add_row(row)

    def finish(self, result: Mapping[str, Any], rows: Iterable[Any] = ()) -> None:
        """Write the table of the rows, if there are any, and the result.

        What `describe` wrote is written again where somebody removed it meanwhile.

        Raises:
            ConfigError: The result is no dictionary, or a row is neither that nor a dataclass.
            OutputError: Something cannot be written.
        """
        checks.mapping("result", result)
        checks.instance("rows", rows, Iterable)
        table = formats.to_csv(formats.as_mapping(row) for row in rows)
        text = formats.to_json(result)
        self.kept = True
        with writing(self.path / ROOM):
            (self.path / ROOM).unlink(missing_ok=True)
        if table:
            self.write(TABLE, table)
        self._describe(date_line("ended"))
        self.write(RESULT, text)
        self._complete = not result.get("interrupted")

    def write(self, name: str, content: str | bytes | Iterator[str]) -> None:
        """Put one file into the directory, whole or not at all; a long text comes in pieces.

        Of a finished run, one that is there stays; but the report tells of those that were missing.

        Raises:
            ConfigError: The name leads out of the directory, or the content is neither text nor
                bytes nor pieces of text.
            OutputError: It cannot be written.
        """
        path = run_files.inside(self.path, name)
        if self.finished and path.exists() and (name != REPORT or self.untouched):
            return
        self.untouched = False
        self.claim_names([name])
        with writing_whole(path, overwrite=True) as file:
            file.writelines(formats.pieces(content))

    def claim_names(self, names: Iterable[str]) -> None:
        """Put names into the list of files of this run, and make folders for these files.

        Raises:
            OutputError: There is such a file, which this run has not made; or it cannot be written.
        """
        names = list(names)
        self.require_free(names)
        with writing(self.path / FILES):
            self.path.mkdir(exist_ok=True)
            run_files.add_to_list(self.path, names)
            for folder in {(self.path / name).parent for name in names}:
                folder.mkdir(exist_ok=True)

    def require_free(self, names: Iterable[str]) -> None:
        """Find out, before a run, whether names that it will write are those of somebody else.

        Raises:
            OutputError: There is such a file, which this run has not made.
        """
        listed = run_files.listed(self.path)
        own = () if listed is None else (FILES, *listed)
        for name in names:
            if name not in own and os.path.lexists(self.path / name):
                raise OutputError(
                    f"{self.path}: expected no file {name} but of this run, found one of somebody "
                    "else; move it, or choose another folder"
                )

    def write_figures(self, figures: Mapping[str, Any]) -> None:
        """Put figures of matplotlib into the directory, each as svg and png, by name.

        Raises:
            ConfigError: One is no figure.
            OutputError: One cannot be written.
        """
        from antennate.figures import render

        for name, figure in checks.mapping("figures", figures).items():
            for suffix, data in render(figure).items():
                self.write(f"{run_files.FIGURES}/{name}.{suffix}", data)

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        complete = kind is None and self._complete  # else what is missing can be written again
        failed = kind is not None and issubclass(kind, (*FAILURES, OSError))
        stays = self.kept or self.can_go_on or (failed and bool(self.made(LOGS, ".mcap")))
        self._leave(stays, spent=complete and not self.keeps_trials)

    def _leave(self, stays: bool, spent: bool = False) -> None:
        """Let others take the folder, as it is or without this run."""
        if self.trials is not None:
            self.trials.close(remove=spent or not stays)
        with contextlib.suppress(OSError):
            if self._lock is not None and stays:
                run_files.trim_list(self.path, self._lock)
            elif self._lock is not None:
                run_files.remove_run(self.path, lambda file: not self.old and not _is_before(file))
            if not stays and self.old is not None:
                self.old.rename(self.path)
            for folder in () if stays else self._created:
                folder.rmdir()
        if self._lock is not None:
            os.close(self._lock)
        self._lock = None


def _is_before(file: Path) -> bool:
    """Whether a file is of those that stand there before anything is measured, or a log."""
    before = (run_files.CONFIG, run_files.VERSIONS, run_files.COMMAND, TRIALS, ROOM)
    return file.name in before or file.parent.name == LOGS
