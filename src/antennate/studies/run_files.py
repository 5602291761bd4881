"""Which files of a run a folder holds, and whether another run may take it.

`files.txt` lists the files that a run writes, each before it is made. Without that list a folder
holds no run of this program, and is never overwritten. With `--overwrite`, NAME is renamed to
NAME.old, and where there is one to NAME.old2, and so on: nothing is removed. The rename is one
step, so a process that is killed at any moment leaves the old run whole, under one of the two
names.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeVar

from antennate import checks
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import decoded, open_regular, read_limited, remove_abandoned, write_whole
from antennate.studies.trial_file import TRIALS, locked
from antennate.telemetry.header import MOST_PARTS, part

T = TypeVar("T")

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
_NAMES = (
    *(FILES, RESULT, TRIALS, SHARD, TABLE, CONFIG, VERSIONS, COMMAND, ROOM, BY_HAND, CALIBRATION),
    *(*_MADE, REPORT, *LOG_PARTS),
)
"""Every file that a run may write beside its figures."""


_BEFORE = ("trials.store.jsonl", "trials.partial.jsonl")
"""Files of the trials of versions before, which are not gone on with."""


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
    """Leave in the list of a run, which is open to write, the files that are there.

    Raises:
        OSError: It cannot be written.
    """
    before = listed(place) or []
    names = [name for name in before if os.path.lexists(place / name)]
    if names != before:
        text = "".join(f"{line}\n" for line in (_TITLE, *names)).encode()
        os.pwrite(handle, text, 0)
        os.ftruncate(handle, len(text))


def files_of(place: Path) -> list[Path]:
    """Files of its run that a folder holds, by their list, which comes last."""
    names = listed(place)
    if names is None:
        return []
    return [*(place / name for name in names if _is_file_within(place, name)), place / FILES]


def _is_file_within(place: Path, name: str) -> bool:
    """Whether there is such a file in the folder or one within it, none behind a link."""
    path = Path(name)
    folders = [place / each for each in path.parents if each != Path()]
    sound = not path.is_absolute() and ".." not in path.parts and all(map(is_folder, folders))
    return sound and os.path.lexists(place / path) and not is_folder(place / path)


def sweep(place: Path) -> None:
    """Remove what killed processes left in a folder that wrote files of its run."""
    names = {FILES, *(listed(place) or ())}
    remove_abandoned(place, names.__contains__)
    for folder in FOLDERS:
        if is_folder(place / folder):
            remove_abandoned(place / folder, lambda name, f=folder: f"{f}/{name}" in names)


def remove_run(place: Path, goes: Callable[[Path], bool] = lambda file: True) -> None:
    """Remove files of its run from a folder; if none is left, the list and folders that get empty.

    Args:
        place: The folder.
        goes: Which of the files.

    Raises:
        OSError: A file cannot be removed.
    """
    *files, last = files_of(place) or [place / FILES]
    for file in filter(goes, files):
        file.unlink()
    for folder in {file.parent for file in files} | {place / name for name in FOLDERS}:
        if folder != place and is_folder(folder):
            with contextlib.suppress(OSError):  # it holds files of somebody else
                folder.rmdir()
    if files_of(place) == [last]:
        last.unlink()


def place_of(command: str, path: str | Path | None) -> Path:
    """The folder for a run of a command: the one of a path, or the next that nobody has named.

    Raises:
        BadInputError: The path is none, or leads to no folder, or no folder can have such a name.
    """
    if path == "":
        raise OutputError("expected the name of a folder, found an empty one")
    if "/" in checks.text("command", command):
        raise ConfigError(f"command: expected a name without a slash, found {command}")
    if path is None:
        places = (Path("runs") / f"{command}-{number}" for number in itertools.count(1))
        return next(place for place in places if not place.exists())
    place = checks.path("path", path)
    if os.path.lexists(place) and not place.is_dir():
        what = "a file" if place.exists() else "a link to nothing"
        raise OutputError(f"{place}: expected a folder, found {what}; give another --out")
    return place


def goes_on(place: Path, resume: bool | None) -> bool:
    """Whether a folder holds a run that is to go on; False if it holds nothing of a run.

    Args:
        place: The folder.
        resume: Whether a run that it holds is to go on; None if the command goes on with none.

    Raises:
        OutputError: It holds another run, or files of somebody with names that a run writes.
    """
    for folder in FOLDERS:
        if (place / folder).is_symlink():
            raise OutputError(f"expected {place / folder} within its run, found a link")
    held = files_of(place)
    named = (place / name for name in _NAMES)
    others = [file for file in named if os.path.lexists(file) and file not in held]
    if not others and held in ([], [place / FILES]):
        return False  # what a process leaves that is killed as it begins
    begun = place / TRIALS in held
    if resume and begun and not others:
        return True
    if resume and (old := [name for name in _BEFORE if place / name in held]) and not begun:
        raise OutputError(
            f"{place}: expected a run of this version to go on with, found {old[0]} of one before; "
            "go on with that version, choose another folder, or give --overwrite"
        )
    if resume and place / RESULT in held:
        raise OutputError(
            f"{place}: expected an unfinished run, found a finished one, which takes no more "
            "trials; choose another folder, or give --overwrite to run all of them anew"
        )
    first = place / RESULT if place / RESULT in held else [*others, *held][0]
    raise OutputError(
        f"expected {'an unfinished run' if resume else 'a folder without a run'}, found {first}; "
        "choose another"
        + (" or give --overwrite" if place / FILES in held else "")
        + (" or --resume" if begun and resume is False else "")
    )


def before_this_version(place: Path) -> str:
    """File of trials of a version before, of a run without a result; empty if there is none."""
    names = (name for name in _BEFORE if (place / name).exists())
    return "" if (place / RESULT).exists() else next(names, "")


def set_aside(place: Path) -> Path:
    """Rename a folder that holds a run; its new name.

    Raises:
        OutputError: It holds no run of ours, cannot have another name, or a process works on it.
        OSError: It cannot be renamed.
    """
    if listed(place) is None and {path.name for path in place.iterdir()} != {JOBS}:
        first = min((path.name for path in place.iterdir()), default="none")
        raise OutputError(
            f"{place}: expected a run of this program to overwrite, whose files {FILES} lists, "
            f"found {first}, which is of none; choose another folder"
        )
    if place.is_symlink():
        raise OutputError(f"{place}: expected a folder to rename, found a link; give its own name")
    if place.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise OutputError(
            f"{place}: expected a folder to rename, found the working directory or one above it; "
            "go to another directory, or choose another folder"
        )
    numbers = itertools.count(2)
    old = place.parent / f"{place.name}.old"
    while os.path.lexists(old):
        old = place.parent / f"{place.name}.old{next(numbers)}"
    lock = locked(place / FILES) if (place / FILES).exists() else None
    place.rename(old)
    if lock is not None:
        os.close(lock)
    return old


def is_finished(place: Path) -> bool:
    """Whether a folder holds the whole result of a run that was not interrupted."""
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
    """The file or folder of a name in a run's folder.

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
