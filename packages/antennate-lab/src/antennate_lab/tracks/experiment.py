"""The experiment `tracks`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from antennate import figures as style
from antennate.messages import shortened
from antennate.studies.columns import column_of, shown
from antennate.studies.experiment import Experiment
from antennate.studies.tables import Table, few
from antennate.types import Ints
from antennate_lab.tracks import measures
from antennate_lab.tracks.config import TracksConfig
from antennate_lab.tracks.measures import (
    FREE,
    MOST_BEYOND,
    NAMES,
    SHAPES,
    UNKNOWN,
    Antenna,
    Varied,
)
from antennate_lab.tracks.result import TrackRow, TracksResult
from antennate_lab.tracks.run import TracksOutcome, run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DEGREES = 180.0 / math.pi
UNITS = {
    "gap": ("lengths", 1.0),
    "angle": ("deg", _DEGREES),
    "flex": ("deg", _DEGREES),
    "offset": ("deg", _DEGREES),
    "duration": ("s", 1.0),
}
"""Unit in which a criterion is shown, and how many of it are one of the flag's."""
_MOST_TRIALS = 24
"""More are not drawn one by one."""
_LONGEST = 20.0
"""Time that is drawn [s]."""
_OUTLINES = 40
"""Outlines of each shape."""
_MARKS = dict(zip(SHAPES, ("o", "s", "^", "D"), strict=True))


def tables(result: TracksResult) -> Sequence[Table]:
    """The shapes, what depends on each criterion, and what was wrong with the tracks."""
    found = Table.of("What was found in the tracks", {"number": result})
    return _shapes(result), _varied(result), found


def _shapes(result: TracksResult) -> Table:
    """Shares of the shapes over trials."""
    trials = result.trials_in_contact
    many = "one trial" if trials == 1 else f"the mean over {trials} trials"
    notes = [f"Shares of the frames in contact, {many}."]
    if result.classified_by == "direction":
        notes.append(
            "With two points along an antenna its bend cannot be seen: forward and "
            "backward\nare the side to which it points, and straight is not known."
        )
    if _free_air(result):
        notes.append("Without a wall every frame counts as contact.")
    return Table.lines("Shapes in contact", result.shapes, note="\n".join(notes))


def _varied(result: TracksResult) -> Table:
    """The shares with one criterion changed."""
    change = column_of(Varied, "change")
    return Table(
        f"The same with each criterion {100 * result.vary:g} % less and more",
        [*SHAPES, change.title],
        [
            (
                f"{row.criterion} [{unit}] {scale * row.value:.3g}",
                [*(shown(row.share[name]) for name in SHAPES), change.cell(row)],
            )
            for row in result.sensitivity
            for unit, scale in [UNITS[row.criterion]]
        ],
    )


def _free_air(result: TracksResult) -> bool:
    """Whether no file has a wall."""
    return all(wall.kind == "none" for wall in result.wall.values())


def sentence(result: TracksResult) -> str:
    """Which shapes antennae in contact have, and how much depends on the criteria."""
    if not result.trials_in_contact:
        return f"No antenna was seen in contact{_nearest(result)}{_unseen(result)}"
    listed = ", ".join(
        f"{name} {100 * each.share:.0f} %"
        + (f" ({shown(each.share_95, '.0f', 100.0)})" if each.share_95 else "")
        for name, each in result.shapes.items()
        if each.share is not None
    )
    most = max(result.sensitivity, key=lambda row: row.change or 0.0)
    right = (
        ""
        if result.correct is None
        else f" Of frames with {result.synthetic_shapes} shapes {100 * result.correct:.1f} % are "
        "classified correctly."
    )
    so_few = few([result.trials_in_contact])
    where = "With no wall given" if _free_air(result) else "In contact"
    return (
        f"{where}: {listed} of the frames. Of all criteria the {most.criterion} matters "
        f"most: changed by {100 * result.vary:g} % it moves a share by "
        f"{100 * (most.change or 0.0):.1f} points.{right}{_beyond(result)}{_unseen(result)}"
        f"{so_few and f' {so_few}'}"
    )


