"""Figure of `bench force`: force over flex, and how much of it one curve explains."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.force.experiment import PARTS, tested
from antennate.experiments.force.loads import Points
from antennate.experiments.force.run import ForceOutcome
from antennate.studies.measures import Measure


@style.styled
def figures(outcome: ForceOutcome) -> dict[str, Figure]:
    """Force over flex at rest and on the move, and the share of force explained.

    The points are those of `descending`, or of the first profile.
    """
    figure, result, profiles = style.canvas(style.WIDTH, 12.0), outcome.result(), outcome.profiles
    rest, move, ranges, shares = figure.subplots(4, 1)
    shown = next((p for p in profiles if p.profile == "descending"), profiles[0])
    scale = ScalarMappable(Normalize(result["from_place"], 1.0), "viridis")
    moved = result["profiles"][shown.profile]["traverses"]["trials"]
    title = f"{shown.profile}: at rest, normal to the link"
    _scatter(rest, shown.statics, scale, result, title)
    _scatter(move, shown.traverses, scale, result, f"Dragged past a post, {moved} traverses")
    label = "place of contact / length"
    figure.colorbar(scale, ax=[rest, move], label=label, **style.above(figure))
    _draw_ranges(ranges, result)
    _draw_shares(shares, result)
    return {"force": figure}


def _scatter(
    panel: Axes, points: Points, scale: ScalarMappable, result: Mapping[str, Any], title: str
) -> None:
    within = points.place >= result["from_place"] - 1e-9
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


def _draw_ranges(panel: Axes, result: Mapping[str, Any]) -> None:
    for name, profile in result["profiles"].items():
        rows = profile["by_range"]
        place = [row["from_place"] for row in rows]
        low, high = np.array([row["r2_95"] for row in rows]).T
        colour = style.PROFILE_LOOKS[name][0]
        panel.fill_between(place, low, high, color=colour, alpha=0.12, linewidth=0)
        panel.plot(place, [row["r2"] for row in rows], color=colour, label=name.replace("_", " "))
    panel.axvline(result["from_place"], color=style.MUTED, linewidth=1, linestyle=(0, (4, 2)))
    panel.set(
        xlabel="nearest place where the contact may be / length",
        ylabel="R² of force, place unknown",
        title="One curve for all places\nfrom there to the tip, at rest",
        ylim=(0, 1.02),
    )
    panel.legend(loc="lower right")


def _draw_shares(panel: Axes, result: Mapping[str, Any]) -> None:
    profiles = result["profiles"]
    parts = (("at rest", style.INK), ("dragged", style.SERIES[5]))
    places = (("known", "o"), ("unknown", "s"))
    trials = tested(result)
    for k, ((part, colour), (place, marker)) in enumerate(product(parts, places)):
        known = Measure(f"{PARTS[part]}.{place}.flex", f"{part}, place {place}")
        style.intervals(
            panel,
            [i + 0.18 * (k - 1.5) for i in range(len(profiles))],
            [known.value(row) for row in profiles.values()],
            ("r2", "r2_95"),
            trials,
            marker=marker,
            color=colour,
            label=known.label,
            markerfacecolor=colour if place == "known" else "white",
        )
    style.categories(panel, [name.replace("_", "\n") for name in profiles])
    panel.set(
        ylabel="R² of force",
        title=f"Share of force that flex explains\n({style.interval_note('95 %', trials)})",
    )
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(bottom, 0.0), top + 0.35)
    panel.set_yticks([0.2 * step for step in range(6)])
    panel.legend(loc="upper left", ncols=2, fontsize=8)
