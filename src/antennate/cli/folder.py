"""The run directory: everything about one run in one place, and nothing half written.

Files are written whole. While a run goes on, finished trials are appended to
`trials.partial.jsonl`. A folder that holds any file of a run belongs to another one and is left
alone unless told otherwise; then those files go first, so that nothing old stands beside the new.
Only a calibration stays until the next one replaces it, so that a robot is never without.
"""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import json
import math
import os
import platform
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import IO, Any

from antennate import __version__
from antennate.cli import COMMANDS
from antennate.cli.toml import to_toml
from antennate.errors import OutputError
from antennate.params import Params
from antennate.params.log import MOST_PARTS
from antennate.telemetry.parts import part

RESULT, TABLE, PARTIAL = "result.json", "trials.csv", "trials.partial.jsonl"
CONFIG, VERSIONS, COMMAND = "config.toml", "versions.json", "command.txt"
_MORE = ("trajectories", "summary", "passages", "touch_roc", "touch_trace")
DRAWINGS = tuple(
    f"figures/{name}.{suffix}" for name in (*_MORE, *COMMANDS) for suffix in ("svg", "png")
)
CALIBRATION, LOG = "calibration.json", "drive.log"
LOGS = tuple(part(Path(LOG), number).name for number in range(1, MOST_PARTS + 1))
FILES = (CALIBRATION, "conditioning.toml", "recording.csv", "ticks.csv", *LOGS)
_NAMES = (RESULT, PARTIAL, TABLE, CONFIG, VERSIONS, COMMAND, *FILES, *DRAWINGS)
"""Every file that a run may write."""
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")


class RunFolder:
    """The folder of one run; as a context it removes itself if it ends without anything to keep.

    Attributes:
        path: Where it is.
    """

    def __init__(self, path: Path, created: list[Path], partial: IO[str]) -> None:
        self.path = path
        self._created = created
        self._partial = partial
        self._kept = False

    @classmethod
    def open(cls, command: str, out: Path | None, overwrite: bool) -> RunFolder:
        """Claim a folder for a run of `command`: `out`, or the next free `runs/COMMAND-N`.

        Raises:
            OutputError: It cannot be made or written to, or it holds another run.
        """
        path = _free(command) if out is None else out
        with _writing(path):
            missing = [p for p in (path, *path.parents) if not p.exists()]
            path.mkdir(parents=True, exist_ok=out is not None)
            held = [name for name in _NAMES if os.path.lexists(path / name)]
            if held and not overwrite:
                raise OutputError(
                    f"--out: expected a folder without a run, found {path / held[0]}; "
                    "choose another or give --overwrite"
                )
            for name in held:
                if (command, name) != ("calibrate", CALIBRATION):
                    (path / name).unlink()
            return cls(path, missing, (path / PARTIAL).open("x", encoding="utf-8"))

    def describe(self, command: str, argv: Sequence[str], config: Params) -> None:
        """Write what is known before the run: configuration, versions and command."""
        self.write(CONFIG, to_toml(config))
        self.write(VERSIONS, to_json(_versions()))
        self.write(COMMAND, shlex.join(["antennate", command, *argv]) + "\n")

    def without_trials(self) -> None:
        """Say that this run has none, so that no empty file of them is left if it is killed."""
        self._drop_partial()

    def append(self, row: Any) -> None:
        """Keep one finished trial, a dataclass, at once."""
        with _writing(self.path / PARTIAL):
            self._partial.write(json.dumps(strict(asdict(row))) + "\n")
            self._partial.flush()
        self._kept = True

    def finish(self, result: Mapping[str, Any], rows: Sequence[Any]) -> None:
        """Write the result and, if there are rows, their table; then drop the partial file."""
        if rows:
            self.write(TABLE, to_csv(asdict(row) for row in rows))
        self.write(RESULT, to_json(result))
        self._kept = True
        self._drop_partial()

    def write(self, name: str, content: str | bytes) -> None:
        """Put one file into the folder, whole or not at all."""
        path = self.path / name
        data = content.encode("utf-8") if isinstance(content, str) else content
        fresh = path.with_name(f".{path.name}.{os.getpid()}")
        with _writing(path):
            path.parent.mkdir(exist_ok=True)
            try:
                fresh.unlink(missing_ok=True)  # of a program with this number that was killed
                with fresh.open("xb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(file.fileno())
                fresh.replace(path)
            finally:
                fresh.unlink(missing_ok=True)

    def _drop_partial(self) -> None:
        self._partial.close()
        with _writing(self.path / PARTIAL):
            (self.path / PARTIAL).unlink(missing_ok=True)

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, *_: object) -> None:
        if self._kept:
            self._partial.close()
            return
        with contextlib.suppress(OSError, OutputError):
            self._drop_partial()
            for name in (CONFIG, VERSIONS, COMMAND) if self._created else ():
                (self.path / name).unlink(missing_ok=True)
            for path in self._created:
                path.rmdir()


def to_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    """A table with a header; text that a spreadsheet would take for a formula gets a quote."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    for number, row in enumerate(rows):
        if not number:
            writer.writerow(row)
        writer.writerow([_cell(value) for value in row.values()])
    return file.getvalue()


def _cell(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    text = _CONTROL.sub(" ", value)
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) else text


def strict(value: Any) -> Any:
    """The value with every NaN and infinity as None, fit for strict JSON."""
    if isinstance(value, Mapping):
        return {key: strict(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [strict(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_json(value: Any) -> str:
    """Strict JSON, indented, as result.json holds it."""
    return json.dumps(strict(value), indent=2, allow_nan=False) + "\n"


def _versions() -> dict[str, str]:
    """What the numbers may depend on."""
    return {
        "antennate": __version__,
        "python": platform.python_version(),
        "numpy": metadata.version("numpy"),
        "scipy": metadata.version("scipy"),
        "mujoco": metadata.version("mujoco-core"),
        "platform": f"{platform.system()} {platform.machine()}",
    }


def _free(command: str) -> Path:
    runs = Path("runs")
    return next(path for n in itertools.count(1) if not (path := runs / f"{command}-{n}").exists())


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"--out: expected to write {path}, found: {error.strerror or error}"
        ) from None
