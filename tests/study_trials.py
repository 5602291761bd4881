"""A function for studies in tests: quick, and it notes each time it ends."""

from __future__ import annotations

import os
import time
from typing import Any


def trial(config: dict[str, Any], seed: int) -> dict[str, Any]:
    """Sleep; note the trial in a file; return numbers that follow from point and seed."""
    time.sleep(config.get("sleep", 0.0))
    mode = config.get("mode", "")
    if mode == "raise" and seed == 1:
        raise ValueError("seed one")
    if mode == "die" and seed == 1:
        os._exit(7)
    if mode == "hang" and seed == 1:
        time.sleep(600.0)
    value = float("nan") if mode == "nan" and seed == 1 else (config["x"] + 0.1) * (seed + 1) / 3
    if notes := os.environ.get("STUDY_NOTES"):
        handle = os.open(notes, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(handle, f"{config['x']} {seed}\n".encode())
        os.close(handle)
    said = {"said": "w" * 150_000} if mode == "\N{SNAIL} talks\x7f" else {}
    return {"value": value, "outcome": "success" if seed % 3 else "timeout", **said}
