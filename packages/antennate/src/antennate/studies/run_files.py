"""Files of a run, by name, the list of those that a run has written, and the dates of the run.

`files.txt` lists the files that a run writes, each before it is made. Without that list a folder
holds no run of this program, and what it does not list is somebody else's: it is neither removed
nor written over.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from antennate import checks
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import decoded, open_regular, read_limited, remove_abandoned, write_whole
from antennate.studies.trial_file import TRIALS, locked
from antennate.telemetry.header import MOST_PARTS, RECOVERED, part

T = TypeVar("T")
_DATE = "%Y-%m-%d %H:%M:%S UTC"
_DATES = re.compile(r"^# (begun|resumed|ended) (.*)$", re.MULTILINE)
"""When a run was begun, resumed and ended, as it stands below its command."""

RESULT, TABLE = "result.json", "trials.csv"
SHARD = "shard.json"
"""File of a shard whose trials are all finished."""
CONFIG, VERSIONS, COMMAND = "config.toml", "versions.json", "command.txt"
FILES = "files.txt"
"""The list of the files of the run."""
_TITLE = "# Files that this run wrote."
FOLDERS = FIGURES, FILMS, LOGS = "figures", "films", "logs"
"""Folders of figures (svg, png), films (mp4) and logs of trials (mcap)."""
JOBS = "slurm"
"""Folder of what submitit keeps of its jobs."""
BY_HAND = "by-hand.txt"
"""What a person changed while the run went on: it does not follow from its configuration then."""
CALIBRATION, LOG, REPORT = "calibration.json", "drive.mcap", "report.html"
LARGEST = 10**9
"""No file of a run is longer [bytes]."""
LOG_PARTS = tuple(part(Path(LOG), number).name for number in range(1, MOST_PARTS + 1))
"""Files of the log of a drive."""
ROOM = ".room"
"""File that keeps room for the result."""
_MADE = ("conditioning.toml", "recording.csv", "ticks.csv", "bom.csv", "points.csv", "frames.csv")
NAMES = (
    *(FILES, RESULT, TRIALS, SHARD, TABLE, CONFIG, VERSIONS, COMMAND, ROOM, BY_HAND, CALIBRATION),
    *(*_MADE, REPORT, *LOG_PARTS),
)
"""Every file that a run may write beside its figures."""
BEFORE = ("trials.store.jsonl", "trials.partial.jsonl")
"""Files of the trials of versions before, which are not gone on with."""


def log_of(path: Path, cure: str = "--log keeps those of a simulation") -> Path:
    """The log that is meant by its name, or by the folder of a run that has one.

    Args:
        path: A log, or a folder.
        cure: What makes a log, for the message.

    Raises:
        BadInputError: The folder has none, or several.
    """
    if not path.is_dir():
        return path
    files = sorted((path / LOGS).glob("*.mcap"))
    recovered = {file.with_stem(file.stem + RECOVERED) for file in files}
    logs = [file for file in files if file not in recovered]
    logs = logs or [file for file in [path / LOG] if file.exists()]
    if not logs:
        raise BadInputError(f"{path}: expected a run with a log, found none; {cure}")
    if len(logs) > 1:
        names = ", ".join(map(str, logs[:3]))
        raise BadInputError(
            f"{path}: expected a run with one log, found {len(logs)}; name one of {names}, …"
        )
    return logs[0]


def listed(place: Path) -> list[str] | None:
    """Names of files that the run of a folder wrote; None if it holds no run of this program."""
    if (place / FILES).is_symlink():
        return None
    try:
        with open_regular(place / FILES) as file:
            title, *names = file.read(LARGEST).decode().splitlines() or [""]
    except (OSError, UnicodeDecodeError):
        return None
    return list(dict.fromkeys(names)) if title.startswith(_TITLE) else None


def add_to_list(place: Path, names: Iterable[str]) -> None:
    """Add names to the list of the files of a run, which is begun if there is none; none twice."""
    known = listed(place) or ()
    lines = "".join(f"{name}\n" for name in names if name not in known).encode()
    if not os.path.lexists(place / FILES):
        write_whole(place / FILES, f"{_TITLE}\n".encode() + lines)
        return
    with (place / FILES).open("ab", buffering=0) as file:
        file.write(lines)


def trim_list(place: Path, handle: int) -> None:
    """Leave in the list of a run, which is open to write, the files that are there."""
    before = listed(place) or []
    names = [name for name in before if os.path.lexists(place / name)]
    if names != before:
        text = "".join(f"{line}\n" for line in (_TITLE, *names)).encode()
        os.ftruncate(handle, os.pwrite(handle, text, 0))


def files_of(place: Path) -> list[Path]:
    """Files of its run that a folder holds, by their list, which comes last; none behind a link."""
    names, home = listed(place), place.resolve()
    files = [place / name for name in names or () if os.path.lexists(place / name)]
    within = [file for file in files if file.parent.resolve().is_relative_to(home)]
    return [] if names is None else [*within, place / FILES]


def remove_run(place: Path, kept: Callable[[Path], bool] = lambda file: False) -> None:
    """Remove files of its run from a folder; if none is left, their list, and emptied folders.

    Args:
        place: The folder.
        kept: Which of the files stay.
    """
    *files, last = files_of(place) or [place / FILES]
    for file in files:
        if not kept(file):
            file.unlink()
    for folder in {file.parent for file in files} | {place / name for name in FOLDERS}:
        with contextlib.suppress(OSError):  # there is none, or it holds other files
            folder.rmdir()
    if files_of(place) == [last]:
        last.unlink()


def sweep(place: Path) -> None:
    """Remove what killed processes left in a folder that wrote files of its run."""
    names = {FILES, *(listed(place) or ())}
    for folder in ("", *FOLDERS):
        if not folder or not (place / folder).is_symlink():
            remove_abandoned(place / folder, lambda name, f=folder: str(Path(f, name)) in names)


def place_of(command: str, path: str | Path | None) -> Path:
    """The folder for a run of a command: the one of a path, or the next that nobody has named."""
    if "/" in checks.text("command", command):
        raise ConfigError(f"command: expected a name without a slash, found {command}")
    if path is not None:
        return checks.path("path", path)
    places = (Path("runs") / f"{command}-{number}" for number in itertools.count(1))
    return next(place for place in places if not place.exists())


def goes_on(place: Path, resume: bool | None) -> bool:
    """Whether a folder holds a run that is to go on; False if it holds nothing of a run.

    Args:
        place: The folder.
        resume: Whether a run that it holds is to go on; None if the command goes on with none.
    """
    if links := [place / name for name in FOLDERS if (place / name).is_symlink()]:
        raise OutputError(f"expected {links[0]} within its run, found a link")
    held = files_of(place)
    begun = place / TRIALS in held
    if held in ([], [place / FILES]):
        return False  # what a process leaves that is killed as it begins
    if resume and begun:
        return True
    first = min(held, key=lambda file: (file.name not in BEFORE, file.name != RESULT))
    raise OutputError(
        f"expected {'an unfinished run of this version' if resume else 'a folder without a run'}, "
        f"found {first}; choose another or give --overwrite"
        + (" or --resume" if begun and resume is False else "")
    )


def set_aside(place: Path) -> Path:
    """Rename a folder that holds a run; its new name."""
    if listed(place) is None and {path.name for path in place.iterdir()} != {JOBS}:
        first = min(path.name for path in place.iterdir())
        raise OutputError(
            f"{place}: expected a run of this program to overwrite, whose files {FILES} lists, "
            f"found {first}, which is of none; choose another folder"
        )
    names = (f"{place.name}.old{number}" for number in ("", *range(2, 10**6)))
    old = next(old for name in names if not os.path.lexists(old := place.parent / name))
    lock = locked(place / FILES) if (place / FILES).exists() else None
    try:
        return place.rename(old)
    finally:
        if lock is not None:
            os.close(lock)


def read_as(path: Path, decode: Callable[[str], T]) -> T:
    """What a text file of a run holds.

    Args:
        path: The file.
        decode: Reads its text; a ValueError says that it is damaged.
    """
    text = decoded(path, read_limited(path, LARGEST))
    try:
        return decode(text)
    except ValueError as error:
        raise BadInputError(
            f"{path}: expected a whole file of this kind, found: {str(error).splitlines()[0]}"
        ) from None


def inside(place: Path, name: str) -> Path:
    """The file or folder of a name in a run's folder."""
    path = Path(checks.text("name", name))
    if path.is_absolute() or ".." in path.parts:
        raise ConfigError(f"name: expected one within the run, found {name}")
    return place / path


def date_line(what: str) -> str:
    """The line of a run that is `begun`, `resumed` or `ended` now."""
    return f"# {what} {datetime.now(UTC).strftime(_DATE)}\n"


def when_run(text: str) -> str:
    """When, and for how long; empty if it does not tell."""
    try:
        dates = {what: datetime.strptime(when, _DATE) for what, when in _DATES.findall(text)}
    except ValueError:
        return ""
    for what, words, it in (("begun", "Run on", "it"), ("resumed", "Resumed on", "the rest")):
        if what in dates:
            took = dates["ended"] - dates[what] if "ended" in dates else None
            day = f"{words} {dates[what]:%Y-%m-%d at %H:%M} UTC"
            return f"{day}." if took is None else f"{day}; {it} took {span(took.total_seconds())}."
    return ""


def span(seconds: float) -> str:
    """A time [s] in words, in the unit that suits it."""
    minutes, hours = seconds / 60, seconds / 3600
    if seconds < 1:
        return "less than 1 s"
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{minutes:.0f} min" if minutes < 100 else f"{hours:.1f} h"
