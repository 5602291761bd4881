"""How a run takes its directory; with `--overwrite`, NAME is renamed to NAME.old first.

Where there is a NAME.old it becomes NAME.old2, and so on: nothing is removed. The rename is one
step, so a process that is killed at any moment leaves the old run whole, under one of the two
names. A new run that ends with nothing to keep gives the name back.
"""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

from antennate.errors import OutputError
from antennate.studies.run_files import (
    FILES,
    FOLDERS,
    JOBS,
    PARTIAL,
    ROOM,
    add_to_list,
    files_of,
    holds_run,
    is_finished,
    listed,
    others_of,
    outdated,
    place_of,
    remove_run,
    sweep,
    writing,
)
from antennate.studies.store import STORE, Store, Tasks, nobody_else, open_store


class Claim(NamedTuple):
    """A directory that a run has taken; see `RunDirectory`.

    Attributes:
        path: Where it is.
        created: Folders that were made for it, the innermost first.
        partial: File of finished trials, None for a run that is finished.
        store: Its finished trials if it can be resumed, None otherwise.
        finished: Whether the run is finished.
        old: The new name of the folder that it replaces, if there is one.
        lock: Handle of the locked list of files, None if the directory is only read.
    """

    path: Path
    created: Sequence[Path] = ()
    partial: IO[str] | None = None
    store: Store | None = None
    finished: bool = False
    old: Path | None = None
    lock: int | None = None


def claim(
    command: str,
    path: str | Path | None,
    overwrite: bool,
    identity: Mapping[str, Any] | None,
    resume: bool | None,
    retry: bool,
    tasks: Tasks | None = None,
) -> Claim:
    """Take a directory; see `RunDirectory.create`."""
    place = place_of(command, path)
    with writing(place):
        _require_folder(place)
        missing = [p for p in (place, *place.parents) if not p.exists()]
        place.mkdir(parents=True, exist_ok=path is not None)
        sweep(place)
        old = _set_aside(place) if overwrite and any(place.iterdir()) else None
        try:
            place.mkdir(exist_ok=True)
            return _begin(place, missing, old, identity, resume, retry, tasks)
        except BaseException:
            with contextlib.suppress(OSError):
                give_back(place, missing, old)
            raise


def _begin(
    place: Path,
    missing: Sequence[Path],
    old: Path | None,
    identity: Mapping[str, Any] | None,
    resume: bool | None,
    retry: bool,
    tasks: Tasks | None,
) -> Claim:
    """Begin a run in a folder that is there, or go on with the one that it holds."""
    for folder in FOLDERS:
        if (place / folder).is_symlink():
            raise OutputError(f"expected {place / folder} within its run, found a link")
    held, others = files_of(place), others_of(place)
    goes_on = bool(resume) and not others and (place / STORE) in held
    if (held or others) and not goes_on:
        raise holds_run(place, [*others, *held], resume)
    if not goes_on:
        add_to_list(place, (PARTIAL, STORE, ROOM))
    lock = _locked(place / FILES)
    try:
        store = open_store(place, identity, tasks if goes_on else None)
        sound = store is not None and not store.damaged and store.holds_all(tasks)
        finished = goes_on and not retry and sound and is_finished(place)
        if goes_on and not finished:
            add_to_list(place, (PARTIAL, STORE, ROOM))
        for file in outdated(held, finished) if goes_on else ():
            file.unlink()
        partial = None if finished else (place / PARTIAL).open("x", encoding="utf-8")
    except BaseException:
        if not goes_on:
            remove_run(place)
        os.close(lock)
        raise
    return Claim(place, missing, partial, store, finished, old, lock)


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


def _require_folder(place: Path) -> None:
    """Refuse a name that is there and leads to no folder."""
    if os.path.lexists(place) and not place.is_dir():
        what = "a file" if place.exists() else "a link to nothing"
        raise OutputError(f"{place}: expected a folder, found {what}; give another --out")


def _set_aside(place: Path) -> Path:
    """Rename a folder that holds a run; its new name."""
    _require_renamable(place)
    numbers = itertools.count(2)
    old = place.parent / f"{place.name}.old"
    while os.path.lexists(old):
        old = place.parent / f"{place.name}.old{next(numbers)}"
    with contextlib.ExitStack() as locks:
        for file in (place / FILES, place / STORE):
            if file.exists():
                locks.callback(os.close, _locked(file))
        place.rename(old)
    return old


def _require_renamable(place: Path) -> None:
    """Refuse a folder without a run of ours, or one that cannot have another name."""
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


def _locked(file: Path) -> int:
    """The handle of a locked file; the system frees the lock when this process ends."""
    lock = os.open(file, os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise nobody_else(file.parent) from None
    except OSError:
        pass  # a file system without locks
    return lock
