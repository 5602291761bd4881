"""The figure of swimmers: its panels, and what is drawn in each."""

from __future__ import annotations

import pytest

from antennate.figures import render
from antennate_lab.swimmers import swimmer_figure
from geometric_locomotion.chain import purcell
from geometric_locomotion.maps import curvature_map


@pytest.mark.ci
def test_the_figure_shows_both_frames_and_both_strokes() -> None:
    figure = swimmer_figure(curvature_map(purcell(), count=5))
    first, second, sizes, bar = figure.axes[0], figure.axes[1], figure.axes[-1], figure.axes[2]
    assert [len(panel.lines) for panel in (first, second)] == [2, 2]
    assert len(sizes.lines) == 3
    assert "rad²" in bar.get_xlabel()
    assert render(figure)["png"].startswith(b"\x89PNG")
