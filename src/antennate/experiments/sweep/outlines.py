"""Points along simulated antennae over time, as plain CSV that `antennate tracks` reads."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.experiments.sweep.scan import Trace
from antennate.types import Bools, Floats

_BODY = 0.1
"""Distance of the point `tail` behind `head`, which is on the base before the first hinge [m]."""


@dataclass(frozen=True, slots=True)
class Outlines:
    """One sweep.

    Attributes:
        trial: Its name.
        t: Time [s], shape (n,).
        points: Along the antenna [m], shape (n, k, 2).
        touching: Whether it touches the wall, shape (n,).
    """

    trial: str
    t: Floats
    points: Floats
    touching: Bools


def of_trace(trial: str, trace: Trace, first: float) -> Outlines:
    """The points of a sweep from `first` [s] on, as `shares` counts them."""
    at = trace.t > first
    return Outlines(trial, trace.t[at], trace.points[at], trace.touching[at])


def to_csv(sweeps: Sequence[Outlines]) -> str:
    """A row for each sample: `left0` to the tip, body axis `tail` to `head`, and contact."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names = [f"left{i}" for i in range(sweeps[0].points.shape[1])]
    columns = [f"{name}_{axis}" for name in (*names, "head", "tail") for axis in "xy"]
    writer.writerow(["trial", "frame", "time", "left_contact", *columns])
    for sweep in sweeps:
        for i, points in enumerate(sweep.points):
            head = points[0]
            every = np.vstack([points, head, head - (_BODY, 0.0)]).ravel()
            cells = [f"{value:.6f}" for value in every]
            writer.writerow([sweep.trial, i, f"{sweep.t[i]:.6f}", int(sweep.touching[i]), *cells])
    return file.getvalue()
