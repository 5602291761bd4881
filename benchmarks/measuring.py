"""What all parts of the benchmarks share: clocks, repetitions in turn, and medians with spread."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

Spread = dict[str, float]
"""Median, smallest and largest of several repetitions, and their number."""
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # programs start as on a computer that keeps it
PACKAGES = ("antennate", "mujoco", "mujoco-core", "numpy", "distributed")


def spread(values: Sequence[float], digits: int = 4) -> Spread:
    """Median, smallest and largest, with so many significant digits."""
    median, low, high = statistics.median(values), min(values), max(values)
    found = {"median": median, "low": low, "high": high}
    return {k: float(f"{v:.{digits}g}") for k, v in found.items()} | {"count": len(values)}


def cpu_seconds(action: Callable[[], Any]) -> float:
    """CPU time that this process takes for an action [s]."""
    before = time.process_time()
    action()
    return time.process_time() - before


def wall_seconds(action: Callable[[], Any]) -> float:
    """Time on the clock that an action takes [s]."""
    before = time.perf_counter()
    action()
    return time.perf_counter() - before


def in_turn(cases: Mapping[Any, Callable[[], float]], repetitions: int) -> dict[Any, list[float]]:
    """What every case measures, all cases once in each repetition, every other time backwards.

    So a change of the machine's load meets all of them.
    """
    found: dict[Any, list[float]] = {name: [] for name in cases}
    for i in range(repetitions):
        for name in list(cases)[:: -1 if i % 2 else 1]:
            found[name].append(cases[name]())
    return found


def ratios(values: Iterable[float], others: Iterable[float]) -> list[float]:
    """Values over those of the same repetition of another case."""
    return [one / other for one, other in zip(values, others, strict=True)]


def machine() -> dict[str, Any]:
    """What the figures of a part depend on beside the code."""
    packages = {}
    for name in PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            packages[name] = metadata.version(name)
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": packages,
    }


def _cpu() -> str:
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        name, _, value = line.partition(":")
        if name.strip() == "model name":
            return " ".join(value.split())
    return platform.processor() or "unknown"


def _busy() -> float:
    """CPU time that all programs of this machine have taken [s]."""
    user, nice, system, _, _, irq, softirq, *_ = map(
        int, Path("/proc/stat").read_text(encoding="utf-8").split("\n", 1)[0].split()[1:]
    )
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def _own() -> float:
    """CPU time that this program and the processes it has waited for have taken [s]."""
    return sum(os.times()[:4])


@contextmanager
def watched(quick: bool):
    """Watch the machine while a part is measured; yields what is filled in at the end.

    `others` is the mean number of cores that other programs kept busy meanwhile.
    """
    about: dict[str, Any] = {
        "date": datetime.now(UTC).date().isoformat(),
        "quick": quick,
        "load_before": round(os.getloadavg()[0], 2),
    }
    begin, busy, own = time.perf_counter(), _busy(), _own()
    yield about
    seconds = time.perf_counter() - begin
    about["load_after"] = round(os.getloadavg()[0], 2)
    about["others"] = round(max(0.0, _busy() - busy - _own() + own) / seconds, 2)
    about["seconds"] = round(seconds)
    about["machine"] = machine()
