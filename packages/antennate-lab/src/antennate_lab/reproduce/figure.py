"""Figures of the claims: the paper's numbers beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from antennate.figures import INK, SERIES, canvas, styled
from antennate_lab.reproduce.verdict import Claim, Finding

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from antennate_lab.reproduce.experiment import ReproduceOutcome

_WIDE = 100.0
"""Numbers that span more than this are drawn on a logarithmic axis."""


def figures(outcome: ReproduceOutcome) -> Mapping[str, Figure]:
    """One figure a claim, by its name."""
    return {claim.name: draw(claim, finding) for claim, finding in outcome.judged}


@styled
def draw(claim: Claim, finding: Finding) -> Figure:
    """Dots with their intervals, the first at the top; the paper's are drawn hollow."""
    bars = finding.bars
    figure = canvas(5.2, 0.65 + 0.28 * len(bars))
    panel = figure.subplots()
    for place, bar in enumerate(bars):
        colour = INK if bar.label.startswith("paper") else SERIES[0]
        if bar.interval is not None:
            panel.plot(bar.interval, (place, place), color=colour, linewidth=1.4)
        face = "white" if bar.label.startswith("paper") else colour
        panel.plot(bar.value, place, "o", color=colour, markerfacecolor=face, markersize=6)
        panel.annotate(
            f"{bar.value:,.0f}" if bar.value >= 1000 else f"{bar.value:.3g}",
            (bar.value, place),
            (0, 5),
            textcoords="offset points",
            ha="center",
        )
    values = np.array([bar.value for bar in bars])
    if len(values) and (values > 0).all() and values.max() > _WIDE * values.min():
        panel.set_xscale("log")
    elif (values >= 0).all():
        panel.set_xlim(left=min(0.0, *panel.get_xlim()))
    panel.margins(x=0.08)
    panel.set_yticks(range(len(bars)), [bar.label for bar in bars])
    panel.set_ylim(len(bars) - 0.4, -0.75)
    panel.set_xlabel(claim.unit)
    panel.grid(visible=False, axis="y")
    return figure
