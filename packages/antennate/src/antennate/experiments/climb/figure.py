"""Figures of `antennate climb`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.climb.config import ClimbConfig
from antennate.experiments.climb.measures import PLAN_BAND, VERDICTS
from antennate.experiments.climb.physics import ClimbPath
from antennate.experiments.climb.result import Climbed, Climbing, ClimbResult, Crossing, Sensing
from antennate.studies.trials import Found

_LOOKS: Mapping[str, tuple[str, str]] = {
    "locked": ("#8C8C8C", "s"),
    "level": (style.SERIES[4], "D"),
    "lifted": (style.SERIES[1], "v"),
    "rhythm": (style.SERIES[3], "^"),
    "climb": (style.SERIES[0], "o"),
    "edges": (style.INK, "*"),
}
"""Colour and marker of each condition."""
_MOMENTS = 6
_APART = 0.006
"""Between two conditions at one size, so that intervals stand beside one another [m]."""
_Sized = list[tuple[float, Climbed]]
"""Sizes, and the trials of a condition at each."""
_AXES = ("height of the step [cm]", "width of the gap [cm]")


def figures(found: Found[ClimbConfig, ClimbResult, ClimbPath]) -> dict[str, Figure]:
    """The figures of a run; one climb and the plan only where `climb` climbs."""
    result = found.result()
    drawn = {"success": success(result.climbing, result.grounds)}
    path = example(found)
    if path is not None:
        drawn["side"] = side(path)
    if any(row.crossings for entry in result.climbing for row in entry.plan or ()):
        drawn["plan"] = plan(result.climbing)
    if result.sensing:
        drawn["felt"] = felt(result.sensing)
    return drawn


def example(found: Found[ClimbConfig, ClimbResult, ClimbPath]) -> ClimbPath | None:
    """The climb that is drawn: of `climb`, first divisor, the step nearest to 10 cm it is over."""
    first = found.config.divisors[0]
    rows = [
        row
        for row in found.rows
        if (row.part, row.condition, row.divisor) == ("climbing", "climb", first)
        and (row.cell, row.trial) in found.drawn
    ]
    rows.sort(key=lambda row: (row.outcome != "success", abs(row.height_m - 0.10)))
    return found.drawn[rows[0].cell, rows[0].trial] if rows else None


@style.styled
def success(entries: Sequence[Climbing], grounds: Sequence[Crossing] = ()) -> Figure:
    """Success over the height of steps, beside it over the width of gaps; a row each divisor.

    Args:
        entries: Steps.
        grounds: Other grounds; without gaps in them there is one column.
    """
    gaps = {entry.divisor: _gaps(entry) for entry in grounds}
    columns = 2 if any(any(rows.values()) for rows in gaps.values()) else 1
    figure = style.canvas(style.WIDTH, 0.9 + 2.5 * len(entries))
    panels = figure.subplots(len(entries), columns, squeeze=False, sharex="col", sharey=True)
    for row, entry in zip(panels, entries, strict=True):
        steps = {
            name: [(each.height_m, each) for each in rows] for name, rows in entry.heights.items()
        }
        _draw_success(row[0], steps)
        row[0].set(ylabel="success [%]", title=f"gain divisor {entry.divisor:g}")
        row[0].set_ylim(-4, 104)
        if columns == 2:
            _draw_success(row[1], gaps.get(entry.divisor, {}))
    for panel, label in zip(panels[-1], _AXES, strict=False):
        panel.set_xlabel(label)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _gaps(entry: Crossing) -> dict[str, _Sized]:
    """Gaps of each condition by their width."""
    gaps = {
        name: [(row.size, row) for row in rows if row.scene == "gap" and row.size is not None]
        for name, rows in entry.grounds.items()
    }
    return {name: sorted(rows, key=lambda pair: pair[0]) for name, rows in gaps.items()}


def _draw_success(panel: Axes, by_name: Mapping[str, Sequence[tuple[float, Climbed]]]) -> None:
    for i, (name, rows) in enumerate(by_name.items()):
        colour, marker = _LOOKS[name]
        shift = _APART * (i - (len(by_name) - 1) / 2) / 3
        x = [100 * (size + shift) for size, _ in rows]
        shares = [row.success_share for _, row in rows]
        y = np.array([np.nan if share is None else 100 * share for share in shares])
        known = [row.wilson95 or (np.nan, np.nan) for _, row in rows]
        ends = 100 * np.array(known).reshape(-1, 2).T
        panel.errorbar(
            x,
            y,
            yerr=[y - ends[0], ends[1] - y],
            color=colour,
            marker=marker,
            markersize=5,
            linewidth=1.2,
            elinewidth=0.8,
            label=name,
        )
    marks = sorted({100 * size for rows in by_name.values() for size, _ in rows})
    if marks:
        panel.set_xticks(marks, [f"{mark:g}" for mark in marks])
        panel.set_xlim(marks[0] - 1.5, marks[-1] + 1.5)


@style.styled
def side(path: ClimbPath) -> Figure:
    """One climb from the side, its moments below one another."""
    figure = style.canvas(style.WIDTH, 5.6)
    panels = figure.subplots(_MOMENTS, 1, sharex=True, sharey=True)
    x = path.links[:, :, 0] - path.edge
    near = np.flatnonzero((x[:, 0] > -0.2) & (x[:, -1] < 0.25))
    first, last = (int(near[0]), int(near[-1])) if len(near) else (0, len(x) - 1)
    shown = x[first : last + 1]
    left, right = float(shown.min()) - 0.06, max(float(shown.max()), 0.06) + 0.06
    for panel, moment in zip(panels, np.linspace(first, last, _MOMENTS).round(), strict=True):
        at = int(moment)
        panel.fill_between([left, 0.0], -0.03, 0.0, color=style.FAINT, linewidth=0)
        panel.fill_between([0.0, right], -0.03, path.height, color=style.FAINT, linewidth=0)
        panel.plot(x[at], path.links[at, :, 2], "-o", color=style.SERIES[0], markersize=4)
        panel.plot(x[at, 0], path.links[at, 0, 2], "o", color=style.INK, markersize=5)
        if np.isfinite(path.plan[at]):
            panel.axvline(
                path.plan[at], color=style.SERIES[1], linewidth=1.2, linestyle=(0, (4, 2))
            )
        panel.set_title(f"{path.t[at]:.1f} s", fontsize=8, pad=2)
        panel.set(xlim=(left, right), ylim=(-0.03, path.height + 0.22))
        panel.set_aspect("equal", adjustable="box")
        panel.grid(visible=False)
    step = f"a step of {100 * path.height:g} cm"
    panels[-1].set_xlabel(f"from the edge of {step} [m]; dashed: the head by the plan")
    panels[_MOMENTS // 2].set_ylabel("height [m]")
    return figure


@style.styled
def plan(entries: Sequence[Climbing]) -> Figure:
    """Error of the plan by link."""
    figure = style.canvas(style.WIDTH, 3.4)
    panel = figure.subplots()
    low, high = (100 * end for end in PLAN_BAND)
    panel.axhspan(low, high, color=style.FAINT, alpha=0.6, zorder=0, label="aim: 90 % in here")
    for i, entry in enumerate(entries):
        rows = [row for row in entry.plan or () if row.crossings]
        places = np.arange(len(rows)) + 0.16 * (i - (len(entries) - 1) / 2)
        ends = np.array([[r.low_cm, r.middle_cm, r.high_cm] for r in rows], float)
        low, middle, high = ends.reshape(-1, 3).T
        panel.errorbar(
            places,
            middle,
            yerr=[middle - low, high - middle],
            fmt="os"[i % 2],
            color=style.SERIES[i % len(style.SERIES)],
            markersize=5,
            label=f"divisor {entry.divisor:g}",
        )
        panel.set_xticks(np.arange(len(rows)), [row.link for row in rows])
    panel.set(ylabel="plan less truth [cm]", xlabel="crosses the edge with its centre")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@style.styled
def felt(entries: Sequence[Sensing]) -> Figure:
    """The confusion table, a panel for each divisor."""
    grounds = list(entries[0].confusion)
    figure = style.canvas(style.WIDTH, 0.5 + (0.6 + 0.22 * len(grounds)) * len(entries))
    panels = figure.subplots(len(entries), 1, squeeze=False)[:, 0]
    for panel, entry in zip(panels, entries, strict=True):
        counts = np.array([[row[v] for v in VERDICTS] for row in entry.confusion.values()])
        shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
        panel.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        for (i, j), number in np.ndenumerate(counts):
            colour = "white" if shares[i, j] > 0.6 else style.INK
            if number:
                panel.text(j, i, str(number), ha="center", va="center", fontsize=7, color=colour)
        panel.set_xticks(range(len(VERDICTS)), [v.replace("_", " ").lower() for v in VERDICTS])
        panel.set_yticks(range(len(grounds)), grounds)
        panel.grid(visible=False)
        panel.set_title(f"felt as, trials with gain divisor {entry.divisor:g}")
    return figure