def _nearest(result: TracksResult) -> str:
    """How near to a wall the antennae came."""
    near = [wall.nearest for wall in result.wall.values() if wall.nearest]
    if not near:
        return "."
    unit = "; is the wall given in the unit of the file?" if min(near) > 1 else "."
    return f": the nearest point lay {min(near):.2g} lengths of an antenna from the wall{unit}"


def _beyond(result: TracksResult) -> str:
    """Which walls many antennae reach beyond."""
    far = {name: wall.beyond for name, wall in result.wall.items() if wall.beyond}
    worst = max(far, key=lambda name: far[name], default="")
    if not worst or far[worst] <= MOST_BEYOND:
        return ""
    return (
        f" In {100 * far[worst]:.0f} % of the frames of {worst} an antenna reaches beyond the "
        "wall: is it where the file has it?"
    )


def _unseen(result: TracksResult) -> str:
    """Which animals were left out, and which antennae were hardly ever seen."""
    antennae = result.unseen
    if not antennae:
        return ""
    gone = dict.fromkeys(each.animal or each.file for each in antennae if each.left_out)
    count, skipped = result.animals + result.skipped, result.skipped
    left = f" Of {count} animals {skipped} left out: {shortened(', '.join(gone))}." if gone else ""
    first = antennae[0]
    empty = f", as {', '.join(first.empty)} never has a value" if first.empty else ""
    others = f"; {len(antennae) - 1} more in result.json" if len(antennae) > 1 else ""
    of = f" of {first.animal}" if first.animal else ""
    return (
        f"{left} The {first.side} antenna{of} in {first.file} is known in "
        f"{first.known} of {first.frames} frames{empty}{others}."
    )


