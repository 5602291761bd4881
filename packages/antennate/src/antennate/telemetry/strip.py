"""The strip below a film: what was read and decided, over the last seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.figures import FAINT, INK, MUTED, SERIES, font
from antennate.types import Floats, Ints

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

WINDOW = 10.0
"""Time that charts show, or the whole of a shorter film [s]."""
_FINE = 2
"""Drawn so many times larger, then made smaller: smooth lines."""
_TEXT, _ROW, _EDGE = 13, 20, 10
"""Height of letters and of a row of text, and free space at the sides [pixels]."""
_SMALL = 11
"""Height of the numbers of an axis [pixels]."""
_LEAST_ROOM = 24
"""Least room for those numbers, left of the chart [pixels]."""
_WORD = 20
"""Height of the letters of a word on the outcome, in a picture of 900 pixels [pixels]."""
_SIDES = ("L ", "R ")
"""What stands before the newest values of two lines."""


@dataclass(frozen=True, slots=True)
class Trace:
    """A chart of one line or two, left before right.

    Attributes:
        label: What it shows, with its unit.
        values: Shape (n, lines); NaN is a gap.
        low, high: Ends of the axis.
        form: Format of the newest value.
        mark: A level that is drawn across, None for none.
        mark_label: What that is.
    """

    label: str
    values: Floats
    low: float
    high: float
    form: str = ".2f"
    mark: float | None = None
    mark_label: str = ""


@dataclass(frozen=True, slots=True)
class Band:
    """A row of states over time.

    Attributes:
        label: What it shows.
        states: Shape (n,).
        looks: Name and colour of each state; one that is missing is left white.
    """

    label: str
    states: Ints
    looks: Mapping[int, tuple[str, str]]


class Strip:
    """Draws the strip of any frame of a film.

    Args:
        title: Of the film.
        t: Times of the frames [s], shape (n,).
        traces: Charts from left to right.
        bands: States, below one another, right of the charts.
        width, height: Its size [pixels].
    """

    def __init__(
        self,
        title: str,
        t: Floats,
        traces: Sequence[Trace],
        bands: Sequence[Band],
        width: int,
        height: int,
    ) -> None:
        self._title, self._t, self._traces, self._bands = title, t, traces, bands
        self._window = min(WINDOW, float(t[-1] - t[0])) or WINDOW
        self._size = (_FINE * width, _FINE * height)
        self._column = self._size[0] / (len(traces) + 1)

    def picture(self, frame: int) -> Any:
        """The strip of one frame, an image of Pillow."""
        from PIL import Image, ImageDraw

        image = Image.new("RGB", self._size, "white")
        draw = ImageDraw.Draw(image)
        draw.fontmode = "L"
        first = int(np.searchsorted(self._t, self._t[frame] - self._window))
        for i, trace in enumerate(self._traces):
            self._draw_trace(draw, trace, i * self._column, first, frame)
        self._draw_words(draw, len(self._traces) * self._column, first, frame)
        return image.reduce(_FINE)

    def _x(self, left: float, right: float, first: int, frame: int) -> Floats:
        """Where times are drawn: now at the right end."""
        age = self._t[frame] - self._t[first : frame + 1]
        return right - age / self._window * (right - left)

    def _draw_trace(
        self, draw: ImageDraw, trace: Trace, start: float, first: int, frame: int
    ) -> None:
        text, row, edge = (_FINE * size for size in (_TEXT, _ROW, _EDGE))
        left, right = start + edge, start + self._column - edge
        top, low = 1.6 * row, self._size[1] - 0.3 * edge - 1.2 * _FINE * _SMALL
        type_ = font(text)
        draw.text((left, row / 3), trace.label, INK, type_)
        left += _room(draw, trace)
        x = right
        colours = SERIES[: trace.values.shape[1]]
        sides = _SIDES if len(colours) == len(_SIDES) else ("",) * len(colours)
        for value, colour, side in reversed(
            list(zip(trace.values[frame], colours, sides, strict=True))
        ):
            words = side + (f"{value:{trace.form}}" if np.isfinite(value) else "-")
            x -= draw.textlength(words, type_) + edge
            draw.text((x + edge, row / 3), words, colour, type_)
        draw.rectangle((left, top, right, low), outline=FAINT, width=_FINE)

        def y(value: Any) -> Any:
            share = (np.clip(value, trace.low, trace.high) - trace.low) / (trace.high - trace.low)
            return low - share * (low - top)

        if trace.mark is not None:
            at = float(y(trace.mark))
            draw.line((left, at, right, at), MUTED, _FINE)
        across = self._x(left, right, first, frame)
        for k, colour in enumerate(colours):
            height = y(trace.values[first : frame + 1, k])
            finite = np.isfinite(height)
            points = np.stack([across[finite], height[finite]], axis=1).ravel().tolist()
            if len(points) >= 4:
                draw.line(points, colour, _FINE + 1, joint="curve")
        self._draw_ends(draw, trace, (left, top, right, low))

    def _draw_ends(
        self, draw: ImageDraw, trace: Trace, frame: tuple[float, float, float, float]
    ) -> None:
        """The numbers at the ends of both axes, and what the mark is, beside the curves."""
        left, top, right, low = frame
        height = _FINE * _SMALL
        small, beside = font(height), left - 3 * _FINE
        for y, value, anchor in ((top, trace.high, "ra"), (low, trace.low, "rd")):
            draw.text((beside, y), f"{value:{trace.form}}", MUTED, small, anchor)
        if trace.mark is not None:
            share = (trace.mark - trace.low) / (trace.high - trace.low)
            at = np.clip(low - share * (low - top), top + 1.8 * height, low - 1.8 * height)
            draw.text((beside, at), trace.mark_label, MUTED, small, "rm")
        draw.text((right, low + _FINE), f"last {self._window:.3g} s", MUTED, small, "ra")

    def _draw_words(self, draw: ImageDraw, start: float, first: int, frame: int) -> None:
        """Title and time, then the bands with the names of their states."""
        text, row, edge = (_FINE * size for size in (_TEXT, _ROW, _EDGE))
        left, right = start + edge, self._size[0] - edge
        type_ = font(text)
        draw.text((left, row / 3), self._title, INK, type_)
        time = f"{self._t[frame]:.{1 if self._window > 2.0 else 2}f} s"
        draw.text((right - draw.textlength(time, type_), row / 3), time, INK, type_)
        room = (self._size[1] - 1.6 * row) / max(1, len(self._bands))
        for i, band in enumerate(self._bands):
            top = 1.6 * row + i * room
            name, _ = band.looks.get(int(band.states[frame]), ("-", ""))
            draw.text((left, top), f"{band.label}: ", MUTED, type_)
            words = draw.textlength(f"{band.label}: ", type_)
            draw.text((left + words, top), name, INK, type_)
            x = self._x(left, right, first, frame)
            ends = [*x[1:].tolist(), right]
            for a, b, state in zip(x, ends, band.states[first : frame + 1].tolist(), strict=True):
                if state in band.looks:
                    at = top + row, top + row + 0.35 * (room - row)
                    draw.rectangle((a, at[0], b, at[1]), fill=band.looks[state][1])


def _room(draw: ImageDraw, trace: Trace) -> float:
    """Room that the words beside a chart take."""
    ends = (f"{value:{trace.form}}" for value in (trace.low, trace.high))
    small = font(_FINE * _SMALL)
    widest = max(draw.textlength(words, small) for words in (*ends, trace.mark_label))
    return max(_LEAST_ROOM * _FINE, widest + 4 * _FINE)


def with_word(picture: Any, word: str) -> Any:
    """A picture of shape (height, width, 3) with a word on the outcome in it."""
    from PIL import Image, ImageDraw

    image = Image.fromarray(picture)
    draw, size = ImageDraw.Draw(image), max(_TEXT, round(_WORD * image.width / 900))
    type_, place = font(size), (image.width / 2, image.height - 1.6 * size)
    left, top, right, low = draw.textbbox(place, word, type_, "mm")
    draw.rounded_rectangle(
        (left - size, top - size / 2, right + size, low + size / 2), size / 2, "white", FAINT
    )
    draw.text(place, word, INK, type_, "mm")
    return np.asarray(image)
