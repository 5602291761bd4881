"""The names of the files of a run, and which of them a folder holds.

`files.txt` lists the files that a run writes, each before it is made. Without that list a folder
holds no run of this program, and is never overwritten. Below its command stands when it ran.
"""

from __future__ import annotations

import contextlib
import datetime
import itertools
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from antennate import checks
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import decoded, open_regular, read_limited, remove_abandoned, write_whole
from antennate.studies.store import STORE
from antennate.telemetry.header import MOST_PARTS, part

T = TypeVar("T")

RESULT, TABLE, PARTIAL = "result.json", "trials.csv", "trials.partial.jsonl"
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


def listed(place: Path) -> list[str] | None:
    """Names of files that the run of a directory wrote; None if it holds no run of this program."""
    if (place / FILES).is_symlink():
        return None
    try:
        with open_regular(place / FILES) as file:
            title, *names = file.read(LARGEST).decode().splitlines() or [""]
    except (OSError, UnicodeDecodeError):
        return None
    return list(dict.fromkeys(names)) if title.startswith(_TITLE) else None


def add_to_list(place: Path, names: Iterable[str]) -> None:
    """Add names to the list of the files of a run, which is begun if there is none; none twice.

    Raises:
        OSError: It cannot be written.
    """
    known = listed(place) or ()
    lines = "".join(f"{name}\n" for name in names if name not in known).encode()
    if not os.path.lexists(place / FILES):
        write_whole(place / FILES, f"{_TITLE}\n".encode() + lines)
        return
    with (place / FILES).open("ab", buffering=0) as file:
        file.write(lines)


def trim_list(place: Path, handle: int) -> None:
    """Leave in the list of a run that ends the files that are there; the lock on it stays.

    Args:
        place: The directory.
        handle: The list, open for writing.

    Raises:
        OSError: It cannot be written.
    """
    before = listed(place)
    names = [name for name in before or () if os.path.lexists(place / name)]
    if before is None or names == before:
        return
    text = "".join(f"{line}\n" for line in (_TITLE, *names)).encode()
    os.pwrite(handle, text, 0)
    os.ftruncate(handle, len(text))


def files_of(place: Path) -> list[Path]:
    """Files of its run that a directory holds, by their list, which comes last."""
    names = listed(place)
    if names is None:
        return []
    return [*(place / name for name in names if _is_file_within(place, name)), place / FILES]


def _is_file_within(place: Path, name: str) -> bool:
    """Whether there is such a file in the directory or a folder of it, none behind a link."""
    path = Path(name)
    folders = [place / each for each in path.parents if each != Path()]
    sound = not path.is_absolute() and ".." not in path.parts and all(map(is_folder, folders))
    return sound and os.path.lexists(place / path) and not is_folder(place / path)


def others_of(place: Path) -> list[Path]:
    """Files with names that a run writes, which are none of the run that a directory holds."""
    own = files_of(place)
    paths = [place / name for name in (FILES, *_NAMES)]
    return [path for path in paths if os.path.lexists(path) and path not in own]


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
    first = place / RESULT if place / RESULT in held else held[0]
    return OutputError(
        f"expected {'an unfinished run' if resume else 'a folder without a run'}, found {first}; "
        "choose another"
        + (" or give --overwrite" if place / FILES in held else "")
        + (" or --resume" if place / STORE in held and resume is False else "")
    )


def outdated(held: Sequence[Path], finished: bool) -> list[Path]:
    """Which of the files that a directory holds go before a run goes on.

    Args:
        held: Those files.
        finished: Whether the run is finished, so that its files stay.
    """
    if finished:
        return [file for file in held if file.name in (PARTIAL, ROOM)]
    return [file for file in held if file.parent.name != LOGS and file.name not in (STORE, FILES)]


def sweep(place: Path) -> None:
    """Remove what killed processes left in a directory that wrote files of its run."""
    names = {FILES, *(listed(place) or ())}
    remove_abandoned(place, names.__contains__)
    for folder in FOLDERS:
        if is_folder(place / folder):
            remove_abandoned(place / folder, lambda name, f=folder: f"{f}/{name}" in names)


def remove_run(place: Path) -> None:
    """Remove the files of its run from a directory, the list last, and folders that get empty.

    Raises:
        OSError: A file cannot be removed.
    """
    files = files_of(place)
    folders = {file.parent for file in files} | {place / name for name in FOLDERS}
    for file in files[:-1]:
        file.unlink()
    for folder in sorted(folders - {place}, reverse=True):
        if is_folder(folder):
            with contextlib.suppress(OSError):  # it holds files of somebody else
                folder.rmdir()
    for file in files[-1:]:
        file.unlink()


def remove_described(place: Path) -> None:
    """Remove what is known before a run, and its logs, from a directory without a result.

    Raises:
        OSError: Something cannot be removed.
    """
    for file in files_of(place):
        if file.name in (CONFIG, VERSIONS, COMMAND) or file.parent == place / LOGS:
            file.unlink()
    if files_of(place) == [place / FILES]:
        (place / FILES).unlink()
    if is_folder(place / LOGS):
        with contextlib.suppress(OSError):  # it holds files of somebody else
            (place / LOGS).rmdir()


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
    path = Path(checks.text("name", name))
    if path.is_absolute() or ".." in path.parts or not name.isprintable():
        raise ConfigError(f"name: expected one within the run, found {name}")
    return place / path


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


def place_of(command: str, path: str | Path | None) -> Path:
    """The folder for a run of a command: the one of a path, or the next that nobody has named.

    Raises:
        BadInputError: The path is none, or no folder can have such a name.
    """
    if path == "":
        raise OutputError("expected the name of a folder, found an empty one")
    if "/" in checks.text("command", command):
        raise ConfigError(f"command: expected a name without a slash, found {command}")
    if path is not None:
        return checks.path("path", path)
    places = (Path("runs") / f"{command}-{number}" for number in itertools.count(1))
    return next(place for place in places if not place.exists())


_DATE = "%Y-%m-%d %H:%M:%S UTC"
_DATES = re.compile(r"^# (begun|resumed|ended) (.*)$", re.MULTILINE)


def begun_line(resumed: bool = False) -> str:
    """The line of a run that begins now, or goes on."""
    return f"# {'resumed' if resumed else 'begun'} {_now()}\n"


def with_end(text: str) -> str:
    """What was written, with the line of a run that ends now."""
    kept = (line for line in text.splitlines(True) if not line.startswith("# ended "))
    return f"{''.join(kept)}# ended {_now()}\n"


def when_run(text: str) -> str:
    """When, and for how long; empty if it does not tell."""
    try:
        dates = {
            what: datetime.datetime.strptime(when, _DATE).replace(tzinfo=datetime.UTC)
            for what, when in _DATES.findall(text)
        }
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


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).strftime(_DATE)
