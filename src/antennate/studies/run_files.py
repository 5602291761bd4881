"""The names of the files of a run, and which of them a folder holds.

`files.txt` lists the files that a run writes, each before it is made. Without that list a folder
holds no run of this program, and is never overwritten.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeVar

from antennate import checks
from antennate.errors import BadInputError, ConfigError, OutputError
from antennate.files import decoded, open_regular, read_limited, remove_abandoned, write_whole
from antennate.studies.trial_file import TRIALS
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
    """Leave in the list of a run that ends the files that are there.

    Args:
        place: The folder.
        handle: The list, open for writing; the lock on it stays.

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


def others_of(place: Path) -> list[Path]:
    """Files with names that a run writes, which are none of the run that a folder holds."""
    own = files_of(place)
    paths = [place / name for name in _NAMES]
    return [path for path in paths if os.path.lexists(path) and path not in own]


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
