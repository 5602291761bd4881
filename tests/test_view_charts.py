"""What the charts and the scene of a page are given, without a browser."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from antennate.figures import font
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.charts import Charts
from antennate.telemetry.view.scene import arrows

WINDOW = 10.0


class Panel:
    """Stands for viser's server and a tab: it keeps what is added."""

    def __init__(self) -> None:
        self.gui, self.charts = self, list[Any]()

    def __enter__(self) -> None:
        """Nothing is opened."""

    def __exit__(self, *_: object) -> None:
        """Nothing is closed."""

    def add_html(self, content: str, **_: Any) -> None:
        """A text is not looked at."""

    def add_uplot(self, data: Any, series: Any, **look: Any) -> Any:
        """A chart."""
        chart = SimpleNamespace(data=data, series=series, visible=True, **look)
        self.charts.append(chart)
        return chart


def tick(number: int, t: float, counts: float) -> Tick:
    """A tick of a simulation."""
    pair = counts, counts
    return Tick(number, t, t, pair, pair, (0.2, 0.3), (0, 1), 1, math.nan, ())


@pytest.fixture
def panel() -> Panel:
    """A page without a browser."""
    return Panel()


def test_every_chart_shows_the_last_ten_seconds_of_each_trial(panel: Panel) -> None:
    """Also after a trial of other readings, at which the limits of the first chart change."""
    charts = Charts(panel, panel)  # type: ignore[arg-type]
    for counts in (150.0, 1850.0, 950.0):
        for number in range(1, 2501):
            charts.take(tick(number, 0.01 * number, counts), 0.5)
            if number in (1, 30, 2500):
                charts.show()
                for chart in panel.charts:
                    first, oldest, last = chart.data[0][[0, 1, -1]]
                    assert last == 1.0, chart.title
                    assert first == pytest.approx(0.0, abs=1e-6), "the axis ends there"
                    assert oldest == pytest.approx(1 - min(1, (0.01 * number - 0.01) / WINDOW))
                    assert chart.axes[0]["splits"] == (0.0, 0.5, 1.0)
                    assert chart.axes[0]["values"] == ("-10", "-5", "0")
                low, high = panel.charts[0].scales["y"]["range"]
                assert low <= counts <= high == low + 100.0


def test_what_a_value_means_is_said_in_words(panel: Panel) -> None:
    """No title is a key of numbers."""
    Charts(panel, panel)  # type: ignore[arg-type]
    for chart in panel.charts:
        assert not any(letter.isdigit() for letter in chart.title)
        low, high = chart.scales["y"].get("range", (0.0, 0.0))
        words = chart.axes[1].get("values", ())
        assert all(low < place < high for place in range(len(words)))
    words = {chart.title: chart.axes[1].get("values") for chart in panel.charts}
    assert words["contact"] == ("free", "contact", "unknown")
    assert words["maneuver"] == ("forward", "turn left", "turn right", "reverse", "hold")
    names = [series["label"] for series in panel.charts[-1].series]
    assert {"missed ticks", "missed answers"} < set(names)


def test_the_words_beside_a_chart_have_room(panel: Panel) -> None:
    """uPlot draws them in 12 pixels, with a tick of 10 and a gap of 5; DejaVu is a wide font."""
    Charts(panel, panel)  # type: ignore[arg-type]
    words = [(w, chart.axes[1]) for chart in panel.charts for w in chart.axes[1].get("values", ())]
    assert "DEGRADED" in [word for word, _ in words]
    for word, axis in words:
        assert font(12).getlength(word) + 10 + 5 <= axis["size"], word


def test_a_weak_force_has_an_arrow_that_is_seen_and_none_has_no_arrow() -> None:
    """A strong one is as long as its newtons say."""
    forces = np.array(
        [[1, 2, 3, 0, 0, 10], [0, 0, 0, 0, 0, 0], [4, 5, 6, 0.01, 0, 0]], dtype=np.float32
    )
    found = arrows(forces, scale=0.02, least=0.03)
    assert found == pytest.approx(
        np.array([[[1, 2, 3], [1, 2, 3.2]], [[4, 5, 6], [4.03, 5, 6]]]), abs=1e-6
    )
    assert arrows(forces[1:2], 0.02, 0.03).shape == (0, 2, 3)
