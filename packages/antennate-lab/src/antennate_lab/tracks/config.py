"""Everything that decides the outcome of `antennate tracks`."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from antennate.params.base import Params, number, require_default

_FORMAT = r"^[^{}]*\{\}[^{}]*$"


class PointsParams(Params):
    """Names of points in the files, A+B for the middle of two; TRex numbers them 0, 1, 2."""

    left: tuple[str, ...] = number(
        ("left_base", "left_mid", "left_tip"), "1", "assumed: plain names"
    )
    """Points of the left antenna from base to tip, at least two; `none` if there is no antenna."""
    right: tuple[str, ...] = number(
        ("right_base", "right_mid", "right_tip"), "1", "assumed: plain names"
    )
    """Points of the right antenna from base to tip, at least two; `none` if there is none."""
    tail: str = number("tail", "1", "assumed: plain names")
    """Point at which the body axis begins."""
    head: str = number("head", "1", "assumed: plain names")
    """Point at which the body axis ends, in front."""

    def of(self, side: str) -> tuple[str, ...]:
        """Points of a side, none if it has no antenna."""
        names: tuple[str, ...] = getattr(self, side)
        return () if names in ((), ("none",)) else names

    @property
    def parts(self) -> tuple[str, ...]:
        """Every point that a file has to have."""
        names = (*self.of("left"), *self.of("right"), self.tail, self.head)
        return tuple(dict.fromkeys(part for name in names for part in name.split("+")))

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides that have an antenna."""
        return tuple(side for side in ("left", "right") if self.of(side))

    @property
    def count(self) -> int:
        """Points of an antenna."""
        return len(self.of(self.sides[0]))

    @model_validator(mode="after")
    def _agree(self) -> PointsParams:
        counts = {side: len(self.of(side)) for side in self.sides}
        if not counts:
            raise ValueError("left: expected points of at least one antenna, found none")
        if len(set(counts.values())) > 1:
            raise ValueError(
                f"right: expected as many points as left, {counts['left']}, found {counts['right']}"
            )
        if self.count < 2:
            raise ValueError("left: expected at least two points, base and tip, found one")
        if self.tail == self.head:
            raise ValueError(f"tail: expected another point than head, found {self.tail}")
        return self


class ColumnsParams(Params):
    """Columns of plain CSV; {} stands for the name of a point."""

    x: str = number("{}_x", "1", "assumed: plain", pattern=_FORMAT)
    """Columns of x."""
    y: str = number("{}_y", "1", "assumed: plain", pattern=_FORMAT)
    """Columns of y."""
    likelihood: str = number("{}_likelihood", "1", "assumed: plain", pattern=_FORMAT)
    """Columns of the likelihood from 0 to 1, if any."""
    frame: str = number("frame", "1", "assumed: plain")
    """Column that numbers frames, if any; else rows are frames."""
    time: str = number("time", "1", "assumed: plain")
    """Column of time [s], if any."""
    contact: str = number("{}_contact", "1", "assumed: plain", pattern=_FORMAT)
    """Columns of contact, 0 or 1, for wall kind `file`; {} stands for left and right."""
    trial: str = number("trial", "1", "assumed: plain")
    """Column with the name of the trial or animal, if any."""


class CleaningParams(Params):
    """What is done about points that are missing or wrong."""

    likelihood: float | None = number(
        None, "1", "assumed: 0.2 for SLEAP, else 0.6: what these programs use", ge=0, le=1
    )
    """Likelihood below which a point counts as missing."""
    smoothing: float = number(0.05, "s", "assumed: far below a stroke of 0.5 s", ge=0, le=1)
    """Width of the running median; below three frames there is none."""
    jump: float = number(0.25, "1", "assumed: five times a good network's error", gt=0, le=5)
    """Distance from the running median, over the antenna's length, that makes a point wrong."""
    stretch: float = number(0.5, "1", "assumed: perspective changes less", gt=0, le=10)
    """How much longer than its median an antenna may be before its tip is wrong."""
    longest_gap: float = number(0.1, "s", "assumed: twice the running median", ge=0, le=10)
    """Longest gap that is bridged by a straight line in the body's frame."""
    least_frames: int = number(10, "1", "assumed: too few for a distribution", ge=1, le=1000000)
    """Known frames below which an animal is left out."""


class TrackWallParams(Params):
    """The wall that the antennae touch."""

    kind: Literal["none", "file", "line", "circle"] = number("none", "1", "assumed: no wall")
    """`none` counts every frame as contact; `file` takes contact from columns of plain CSV."""
    line: tuple[float, float, float, float] | None = number(
        None, "unit of file", "assumed: fitted to each file"
    )
    """Two points of the line: x, y, x, y."""
    circle: tuple[float, float, float] | None = number(
        None, "unit of file", "assumed: fitted to each file"
    )
    """Centre and radius of the circle around the animals: x, y, r."""

    @model_validator(mode="after")
    def _agree(self) -> TrackWallParams:
        for kind in ("line", "circle"):
            if getattr(self, kind) is not None and self.kind != kind:
                raise ValueError(f"kind: expected {kind}, as a {kind} is given, found {self.kind}")
        if self.line is not None and self.line[:2] == self.line[2:]:
            raise ValueError("line: expected two different points, found one twice")
        if self.circle is not None and self.circle[2] <= 0:
            raise ValueError(f"circle: expected a radius above 0, found {self.circle[2]:g}")
        return self


