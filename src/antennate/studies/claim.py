"""How a run takes its directory; with `--overwrite`, NAME is renamed to NAME.old first.

The rename is one step, so a process that is killed at any moment leaves the old run whole, under
one of the two names. A new run that ends with nothing to keep gives the name back.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

from antennate.errors import OutputError
from antennate.studies.run_files import (
    COMMAND,
    CONFIG,
    FILES,
    FOLDERS,
    JOBS,
    PARTIAL,
    ROOM,
    VERSIONS,
    add_to_list,
    files_of,
    holds_run,
    is_finished,
    is_folder,
    listed,
    old_of,
    others_of,
    outdated,
    place_of,
    remove_run,
    sweep,
    writing,
)
from antennate.studies.store import STORE, Store, Tasks, nobody_else, open_store, parsed


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
    add_to_list(place, (PARTIAL, STORE, ROOM))
    lock = _locked(place / FILES)
    try:
        store = open_store(place, identity, tasks if goes_on else None)
        sound = store is not None and not store.damaged and store.holds_all(tasks)
        finished = goes_on and not retry and sound and is_finished(place)
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
    old, spare = old_of(place), place.parent / f".{place.name}.old"
    with contextlib.ExitStack() as locks:
        for file in (place / FILES, place / STORE):
            if file.exists():
                locks.callback(os.close, _locked(file))
        if not (place / FILES).exists():
            raise nobody_else(place)
        for earlier in (old, spare):
            _require_run_alone(earlier)
            if (earlier / FILES).exists():
                locks.callback(os.close, _locked(earlier / FILES))
        if (old / FILES).exists() and _is_only_begun(place):
            remove_run(place)  # the run before it stays what can be had back
        else:
            _rename(place, old, spare)
    return old


def _require_renamable(place: Path) -> None:
    """Refuse a folder without a run of ours, or one that cannot have another name."""
    if listed(place) is None:
        first = min((path.name for path in place.iterdir()), default="none")
        raise OutputError(
            f"{place}: expected a run of this program to overwrite, whose files {FILES} lists, "
            f"found {first}, which is of none; choose another folder"
        )
    if place.is_symlink():
        raise OutputError(f"{place}: expected a folder to rename, found a link; give its own name")
    working = (Path.cwd(), *Path.cwd().parents)
    if place.name in ("", "..") or {place.resolve(), old_of(place).resolve()} & {*working}:
        raise OutputError(
            f"{place}: expected a folder to rename, found the working directory or one above it; "
            "go to another directory, or choose another folder"
        )
    if place.is_mount():
        raise OutputError(
            f"{place}: expected a folder to rename, found a file system of its own; choose a "
            "folder in it"
        )
    if not os.access(place.parent, os.W_OK):  # before anything is moved
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _rename(place: Path, old: Path, spare: Path) -> None:
    """Rename a folder; what has the new name is removed last, and has it again on an error."""
    _remove_old(spare)
    if os.path.lexists(old):
        old.rename(spare)
    try:
        place.rename(old)
    except OSError:
        if spare.exists():
            spare.rename(old)
        raise
    _remove_old(spare)


def _is_only_begun(place: Path) -> bool:
    """Whether a folder holds a run that was killed before anything was measured, and no more."""
    known = {*files_of(place)}
    return all(path in known and _is_description(path) for path in place.rglob("*"))


def _is_description(file: Path) -> bool:
    """Whether a file of a run says what is to be measured, and not what was."""
    if file.name == PARTIAL:
        return not file.stat().st_size
    if file.name == STORE:
        return not parsed(file.read_bytes()).records
    return file.name in (CONFIG, VERSIONS, COMMAND, ROOM, FILES)


def _require_run_alone(old: Path) -> None:
    """Refuse what an earlier overwrite left under a name if it holds more than a run.

    An empty folder is taken, too.
    """
    if not os.path.lexists(old):
        return
    others = [old]
    if is_folder(old):
        sweep(old)
        files = files_of(old)
        own = {*files, *(folder for file in files for folder in file.parents)}
        own |= {old / name for name in FOLDERS if files}
        others = sorted(path for path in old.rglob("*") if path not in own)
        if files:
            others = [path for path in others if old / JOBS not in (path, *path.parents)]
    if others:
        raise OutputError(
            f"{old}: expected an old run alone, which --overwrite removes, found {others[0]}, "
            f"which no run wrote; move {old} away"
        )


def _remove_old(old: Path) -> None:
    """Remove a run that was replaced, with its folder."""
    if os.path.lexists(old):
        shutil.rmtree(old / JOBS, ignore_errors=True)
        remove_run(old)
        if is_folder(old):
            old.rmdir()


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
