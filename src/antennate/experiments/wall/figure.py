"""Figures of `antennate wall`: outcomes of each profile, how tips advance, and a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.wall.outcome import Traverse

OUTCOME_COLOURS = {
    "successes": "#009E73",
    "jams": "#D55E00",
    "slips": "#56B4E9",
    "invalid": "#000000",
}


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


@style.styled
def sticks(rows: Sequence[Mapping[str, Any]], limit_mm: float) -> Figure:
    """Longest stick of each profile over the base angle: median and range of its trials.

    Args:
        rows: `base_angle_deg`, `profile`, and `sticks_mm`, one for each trial.
        limit_mm: Travel from which a stick counts as a jam [mm].
    """
    figure = style.canvas(7.0, 4.2)
    panel = figure.subplots()
    profiles = list(dict.fromkeys(row["profile"] for row in rows))
    for k, (profile, colour) in enumerate(zip(profiles, style.series(len(profiles)), strict=True)):
        held = [row for row in rows if row["profile"] == profile]
        middle = np.array([np.median(row["sticks_mm"]) for row in held])
        below = middle - np.array([min(row["sticks_mm"]) for row in held])
        above = np.array([max(row["sticks_mm"]) for row in held]) - middle
        angles = np.array([row["base_angle_deg"] for row in held]) + 0.25 * (k - 2)
        name = profile.replace("_", " ")
        panel.errorbar(angles, middle, [below, above], marker="o", color=colour, label=name)
    panel.axhline(limit_mm, color=style.INK, linewidth=1, linestyle=(0, (4, 2)))
    panel.annotate(
        "a jam from here on",
        (1, limit_mm),
        (-2, 2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )
    trials = len(rows[0]["sticks_mm"])
    panel.set(
        xlabel="base angle [deg]",
        ylabel="longest stick [mm]",
        title=f"Median and range of {trials} trials a point",
        yscale="log",
    )
    panel.legend()
    return figure


@style.styled
def outcome_map(cells: Sequence[Mapping[str, Any]]) -> Figure:
    """Successes after the start, a column for each profile.

    Over link mass and overlap with a row for each angle and gravity; if all masses are equal, over
    angle and overlap with a row for each gravity.

    Args:
        cells: Cells with `link_mass_g`, `overlap_mm`, `base_angle_deg`, `gravity` and `profiles`.
    """
    profiles = list(cells[0]["profiles"])
    one_mass = len({cell["link_mass_g"] for cell in cells}) == 1
    across, label = ("base_angle_deg", "base angle [deg]") if one_mass else _MASS
    apart = ("gravity",) if one_mass else ("gravity", "base_angle_deg")
    rows = sorted({tuple(cell[key] for key in apart) for cell in cells})
    figure = style.canvas(2.1 * len(profiles) + 1.2, 1.55 * len(rows) + 0.6)
    panels = figure.subplots(len(rows), len(profiles), squeeze=False, sharex=True, sharey=True)
    image = None
    for row, line in zip(rows, panels, strict=True):
        held = [cell for cell in cells if tuple(cell[key] for key in apart) == row]
        for profile, panel in zip(profiles, line, strict=True):
            image = _draw_map(panel, held, profile, across)
        place = ", ".join([f"gravity {row[0]}", *(f"{angle:g} deg" for angle in row[1:])])
        line[0].set_ylabel(f"{place}\noverlap [mm]")
    for profile, panel in zip(profiles, panels[0], strict=True):
        panel.set_title(profile.replace("_", " "))
    for panel in panels[-1]:
        panel.set_xlabel(label)
    if image is not None:
        name = "share of successes\nafter the start"
        figure.colorbar(image, ax=panels, label=name, shrink=0.8 if one_mass else 0.3)
    return figure


_MASS = ("link_mass_g", "link mass [g]")


def _draw_map(panel: Axes, cells: Sequence[Mapping[str, Any]], profile: str, across: str) -> Any:
    columns = sorted({cell[across] for cell in cells})
    overlaps = sorted({cell["overlap_mm"] for cell in cells})
    grid = np.full((len(overlaps), len(columns)), np.nan)
    for cell in cells:
        counts = cell["profiles"][profile]["after_start"]
        at = overlaps.index(cell["overlap_mm"]), columns.index(cell[across])
        grid[at] = counts["successes"] / counts["trials"]
        mark = f"{counts['successes']}/{counts['jams']}/{counts['slips']}"
        ink = "white" if grid[at] < 0.6 else style.INK
        panel.text(at[1], at[0], mark, ha="center", va="center", fontsize=6, color=ink)
    image = panel.imshow(grid, origin="lower", cmap="cividis", vmin=0, vmax=1, aspect="auto")
    panel.set_xticks(range(len(columns)), [f"{value:g}" for value in columns])
    panel.set_yticks(range(len(overlaps)), [f"{o:g}" for o in overlaps])
    panel.grid(visible=False)
    return image
