"""Functions for searches in tests: quick, with known optima, and they note each trial."""

from __future__ import annotations

import os
import random
import time
from itertools import pairwise
from pathlib import Path
from typing import Any


def trial(config: dict[str, Any], seed: int) -> dict[str, Any]:
    """Two bowls with noise: `near` is least at x = 0, `far` at x = 1, `bowl` at x = 0.7, n = 3."""
    time.sleep(config.get("sleep", 0.0))
    x, n = config["x"], config.get("n", 3)
    mode = config.get("mode", "")
    if mode == "raise" and x > 0.5:
        raise ValueError("too far")
    if mode == "file" and seed == 1 and Path(config["file"]).exists():
        raise ValueError("the file is there")
    if notes := os.environ.get("STUDY_NOTES"):
        handle = os.open(notes, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(handle, f"{config} {seed}\n".encode())
        os.close(handle)
    coils = config.get("coils", [])
    noise = config.get("noise", 0.0) * random.Random(f"{x} {seed}").gauss(0.0, 1.0)
    return {
        "near": x**2 + noise,
        "far": (x - 1.0) ** 2 + noise if mode != "nan" or seed != 1 else float("nan"),
        "bowl": (x - 0.7) ** 2 + (n - 3) ** 2,
        "length": len(coils),
        "fall": sum(first > second for first, second in pairwise(coils)),
        "word": "text",
        "outcome": "success" if x + noise < 0.5 else "timeout",
    }
