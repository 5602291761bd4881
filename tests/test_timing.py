"""Overruns are counted and blamed, ticks keep their grid, and none is made up for."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest

import antennate.hardware
from antennate.errors import ConfigError
from antennate.hardware.timing import LoopTiming

PERIOD = 0.01
PURE = ("causes", "diagnosis", "rate", "supervisor", "timing", "touch_check")


def run(delays: dict[int, tuple[str, float]], ticks: int, start: float = 5.0):
    """A loop of two stages of 1 ms in invented time; some ticks are delayed in one of them [s]."""
    timing = LoopTiming(start, PERIOD)
    now, begun = start, []
    for _ in range(ticks):
        stage, delay = delays.get(timing.number, ("", 0.0))
        begun.append((timing.number, now))
        timing.begin(now)
        for name in ("read", "decide"):
            now += 0.001 + delay * (name == stage)
            timing.mark(name, now)
        due = timing.finish(now)
        assert due >= now
        now = max(now, due)
    return timing, begun


@pytest.mark.parametrize("delay", [0.005, 0.0085, 0.01, 0.033, 0.12, 0.5])
@pytest.mark.parametrize("stage", ["read", "decide"])
def test_T1_an_overrun_is_counted_and_blamed(delay: float, stage: str) -> None:
    timing, begun = run({20: (stage, delay)}, 100)
    report = timing.report()
    lasted = 0.002 + delay
    missed = math.ceil(lasted / PERIOD - 1e-9) - 1
    assert report.overruns == (missed > 0)
    assert report.missed_cycles == missed
    assert report.worst_tick == pytest.approx(lasted)
    assert report.stages[stage].worst == pytest.approx(0.001 + delay)
    other = "decide" if stage == "read" else "read"
    assert report.stages[stage].overruns == report.overruns
    assert report.stages[other].overruns == 0
    assert report.missed_share == pytest.approx(missed / (100 + missed))
    assert begun[-1][0] == 99 + missed


def test_T1_the_nth_tick_is_due_at_its_place_and_there_is_no_burst() -> None:
    """Random overruns for 10^5 ticks: no drift, and no two ticks closer than a period."""
    rng = np.random.default_rng(1)
    hit = rng.random(120_000) < 0.02
    delays = {n: ("decide", float(rng.uniform(0.005, 0.5))) for n in np.flatnonzero(hit).tolist()}
    timing, begun = run(delays, 100_000, start=1234.5)
    numbers = np.array([n for n, _ in begun])
    times = np.array([t for _, t in begun])
    assert times == pytest.approx(1234.5 + numbers * PERIOD, abs=1e-9)
    assert np.diff(times).min() > 0.99 * PERIOD
    assert (
        timing.report().missed_cycles == numbers[-1] + 1 + (timing.number - numbers[-1] - 1) - 1e5
    )
    assert timing.report().overruns > 1000


def test_T1_a_late_start_is_lateness_but_shifts_nothing() -> None:
    timing = LoopTiming(0.0, PERIOD)
    assert timing.begin(0.004) == pytest.approx(0.004)
    assert timing.finish(0.006) == pytest.approx(0.01)
    assert timing.begin(0.01) == 0
    assert timing.finish(0.02) == pytest.approx(0.02)
    assert timing.report().worst_lateness == pytest.approx(0.004)
    assert timing.report().overruns == 0


def test_T1_a_stage_may_have_several_parts() -> None:
    timing = LoopTiming(0.0, PERIOD)
    timing.begin(0.0)
    for n, stage in enumerate(["bus", "decide", "bus"], 1):
        timing.mark(stage, 0.001 * n)
    timing.finish(0.003)
    stages = timing.report().stages
    assert stages["bus"].worst == pytest.approx(0.002)
    assert stages["decide"].worst == pytest.approx(0.001)


@pytest.mark.parametrize(("start", "period"), [(math.nan, 0.01), (0.0, 0.0), (0.0, math.inf)])
def test_a_pace_that_cannot_be_kept_is_refused(start: float, period: float) -> None:
    with pytest.raises(ConfigError, match="period above 0 s"):
        LoopTiming(start, period)


@pytest.mark.parametrize("module", PURE)
def test_T4_nothing_here_can_read_a_clock(module: str) -> None:
    """A step of the wall clock has no effect on what never asks for it."""
    path = Path(antennate.hardware.__path__[0]) / f"{module}.py"
    imported = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module or "")
    outside = {name for name in imported if not name.startswith("antennate")}
    assert outside <= {
        "__future__",
        "collections",
        "collections.abc",
        "dataclasses",
        "enum",
        "math",
    }
