"""The run that a folder held, set aside until the one that replaces it has something to keep.

Its files go into a hidden folder beside the new ones. The name of that folder tells how far this
went, so that a process that is killed at any moment leaves the old run or the new one: whoever
takes the folder next, or reads its run, ends what was begun. The process that replaces a run holds
a lock on the hidden folder.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from antennate.errors import OutputError
from antennate.studies.run_files import (
    CALIBRATION,
    FOLDERS,
    LOG_PARTS,
    PARTIAL,
    RESULT,
    SHARD,
    files_of,
    is_folder,
    is_same,
    sweep,
)
from antennate.studies.store import STORE, Store, nobody_else, parsed

_ASIDE = ".replaced"
"""Holds all files of the old run; those beside it are of the new one."""
_MOVING = ".replaced.moving"
"""Holds some files of the old run; the others are beside it."""
_GONE = ".replaced.gone"
"""Holds files of the old run that the new one has replaced."""


class Replaced:
    """The run that a folder held.

    Args:
        place: The folder.
        held: Files of its run.
        stays: Name of a file that stays until the new run replaces it.

    Raises:
        OSError: A file cannot be moved; all are where they were.
        OutputError: Another process works on it.
    """

    def __init__(self, place: Path, held: Sequence[Path], stays: str) -> None:
        self._place = place
        self._store = Store(place / STORE) if place / STORE in held else None
        self._lock = None
        folder = place / _MOVING
        try:
            folder.mkdir()
            self._lock = _locked(folder)
            for file in held:
                target = folder / file.relative_to(place)
                target.parent.mkdir(parents=True, exist_ok=True)
                (os.link if file.name == stays else os.rename)(file, target)
            folder.rename(place / _ASIDE)
        except BaseException:
            if is_folder(folder):
                _move_back(place)
            self._close()
            raise

    def forget(self) -> None:
        """Remove it: the new run has something to keep."""
        _remove(self._place)
        self._close()

    def settle(self) -> None:
        """Remove it if the new run has something to keep, else put it back."""
        _settle(self._place)
        self._close()

    def _close(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
        if self._store is not None:
            self._store.close()


def settle(place: Path, sure: bool = False) -> None:
    """End what a killed process has left half replaced in a folder.

    Args:
        place: The folder.
        sure: Whether it must be certain that the process is dead; without locks it never is.

    Raises:
        OSError: A file cannot be moved, or, if it must be sure, there are no locks.
        OutputError: The process lives.
    """
    for folder in [place / name for name in (_MOVING, _ASIDE, _GONE)]:
        if is_folder(folder):
            lock = _locked(folder, sure)
            try:
                _settle(place)
            finally:
                os.close(lock)


def settle_if_free(place: Path) -> None:
    """The same before a folder is read, unless it cannot be written or another process may live."""
    with contextlib.suppress(OSError, OutputError):
        settle(place, sure=True)


def _locked(folder: Path, sure: bool = False) -> int:
    """A lock on a folder, which the system frees when this process ends.

    Args:
        folder: Where.
        sure: Whether a file system without locks is an error.
    """
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise nobody_else(folder.parent) from None
    except OSError:  # a file system without locks
        if sure:
            os.close(lock)
            raise
    return lock


def _settle(place: Path) -> None:
    sweep(place)
    if is_folder(place / _MOVING):
        _move_back(place)
    elif is_folder(place / _ASIDE) and not _has_results(place):
        _put_back(place)
    else:
        _remove(place)


def _has_results(place: Path) -> bool:
    """Whether the new run has what was measured: trials that ended, a log of a drive, a result."""
    return any(_is_result(file, place / _ASIDE / file.name) for file in files_of(place))


def _is_result(file: Path, old: Path) -> bool:
    if file.name == PARTIAL:
        return bool(file.stat().st_size)
    if file.name == STORE:
        return bool(parsed(file.read_bytes()).records)
    if file.name == CALIBRATION:
        return not is_same(file, old)
    return file.name in (RESULT, SHARD, *LOG_PARTS)


def _put_back(place: Path) -> None:
    for file in files_of(place):
        if not is_same(file, place / _ASIDE / file.name):
            file.unlink()
    for name in FOLDERS:
        if is_folder(place / name):
            with contextlib.suppress(OSError):
                (place / name).rmdir()
    (place / _ASIDE).rename(place / _MOVING)
    _move_back(place)


def _move_back(place: Path) -> None:
    folder = place / _MOVING
    for file in [each for each in folder.rglob("*") if not is_folder(each)]:
        target = place / file.relative_to(folder)
        target.parent.mkdir(parents=True, exist_ok=True)
        file.replace(target)
    shutil.rmtree(folder)


def _remove(place: Path) -> None:
    if is_folder(place / _ASIDE):
        (place / _ASIDE).rename(place / _GONE)
    shutil.rmtree(place / _GONE, ignore_errors=True)
