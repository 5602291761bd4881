"""Figures of `bench force`: force over flex, and the share of the force that flex explains."""

from __future__ import annotations

from itertools import product

import numpy as np
from matplotlib import cm, colors
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.force.experiment import ForceOutcome, tested
from antennate.experiments.force.explained import Explained
from antennate.experiments.force.physics import Points
from antennate.experiments.force.result import ForceResult
from antennate.studies.columns import column_of

R2 = column_of(Explained, "r2")


@style.styled
def figures(outcome: ForceOutcome) -> dict[str, Figure]:
    """Force over flex at rest and on the move, and the share of force explained.

    The points are those of `descending`, or of the first profile.
    """
    figure, result, profiles = style.canvas(style.WIDTH, 12.0), outcome.result(), outcome.profiles
    rest, move, ranges, shares = figure.subplots(4, 1)
    example = next((p for p in profiles if p.profile == "descending"), profiles[0])
    scale = cm.ScalarMappable(colors.Normalize(result.from_place, 1.0), "viridis")
    moved = example.result.traverses.trials
    title = f"{example.profile}: at rest, normal to the link"
    _scatter(rest, example.statics, scale, result, title)
    _scatter(move, example.traverses, scale, result, f"Dragged past a post, {moved} traverses")
    label = "place of contact / length"
    figure.colorbar(scale, ax=[rest, move], label=label, **style.above(figure))
    _draw_ranges(ranges, result)
    _draw_shares(shares, result)
    return {"force": figure}


def _scatter(
    panel: Axes, points: Points, scale: ScalarMappable, result: ForceResult, title: str
) -> None:
    within = points.place >= result.from_place - 1e-9
    panel.scatter(
        np.degrees(points.scalars["flex"][within]),
        points.force[within],
        c=scale.to_rgba(points.place[within]),
        s=7,
        linewidths=0,
        rasterized=True,
    )
    panel.set(
        xlabel="flex under the flex sensor [deg]",
        ylabel="contact force [N]",
        title=f"{title}\n(n = {within.sum()})",
        xlim=(0, None),
        ylim=(0, None),
    )


def _draw_ranges(panel: Axes, result: ForceResult) -> None:
    for name, profile in result.profiles.items():
        told = profile.by_range
        place, ends = [each.from_place for each in told], [each.r2_95 for each in told]
        colour = style.PROFILE_LOOKS[name][0]
        panel.fill_between(place, *np.array(ends).T, color=colour, alpha=0.12, linewidth=0)
        panel.plot(place, [each.r2 for each in told], color=colour, label=name.replace("_", " "))
    panel.axvline(result.from_place, color=style.MUTED, linewidth=1, linestyle=(0, (4, 2)))
    panel.set(
        xlabel="nearest place where the contact may be / length",
        ylabel="R² of force, place unknown",
        title="One curve for all places\nfrom there to the tip, at rest",
        ylim=(0, 1.02),
    )
    panel.legend(loc="lower right")


def _draw_shares(panel: Axes, result: ForceResult) -> None:
    profiles, trials = result.profiles.values(), tested(result)
    rest, moved = [p.statics.frictionless for p in profiles], [p.traverses for p in profiles]
    lines = (
        ("at rest, place known", [each.known for each in rest]),
        ("at rest, place unknown", [each.unknown for each in rest]),
        ("dragged, place known", [each.known for each in moved]),
        ("dragged, place unknown", [each.unknown for each in moved]),
    )
    looks = product((style.INK, style.SERIES[5]), ("o", "s"))
    for k, ((label, scalars), (colour, marker)) in enumerate(zip(lines, looks, strict=True)):
        style.intervals(
            panel,
            [i + 0.18 * (k - 1.5) for i in range(len(scalars))],
            [each.flex for each in scalars],
            (R2.name, R2.interval),
            trials,
            marker=marker,
            color=colour,
            label=label,
            markerfacecolor=colour if marker == "o" else "white",
        )
    style.categories(panel, [name.replace("_", "\n") for name in result.profiles])
    panel.set(
        ylabel="R² of force",
        title=f"Share of force that flex explains\n({style.interval_note(trials)})",
    )
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(bottom, 0.0), top + 0.35)
    panel.set_yticks([0.2 * step for step in range(6)])
    panel.legend(loc="upper left", ncols=2, fontsize=8)
