"""Figure of `antennate dataset`: what the baselines reach, task by task."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from antennate import figures as style
from antennate.studies.columns import Column
from antennate_lab.dataset.columns import TASKS
from antennate_lab.dataset.config import TESTS
from antennate_lab.dataset.estimates import BASELINES, MAE, Errors, TaskResult
from antennate_lab.dataset.experiment import TITLES, FoundWindows

_MARKS = {
    "test": ("o", style.INK),
    "test_antenna": ("s", style.SERIES[1]),
    "test_speed": ("^", style.SERIES[0]),
}


@style.styled
def figures(outcome: FoundWindows) -> dict[str, Figure]:
    """Errors of the baselines in each task, on the three splits of test."""
    results = outcome.result().tasks
    tasks = [task for task in TASKS if task.name in results]
    figure = style.canvas(style.WIDTH, 0.9 + 2.1 * len(tasks))
    panels = np.atleast_1d(np.array(figure.subplots(len(tasks), 1)))
    for panel, task in zip(panels, tasks, strict=True):
        _draw(panel, results[task.name])
        panel.set_title(task.title)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(TESTS))
    return {"dataset": figure}


def _draw(panel: Axes, task: TaskResult) -> None:
    mae = MAE[task.unit]
    for i, (split, test) in enumerate(task.tests.items()):
        marker, colour = _MARKS[split]
        style.intervals(
            panel,
            [k + 0.18 * (i - 1) for k in range(len(BASELINES))],
            [_drawn(mae, test.get(baseline)) for baseline in BASELINES],
            ("mean", "ends"),
            marker=marker,
            color=colour,
            label=TITLES[split],
        )
    style.categories(panel, [b.replace("_", "\n") for b in BASELINES])
    panel.set(ylabel=f"mean absolute\nerror [{mae.unit}] (95 %)", ylim=(0, None))


def _drawn(mae: Column, errors: Errors | None) -> dict[str, Any]:
    """Mean absolute error and its interval in the unit shown; None where there is none."""
    value, ends = mae.value(errors), mae.ends.value(errors)
    return {
        "mean": None if value is None else mae.scale * value,
        "ends": ends and tuple(mae.scale * end for end in ends),
    }
