"""Files of tracking software as tracks: plain CSV, DeepLabCut CSV and TRex npz; HDF5 beside it."""

from __future__ import annotations

import math
import zipfile
import zlib
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from antennate.csv_files import MISSING, Row, column, csv_rows, number_of
from antennate.errors import BadInputError
from antennate.experiments.tracks.config import ColumnsParams
from antennate.experiments.tracks.track import (
    LARGEST,
    Track,
    from_columns,
    numbered,
    refuse_labels,
    require_points,
    require_room_for,
)
from antennate.files import read_limited
from antennate.messages import nearest, shortened
from antennate.types import Floats, Ints

SUFFIXES = (".csv", ".h5", ".hdf5", ".slp", ".npz")
_DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    KeyError,
    OSError,
    RuntimeError,  # a byte that says encrypted, or another compression
    ValueError,
)
"""What NumPy raises for a damaged npz file."""
_TREX = "an npz file of TRex with poseX0, poseY0 and so on"
_LONGEST_HEADER = 1 << 14
"""More than NumPy takes of an array's header [byte]; one may say of itself that it has 4 GB."""


def read(path: Path, names: Sequence[str], columns: ColumnsParams) -> list[Track]:
    """The animals of a file, with the named points.

    Args:
        path: The file; its suffix gives the format.
        names: Points that are wanted.
        columns: Columns of plain CSV.

    Raises:
        BadInputError: It cannot be read, or lacks a point; the text says how to go on.
        MissingPackageError: It is HDF5 and h5py is not installed.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return _csv(path, names, columns)
    if suffix == ".npz":
        return _trex(path, names)
    if suffix in SUFFIXES:
        from antennate.experiments.tracks import hdf5

        return hdf5.read(path, names)
    raise BadInputError(
        f"{path}: expected a file in {', '.join(SUFFIXES)}, found {suffix or 'none'}"
    )


def _csv(path: Path, names: Sequence[str], columns: ColumnsParams) -> list[Track]:
    rows = csv_rows(path, read_limited(path, LARGEST), (), BadInputError, ended=True)
    _, header = next(rows)
    if not header:
        raise BadInputError(f"{path}: row 1: expected the names of the columns, found a blank line")
    if header[0] == "scorer":
        return _deeplabcut(path, header, rows, names)
    return _plain(path, header, rows, names, columns)


def _numbers(
    path: Path, line: int, header: Sequence[str], cells: list[str], places: Sequence[int]
) -> list[float]:
    """Numbers of a row, NaN for a cell that says of itself that it has none."""
    if len(cells) != len(header):
        why = "; are there decimal commas? write points"
        if len(cells) < len(header):
            why = " (truncated); delete the row"
        elif any("." in cell for cell in cells):
            why = (
                "; does row 1 lack the name of a column? R writes none above its row names: write "
                "one there, and name the column of frames with --columns.frame"
            )
        raise BadInputError(
            f"{path}: row {line}: expected {len(header)} cells, found {len(cells)}{why}"
        )
    values: list[float] = []
    for place in places:
        cell = cells[place].strip()
        try:
            value = number_of(cell)
        except ValueError as error:
            raise BadInputError(f"{path}: row {line}: expected {error}, found {cell!r}") from None
        if math.isnan(value) and cell.lower() not in MISSING:
            raise BadInputError(
                f"{path}: row {line}: expected a number or nothing in {header[place]}, found "
                f"{shortened(cell)}"
            )
        values.append(value)
    return values


def _table(
    path: Path, rows: Iterator[Row], header: Sequence[str], places: Sequence[int]
) -> tuple[Floats, list[str]]:
    """Numbers of some columns, a row for each frame, and the texts of the last place, if any."""
    numbers, texts = array("d"), list[str]()
    *places, text = places
    for line, cells in rows:
        numbers.extend(_numbers(path, line, header, cells, places))
        texts.append(cells[text].strip() if text >= 0 else "")
    if not texts:
        raise BadInputError(f"{path}: expected rows of frames, found none")
    return np.array(numbers).reshape(len(texts), -1), texts


def _deeplabcut(
    path: Path, first: list[str], rows: Iterator[Row], names: Sequence[str]
) -> list[Track]:
    """Columns named by scorer, (individuals,) bodyparts and coords, a row for each frame."""
    levels = {"scorer": first}
    while "coords" not in levels:
        _, cells = next(rows, (0, []))
        key = cells[0].strip() if cells else ""
        if key not in ("individuals", "bodyparts", "coords") or len(cells) != len(first):
            raise BadInputError(
                f"{path}: row {len(levels) + 1}: expected DeepLabCut's row of bodyparts or coords, "
                f"found {shortened(key) if cells else 'the end (truncated)'}"
            )
        levels[key] = [cell.strip() for cell in cells]
    if "bodyparts" not in levels:
        raise BadInputError(f"{path}: row 2: expected DeepLabCut's row of bodyparts, found none")
    begin = next((i for i, name in enumerate(levels["coords"]) if name in ("x", "y")), 1)
    body = _without_images(path, rows)
    if begin > 1:
        refuse_labels(path, "/".join(next(body, (0, [""]))[1][:begin]))
    animals = levels.get("individuals", [""] * len(first))
    columns = {
        (animals[i], levels["bodyparts"][i], levels["coords"][i]): i
        for i in range(1, len(first))
        if levels["bodyparts"][i] in names
    }
    require_points(path, names, levels["bodyparts"][1:])
    table, _ = _table(path, body, levels["bodyparts"], [0, *columns.values(), -1])
    values = dict(zip(columns, table.T[1:], strict=True))
    return from_columns(path, table[:, 0], values, names)


def _without_images(path: Path, rows: Iterator[Row]) -> Iterator[Row]:
    for line, cells in rows:
        if "/" in cells[0] or "\\" in cells[0] or cells[0].lower().endswith(".png"):
            refuse_labels(path, cells[0])
        yield line, cells


def _plain(
    path: Path,
    header: list[str],
    rows: Iterator[Row],
    names: Sequence[str],
    columns: ColumnsParams,
) -> list[Track]:
    wanted = {(n, c): getattr(columns, c).format(n) for n in names for c in "xy"}
    scores = {n: columns.likelihood.format(n) for n in names}
    touch = {side: columns.contact.format(side) for side in ("left", "right")}
    extra = {columns.frame, columns.time, *scores.values(), *touch.values()}
    places = {
        name: place
        for name in (*wanted.values(), *sorted(extra))
        if (place := column(header, name)) is not None
    }
    for (_, coordinate), name in wanted.items():
        if name not in places:
            raise BadInputError(
                f"{path}: row 1: expected a column {name}{nearest(name, header)}, found "
                f"{shortened(', '.join(header))}; name points with --points.* and columns with "
                f"--columns.{coordinate}"
            )
    split = column(header, columns.trial)
    _require_named(path, header, columns, {**places, columns.trial: split}, (scores, touch))
    table, trials = _table(path, rows, header, [*places.values(), -1 if split is None else split])
    values = dict(zip(places, table.T, strict=True))
    tracks = []
    order = {trial: number for number, trial in enumerate(dict.fromkeys(trials))}
    number = np.array([order[trial] for trial in trials])
    for trial, place in order.items():
        at = number == place
        part = {name: value[at] for name, value in values.items()}
        numbers = numbered(path, part.get(columns.frame, np.arange(float(at.sum()))))
        points = {n: np.stack([part[wanted[n, c]] for c in "xy"], axis=1) for n in names}
        likely = {n: part[name] for n, name in scores.items() if name in part}
        rate = _rate(path, numbers, part[columns.time]) if columns.time in part else None
        contact = {side: part[name] for side, name in touch.items() if name in part}
        tracks.append(Track(str(path), trial, numbers, rate, points, likely, contact=contact))
    return tracks


def _require_named(
    path: Path,
    header: list[str],
    columns: ColumnsParams,
    places: Mapping[str, int | None],
    several: Sequence[Mapping[str, str]],
) -> None:
    """Refuse a column that was named and is not there; by their defaults columns may be absent."""
    of = {"frame": [columns.frame], "time": [columns.time], "trial": [columns.trial]}
    of |= {key: list(m.values()) for key, m in zip(("likelihood", "contact"), several, strict=True)}
    for key, wanted in of.items():
        if key in columns.model_fields_set and all(places.get(name) is None for name in wanted):
            raise BadInputError(
                f"{path}: row 1: expected a column {wanted[0]}{nearest(wanted[0], header)}, found "
                f"{shortened(', '.join(header))}; is it the right --columns.{key}?"
            )


def _rate(path: Path, frames: Ints, t: Floats) -> float | None:
    """Frames a second by a column of time [s]; None of one frame."""
    new = np.diff(frames) > 0
    steps = np.diff(t)[new] / np.diff(frames)[new]
    if not np.isfinite(t).all() or (steps <= 0).any():
        raise BadInputError(f"{path}: expected time to rise with the frames, found it otherwise")
    return float(1.0 / np.median(steps)) if len(steps) else None


def _trex(path: Path, names: Sequence[str]) -> list[Track]:
    """Points poseX0, poseY0 and so on, of one individual; what is missing is infinite."""
    import io

    data = read_limited(path, LARGEST)
    if not data.startswith(b"PK"):
        raise BadInputError(f"{path}: expected {_TREX}, found {'none' if data else 'nothing'}")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            held = _arrays(path, file, names)
    except BadInputError:
        raise
    except _DAMAGES as error:
        found = "objects of Python" if "pickle" in str(error) else f"a damaged one: {error}"
        raise BadInputError(f"{path}: expected {_TREX}, found {found}") from None
    frames = numbered(path, held["frame"])
    lost = held["missing"] > 0 if "missing" in held else np.zeros(len(frames), bool)
    points = {}
    for name in names:
        values = np.stack([held[f"pose{axis}{name}"] for axis in "XY"], axis=1)
        values[~np.isfinite(values).all(axis=1) | lost] = np.nan
        points[name] = values
    rate = float(held["frame_rate"][0]) if len(held.get("frame_rate", ())) else None
    return [Track(str(path), "", frames, rate, points, {})]


def _arrays(path: Path, file: Any, names: Sequence[str]) -> dict[str, Floats]:
    """Arrays of an npz file of TRex. Names, then lengths, are judged before one is unpacked."""
    known = sorted(key.removeprefix("poseX") for key in file.files if key.startswith("poseX"))
    if not known:
        others = shortened(", ".join(file.files) or "no array")
        raise BadInputError(f"{path}: expected {_TREX}, found {others}")
    require_points(path, names, known)
    needed = ["frame", *(f"pose{axis}{name}" for name in names for axis in "XY")]
    for key in needed:
        if key not in file.files:
            raise BadInputError(f"{path}: expected an array {key}, found none")
    wanted = [*needed, *(key for key in ("missing", "frame_rate") if key in file.files)]
    lengths, total = _lengths(file.zip, wanted)
    require_room_for(path, total)
    for key in wanted:
        least, most = (0, 1) if key == "frame_rate" else (lengths["frame"], lengths["frame"])
        if not least <= lengths[key] <= most:
            raise BadInputError(f"{path}: expected {most} values of {key}, found {lengths[key]}")
    return {key: np.asarray(file[key], np.float64).reshape(-1) for key in wanted}


def _lengths(packed: zipfile.ZipFile, keys: Collection[str]) -> tuple[dict[str, int], int]:
    """How many numbers some arrays of an npz file have, and what all take [byte], by their headers.

    Numbers count as 8 bytes at least, as they become floats.
    """
    lengths, total = dict[str, int](), 0
    for entry in packed.infolist():
        if (key := entry.filename.removesuffix(".npy")) not in keys:
            continue
        with packed.open(entry) as file:
            shape, _, kind = _header(file.read(_LONGEST_HEADER))
        if kind.hasobject:
            raise ValueError(f"{key} is pickled")
        if kind.kind not in "biuf" or min(shape, default=0) < 0:
            raise ValueError(f"{key} is no array of numbers")
        if key in lengths:
            raise ValueError(f"{key} is there twice")
        lengths[key] = math.prod(shape)
        total += lengths[key] * max(8, kind.itemsize)
    return lengths, total


def _header(begin: bytes) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    import io

    file = io.BytesIO(begin)
    if np.lib.format.read_magic(file) == (1, 0):
        return np.lib.format.read_array_header_1_0(file)
    return np.lib.format.read_array_header_2_0(file)
