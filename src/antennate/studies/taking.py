"""Which folder a run may take; with `--overwrite`, NAME is renamed to NAME.old first.

Where there is a NAME.old it becomes NAME.old2, and so on: nothing is removed. The rename is one
step, so a process that is killed at any moment leaves the old run whole, under one of the two
names. A new run that ends with nothing to keep gives the name back.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from pathlib import Path

from antennate import checks
from antennate.errors import ConfigError, OutputError
from antennate.studies.run_files import (
    FILES,
    FOLDERS,
    JOBS,
    RESULT,
    files_of,
    listed,
    others_of,
)
from antennate.studies.trial_file import TRIALS, locked

_BEFORE = ("trials.store.jsonl", "trials.partial.jsonl")
"""Files of the trials of versions before, which are not gone on with."""


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
    held, others = files_of(place), others_of(place)
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


def give_back(place: Path, created: Sequence[Path], old: Path | None) -> None:
    """Remove the empty folders of a run that left nothing; the run before has its name again.

    Args:
        place: The folder.
        created: Folders that were made for it, the innermost first.
        old: The name of the run before, if there was one.

    Raises:
        OSError: A folder is not empty, or cannot be written.
    """
    if old is not None:
        old.rename(place)
    for folder in created:
        folder.rmdir()
