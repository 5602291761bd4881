"""How a run takes its directory: nothing of another run goes before this one can begin."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

from antennate.errors import OutputError
from antennate.studies.replaced import Replaced, settle
from antennate.studies.run_files import (
    CALIBRATION,
    FILES,
    FOLDERS,
    PARTIAL,
    ROOM,
    add_to_list,
    files_of,
    holds_run,
    is_finished,
    others_of,
    outdated,
    place_of,
    require_replaceable,
    sweep,
    writing,
)
from antennate.studies.store import STORE, Store, Tasks, open_store


class Claim(NamedTuple):
    """A directory that a run has taken; see `RunDirectory`.

    Attributes:
        path: Where it is.
        created: Folders that were made for it, the innermost first.
        partial: File of finished trials, None for a run that is finished.
        store: Its finished trials if it can be resumed, None otherwise.
        finished: Whether the run is finished.
        replaced: The run that is replaced, if there is one.
    """

    path: Path
    created: Sequence[Path] = ()
    partial: IO[str] | None = None
    store: Store | None = None
    finished: bool = False
    replaced: Replaced | None = None


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
        for folder in FOLDERS:
            if (place / folder).is_symlink():
                raise OutputError(f"expected {place / folder} within its run, found a link")
        settle(place)
        sweep(place)
        held, others = files_of(place), others_of(place)
        goes_on = bool(resume) and not overwrite and not others and (place / STORE) in held
        if overwrite:
            require_replaceable(place)
        elif (held or others) and not goes_on:
            raise holds_run(place, [*others, *held], resume)
        stays = CALIBRATION if command == "calibrate" else ""
        replaced = Replaced(place, held, stays) if held and overwrite else None
        try:
            known = (stays,) if stays and held else ()
            add_to_list(place, (PARTIAL, STORE, ROOM, *known))
            store = open_store(place, identity, tasks if goes_on else None)
            sound = store is not None and not store.damaged and store.holds_all(tasks)
            finished = goes_on and not retry and sound and is_finished(place)
            for file in outdated(held, stays, finished) if goes_on else ():
                file.unlink()
            partial = None if finished else (place / PARTIAL).open("x", encoding="utf-8")
        except BaseException:
            if replaced is not None:
                replaced.settle()
            elif files_of(place) == [place / FILES]:
                (place / FILES).unlink()
            with contextlib.suppress(OSError):
                for each in missing:
                    each.rmdir()
            raise
        return Claim(place, missing, partial, store, finished, replaced)


def _require_folder(place: Path) -> None:
    """Refuse a name that is there and leads to no folder."""
    if os.path.lexists(place) and not place.is_dir():
        what = "a file" if place.exists() else "a link to nothing"
        raise OutputError(f"{place}: expected a folder, found {what}; give another --out")
