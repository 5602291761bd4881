"""The names of the files of a run, and which of them a folder holds."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from antennate import checks
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import decoded, read_limited, remove_abandoned
from antennate.studies.identity import texts
from antennate.studies.store import STORE
from antennate.telemetry.parts import MOST_PARTS, part

T = TypeVar("T")

RESULT, TABLE, PARTIAL = "result.json", "trials.csv", "trials.partial.jsonl"
SHARD = "shard.json"
"""File of a shard whose trials are all finished."""
CONFIG, VERSIONS, COMMAND = "config.toml", "versions.json", "command.txt"
FIGURES, FILMS, LOGS = "figures", "films", "logs"
"""Folders of figures (svg, png), films (mp4) and logs of trials (mcap), which belong to the run."""
ENDINGS = {FIGURES: (".svg", ".png"), FILMS: (".mp4",), LOGS: (".mcap",)}
"""What the files of each of these folders end with."""
BY_HAND = "by-hand.txt"
"""What a person changed while the run went on: it does not follow from its configuration then."""
CALIBRATION, LOG, REPORT = "calibration.json", "drive.mcap", "report.html"
LARGEST = 10**9
"""No file of a run is longer [bytes]."""
LOG_PARTS = tuple(part(Path(LOG), number).name for number in range(1, MOST_PARTS + 1))
"""Files of the log of a drive."""
_FILES = (
    BY_HAND,
    CALIBRATION,
    "conditioning.toml",
    "recording.csv",
    "ticks.csv",
    "bom.csv",
    "points.csv",
    "frames.csv",
    REPORT,
    *LOG_PARTS,
)
ROOM = ".room"
"""File that keeps room for the result."""
_NAMES = (RESULT, PARTIAL, STORE, SHARD, TABLE, CONFIG, VERSIONS, COMMAND, ROOM, *_FILES)
"""Every file that a run may write beside its figures."""


def files_of(place: Path) -> list[Path]:
    """Files of a run that a directory holds."""
    inner = [
        path
        for folder, endings in ENDINGS.items()
        for path in (sorted((place / folder).iterdir()) if is_folder(place / folder) else ())
        if path.suffix in endings
    ]
    return [place / name for name in _NAMES if os.path.lexists(place / name)] + inner


def holds_run(place: Path, held: Sequence[Path], resume: bool | None) -> OutputError:
    """The error of a directory that holds another run, whose files are given.

    Args:
        place: The directory.
        held: Files of a run that it holds.
        resume: Whether that run was to go on; None if the command goes on with none.
    """
    if resume and place / RESULT in held:
        return OutputError(
            f"{place}: expected an unfinished run, found a finished one, which takes no more "
            "trials; choose another folder, or give --overwrite to run all of them anew"
        )
    return OutputError(
        f"expected {'an unfinished run' if resume else 'a folder without a run'}, found {held[0]}; "
        "choose another or give --overwrite"
        + (" or --resume" if place / STORE in held and resume is False else "")
    )


def require_apart(
    out: str | Path | None, config: Mapping[str, Any], reads: Iterable[Path] = ()
) -> None:
    """Check that what a run reads does not go with the run that its folder holds.

    Args:
        out: The folder.
        config: The configuration, with names of files.
        reads: More files.

    Raises:
        OutputError: It would.
    """
    held = files_of(Path(out)) if out is not None and Path(out).is_dir() else []
    for path in (*reads, *map(Path, texts(config))) if held else ():
        if any(is_same(path, each) for each in held):
            raise OutputError(f"expected another folder than that of {path}, found {out}")


def is_same(path: Path, other: Path) -> bool:
    """Whether both names lead to one file."""
    try:
        return path.samefile(other)
    except (OSError, ValueError):  # no file, or not even a name of one
        return False


def outdated(held: Sequence[Path], stays: str, finished: bool) -> list[Path]:
    """Which of the files that a directory holds go before a run goes on.

    Args:
        held: Those files.
        stays: Name of a file that stays until it is replaced.
        finished: Whether the run is finished, so that its files stay.
    """
    if finished:
        return [file for file in held if file.name in (PARTIAL, ROOM)]
    return [file for file in held if file.parent.name != LOGS and file.name not in (STORE, stays)]


def sweep(place: Path) -> None:
    """Remove what killed processes left in a directory that wrote files of its run."""
    remove_abandoned(place, lambda name: name in _NAMES)
    for folder, endings in ENDINGS.items():
        if is_folder(place / folder):
            remove_abandoned(place / folder, lambda name, e=endings: name.endswith(e))


def is_finished(place: Path) -> bool:
    """Whether a directory holds the whole result of a run that was not interrupted."""
    try:
        return not json.loads((place / RESULT).read_bytes()).get("interrupted")
    except (OSError, ValueError, AttributeError):
        return False


def read_as(path: Path, decode: Callable[[str], T]) -> T:
    """What a text file of a run holds.

    Args:
        path: The file.
        decode: Reads its text; a ValueError says that it is damaged.

    Raises:
        BadInputError: It cannot be read, or is damaged.
    """
    text = decoded(path, read_limited(path, LARGEST))
    try:
        return decode(text)
    except ValueError as error:
        raise BadInputError(
            f"{path}: expected a whole file of this kind, found: {str(error).splitlines()[0]}"
        ) from None


def inside(place: Path, name: str) -> Path:
    """The file or folder of a name in a run's directory.

    Raises:
        ConfigError: The name leads out of it.
    """
    found = Path(checks.text("name", name))
    if found.is_absolute() or ".." in found.parts:
        raise ConfigError(f"name: expected one within the run, found {name}")
    return place / found


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Tell of what the system refuses while a file or folder is written.

    Raises:
        OutputError: It refuses something.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(f"expected to write {path}, found: {error.strerror or error}") from None


def is_folder(folder: Path) -> bool:
    """Whether it is a folder itself, and no link to one."""
    return folder.is_dir() and not folder.is_symlink()


def remove_described(place: Path) -> None:
    """Remove what is known before a run, and its logs, from a directory without a result.

    Raises:
        OSError: Something cannot be removed.
    """
    for file in files_of(place):
        if file.name in (CONFIG, VERSIONS, COMMAND) or file.parent == place / LOGS:
            file.unlink()
    if is_folder(place / LOGS):
        (place / LOGS).rmdir()


def place_of(command: str, path: str | Path | None) -> Path:
    """The folder for a run of a command: the one of a path, or the next that nobody has named.

    Raises:
        BadInputError: The path is none, or no folder can have such a name.
    """
    if path == "":
        raise OutputError("expected the name of a folder, found an empty one")
    if "/" in checks.text("command", command):
        raise ConfigError(f"command: expected a name without a slash, found {command}")
    return _free(command) if path is None else checks.path("path", path)


def _free(command: str) -> Path:
    """The next folder for a run of a command that nobody has named."""
    runs = Path("runs")
    return next(path for n in itertools.count(1) if not (path := runs / f"{command}-{n}").exists())
