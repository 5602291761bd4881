"""Figure of `antennate force`: force over flex, and how much of it one curve explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.force.loads import Points
from antennate.experiments.force.run import ForceOutcome, ProfileOutcome

_SHOWN = "descending"


def figures(outcome: ForceOutcome) -> dict[str, Figure]:
    """The figure of a run."""
    return {"force": study(outcome.result(), outcome.profiles)}


@style.styled
def study(result: Mapping[str, Any], profiles: Sequence[ProfileOutcome]) -> Figure:
    """Force over flex at rest and on the move, and the share of force explained.

    Args:
        result: The content of result.json.
        profiles: The points of every profile; those of `descending`, or of the first, are drawn.
    """
    figure = style.canvas(10.0, 7.4)
    (rest, move), (ranges, shares) = figure.subplots(2, 2, height_ratios=(1.1, 1))
    shown = next((p for p in profiles if p.profile == _SHOWN), profiles[0])
    scale = ScalarMappable(Normalize(result["from_place"], 1.0), "viridis")
    _scatter(rest, shown.statics, scale, result, "At rest, normal to the link")
    moved = result["profiles"][shown.profile]["traverses"]["trials"]
    _scatter(move, shown.traverses, scale, result, f"Dragged past a post, {moved} traverses")
    rest.set_title(f"{shown.profile}: {rest.get_title(loc='left').lower()}")
    figure.colorbar(scale, ax=[rest, move], label="place of contact / length", shrink=0.9)
    _draw_ranges(ranges, result)
    _draw_shares(shares, result)
    return figure


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
        title=f"{title} (n = {within.sum()})",
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
        panel.plot(place, [row["r2"] for row in rows], color=colour, label=name)
    panel.axvline(result["from_place"], color=style.MUTED, linewidth=1, linestyle=(0, (4, 2)))
    panel.set(
        xlabel="nearest place where the contact may be / length",
        ylabel="R² of force, place unknown",
        title="One curve for all places from there to the tip, at rest",
        ylim=(0, 1.02),
    )
    panel.legend(loc="lower right")


_BARS = {
    "known": ("at rest, place known", ("statics", "frictionless")),
    "unknown": ("at rest, place unknown", ("statics", "frictionless")),
    "dragged, known": ("dragged, place known", ("traverses",)),
    "dragged, unknown": ("dragged, place unknown", ("traverses",)),
}
_BAR_MARKS = (("o", style.INK), ("s", style.INK), ("o", "#D55E00"), ("s", "#D55E00"))


def _draw_shares(panel: Axes, result: Mapping[str, Any]) -> None:
    names = list(result["profiles"])
    for k, ((key, (label, path)), (marker, colour)) in enumerate(
        zip(_BARS.items(), _BAR_MARKS, strict=True)
    ):
        for i, name in enumerate(names):
            row = result["profiles"][name]
            for step in (*path, key.rpartition(" ")[2], "flex"):
                row = row[step]
            low, high = row["r2_95"]
            panel.errorbar(
                i + 0.18 * (k - 1.5),
                row["r2"],
                [[max(row["r2"] - low, 0.0)], [max(high - row["r2"], 0.0)]],
                marker=marker,
                color=colour,
                markersize=5,
                linewidth=1.2,
                label=label if i == 0 else None,
                markerfacecolor=colour if "known" in label.split() else "white",
            )
    panel.set_xticks(range(len(names)), [name.replace("_", "\n") for name in names])
    panel.set(ylabel="R² of force", title="Share of force that flex explains (95 %)")
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(bottom, 0.0), top + 0.35)
    panel.set_yticks([0.2 * step for step in range(6)])
    panel.grid(visible=False, axis="x")
    panel.legend(loc="upper left", ncols=2, fontsize=8)
