"""One animal as a file of tracking software holds it, and what every format has to fulfil."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from antennate.csv_files import LARGEST_WHOLE
from antennate.errors import BadInputError
from antennate.files import in_units
from antennate.messages import nearest, shortened
from antennate.types import Floats, Ints

LARGEST = 10**9
"""No file is longer [bytes]."""
UNPACKED = 2 * 10**8
"""Nor does what is read of it unpack to more [bytes]: 1.4 million frames of the eight points of two
antennae and a body axis (two coordinates, frame and `missing`, 8 bytes each). That is 6 h at 60 Hz,
at which TRex tracks while it films (Walter and Couzin 2021, eLife 10:e64000)."""


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
    """

    file: str
    animal: str
    frames: Ints
    rate: float | None
    points: Mapping[str, Floats]
    scores: Mapping[str, Floats]
    cutoff: float = 0.6
    contact: Mapping[str, Floats] = field(default_factory=dict[str, Floats])
    unsorted: int = 0

    def in_order(self) -> Track:
        """The same with its frames in rising order.

        Raises:
            BadInputError: They do not rise, and some stand twice: then it may be several animals.
        """
        latest = np.maximum.accumulate(self.frames)
        late = self.frames < latest
        if not late.any():
            return self
        order = np.argsort(self.frames)
        if (np.diff(self.frames[order]) == 0).any():
            at = int(np.argmax(late))
            raise BadInputError(
                f"{self.file}: expected frames in rising order or each once, found "
                f"{self.frames[at]} after {latest[at]}, and some twice; name the column of trials "
                "with --columns.trial"
            )

        def sort(columns: Mapping[str, Floats]) -> dict[str, Floats]:
            return {name: values[order] for name, values in columns.items()}

        return replace(
            self,
            frames=self.frames[order],
            points=sort(self.points),
            scores=sort(self.scores),
            contact=sort(self.contact),
            unsorted=int(late.sum()),
        )


def require_points(path: Path, names: Sequence[str], known: Sequence[str]) -> None:
    """Check that a file has the named points.

    Raises:
        BadInputError: One is missing.
    """
    for name in names:
        if name not in known:
            listed = shortened(", ".join(dict.fromkeys(known)) or "none")
            raise BadInputError(
                f"{path}: expected a point {name}{nearest(name, known)}, found {listed}; name the "
                "points of the antennae and the body axis with --points.*"
            )


def require_room_for(path: Path, size: int) -> None:
    """Check, before anything is unpacked, how much a file unpacks to [byte].

    Raises:
        BadInputError: It is more than `UNPACKED`.
    """
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
    path: Path, frames: Floats, columns: Mapping[tuple[str, str, str], Floats], names: Sequence[str]
) -> list[Track]:
    """DeepLabCut's columns, by individual, bodypart and coordinate, as tracks."""
    known = [part for _, part, _ in columns]
    require_points(path, names, known)
    tracks = []
    for animal in dict.fromkeys(animal for animal, _, _ in columns):
        if (animal, names[0], "x") not in columns:
            continue  # `single`: points that belong to no animal, such as corners of the arena
        lacking = [n for n in names for c in "xy" if (animal, n, c) not in columns]
        if lacking:
            raise BadInputError(f"{path}: {animal}: expected x and y of {lacking[0]}, found none")
        points = {n: np.stack([columns[animal, n, c] for c in "xy"], axis=1) for n in names}
        scores = {n: columns[key] for n in names if (key := (animal, n, "likelihood")) in columns}
        tracks.append(Track(str(path), animal, numbered(path, frames), None, points, scores))
    return tracks


def numbered(path: Path, frames: Floats) -> Ints:
    """Numbers of frames as whole numbers.

    Raises:
        BadInputError: They are none.
    """
    if not np.isfinite(frames).all() or (frames != np.round(frames)).any():
        raise BadInputError(f"{path}: expected whole numbers of frames, found others")
    if abs(frames).max(initial=0.0) > LARGEST_WHOLE:
        raise BadInputError(
            f"{path}: expected numbers of frames up to {LARGEST_WHOLE:g}, found "
            f"{frames[abs(frames).argmax()]:g}"
        )
    return frames.astype(np.int64)
