"""Figure of a log or its replay: what was read, felt and decided, over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from antennate import figures as style
from antennate.telemetry.reader import LogReader
from antennate.types import Contact, Floats, Ints, Maneuver

if TYPE_CHECKING:
    from antennate.telemetry.mocap import Poses

_MOST_DRAWN = 5000
"""Most ticks that a figure shows."""
_PAUSE = 1.0
"""Time without a tick that a figure leaves empty [s] (assumed: a hundred ticks)."""
_LARGEST = 1e100
"""Largest number that it shows; an axis of larger ones overflows."""
_NOTHING = -9
"""A code that has no colour."""
_SIDES = ("left", "right")
_STATES = {
    "OK": "#BFE3B4",
    "DEGRADED": "#F0E442",
    "HOLD": "#56B4E9",
    "FAULT": "#882255",
    "OFF": style.FAINT,
}
_CONTACTS: dict[int, str] = {Contact.CONTACT: style.INK, Contact.UNKNOWN: "#CC79A7"}
_MANEUVERS: dict[int, str] = {int(m): colour for m, colour in style.MANEUVER_COLOURS.items()}

_BESIDE_THE_TITLE: dict[str, Any] = {
    "loc": "lower right",
    "bbox_to_anchor": (1.0, 1.0),
    "borderaxespad": 0.0,
    "ncols": 2,
}
"""Place of a short legend, above its panel."""
_COLUMNS = 4
"""Columns of a long legend, below all panels."""


@dataclass(frozen=True, slots=True)
class Course:
    """A drive, tick by tick.

    Attributes:
        t: The loop's time [s], shape (n,).
        reading: Readings of the board [counts], shape (n, 2).
        level: Bending levels, shape (n, 2).
        contact: `Contact`, shape (n, 2).
        recorded: `Maneuver` decided then, shape (n,).
        replayed: `Maneuver` decided now, shape (n,); None without a replay.
        state: The supervisor's, n of them; empty text without one.
        threshold: Level from which on there is contact; NaN if it is not known.
        pitch: Commanded pitch joints, head first [rad], shape (n, P); P is 0 without them.
        elevation: Commanded elevations of the antennae [rad], shape (n, 2), (n, 0) without them.
    """

    t: Floats
    reading: Floats
    level: Floats
    contact: Ints
    recorded: Ints
    replayed: Ints | None
    state: Sequence[str]
    threshold: float
    pitch: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    elevation: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def of(cls, log: LogReader, count: int, replayed: Sequence[int] | None = None) -> Course:
        """Every tick of a short log, some of a long one.

        Args:
            log: The log, not empty.
            count: Ticks in it.
            replayed: `Maneuver` decided now, one a tick; None without a replay.
        """
        step = -(-count // _MOST_DRAWN)
        ticks = list(islice(log, 0, None, step))
        robot = log.header.robot
        angles = _drawable([tick.angles for tick in ticks])
        return cls(
            t=_drawable([tick.now for tick in ticks]),
            reading=_drawable([tick.reading for tick in ticks]),
            level=_drawable([tick.level for tick in ticks]),
            contact=np.array([tick.contact for tick in ticks]),
            recorded=np.array([tick.maneuver for tick in ticks]),
            replayed=None if replayed is None else np.array(replayed[::step]),
            state=[tick.state for tick in ticks],
            threshold=log.header.params.rule.threshold,
            pitch=angles[:, robot.places("pitch")],
            elevation=angles[:, robot.places("elevation")],
        )


def _with_pauses(course: Course) -> Course:
    """The course with a tick of which nothing is known at the begin of each pause."""
    step = np.diff(course.t)
    usual = float(np.median(step)) if step.size else 0.0
    after = np.flatnonzero(step > max(_PAUSE, 3.0 * usual)) + 1

    def cut(values: Any, nothing: float | str) -> Any:
        return np.insert(np.asarray(values), after, nothing, axis=0)

    begins = {"t": np.insert(course.t, after, course.t[after - 1] + usual)}
    numbers = ("reading", "level", "pitch", "elevation")
    known = [name for name in numbers if len(getattr(course, name))]
    empty = {name: cut(getattr(course, name), math.nan) for name in known}
    codes = ("contact", "recorded", "replayed")
    decided = [name for name in codes if getattr(course, name) is not None]
    none = {name: cut(getattr(course, name), _NOTHING) for name in decided}
    states = cut(np.array(course.state, object), "").tolist()
    return replace(course, **begins, **empty, **none, state=states)


def of_arrays(
    t: Floats, reading: Floats, level: Floats, contact: Ints, maneuver: Ints, threshold: float
) -> Figure:
    """The figure of one tick or more; arrays as in `Course`, of a long series some ticks."""
    shown = slice(None, None, -(-len(t) // _MOST_DRAWN))
    return replay(
        Course(
            *(_drawable(values[shown]) for values in (t, reading, level)),
            contact=contact[shown],
            recorded=maneuver[shown],
            replayed=None,
            state=[""] * len(t[shown]),
            threshold=threshold,
        )
    )


def _drawable(values: Floats | Sequence[float] | Sequence[tuple[float, ...]]) -> Floats:
    """Numbers as they are, NaN for those that no axis can show."""
    numbers = np.array(values)
    return np.where(np.abs(numbers) <= _LARGEST, numbers, np.nan)


def drawn(path: Path) -> tuple[LogReader, Figure]:
    """A log as it was read, and its figure."""
    with LogReader(path) as log:
        log.survey()
        log.require_ticks()
        count = log.ticks
    with LogReader(path) as log:
        course = Course.of(log, count)
        log.require_ticks()
        return log, replay(course)


@style.styled
def replay(course: Course) -> Figure:
    """Panels over one time, of what is known: a twin does not know what its client decides."""
    parts: list[tuple[float, Callable[[Axes, Course], None]]] = [(3.0, _draw_readings)]
    if np.isfinite(course.level).any():
        parts.append((3.0, _draw_levels))
    if (course.contact != Contact.UNKNOWN).any():
        parts.append((1.2, _draw_contact))
    if course.pitch.size or course.elevation.size:
        parts.append((3.0, _draw_raised))
    if any(course.state) or (course.recorded >= 0).any() or course.replayed is not None:
        parts.append((1.8, _draw_decisions))
    heights = [height for height, _ in parts]
    figure = style.canvas(style.WIDTH, 1.0 + 0.75 * sum(heights))
    panels = figure.subplots(len(parts), 1, sharex=True, height_ratios=heights, squeeze=False)
    shown = _with_pauses(course)
    for panel, (_, draw) in zip(panels[:, 0], parts, strict=True):
        draw(panel, shown)
    panels[-1, 0].set(xlabel="time of the loop [s]")
    return figure


@style.styled
def path_of(poses: Poses) -> Figure:
    """The path by motion capture, with the true one of a simulation, and yaw rates of both."""
    from antennate.telemetry.mocap.clock import SPAN, turns  # slow to import

    figure, true = style.canvas(style.WIDTH, 6.0), poses.beside()
    path, rates = figure.subplots(2, 1, height_ratios=[2, 1])
    measured, logged = style.series(1)[0], style.INK
    if true is not None:
        places = true.places
        path.plot(places.real, places.imag, color=style.FAINT, linewidth=4, label="simulated")
    path.plot(poses.x, poses.y, color=measured, linewidth=1, label="measured")
    path.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="Path")
    path.legend(**_BESIDE_THE_TITLE)
    t = np.linspace(poses.t[0], poses.t[-1], _MOST_DRAWN)
    for course, name, colour in (
        ((poses.log.t, poses.log.turned), poses.log.source, logged),
        ((poses.t, poses.heading), "table", measured),
    ):
        rate = np.degrees(turns(course, t)) / SPAN
        rates.plot(t, rate, color=colour, linewidth=0.8, label=name)
    rates.set(xlabel="time of the loop [s]", ylabel="[°/s]", title="Yaw rate")
    rates.legend(**_BESIDE_THE_TITLE)
    return figure


def _draw_readings(panel: Axes, course: Course) -> None:
    for side, (name, colour) in enumerate(zip(_SIDES, style.series(2), strict=True)):
        panel.plot(course.t, course.reading[:, side], color=colour, linewidth=1, label=name)
    panel.set(ylabel="reading [counts]", title="Readings")
    panel.legend(**_BESIDE_THE_TITLE)


def _draw_levels(panel: Axes, course: Course) -> None:
    for side, colour in enumerate(style.series(2)):
        panel.plot(course.t, course.level[:, side], color=colour, linewidth=1)
    if math.isfinite(course.threshold):
        at = (1.005, course.threshold)
        panel.axhline(course.threshold, color=style.INK, linestyle=":", linewidth=1)
        panel.annotate("θ", at, xycoords=("axes fraction", "data"), va="center")
    panel.set(ylabel="b", ylim=(-0.05, 1.05), title="Bending level")


def _draw_contact(panel: Axes, course: Course) -> None:
    for side in range(len(_SIDES)):
        colours = [_CONTACTS.get(value) for value in course.contact[:, side].tolist()]
        _band(panel, course.t, colours, 1 - side)
    panel.set(yticks=[1, 0], yticklabels=_SIDES, ylim=(-0.6, 1.6), title="Contact")
    contacts = {Contact(kind).name.lower(): colour for kind, colour in _CONTACTS.items()}
    panel.legend(handles=_patches(contacts), **_BESIDE_THE_TITLE)
    panel.grid(visible=False)


def _draw_raised(panel: Axes, course: Course) -> None:
    for joint, angles in enumerate(np.degrees(course.pitch.T)):
        shade = style.INK if joint == 0 else style.MUTED
        name = {0: "first joint", 1: "others"}.get(joint)
        panel.plot(course.t, angles, color=shade, linewidth=1.2 if joint == 0 else 0.6, label=name)
    for side, angles in enumerate(np.degrees(course.elevation.T)):
        name = None if side else "antennae"
        panel.plot(course.t, angles, color=style.series(3)[2], linewidth=1, label=name)
    panel.set(ylabel="up [°]", title="Raised")
    panel.legend(**{**_BESIDE_THE_TITLE, "ncols": 3}, handlelength=1.2, columnspacing=1.0)


def _draw_decisions(panel: Axes, course: Course) -> None:
    rows = {"recorded": course.recorded, "replayed": course.replayed}
    shown = {name: values for name, values in rows.items() if values is not None}
    bands = {
        name: [_MANEUVERS.get(value) for value in values.tolist()] for name, values in shown.items()
    }
    if any(course.state):
        bands["supervisor"] = [_STATES.get(state) for state in course.state]
    for height, colours in enumerate(reversed(bands.values())):
        _band(panel, course.t, colours, height)
    panel.set(
        title="Maneuver and supervisor" if "supervisor" in bands else "Maneuver",
        yticks=[*reversed(range(len(bands)))],
        yticklabels=[*bands],
        ylim=(-0.6, len(bands) - 0.4),
    )
    seen = {value for values in shown.values() for value in values.tolist()}
    key = {style.MANEUVER_NAMES[m]: style.MANEUVER_COLOURS[m] for m in Maneuver if m in seen}
    key |= {name: _STATES[name] for name in _STATES if name in course.state}
    panel.figure.legend(handles=_patches(key), loc="outside lower center", ncols=_COLUMNS)
    panel.grid(visible=False)


def _band(panel: Axes, t: Floats, colours: Iterable[str | None], height: float) -> None:
    """Stretches of one colour beside one another; none where there is no colour."""
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    ends = np.append(t[1:], t[-1:] + step)
    for colour, run in groupby(enumerate(colours), key=lambda pair: pair[1]):
        at = [i for i, _ in run]
        if colour is not None:
            span = (float(t[at[0]]), float(ends[at[-1]] - t[at[0]]))
            panel.broken_barh([span], (height - 0.4, 0.8), color=colour, linewidth=0)


def _patches(colours: dict[str, str]) -> list[Patch]:
    return [Patch(color=colour, label=name) for name, colour in colours.items()]
