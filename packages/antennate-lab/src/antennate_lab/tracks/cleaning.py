"""From a track as it stands in a file to antennae in the body's frame, with what was wrong counted.

The body's frame begins at the head; x is ahead, y to the left. It is followed frame by frame, so
that walking and turning are no movement of the antennae.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from antennate.errors import BadInputError
from antennate.studies.columns import column, columns, tabular
from antennate.studies.pooling import total
from antennate.types import Bools, Floats, Ints
from antennate_lab.tracks.config import CleaningParams, TracksConfig
from antennate_lab.tracks.track import Track

_MOST_EXCHANGED, _MOST_ACROSS = 0.5, 0.8
"""Shares of frames beyond which left and right are not exchanged now and then but always: with two
antennae, and with one, which may swing across the body axis."""
_CLEARLY = 0.3
"""Sine of the angle by which a single antenna points across the body axis."""
_FRAMES_TO_JUDGE = 10
_MOST_ABSENT, _SHORT = 20, 100_000
"""Frames from first to last over the rows of a track, and a number that is never too many."""


@tabular
class Handled:
    """Defects of the track of an animal, counted, and what is done about them."""

    unsorted: int = column("rows after one of a later frame, sorted", pool=total, form="d")
    duplicated: int = column("frames that stand twice, left out", pool=total, form="d")
    """Frames that stand again with the same points, and instances of SLEAP that were corrected by
    hand: the first counts, or what was corrected."""
    absent: int = column("frames absent from the file", pool=total, form="d")
    """Numbers of frames that are missing: left as a gap."""
    still: int = column("frames equal to the last in every point, kept", pool=total, form="d")
    """Frames equal to the last in every point: kept, as the animal may stand, or the camera
    repeated a picture."""
    low_likelihood: int = column("points of low likelihood, left out", pool=total, form="d")
    """Points below `--cleaning.likelihood`, 0.2 for SLEAP, else 0.6: left as a gap."""
    missing: int = column("points missing", pool=total, form="d")
    """Points without a value: left as a gap."""
    swapped: int = column("frames with left and right exchanged, put back", pool=total, form="d")
    outliers: int = column("points in wrong places, left out", pool=total, form="d")
    """Points far from their running median, and tips of antennae that are far too long: left as a
    gap."""
    bridged: int = column("points bridged over short gaps", pool=total, form="d")
    """Points in gaps of at most `--cleaning.longest_gap`: put on a straight line, in the body's
    frame."""


@dataclass
class Antennae:
    """The antennae of one animal.

    Attributes:
        track: Where they come from.
        rate: Frames a second [Hz].
        sides: Points of each antenna in the body's frame with y outwards, shape (n, k, 2), NaN
            where not known.
        places: The same points as in the file's frame.
        contact: Whether each antenna touches, shape (n,), where the file has it.
        handled: What was wrong.
        empty: Names of points that were never known.
    """

    track: Track
    rate: float
    sides: dict[str, Floats]
    places: dict[str, Floats]
    contact: dict[str, Floats]
    handled: Handled
    empty: tuple[str, ...]

    @property
    def frames(self) -> int:
        """Number of frames, absent ones included."""
        return len(next(iter(self.sides.values())))

    def known(self, side: str) -> int:
        """Frames in which every point of an antenna is known."""
        return int(np.isfinite(self.sides[side]).all(axis=(1, 2)).sum())


def clean(config: TracksConfig, track: Track, rate: float, y_down: bool) -> Antennae:
    """The antennae of a track."""
    params, names = config.cleaning, config.points
    _refuse_far_apart(track)
    counts = {each.name: 0 for each in columns(Handled)}
    points = _each_frame_once(params, track, counts)
    width, longest = frames_of(params.smoothing, rate), round(params.longest_gap * rate)

    def of(*wanted: str) -> Floats:
        middles = [np.mean([points[part] for part in name.split("+")], axis=0) for name in wanted]
        return np.stack(middles, axis=1)

    axis = of(names.tail, names.head)
    axis = running_median(bridged(axis, longest, counts), width)
    ahead = axis[:, 1] - axis[:, 0]
    size = np.hypot(*ahead.T)[:, None]
    ahead = ahead / np.where(size > 0, size, np.nan)
    left = np.stack([ahead[:, 1], -ahead[:, 0]] if y_down else [-ahead[:, 1], ahead[:, 0]], axis=1)
    frame = np.stack([ahead, left], axis=1)
    body = {
        side: np.einsum("nij,nkj->nki", frame, of(*names.of(side)) - axis[:, 1:])
        for side in names.sides
    }
    _exchange(track, body, counts)
    for side, values in body.items():
        _drop_outliers(params, values, width, counts)
        body[side] = running_median(bridged(values, longest, counts), width)
    places = {s: np.einsum("nij,nki->nkj", frame, v) + axis[:, 1:] for s, v in body.items()}
    outwards = {s: v * (1.0, 1.0 if s == "left" else -1.0) for s, v in body.items()}
    contact = {side: _whole(track, values) for side, values in track.contact.items()}
    empty = tuple(name for name, values in points.items() if np.isnan(values).all())
    return Antennae(track, rate, outwards, places, contact, Handled(**counts), empty)


def _refuse_far_apart(track: Track) -> None:
    """Every frame from first to last has a row, so one wrong number would fill the memory."""
    first, last, rows = int(track.frames[0]), int(track.frames[-1]), len(track.frames)
    if last - first >= max(_SHORT, _MOST_ABSENT * rows):
        raise BadInputError(
            f"{track.file}: expected frames without large gaps, found {rows} rows from frame "
            f"{first} to {last}; are these numbers of frames, and not times or labels?"
        )


def _whole(track: Track, values: Floats) -> Floats:
    """Values with one for each frame from first to last, the first of those that stand twice."""
    whole = np.full((int(track.frames[-1] - track.frames[0]) + 1, *values.shape[1:]), np.nan)
    first = np.concatenate([[True], np.diff(track.frames) > 0])
    whole[track.frames[first] - track.frames[0]] = values[first]
    return whole


def frames_of(time: float, rate: float) -> int:
    """Odd number of frames in a time [s]; below three it is one."""
    whole = round(time * rate)
    return whole - 1 + whole % 2 if whole >= 3 else 1


def _each_frame_once(
    params: CleaningParams, track: Track, counts: dict[str, int]
) -> dict[str, Floats]:
    """Points with a row for each frame from first to last; what is not known is NaN."""
    first = np.concatenate([[True], np.diff(track.frames) > 0])
    cutoff = track.cutoff if params.likelihood is None else params.likelihood
    counts["unsorted"] = track.unsorted
    counts["duplicated"] = int((~first).sum()) + track.replaced
    counts["absent"] = int(track.frames[-1] - track.frames[0] + 1 - first.sum())
    points: dict[str, Floats] = {}
    for name, raw in track.points.items():
        values = raw.astype(np.float64)
        missing = np.asarray(~np.isfinite(values).all(axis=1))
        low = np.zeros(len(raw), bool)
        if name in track.scores:
            low = ~missing & ~(track.scores[name] >= cutoff)
        counts["missing"] += int(missing[first].sum())
        counts["low_likelihood"] += int(low[first].sum())
        values[missing | low] = np.nan
        points[name] = _whole(track, values)
    joined = np.hstack(list(points.values()))
    counts["still"] = int((np.diff(joined, axis=0) == 0).all(axis=1).sum())
    return points


def _exchange(track: Track, body: dict[str, Floats], counts: dict[str, int]) -> None:
    """Put antennae whose sides were exchanged back, frame by frame.

    They are if the left antenna lies on the right of the other in more than half of the points.
    Antennae that spring from one point may cross: then their tips have to be nearer to those of
    the last frame as well.
    """
    if set(body) != {"left", "right"}:
        _refuse_each_across(track, body)
        return
    left, right = body["left"], body["right"]
    apart = left[..., 1] - right[..., 1]
    own_base = bool((abs(apart[:, 0]) > 0).any())
    order = np.sort(apart if own_base else apart[:, 1:], axis=1)
    order = order[:, order.shape[1] // 2]
    wrong = order < 0
    if np.isfinite(order).sum() < _FRAMES_TO_JUDGE:
        _refuse_each_across(track, body)
    _refuse_mirrored(track, wrong, np.isfinite(order), _MOST_EXCHANGED)
    if not own_base:
        wrong = _nearer_if_exchanged(left[:, -1], right[:, -1], wrong)
    counts["swapped"] = int(wrong.sum())
    left[wrong], right[wrong] = right[wrong], left[wrong].copy()


def _refuse_each_across(track: Track, body: dict[str, Floats]) -> None:
    """Judge each antenna alone, where there is no other one to compare it with."""
    for side, values in body.items():
        ahead, out = (values[:, -1] - values[:, 0]).T
        across = (-out if side == "left" else out) > _CLEARLY * np.hypot(ahead, out)
        _refuse_mirrored(track, across, np.isfinite(out), _MOST_ACROSS)


def _refuse_mirrored(track: Track, wrong: Bools, known: Bools, most: float) -> None:
    if known.sum() >= _FRAMES_TO_JUDGE and wrong.sum() > most * known.sum():
        raise BadInputError(
            f"{track.file}: expected left antennae on the left of the body axis, found "
            f"{100 * wrong.sum() / known.sum():.0f} % on the right; does y point up (--no-y-down) "
            "or down (--y-down), and which is --points.head?"
        )


def _nearer_if_exchanged(left: Floats, right: Floats, wrong: Bools) -> Bools:
    """Which frames, among the wrong ones, fit the last known tips better if exchanged."""
    nearer = np.zeros(len(wrong), bool)
    last: tuple[Floats, Floats] | None = None
    for i in np.flatnonzero(np.isfinite(left).all(axis=1) & np.isfinite(right).all(axis=1)):
        now = left[i], right[i]
        if last is not None and wrong[i]:
            as_is = np.hypot(*(now[0] - last[0])) + np.hypot(*(now[1] - last[1]))
            exchanged = np.hypot(*(now[1] - last[0])) + np.hypot(*(now[0] - last[1]))
            nearer[i] = exchanged < as_is
        last = (now[1], now[0]) if nearer[i] else now
    return nearer


def _drop_outliers(
    params: CleaningParams, points: Floats, width: int, counts: dict[str, int]
) -> None:
    """Make points NaN that lie far from their running median, and tips of too long antennae."""
    lengths = np.hypot(*np.diff(points, axis=1).transpose(2, 0, 1)).sum(axis=1)
    if not np.isfinite(lengths).any():
        return
    usual = float(np.nanmedian(lengths))
    if width > 1:
        off = points - running_median(points, width)
        wrong = np.hypot(off[..., 0], off[..., 1]) > params.jump * usual
        counts["outliers"] += int(wrong.sum())
        points[wrong] = np.nan
        lengths = np.hypot(*np.diff(points, axis=1).transpose(2, 0, 1)).sum(axis=1)
    long = lengths > (1.0 + params.stretch) * usual
    counts["outliers"] += int(long.sum())
    points[long, -1] = np.nan


def bridged(points: Floats, longest: int, counts: dict[str, int]) -> Floats:
    """Points (n, k, 2) with gaps of at most `longest` frames filled by straight lines."""
    filled = points.copy()
    for k in range(points.shape[1]):
        known = np.flatnonzero(np.isfinite(points[:, k]).all(axis=1))
        for a, b in itertools.pairwise(known):
            if 1 < b - a <= longest + 1:
                share = np.arange(1, b - a)[:, None] / (b - a)
                filled[a + 1 : b, k] = (1 - share) * points[a, k] + share * points[b, k]
                counts["bridged"] += int(b - a - 1)
    return filled


def running_median(points: Floats, width: int) -> Floats:
    """Median over `width` frames around each, of those that are known; NaN stays NaN.

    Args:
        points: Shape (n, k, 2).
        width: An odd number of frames; 1 changes nothing.
    """
    if width < 3 or len(points) < width:
        return points
    half = width // 2
    padded = np.concatenate([np.full((half, *points.shape[1:]), np.nan), points])
    padded = np.concatenate([padded, np.full((half, *points.shape[1:]), np.nan)])
    windows = np.sort(np.lib.stride_tricks.sliding_window_view(padded, width, axis=0), axis=-1)
    known: Ints = np.isfinite(windows).sum(axis=-1)
    low = np.maximum(known - 1, 0) // 2
    pair = [np.take_along_axis(windows, at[..., None], -1)[..., 0] for at in (low, known // 2)]
    odd = known % 2 == 1
    median = np.where(odd, pair[0], (pair[0] + pair[1]) / 2.0)
    return np.where(np.isfinite(points), median, np.nan)
