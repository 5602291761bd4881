"""Figures of `bench wall`: outcomes of each profile, sticks, and how tips advance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from antennate import figures as style
from antennate.experiments.wall.outcome import Traverse, WallTrial
from antennate.experiments.wall.run import WallOutcome

OUTCOME_COLOURS = {
    "successes": "#009E73",
    "jams": "#D55E00",
    "slips": "#56B4E9",
    "invalid": "#000000",
}


def figures(outcome: WallOutcome) -> dict[str, Figure]:
    """All figures of a run; without an example, no passages."""
    result = outcome.result()
    drawn = {"wall": outcomes(result), "sticks": sticks(outcome.rows, result["border"]["at_mm"])}
    examples = outcome.examples
    return {**drawn, "passages": passages(examples)} if examples else drawn


@style.styled
def outcomes(result: Mapping[str, Any]) -> Figure:
    """Outcomes of the trials of each profile, over the whole travel and after the start."""
    figure = style.canvas(style.WIDTH, 6.0)
    whole, late = figure.subplots(2, 1)
    profiles = result["profiles"]
    _draw_outcomes(whole, profiles, "Whole travel; lines: Wilson 95 % of success")
    after = {name: profile["after_start"] for name, profile in profiles.items()}
    start = f"first {1e3 * result['start_m']:g} mm"
    _draw_outcomes(late, after, f"After the {start}, in which the\nantenna bows from its approach")
    figure.legend(
        *whole.get_legend_handles_labels(), loc="outside lower center", ncols=4, columnspacing=1.2
    )
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
        ends = profile["wilson95"]
        if ends:
            panel.plot([place, place], ends, color=style.INK, linewidth=1.4)
    labels = [
        f"{name.replace('_', chr(10))}\nn = {profile['trials']}"
        for name, profile in profiles.items()
    ]
    panel.set_xticks(places, labels)
    panel.set(title=title, ylabel="share of trials", ylim=(0, 1.02))
    panel.grid(axis="x", visible=False)


@style.styled
def sticks(rows: Sequence[WallTrial], border: float) -> Figure:
    """The longest stick of every valid trial, and what makes one a jam.

    Args:
        rows: Trials of all profiles.
        border: Longest stick that is no jam [mm].
    """
    figure = style.canvas(style.WIDTH, 3.6)
    panel = figure.subplots()
    profiles = list(dict.fromkeys(row.profile for row in rows))
    for place, profile in enumerate(profiles):
        valid = [r for r in rows if r.profile == profile and r.outcome != "invalid"]
        apart = place + np.linspace(-0.25, 0.25, len(valid)) if len(valid) > 1 else [place]
        colour, marker, _ = style.PROFILE_LOOKS[profile]
        heights = sorted(row.longest_stick_mm for row in valid)
        panel.plot(apart[: len(valid)], heights, marker, color=colour, markersize=4)
    panel.axhline(border, color=style.INK, linewidth=1.0)
    panel.annotate(
        f"above {border:g} mm: a jam",
        (len(profiles) - 0.45, border),
        (0, 3),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )
    style.categories(panel, [name.replace("_", "\n") for name in profiles])
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    ticks = [tick for tick in (1, 2, 5, 10, 20, 50, 100, 200) if low <= tick <= high]
    panel.set_yticks(ticks, [str(tick) for tick in ticks])
    panel.yaxis.minorticks_off()
    panel.set_ylabel("longest stick of a trial:\nthe base moves, the tip does not [mm]")
    panel.set_title("The outcome depends on this border; a mark is a trial")
    return figure


def _draw_boulders(panel: Axes, seen: Traverse) -> None:
    """The boulders that the antenna could have reached."""
    along = seen.shapes[..., 1]
    reached = (seen.boulders[:, 1] > along.min()) & (seen.boulders[:, 1] < along.max())
    for x, y, radius in (1e3 * seen.boulders[reached]).tolist():
        panel.add_patch(Circle((x, y), radius, color=style.MUTED, linewidth=0))


@style.styled
def passages(examples: Mapping[str, Traverse]) -> Figure:
    """The first trial of every profile: advance of the tip, and shapes along the wall."""
    figure = style.canvas(style.WIDTH, 2.3 * len(examples))
    panels = figure.subplots(len(examples), 2, squeeze=False, sharex="col", sharey="col")
    for (profile, seen), (advance, along) in zip(examples.items(), panels, strict=True):
        colour = style.PROFILE_LOOKS[profile][0]
        advance.plot(1e3 * seen.base, 1e3 * seen.tip, color=colour)
        end = 1e3 * seen.base[-1]
        advance.plot([0, end], [0, end], color=style.FAINT, zorder=0)
        advance.set(title=profile.replace("_", " "), ylabel="advance of the tip [mm]")
        for shape in seen.shapes:
            along.plot(*(1e3 * shape.T), color=colour, linewidth=1.0)
        _draw_boulders(along, seen)
        along.set_aspect("equal")
        along.set(ylabel="along the wall [mm]")
    for panel, words in zip(
        panels[-1], ("travel of the base [mm]", "from the crests [mm]"), strict=True
    ):
        panel.set_xlabel(words)
    return figure