@style.styled
def figures(outcome: TracksOutcome) -> dict[str, Figure]:
    """Shares by trial and over trials, outlines of each shape, an angle over time, sensitivity."""
    figure, result = style.canvas(style.WIDTH, 13.0), outcome.result()
    shares, outlines, angle, change = figure.subplots(4, 1, height_ratios=(1.2, 1.4, 0.9, 1.5))
    shapes = [measures.shapes_of(outcome.config.criteria, a) for a in outcome.antennae]
    _draw_shares(shares, outcome, result)
    _draw_outlines(outlines, outcome, shapes)
    contact = [int((frames >= 0).sum()) for frames in shapes]
    most = int(np.argmax(contact))
    _draw_angle(angle, outcome.antennae[most], shapes[most])
    _draw_change(change, result)
    handles = [
        shares.plot([], [], _MARKS.get(shape, "s"), color=colour, label=shape)[0]
        for shape, colour in style.SHAPE_COLOURS.items()
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return {"tracks": figure}


def _draw_shares(panel: Axes, outcome: TracksOutcome, result: TracksResult) -> None:
    """A bar for each trial in contact, and the mean over all with its interval."""
    table = measures.by_trial(outcome.config.criteria, outcome.antennae)
    bars = table if len(table) <= _MOST_TRIALS else table[:0]
    left = 0.0
    for at, share in enumerate(bars):
        bottom = 0.0
        for name, part in zip(SHAPES, share, strict=True):
            panel.bar(at, part, 0.85, bottom, color=style.SHAPE_COLOURS[name])
            bottom += part
        left = at + 1.6
    for k, (name, each) in enumerate(result.shapes.items()):
        style.intervals(
            panel,
            [left + k],
            [each],
            ("share", "share_95"),
            len(table),
            marker=_MARKS[name],
            color=style.SHAPE_COLOURS[name],
            markeredgecolor=style.INK,
            ecolor=style.INK,
        )
    ticks = [*range(len(bars)), left + 1.5]
    names = [str(at + 1) for at in range(len(bars))]
    panel.set_xticks(ticks, [*names, f"mean of {len(table)},\n{style.interval_note(len(table))}"])
    panel.set_ylim(-0.02, 1.02)
    panel.set_ylabel("share of frames in contact")
    panel.set_title("Shapes in contact, by trial and over trials")
    panel.grid(visible=False, axis="x")


def _draw_outlines(panel: Axes, outcome: TracksOutcome, shapes: list[Ints]) -> None:
    """Antennae as seen from above the body, ahead upwards, of one side each."""
    rng = np.random.default_rng(0)
    points = np.concatenate([antenna.points for antenna in outcome.antennae])
    joined = np.concatenate(shapes)
    for value, name in enumerate(SHAPES):
        frames = np.flatnonzero(joined == value)
        for i in rng.permutation(frames)[:_OUTLINES]:
            relative = points[i] - points[i, 0]
            panel.plot(
                relative[:, 1], relative[:, 0], color=style.SHAPE_COLOURS[name], linewidth=0.7
            )
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel("outwards / length")
    panel.set_ylabel("ahead / length")
    panel.set_title(f"Antennae in contact, up to {_OUTLINES} of each shape")


def _draw_angle(panel: Axes, antenna: Antenna, shapes: Ints) -> None:
    """Direction from base to tip over the time with most contact, coloured by shape."""
    count = min(len(shapes), round(_LONGEST * antenna.rate))
    touched = np.concatenate([[0], np.cumsum(shapes >= 0)])
    start = int(np.argmax(touched[count:] - touched[: len(touched) - count]))
    at = slice(start, start + count)
    t, angle = (
        np.arange(start, start + count) / antenna.rate,
        np.degrees(antenna.outline.direction[at]),
    )
    panel.plot(t, angle, color=style.FAINT, linewidth=0.8, zorder=1)
    for value, name in NAMES.items():
        frames = shapes[at] == value
        if value != UNKNOWN:
            colour, size = style.SHAPE_COLOURS[name], 3 if value == FREE else 7
            panel.scatter(t[frames], angle[frames], size, colour, zorder=2, linewidths=0)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("base to tip [deg]")
    panel.set_title(f"Angle from the body axis, trial {antenna.trial + 1}, {antenna.side} antenna")


def _draw_change(panel: Axes, result: TracksResult) -> None:
    """Share of every shape with each criterion less and more; equal ones stand side by side."""
    rows = result.sensitivity
    for k, name in enumerate(SHAPES):
        usual = result.shapes[name].share
        if usual is None:
            continue
        colour = style.SHAPE_COLOURS[name]
        panel.axvline(usual, color=colour, linewidth=1.0)
        panel.plot(
            np.array([row.share[name] for row in rows], float),
            np.arange(len(rows)) + 0.15 * (k - 1.5),
            marker=_MARKS[name],
            linestyle="",
            color=colour,
            markeredgecolor=style.INK,
        )
    percent = f"{100 * result.vary:g} %"
    signs = ("−", "+") * len(rows)
    labels = [f"{row.criterion} {s}{percent}" for row, s in zip(rows, signs, strict=False)]
    panel.set_yticks(range(len(rows)), labels)
    panel.set_ylim(len(rows) - 0.4, -0.6)
    panel.margins(x=0.12)
    panel.set_xlim(left=-0.03)
    panel.set_xlabel("share, mean over trials")
    panel.set_title("With one criterion changed; lines: with none changed")
    panel.grid(visible=False, axis="y")


EXPERIMENT = Experiment.of_folder(
    __name__,
    TracksConfig,
    run,
    tables,
    sentence,
    files=lambda config: {"frames.csv": lambda outcome: outcome.frames_csv()},
    result=TracksResult,
    row=TrackRow,
    figures=figures,
    captions={
        "tracks": "Shares of the shapes in each trial and over all, outlines of each shape, an "
        "angle over time, and what other criteria change.",
    },
    workers="none",
)
