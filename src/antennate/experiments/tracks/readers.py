"""Files of tracking software as tracks: plain CSV, DeepLabCut CSV and TRex npz; HDF5 beside it."""

from __future__ import annotations

import math
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from antennate.csv_files import Row, csv_rows, number_of
from antennate.errors import BadInputError
from antennate.experiments.tracks.config import ColumnsParams
from antennate.experiments.tracks.track import (
    LARGEST,
    Track,
    from_columns,
    numbered,
    refuse_labels,
    require_points,
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
    if header[0] == "scorer":
        return _deeplabcut(path, header, rows, names)
    return _plain(path, header, rows, names, columns)


def _numbers(path: Path, line: int, width: int, cells: list[str], places: Sequence[int]) -> Floats:
    if len(cells) != width:
        raise BadInputError(f"{path}: row {line}: expected {width} cells, found {len(cells)}")
    values = np.empty(len(places))
    for i, place in enumerate(places):
        cell = cells[place].strip()
        try:
            values[i] = number_of(cell)
        except ValueError as error:
            raise BadInputError(f"{path}: row {line}: expected {error}, found {cell!r}") from None
        if math.isnan(values[i]) and cell.lower() not in ("", "nan"):
            raise BadInputError(
                f"{path}: row {line}: expected a number or nothing, found {shortened(cell)}"
            )
    return values


def _table(path: Path, rows: Iterator[Row], width: int, places: Sequence[int]) -> Floats:
    found = [_numbers(path, line, width, cells, places) for line, cells in rows]
    if not found:
        raise BadInputError(f"{path}: expected rows of frames, found none")
    return np.array(found)


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
        (animals[i], levels["bodyparts"][i], levels["coords"][i]): i for i in range(1, len(first))
    }
    table = _table(path, body, len(first), range(len(first)))
    return from_columns(path, table[:, 0], {key: table[:, i] for key, i in columns.items()}, names)


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
    for (_, coordinate), column in wanted.items():
        if column not in header:
            raise BadInputError(
                f"{path}: row 1: expected a column {column}{nearest(column, header)}, found "
                f"{shortened(', '.join(header))}; name points with --points.* and columns with "
                f"--columns.{coordinate}"
            )
    extra = {key: getattr(columns, key) for key in ("frame", "time")}
    extra |= {name: columns.likelihood.format(name) for name in names}
    touch = {side: columns.contact.format(side) for side in ("left", "right")}
    extra |= {f"contact {side}": column for side, column in touch.items()}
    used = [*wanted.values(), *(column for column in extra.values() if column in header)]
    body = list(rows)
    table = _table(path, iter(body), len(header), [header.index(column) for column in used])
    values = dict(zip(used, table.T, strict=True))
    split = header.index(columns.trial) if columns.trial in header else None
    trials = np.array(["" if split is None else cells[split].strip() for _, cells in body])
    tracks = []
    for trial in dict.fromkeys(trials.tolist()):
        at = trials == trial
        part = {column: value[at] for column, value in values.items()}
        frames = part.get(extra["frame"], np.arange(float(at.sum())))
        numbers = numbered(path, frames)
        points = {n: np.stack([part[wanted[n, c]] for c in "xy"], axis=1) for n in names}
        scores = {n: part[extra[n]] for n in names if extra[n] in part}
        rate = _rate(path, numbers, part[extra["time"]]) if extra["time"] in part else None
        contact = {side: part[column] for side, column in touch.items() if column in part}
        tracks.append(Track(str(path), trial, numbers, rate, points, scores, contact=contact))
    return tracks


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
    wanted = "an npz file of TRex with poseX0, poseY0 and so on"
    if not data.startswith(b"PK"):
        raise BadInputError(f"{path}: expected {wanted}, found {'none' if data else 'nothing'}")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            held: dict[str, Any] = {
                key: np.asarray(file[key], np.float64).reshape(-1)
                for key in file.files
                if key in ("frame", "frame_rate", "time", "missing", "id") or key.startswith("pose")
            }
            others = ", ".join(file.files) or "no array"
    except _DAMAGES as error:
        found = "objects of Python" if "pickle" in str(error) else f"a damaged one: {error}"
        raise BadInputError(f"{path}: expected {wanted}, found {found}") from None
    known = sorted(key.removeprefix("poseX") for key in held if key.startswith("poseX"))
    if not known:
        raise BadInputError(f"{path}: expected {wanted}, found {shortened(others)}")
    require_points(path, names, known)
    if "frame" not in held:
        raise BadInputError(f"{path}: expected an array frame, found none")
    frames = numbered(path, held["frame"])
    lost = held.get("missing", np.zeros(len(frames))) > 0
    points = {}
    for name in names:
        pair = [held.get(f"pose{axis}{name}", np.zeros(0)) for axis in "XY"]
        if len(lost) != len(frames) or any(len(values) != len(frames) for values in pair):
            raise BadInputError(
                f"{path}: expected {len(frames)} values of point {name}, found "
                f"{', '.join(str(len(values)) for values in pair)}"
            )
        values = np.stack(pair, axis=1)
        values[~np.isfinite(values).all(axis=1) | lost] = np.nan
        points[name] = values
    rate = float(held["frame_rate"][0]) if len(held.get("frame_rate", ())) else None
    return [Track(str(path), "", frames, rate, points, {})]
