"""One look for every figure: fonts, colours, axes, and bytes that depend on the data alone.

matplotlib takes long to import, so a function imports it when it draws.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from antennate import checks
from antennate.jackknife import ENOUGH as ENOUGH_TRIALS
from antennate.types import Maneuver

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

P = ParamSpec("P")
R = TypeVar("R")

Keys = tuple[str, str]

MANEUVER_COLOURS = {
    Maneuver.FORWARD: "#0072B2",
    Maneuver.TURN_L: "#009E73",
    Maneuver.TURN_R: "#E69F00",
    Maneuver.REVERSE: "#D55E00",
    Maneuver.HOLD: "#000000",
}
"""After Okabe and Ito: apart for every kind of colour vision."""

MANEUVER_NAMES = {
    Maneuver.FORWARD: "forward",
    Maneuver.TURN_L: "turn left",
    Maneuver.TURN_R: "turn right",
    Maneuver.REVERSE: "reverse",
    Maneuver.HOLD: "hold",
}
SERIES = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9", "#332288")
"""For whatever has no colour of its own; after Okabe and Ito."""

WIDTH = 4.5
"""Width of a figure [inches]: panels stand below one another, so that a phone shows its letters."""

INK, MUTED, FAINT = "#222222", "#6E6E6E", "#D5D5D5"
"""Text and robots; secondary lines; things in the background."""

PROFILE_LOOKS = {
    "stiff": ("#0072B2", "o", "solid"),
    "descending": ("#D55E00", "s", (0, (5, 1.5))),
    "compliant": ("#009E73", "^", (0, (4, 1.5, 1, 1.5))),
    "matched_uniform": ("#CC79A7", "D", (0, (1, 1.2))),
    "ascending": ("#E69F00", "v", (0, (6, 1, 1, 1, 1, 1))),
}
"""Colour, marker and line of each profile: apart in grey, too."""

SHAPE_COLOURS = {
    "forward": "#0072B2",
    "backward": "#D55E00",
    "straight": "#F0E442",
    "transition": "#000000",
    "free": "#DDDDDD",
}
"""Shapes of an antenna that touches, and no contact."""

_SMALL_DPI, _COLOURS = 120, 256
"""Pixels an inch and colours of a thumbnail."""

_RC: dict[Any, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 200,
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ECECEC",
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "svg.fonttype": "path",
    "svg.hashsalt": "antennate",
}
_THEIRS = frozenset({"backend", "backend_fallback", "interactive", "toolbar", "webagg.port"})
"""Settings that say where figures are shown, not how."""


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Let a function draw in this look."""

    @functools.wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        import matplotlib as mpl

        with mpl.rc_context({**_changed(), **_RC}):
            return draw(*args, **kwargs)

    return inside


def _changed() -> dict[Any, Any]:
    """What the user's own settings of matplotlib have changed, as it is by default."""
    import matplotlib as mpl

    now, default = dict(dict.items(mpl.rcParams)), dict.items(mpl.rcParamsDefault)
    return {key: v for key, v in default if key not in _THEIRS and now[key] != v}


def plain(names: Mapping[str, str]) -> dict[str, str]:
    """Names as matplotlib writes them: `$` begins a formula there, `_` what no legend shows."""
    escaped = {key: name.replace("$", r"\$") for key, name in names.items()}
    return {key: f" {name}" if name[:1] == "_" else name for key, name in escaped.items()}


def series(count: int) -> list[str]:
    """As many colours, the first ones first; they repeat after seven."""
    return [SERIES[i % len(SERIES)] for i in range(count)]


@functools.cache
def font(size: int) -> Any:
    """The letters of our figures for Pillow, of a height [pixels]."""
    from matplotlib.font_manager import findfont
    from PIL import ImageFont

    return ImageFont.truetype(findfont(_RC["font.family"]), size)