class CriteriaParams(Params):
    """Criteria of contact and of the shapes."""

    gap: float = number(0.15, "1", "assumed: three times a good network's error", gt=0, le=1)
    """Distance to the wall, over the antenna's length, below which an antenna touches."""
    angle: float = number(math.pi / 2, "rad", "assumed: sideways", gt=0, le=math.pi)
    """Angle from the heading below which a direction points forward, and else backward."""
    flex: float = number(math.radians(20.0), "rad", "assumed: above tracking errors", gt=0, le=3)
    """Bend between first and last segment below which an antenna is straight."""
    offset: float = number(math.radians(10.0), "rad", "assumed: half, if evenly bent", gt=0, le=3)
    """Angle of the tip off the first segment below which an antenna is straight."""
    duration: float = number(0.05, "s", "assumed: the width of the running median", ge=0, le=10)
    """Time for which a shape is held; shorter ones are transitions."""


class SyntheticParams(Params):
    """The synthetic animal: five points along each antenna, a straight wall, known shapes."""

    shapes: Literal["separated", "continuous"] = number(
        "separated", "1", "assumed: known by their drawing, whatever the criteria are"
    )
    """`separated`: four shapes far from all borders; `continuous`: bends across the borders."""
    trials: int = number(6, "1", "assumed: enough for an interval", ge=1, le=1000)
    """Recordings."""
    frames: int = number(2000, "1", "assumed: 20 s", ge=200, le=1000000)
    """Frames of each."""
    rate: float = number(100.0, "Hz", "assumed: a usual camera for insects", ge=20, le=10000)
    """Frames a second."""
    length: float = number(100.0, "px", "assumed: a close view", ge=20, le=10000)
    """Length of an antenna."""
    error: float = number(
        1.0,
        "1",
        "measured: a network's antennal tips on 2598 ants, docs/tracks.md",
        ge=0,
        le=10,
    )
    """Size of the tracking errors, over those of the network: median 1.6 px, 5 % above 20 px."""
    missing: float = number(0.075, "1", "measured: 7 to 8 % of the same tips", ge=0, lt=1)
    """Share of points that are missing; half of them stand elsewhere with a low likelihood."""
    swapped: float = number(0.01, "1", "assumed: now and then", ge=0, lt=0.5)
    """Share of frames in which left and right are exchanged."""
    repeated: float = number(0.002, "1", "assumed: rare", ge=0, lt=0.5)
    """Share of frames that stand twice in the file, and of frames that are absent from it."""


class TracksConfig(Params):
    """Everything that decides the outcome of `antennate tracks`."""

    files: tuple[str, ...] = number(
        (), "1", "assumed: no files, the synthetic animal", metavar="FILE"
    )
    """Files to read: .csv, .h5, .slp or .npz."""
    rate: float | None = number(None, "Hz", "assumed: as the files say", gt=0, le=100000)
    """Frames a second at which was recorded."""
    playback_rate: float | None = number(None, "Hz", "assumed: that of the recording", gt=0, le=1e5)
    """Frames a second that the files state, if it is not that of the recording."""
    y_down: bool = number(True, "1", "assumed: as in images")
    """Whether y points down."""
    vary: float = number(0.2, "1", "assumed: a reader's doubt of any criterion", gt=0, lt=1)
    """Share by which each criterion is varied."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    points: PointsParams = PointsParams()
    columns: ColumnsParams = ColumnsParams()
    cleaning: CleaningParams = CleaningParams()
    wall: TrackWallParams = TrackWallParams()
    criteria: CriteriaParams = CriteriaParams()
    synthetic: SyntheticParams = SyntheticParams()

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> TracksConfig:
        plain = any(name.lower().endswith(".csv") for name in self.files)
        if not self.files:
            names = ("rate", "playback_rate", "y_down", "points", "columns", "wall")
            require_default(self, "it is not read without files", *names)
        else:
            require_default(self, "it is not read with files", "synthetic")
        if self.files and not plain:
            require_default(self, "it is not read without a .csv file", "columns")
        if self.playback_rate is not None and self.rate is None:
            raise ValueError("playback_rate: expected a rate beside it, found none")
        for name in CriteriaParams.model_fields:
            if name not in self.read_criteria:
                why = "without a wall" if name == "gap" else "with two points along an antenna"
                require_default(self, f"it is not read {why}", f"criteria.{name}")
        return self

    @property
    def read_criteria(self) -> tuple[str, ...]:
        """Names of the criteria that decide: without a wall no gap, with two points no bend."""
        bend = ("flex", "offset") if not self.files or self.points.count > 2 else ()
        gap = () if self.files and self.wall.kind in ("none", "file") else ("gap",)
        return (*gap, "angle", *bend, "duration")
