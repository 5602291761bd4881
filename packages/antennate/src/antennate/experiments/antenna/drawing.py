"""The drawing of an antenna: from the side and from above, to scale, with its dimensions in mm."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.patches import Circle, Rectangle

from antennate import figures as style
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.result import overlap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SENSOR = style.SERIES[1]
_MOST_NAMED = 12
"""Most springs that are named one by one; the table of springs has them all."""
_ROOM = 4.0
"""Room between a view and its dimensions, and from one dimension to the next [mm]."""
_LETTERS = 7


def drawing(config: AntennaConfig) -> Figure:
    """Both views: the hinges turn in the plane of the one from above."""
    antenna = config.antenna
    length, thick = 1e3 * antenna.length, 2e3 * antenna.radius
    bodies = [config.wire_mm * (turns + 1.0) for turns in antenna.active_coils]
    high = max(*bodies, thick, config.coil_mm + config.wire_mm)
    side = high + 5.0 * _ROOM
    bottom, top = -high / 2 - 3.5 * _ROOM, side + high / 2 + 5.5 * _ROOM
    wide = 7.0
    figure = style.canvas(wide, wide * (top - bottom) / (length + 2.0 * _ROOM))
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set(xlim=(-_ROOM, length + _ROOM), ylim=(bottom, top))
    _chain(axes, config, 0.0, None)
    _chain(axes, config, side, bodies)
    ends = [i * 1e3 * antenna.link_length for i in range(antenna.hinges + 1)]
    named = antenna.active_coils if antenna.hinges <= _MOST_NAMED else ()
    for at, turns, tall in zip(ends, named, bodies, strict=False):
        axes.text(at, side + high / 2 + _ROOM, f"{turns:g} coils\n{tall:.1f} tall", **_CENTRED)
    _dimension(axes, ends[0], ends[1], -high / 2 - _ROOM, f"{ends[1]:.1f}")
    _dimension(axes, 0.0, length, -high / 2 - 2.5 * _ROOM, f"{length:.1f}")
    sensed = min(1e3 * antenna.sensor.active_length, length)
    _dimension(axes, 0.0, sensed, side - high / 2 - _ROOM, f"flex sensor {sensed:.1f}", _SENSOR)
    coil = f"wire {config.wire_mm:g}, coils {config.coil_mm:g} in the middle"
    title = f"from the side; links {thick:g} thick; {coil} [mm]"
    axes.text(0.0, side + high / 2 + 4.0 * _ROOM, title, fontsize=_LETTERS + 1)
    plane = "from above: the plane in which it bends"
    plane += overlap(config.coil_mm + config.wire_mm, ends[1])
    axes.text(0.0, high / 2 + 0.5 * _ROOM, plane, fontsize=8)
    return figure


_CENTRED = {"ha": "center", "va": "center", "fontsize": _LETTERS}


def _chain(axes: Axes, config: AntennaConfig, y: float, bodies: list[float] | None) -> None:
    """Links and springs of a view: from above, or from the side with these heights of the coils."""
    antenna = config.antenna
    length, thick = 1e3 * antenna.link_length, 2e3 * antenna.radius
    outer = config.coil_mm + config.wire_mm
    for i in range(antenna.hinges):
        at = i * length
        edge = {"edgecolor": style.INK, "linewidth": 0.8}
        axes.add_patch(Rectangle((at, y - thick / 2), length, thick, facecolor="white", **edge))
        if bodies is None:
            axes.add_patch(Circle((at, y), outer / 2, facecolor=style.FAINT, **edge))
            axes.plot(at, y, color=style.INK, marker="+", markersize=4)
        else:
            place = at - outer / 2, y - bodies[i] / 2
            axes.add_patch(Rectangle(place, outer, bodies[i], facecolor=style.FAINT, **edge))
    sensed = min(1e3 * antenna.sensor.active_length, 1e3 * antenna.length)
    if bodies is not None:
        axes.plot([0.0, sensed], [y, y], color=_SENSOR, linewidth=1.6)


def _dimension(
    axes: Axes, begin: float, end: float, y: float, text: str, colour: str = style.INK
) -> None:
    """A line with arrows at both ends, and its length."""
    arrow = {"arrowstyle": "<->", "color": colour, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (end, y), (begin, y), arrowprops=arrow)
    axes.text((begin + end) / 2, y - 0.3 * _ROOM, text, color=colour, ha="center", va="top",
              fontsize=_LETTERS)  # fmt: skip
