"""Figures of `antennate wall`: outcomes of each profile, and how tips advance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.wall.outcome import Traverse
from antennate.experiments.wall.run import WallOutcome

OUTCOME_COLOURS = {
    "successes": "#009E73",
    "jams": "#D55E00",
    "slips": "#56B4E9",
    "invalid": "#000000",
}


def figures(outcome: WallOutcome) -> dict[str, Figure]:
    """Both figures of a run; without an example, the first alone."""
    drawn = {"wall": outcomes(outcome.result())}
    examples = outcome.examples
    return {**drawn, "passages": passages(examples)} if examples else drawn


@style.styled
def outcomes(result: Mapping[str, Any]) -> Figure:
    """Outcomes of the trials of each profile, over the whole travel and after the start.

    Args:
        result: The content of result.json.
    """
    figure = style.canvas(10.0, 3.6)
    whole, late = figure.subplots(1, 2, sharey=True)
    profiles = result["profiles"]
    _draw_outcomes(whole, profiles, "Whole travel")
    after = {name: profile["after_start"] for name, profile in profiles.items()}
    _draw_outcomes(late, after, f"Without the first {1e3 * result['start_m']:g} mm")
    whole.set_ylabel("share of trials")
    whole.legend(loc="lower center", bbox_to_anchor=(1.05, -0.42), ncols=4, fontsize=8)
    return figure


def _draw_outcomes(panel: Axes, profiles: Mapping[str, Mapping[str, Any]], title: str) -> None:
    places = np.arange(len(profiles))
    floor = np.zeros(len(profiles))
    for outcome, colour in OUTCOME_COLOURS.items():
        shares = np.array(
            [profile[outcome] / max(profile["trials"], 1) for profile in profiles.values()]
        )
        if outcome != "invalid" or shares.any():
            panel.bar(places, shares, 0.6, floor, color=colour, label=outcome)
        floor += shares
    for place, profile in zip(places, profiles.values(), strict=True):
        low, high = profile["wilson95"]
        panel.plot([place, place], [low, high], color=style.INK, linewidth=1.4)
    labels = [
        f"{name.replace('_', chr(10))}\n{profile['trials']}" for name, profile in profiles.items()
    ]
    panel.set_xticks(places, labels)
    panel.set(title=f"{title}; bars: Wilson 95 % of success", ylim=(0, 1.02))
    panel.grid(axis="x", visible=False)


@style.styled
def passages(examples: Mapping[str, Traverse]) -> Figure:
    """The first trial of every profile: advance of the tip, and shapes along the wall.

    Args:
        examples: Passages by profile.
    """
    figure = style.canvas(2.2 * len(examples) + 0.8, 5.2)
    panels = figure.subplots(2, len(examples), squeeze=False, height_ratios=(1, 1.3))
    colours = style.series(len(examples))
    for (profile, seen), colour, (above, below) in zip(
        examples.items(), colours, panels.T, strict=True
    ):
        above.plot(1e3 * seen.base, 1e3 * seen.tip, color=colour)
        above.plot([0, 1e3 * seen.base[-1]], [0, 1e3 * seen.base[-1]], color=style.FAINT, zorder=0)
        above.set(title=profile.replace("_", " "), xlabel="travel of the base [mm]")
        for shape in seen.shapes:
            below.plot(*(1e3 * shape.T), color=colour, linewidth=1.0)
        below.axvline(0, color=style.MUTED, linewidth=1.0)
        below.set_aspect("equal")
        below.set(xlabel="from the crests [mm]")
    panels[0, 0].set_ylabel("advance of the tip [mm]")
    panels[1, 0].set_ylabel("along the wall [mm]")
    for row in panels:
        low = min(panel.get_ylim()[0] for panel in row)
        high = max(panel.get_ylim()[1] for panel in row)
        for panel in row:
            panel.set_ylim(low, high)
    return figure
