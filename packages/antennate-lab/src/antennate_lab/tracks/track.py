"""One animal as a file of tracking software holds it, what every format has to fulfil, and CSV."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from antennate.csv_files import (
    LARGEST_WHOLE,
    MISSING,
    Row,
    column,
    csv_rows,
    number_of,
    wrong_count,
)
from antennate.errors import BadInputError
from antennate.files import in_units, read_limited
from antennate.messages import nearest, shortened
from antennate.types import Floats, Ints
from antennate_lab.tracks.config import ColumnsParams

LARGEST = 10**9
"""No file is longer [bytes]."""
UNPACKED = 2 * 10**8
"""Nor does what is read of it unpack to more [bytes]: 1.4 million frames of the eight points of two
antennae and a body axis (two coordinates, frame and `missing`, 8 bytes each). That is 6 h at 60 Hz,
at which TRex tracks while it films (Walter and Couzin 2021, eLife 10:e64000)."""
DEEPLABCUT_CUTOFF, SLEAP_CUTOFF = 0.6, 0.2
"""Likelihood, and height of a peak, below which these programs leave a point out by default."""
_SLEAP = {
    "x": "{}.x", "y": "{}.y", "likelihood": "{}.score", "frame": "frame_idx", "trial": "track",
}  # fmt: skip
"""Columns of SLEAP's analysis CSV; those that a user names go before."""


@dataclass(frozen=True)
class Track:
    """One animal of one file, as it stands there.

    Attributes:
        file: Name of the file.
        animal: What the file calls the animal, empty if it has one alone.
        frames: Numbers of the frames, shape (n,).
        rate: Frames a second that the file states, None if it states none.
        points: Named points in the file's unit, each of shape (n, 2); NaN where missing.
        scores: Likelihood of each point, shape (n,); absent where the file has none.
        cutoff: Likelihood below which a point is usually left out in this format.
        contact: Whether each side's antenna touches, 0 or 1, shape (n,), where the file has it.
        unsorted: Rows that stood after one of a later frame.
        replaced: Instances that were left out, as another of the animal stands in the same frame.
    """

    file: str
    animal: str
    frames: Ints
    rate: float | None
    points: Mapping[str, Floats]
    scores: Mapping[str, Floats]
    cutoff: float = DEEPLABCUT_CUTOFF
    contact: Mapping[str, Floats] = field(default_factory=dict[str, Floats])
    unsorted: int = 0
    replaced: int = 0

    def in_order(self) -> Track:
        """The track with its frames in rising order."""
        late = self.frames < np.maximum.accumulate(self.frames)
        order = np.argsort(self.frames, kind="stable")

        def sort(columns: Mapping[str, Floats]) -> dict[str, Floats]:
            return {name: values[order] for name, values in columns.items()}

        track = replace(
            self,
            frames=self.frames[order],
            points=sort(self.points),
            scores=sort(self.scores),
            contact=sort(self.contact),
            unsorted=int(late.sum()),
        )
        track._refuse_two_places()
        return track

    def _refuse_two_places(self) -> None:
        """Refuse rows of one frame that differ where the later one has a value."""
        same = np.flatnonzero(np.diff(self.frames) == 0)
        places = np.hstack(list(self.points.values()))
        later = places[same + 1]
        moved = self.frames[same[(np.isfinite(later) & (later != places[same])).any(axis=1)]]
        if len(moved):
            raise BadInputError(
                f"{self.file}: expected one place for each point in a frame, found more in "
                f"{len(np.unique(moved))} frames{f' of {self.animal}' if self.animal else ''}, the "
                f"first of them {moved[0]}; if these are several animals, name each in the column "
                "of --columns.trial"
            )


def require_points(path: Path, names: Sequence[str], known: Sequence[str]) -> None:
    """Check that a file has the named points."""
    for name in names:
        if name not in known:
            listed = shortened(", ".join(dict.fromkeys(known)) or "none")
            others = [each for each in known if each not in names]
            raise BadInputError(
                f"{path}: expected a point {name}{nearest(name, others)}, found {listed}; name the "
                "points of the antennae and the body axis with --points.*"
            )


def require_room_for(path: Path, size: int) -> None:
    """Check, before anything is unpacked, how much a file unpacks to [byte]."""
    if size > UNPACKED:
        raise BadInputError(
            f"{path}: expected at most {in_units(UNPACKED)} once unpacked, found {in_units(size)}; "
            "split the recording, or name fewer points"
        )


