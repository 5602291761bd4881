"""Figures of docs/science/published.md: what is left of the unknowns, and what depends on which."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate.figures import FAINT, INK, SERIES, WIDTH, canvas, styled

COLUMNS = 4
"""Panels beside one another."""
SMALL = 7
"""Size of letters [points]."""
Ends = Mapping[str, tuple[str, str]]
"""Of each unknown its lowest and highest value in words."""


def short(name: str) -> str:
    """The last part of the name of an unknown without its unit; of a friction whose it is, too."""
    *parents, last = name.split(".")
    whose = f"{parents[-1]} " * (last == "friction")
    return whose + last.split("_n_mm")[0].replace("_", " ")


def _ends(panel: Axes, ends: tuple[str, str]) -> None:
    """Write the ends of a range below a panel."""
    panel.set_xticks([0, 1], ends, fontsize=SMALL)
    for label, side in zip(panel.get_xticklabels(), ("left", "right"), strict=True):
        label.set_horizontalalignment(side)


@styled
def marginals(left: Mapping[str, Any], ends: Ends) -> Figure:
    """How much likelier than in its range each value of an unknown is, most narrowed first."""
    names = sorted(left, key=lambda n: -left[n]["narrowed"])
    rows = max(1, math.ceil(len(names) / COLUMNS))
    drawn = canvas(WIDTH, 0.5 + 1.25 * rows)
    panels = drawn.subplots(rows, COLUMNS, squeeze=False, sharey=True).ravel()
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    for panel, n in zip(panels, names, strict=False):
        share = left[n]["share"]
        place, width = np.arange(len(share)) / len(share), 1 / len(share)
        panel.bar(place, share, width, align="edge", color=SERIES[0])
        panel.axhline(1.0, color=FAINT)
        panel.set_title(short(n).replace(" ", "\n", 1), fontsize=SMALL)
        panel.tick_params(axis="y", labelsize=SMALL)
        _ends(panel, ends[n])
    return drawn


@styled
def screening(effects: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Change of each outcome from one end of an unknown to the other, written where it is no noise.

    Colours go to once the size that noise reaches in one study of twenty.
    """
    outcomes = list(effects)
    names = list(effects[outcomes[0]])
    value = np.array([[effects[o][n][0] for o in outcomes] for n in names])
    size = np.array([[effects[o][n][1] for o in outcomes] for n in names])
    drawn = canvas(WIDTH, 1.2 + 0.165 * len(names))
    panel = drawn.subplots()
    panel.imshow(np.sign(value) * size, cmap="RdBu", vmin=-1.5, vmax=1.5, aspect="auto")
    for row, column in zip(*np.nonzero(size >= 1.0), strict=True):
        text = f"{value[row, column]:+.2f}"
        panel.text(column, row, text, ha="center", va="center", fontsize=SMALL, color="white")
    panel.set_xticks(range(len(outcomes)), [o.replace(" ", "\n", 1) for o in outcomes])
    panel.set_yticks(range(len(names)), [short(n) for n in names])
    panel.tick_params(labelsize=SMALL, top=True, labeltop=True, bottom=False, labelbottom=False)
    panel.grid(visible=False)
    return drawn


@styled
def trade(
    shares: Sequence[tuple[float, float, int]], judged: Sequence[tuple[float, float]]
) -> Figure:
    """What the rule makes of settings in which robots without feedback cross so often.

    Dots are moved a little, so that none hides others.

    Args:
        shares: Of each setting how many cross without and with the rule, of how many trials.
        judged: Likewise of settings that were judged on fresh trials.
    """
    drawn = canvas(WIDTH, 3.4)
    panel = drawn.subplots()
    x, y, trials = np.array(shares, float).T
    panel.axvspan(0.45, 0.75, color=FAINT, linewidth=0)
    panel.plot([0, 1], [0, 1], color=INK, linewidth=0.8)
    panel.axhline(0.95, color=INK, linewidth=0.8, linestyle="--")
    apart = np.random.default_rng(0).uniform(-0.02, 0.02, (2, len(x)))
    panel.scatter(x + apart[0], y + apart[1], s=3 * trials, color=SERIES[0], alpha=0.4, linewidth=0)
    if judged:
        panel.scatter(*np.array(judged).T, marker="D", s=36, color=SERIES[1])
    panel.set_xlabel("share that crosses without feedback")
    panel.set_ylabel("share that crosses with the rule")
    panel.set_xlim(-0.03, 1.03)
    panel.set_ylim(-0.03, 1.03)
    return drawn
