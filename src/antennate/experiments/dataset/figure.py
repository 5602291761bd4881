"""Figure of `antennate dataset`: what the baselines reach, task by task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.experiments.dataset.columns import TASKS
from antennate.experiments.dataset.config import TESTS
from antennate.experiments.dataset.estimates import BASELINES
from antennate.experiments.dataset.experiment import TITLES, DatasetOutcome, shown_error

_MARKS = {
    "test": ("o", style.INK),
    "test_antenna": ("s", style.SERIES[1]),
    "test_speed": ("^", style.SERIES[0]),
}


@style.styled
def figures(outcome: DatasetOutcome) -> dict[str, Figure]:
    """Errors of the baselines in each task, on the three splits of test."""
    entries = outcome.result()["tasks"]
    tasks = [task for task in TASKS if task.name in entries]
    figure = style.canvas(style.WIDTH, 0.9 + 2.1 * len(tasks))
    panels = np.atleast_1d(np.array(figure.subplots(len(tasks), 1)))
    for panel, task in zip(panels, tasks, strict=True):
        _draw(panel, task.name, entries[task.name])
        panel.set_title(task.title)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(TESTS))
    return {"dataset": figure}


def _draw(panel: Axes, name: str, entry: Mapping[str, Any]) -> None:
    measure = shown_error(name, entry["unit"])
    key = measure.name
    for i, (split, test) in enumerate(entry["tests"].items()):
        marker, colour = _MARKS[split]
        rows = [
            {
                "value": measure.scale * test[b][key],
                "ends": _scaled(test[b][f"{key}_95"], measure.scale),
            }
            if test.get(b, {}).get("windows")
            else {}
            for b in BASELINES
        ]
        places = [k + 0.18 * (i - 1) for k in range(len(BASELINES))]
        style.intervals(
            panel,
            places,
            rows,
            ("value", "ends"),
            marker=marker,
            color=colour,
            label=TITLES[split],
        )
    style.categories(panel, [b.replace("_", "\n") for b in BASELINES])
    panel.set(ylabel=f"mean absolute\nerror [{measure.unit}] (95 %)", ylim=(0, None))


def _scaled(ends: Any, scale: float) -> Any:
    return None if ends is None else [scale * end for end in ends]