def canvas(width: float, height: float) -> Figure:
    """An empty figure of this size [inches] whose parts keep clear of one another."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def above(figure: Figure) -> dict[str, Any]:
    """Place of a bar of colours: above all panels, near the first title."""
    return {"location": "top", "aspect": 40, "pad": 0.12 / figure.get_figheight()}


def categories(panel: Axes, labels: Sequence[str]) -> None:
    """Let x = 0, 1, 2, ... be categories of these names."""
    panel.set_xticks(range(len(labels)), labels)
    panel.set_xlim(-0.6, len(labels) - 0.4)
    panel.grid(visible=False, axis="x")


def interval_note(trials: int) -> str:
    """What a title says of intervals, or why there are none."""
    return "95 %" if trials >= ENOUGH_TRIALS else f"no intervals below {ENOUGH_TRIALS} trials"


def intervals(
    panel: Axes,
    x: Sequence[float],
    rows: Sequence[Any],
    keys: Keys,
    trials: int = ENOUGH_TRIALS,
    **look: Any,
) -> None:
    """Draw a measure of each row at x with its interval; what does not exist is left out.

    Args:
        panel: Where to draw.
        x: A place for each row.
        rows: Parts of a result, or mappings.
        keys: Names of the measure and of its interval in a row; empty for no interval.
        trials: Trials behind each row; without `ENOUGH_TRIALS` of them no interval is drawn.
        look: Colour, marker and label, as for `plot`.
    """
    value, interval = keys
    interval = interval if trials >= ENOUGH_TRIALS else ""
    known = [(a, _of(row, value), _of(row, interval)) for a, row in zip(x, rows, strict=True)]
    known = [(a, b, ends or (b, b)) for a, b, ends in known if b is not None and b == b]
    middle = np.array([b for _, b, _ in known])
    ends = np.array([ends for *_, ends in known], float).reshape(-1, 2)
    low, high = np.where(np.isfinite(ends).all(axis=1), ends.T, middle)
    whiskers = np.maximum(0.0, [middle - low, high - middle])
    look = {"markersize": 5, "linestyle": "", "capsize": 2.5, "elinewidth": 1.2, **look}
    panel.errorbar([a for a, *_ in known], middle, yerr=whiskers, **look)


def _of(row: Any, name: str) -> Any:
    return row.get(name) if isinstance(row, Mapping) else getattr(row, name, None)


@styled
def render(figure: Figure) -> dict[str, bytes]:
    """The figure as svg and png: the same bytes for the same data."""
    from matplotlib.figure import Figure

    checks.instance("figure", figure, Figure)
    _settle(figure)
    files = {}
    for suffix, metadata in (("svg", {"Date": None}), ("png", {})):
        file = io.BytesIO()
        figure.savefig(file, format=suffix, metadata=metadata, facecolor="white")
        files[suffix] = file.getvalue()
    return files


@styled
def thumbnail(figure: Figure) -> bytes:
    """The figure as a small png of few colours, for a page that holds many."""
    from PIL import Image

    _settle(figure)
    large, small = io.BytesIO(), io.BytesIO()
    figure.savefig(large, format="png", dpi=_SMALL_DPI, facecolor="white")
    Image.open(large).convert("RGB").quantize(_COLOURS).save(small, "png", optimize=True)
    return small.getvalue()


def _settle(figure: Figure) -> None:
    """Lay the figure out once and round the result: the solver's last digits are not repeatable."""
    from matplotlib.layout_engine import PlaceHolderLayoutEngine
    from matplotlib.transforms import Bbox

    if isinstance(figure.get_layout_engine(), PlaceHolderLayoutEngine):
        return
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for panel in figure.axes:
        left, low, right, high = (round(x, 4) for x in panel.get_position(original=True).extents)
        panel.set_position(Bbox.from_extents(left, low, right, high))


def called(maneuver: int) -> str:
    """A maneuver in words; a number that is none of ours, as a controller may say, stays one."""
    return MANEUVER_NAMES[Maneuver(maneuver)] if maneuver in set(Maneuver) else str(maneuver)


def rgba(colour: str) -> tuple[float, float, float, float]:
    """Red, green, blue and opacity of `#RRGGBB`, 0 to 1."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue, 1.0
