"""A walking animal with antennae of known shapes, as plain CSV, and what `tracks` makes of it."""

from __future__ import annotations

import csv
import pickle
from pathlib import Path

import numpy as np
import pytest

import antennate

POINTS = {
    "left": ("l0", "l1", "l2", "l3"),
    "right": ("r0", "r1", "r2", "r3"),
    "tail": "tail",
    "head": "head",
}
NAMES = (*POINTS["left"], *POINTS["right"], "tail", "head")
DWELL = {  # direction of the first segment and turns [deg], outwards, of antennae held so
    "forward": (60.0, -30.0, -25.0),
    "straight": (50.0, 0.0, 0.0),
    "backward": (80.0, 30.0, 30.0),
    "transition": (50.0, 45.0, -45.0),
}


def bent(direction: float, *turns: float, length: float = 1.0) -> np.ndarray:
    """Points of an antenna of equal segments from the origin, ahead and outwards; angles [deg]."""
    angles = np.radians(np.cumsum([direction, *turns]))
    steps = length / len(angles) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([[(0.0, 0.0)], np.cumsum(steps, axis=0)])


def animal(names: list[str], heading: float = 0.3) -> dict[str, np.ndarray]:
    """Points (n, 2) of a walking animal, y up, both antennae of these shapes frame by frame."""
    t = np.arange(len(names)) / 100.0
    heading_now = heading + 0.2 * np.sin(t)
    ahead = np.stack([np.cos(heading_now), np.sin(heading_now)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    head = np.stack([300.0 + 40.0 * t, 200.0 + 10.0 * t], axis=1)
    found = {"head": head, "tail": head - 150.0 * ahead}
    shape = np.array([bent(*DWELL[name], length=100.0) for name in names])
    for side, sign in (("l", 1.0), ("r", -1.0)):
        for k in range(4):
            x, y = shape[:, k, 0], sign * (10.0 + shape[:, k, 1])
            found[f"{side}{k}"] = head + x[:, None] * ahead + y[:, None] * left
    return found


def write(
    path: Path,
    points: dict[str, np.ndarray],
    likelihood: dict[str, np.ndarray] | None = None,
    frames: np.ndarray | None = None,
) -> Path:
    """Plain CSV with the default names of columns."""
    count = len(next(iter(points.values())))
    frames = np.arange(count) if frames is None else frames
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        scored = likelihood or {}
        header = [f"{n}_{a}" for n in points for a in "xy"]
        writer.writerow(["frame", "time", *header, *("_".join((n, "likelihood")) for n in scored)])
        for i in range(count):
            cells = [v for n in points for v in points[n][i]]
            cells = ["" if v != v else f"{v:.3f}" for v in cells]
            likely = [f"{scored[n][i]:.2f}" for n in scored]
            writer.writerow([frames[i], f"{frames[i] / 100.0:.2f}", *cells, *likely])
    return path


def dwelling(seed: int, frames: int) -> list[str]:
    """A name of a shape for each frame, each held for 0.4 to 1.5 s at 100 Hz."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < frames:
        found += [list(DWELL)[rng.integers(4)]] * int(rng.integers(40, 150))
    return found[:frames]


def classified(path: Path, **settings) -> tuple[antennate.Result, dict[str, list[str]]]:
    """A run, and the shapes frame by frame of each side."""
    values = {"files": [str(path)], "points": POINTS, "y_down": False, **settings}
    result = antennate.run("tracks", **values)
    rows = list(
        csv.DictReader(
            result.experiment.files(result.config)["frames.csv"](result.outcome).splitlines()
        )
    )
    return result, {
        side: [row["shape"] for row in rows if row["side"] == side] for side in ("left", "right")
    }


def write_table(
    path: Path, columns: list[tuple[str, ...]], values: np.ndarray, names: bytes | None = None
) -> Path:
    """HDF5 as pandas writes it in format `table`, which DeepLabCut uses."""
    h5py = pytest.importorskip("h5py")
    kind = [("index", "<i8"), ("values_block_0", "<f8", (values.shape[1],))]
    table = np.zeros(len(values), kind)
    table["index"], table["values_block_0"] = np.arange(len(values)), values
    with h5py.File(path, "w") as file:
        group = file.create_group("df_with_missing")
        group.attrs["pandas_type"] = b"frame_table"
        made = group.create_dataset("table", data=table)
        made.attrs["values_block_0_kind"] = np.bytes_(names or pickle.dumps(columns, protocol=0))
    return path
