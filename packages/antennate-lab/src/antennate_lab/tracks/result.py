"""What `tracks` leaves: a row for each antenna, and the result."""

from __future__ import annotations

from typing import Literal

from antennate.studies.columns import column, tabular, tabular_row
from antennate.studies.pooling import total
from antennate_lab.tracks.cleaning import Handled
from antennate_lab.tracks.measures import ShapeShare, Varied, Wall


@tabular
class Seen:
    """Frames of an antenna."""

    frames: int = column(pool=total, form="d")
    """Frames from first to last."""
    contact: int = column("frames contact", pool=total, form="d")
    """Frames in contact."""
    free: int = column("frames free", pool=total, form="d")
    """Frames without contact."""
    unknown: int = column("frames unknown", pool=total, form="d")
    """Frames in which a point is not known; they belong to no share."""


@tabular_row
class TrackRow(Handled, Seen):
    """One antenna of one animal, a row of trials.csv.

    Counts of what was wrong are those of the animal, the same on both sides.
    """

    seed: int
    trial: int
    """Number of the animal."""
    file: str
    """Name of the file."""
    animal: str
    """What the file calls the animal; empty if it has one alone."""
    side: str
    """`left` or `right`."""
    status: Literal["contact", "no_contact"]
    """`contact` if any frame is in contact, else `no_contact`."""
    rate_hz: float
    """Frames a second."""
    forward: float | None
    """Share of the frames in contact that are forward pointing; empty without contact, as are the
    other shares and both angles."""
    backward: float | None
    """Share that is backward pointing."""
    straight: float | None
    """Share that is straight."""
    transition: float | None
    """Share in transition."""
    angle_median_rad: float | None
    """Median direction from base to tip in contact, from the body axis outwards."""
    flex_median_rad: float | None
    """Median bend in contact."""
    correct: float | None
    """Share of all frames that are classified correctly, on the left of the synthetic animal."""


@tabular
class WallFound(Wall):
    """Wall of a file, and how near the antennae came to it."""

    nearest: float | None
    """Least distance of a point of an antenna from the wall, over the length of the antenna; `null`
    unless the wall is a line or a circle."""
    beyond: float | None
    """Share of frames in which an antenna reaches beyond the wall; `null` likewise."""


@tabular
class Unseen:
    """An antenna that was known in hardly any frame."""

    file: str
    animal: str
    side: str
    frames: int
    """Frames of the animal."""
    known: int
    """Frames in which the antenna was known."""
    empty: tuple[str, ...]
    """Points of the antenna and the body axis that never have a value."""
    left_out: bool
    """Whether the animal was left out, as it has no other antenna."""


@tabular
class TracksResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "tracks"
    seed: int
    source: Literal["files", "synthetic"]
    """`files`, or `synthetic` for the synthetic animal."""
    synthetic_shapes: str | None
    """`separated` or `continuous`; `null` with files."""
    classified_by: Literal["bend", "direction"]
    """`bend`, or `direction` with two points along an antenna."""
    wall: dict[str, WallFound]
    """Wall of each file."""
    frames: Seen = column()
    """Frames of all antennae."""
    animals: int = column("animals", form="d")
    """Animals, each a trial."""
    skipped: int = column("animals known in too few frames, left out", form="d")
    handled: Handled = column()
    """Defects, over all animals."""
    unseen: list[Unseen]
    """Antennae that were known in too few frames."""
    trials_in_contact: int
    """Animals with contact."""
    shapes: dict[str, ShapeShare]
    """Share of each shape."""
    vary: float
    """Share by which each criterion is varied."""
    sensitivity: list[Varied]
    """Result with each criterion less and more."""
    curvature_rad: dict[str, list[float]]
    """Median curvature of each shape at each inner point, base first, times the length."""
    correct: float | None
    """Share of frames that are classified correctly, of the synthetic animal alone."""

    @property
    def failed(self) -> bool:
        """Whether no animal is in contact."""
        return not self.trials_in_contact
