"""A small network in NumPy that learns from a data set of touch: `touch_network.py RUN [TASK]`."""

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from antennate.studies.statistics import mean95
from antennate_lab.dataset.estimates import by_episode

STEPS, HIDDEN, ROUNDS, RATE = 20, 32, 1000, 3e-3
"""Means that a window becomes, size of the hidden layer, steps of Adam, and how large they are."""
TASKS = {
    "distance": ("walk", "distance_m"),
    "angle": ("walk", "angle_rad"),
    "gap": ("gap", "gap_m"),
    "place": ("push", "place_m"),
}


def read(folder, kind, label):
    """Inputs (n, k), labels (n,), splits (n,) and episodes (n,) of a file."""
    table = pq.read_table(f"{folder}/{kind}.parquet")
    names = [f.name for f in table.schema if f.metadata[b"role"] == b"input"]
    columns = [np.stack(table[n].to_numpy()) for n in names if not n.startswith("leg")]
    x = np.hstack([c.reshape(len(c), STEPS, -1).mean(axis=2) for c in columns])
    return x, *(table[name].to_numpy() for name in (label, "split", "episode"))


def predict(w, x):
    """Hidden layer and estimates."""
    h = np.tanh(x @ w[0] + w[1])
    return h, h @ w[2] + w[3]


def train(x, y, split, decay, rng):
    """Weights of least error on the validation split, and that error."""
    w = [rng.normal(0, x.shape[1] ** -0.5, (x.shape[1], HIDDEN)), np.zeros(HIDDEN)]
    w += [rng.normal(0, HIDDEN**-0.5, HIDDEN), np.zeros(())]
    m, v = [[np.zeros_like(p) for p in w] for _ in range(2)]
    a, b, c = x[split == "train"], y[split == "train"], split == "validation"
    best, least = w, np.inf
    for step in range(1, ROUNDS + 1):
        h, out = predict(w, a)
        e = (out - b) / len(b)
        d = np.outer(e, w[2]) * (1 - h**2)
        for i, g in enumerate((a.T @ d + decay * w[0], d.sum(0), h.T @ e, e.sum())):
            m[i], v[i] = 0.9 * m[i] + 0.1 * g, 0.999 * v[i] + 0.001 * g**2
            size = np.sqrt(v[i] / (1 - 0.999**step)) + 1e-8
            w[i] = w[i] - RATE * m[i] / (1 - 0.9**step) / size
        if (error := abs(predict(w, x[c])[1] - y[c]).mean()) < least:
            best, least = list(w), error
    return best, least


def main(folder, tasks):
    """Train and test a network for each task, of those of which there is data if none is named."""
    there = [task for task in TASKS if (folder / f"{TASKS[task][0]}.parquet").exists()]
    for task in tasks or there:
        kind, label = TASKS[task]
        x, y, split, episode = read(folder, kind, label)
        known = split == "train"
        x = (x - x[known].mean(0)) / (x[known].std(0) + 1e-6)
        scaled = (y - y[known].mean()) / y[known].std()
        fits = [train(x, scaled, split, d, np.random.default_rng(0)) for d in (1e-3, 1e-2, 1e-1)]
        w, _ = min(fits, key=lambda fit: fit[1])
        error = abs(predict(w, x)[1] - scaled) * y[known].std()
        for name in ("test", "test_antenna", "test_speed"):
            mean, ends = mean95(by_episode(error[split == name], episode[split == name]))
            print(f"{task:9}{name:13}{mean:.5f}", *(f"{end:.5f}" for end in ends or ()))


if __name__ == "__main__":
    main(Path(*sys.argv[1:2] or sys.exit(__doc__)), sys.argv[2:])