def refuse_labels(path: Path, index: str) -> NoReturn:
    """Refuse hand labels, whose rows are images and no frames of a video."""
    raise BadInputError(
        f"{path}: expected numbers of frames, found an image, {shortened(index)}: these are "
        "labels; give the file that analysing a video wrote"
    )


def from_columns(
    path: Path,
    frames: Floats,
    columns: Mapping[tuple[str, str, str], Floats],
    names: Sequence[str],
    animals: Sequence[str],
) -> list[Track]:
    """DeepLabCut's columns, by individual, bodypart and coordinate, as tracks of its animals.

    One with none of the points is never known: `single`, of points that belong to no animal.
    """
    known = [part for _, part, _ in columns]
    require_points(path, names, known)
    tracks, unknown = list[Track](), np.full(len(frames), np.nan)
    for animal in dict.fromkeys(animals):
        lacking = [n for n in names for c in "xy" if (animal, n, c) not in columns]
        if 0 < len(lacking) < 2 * len(names):
            raise BadInputError(f"{path}: {animal}: expected x and y of {lacking[0]}, found none")
        points = {
            n: np.stack([columns.get((animal, n, c), unknown) for c in "xy"], axis=1) for n in names
        }
        scores = {n: columns[key] for n in names if (key := (animal, n, "likelihood")) in columns}
        tracks.append(Track(str(path), animal, numbered(path, frames), None, points, scores))
    return tracks


def numbered(path: Path, frames: Floats) -> Ints:
    """Numbers of frames as whole numbers."""
    if not np.isfinite(frames).all() or (frames != np.round(frames)).any():
        raise BadInputError(f"{path}: expected whole numbers of frames, found others")
    if abs(frames).max(initial=0.0) > LARGEST_WHOLE:
        raise BadInputError(
            f"{path}: expected numbers of frames up to {LARGEST_WHOLE:g}, found "
            f"{frames[abs(frames).argmax()]:g}"
        )
    return frames.astype(np.int64)


def read_csv(path: Path, names: Sequence[str], columns: ColumnsParams) -> list[Track]:
    """The animals of a plain CSV file, or of one of DeepLabCut."""
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
    surplus = (
        "; does row 1 lack the name of a column? R writes none above its row names: write one "
        "there, and name the column of frames with --columns.frame"
    )
    if why := wrong_count(header, cells, surplus):
        raise BadInputError(f"{path}: row {line}: {why}")
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
    return from_columns(path, table[:, 0], values, names, animals[1:])


def _without_images(path: Path, rows: Iterator[Row]) -> Iterator[Row]:
    """Rows whose first cell is no image, as that of hand labels is."""
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
    """A column for each coordinate of a point, and one that tells trials or animals apart."""
    theirs = _SLEAP if {"track", "frame_idx"} <= set(header) else {}
    own = columns.model_fields_set
    columns = columns.model_copy(update={k: v for k, v in theirs.items() if k not in own})
    cutoff = SLEAP_CUTOFF if theirs else DEEPLABCUT_CUTOFF
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
            others = [each for at, each in enumerate(header) if at not in places.values()]
            raise BadInputError(
                f"{path}: row 1: expected a column {name}{nearest(name, others)}, found "
                f"{shortened(', '.join(header))}; name points with --points.* and columns with "
                f"--columns.{coordinate}"
            )
    split = column(header, columns.trial)
    _require_named(path, header, columns, [*scores.values()], [*touch.values()])
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
        tracks.append(Track(str(path), trial, numbers, rate, points, likely, cutoff, contact))
    return tracks


def _require_named(
    path: Path,
    header: list[str],
    columns: ColumnsParams,
    scores: Sequence[str],
    touch: Sequence[str],
) -> None:
    """Refuse a column that was named and is not there; by their defaults columns may be absent."""
    single = {key: [getattr(columns, key)] for key in ("frame", "time", "trial")}
    for key, names in {**single, "likelihood": scores, "contact": touch}.items():
        if key in columns.model_fields_set and all(column(header, n) is None for n in names):
            raise BadInputError(
                f"{path}: row 1: expected a column {names[0]}{nearest(names[0], header)}, found "
                f"{shortened(', '.join(header))}; is it the right --columns.{key}?"
            )


def _rate(path: Path, frames: Ints, t: Floats) -> float | None:
    """Frames a second by a column of time [s]; None of one frame."""
    new = np.diff(frames) > 0
    steps = np.diff(t)[new] / np.diff(frames)[new]
    if not np.isfinite(t).all() or (steps <= 0).any():
        raise BadInputError(f"{path}: expected time to rise with the frames, found it otherwise")
    return float(1.0 / np.median(steps)) if len(steps) else None
