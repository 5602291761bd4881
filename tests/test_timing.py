"""The one loop: its order, ticks on their grid, overruns that are counted and blamed."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest

import antennate
from antennate.control.loop import run_loop
from antennate.hardware.timing import LoopTiming
from antennate.types import AntennaFrame, JointCommand

PERIOD = 0.01
LIBRARY = Path(antennate.__path__[0])
MODULES = sorted(
    path.relative_to(LIBRARY)
    for part in ("hardware", "twin")
    for path in (LIBRARY / part).rglob("*.py")
)
WALL = {
    "time": {"time", "time_ns", "ctime", "localtime", "gmtime", "strftime", "asctime"},
    "datetime": {"now", "utcnow", "today"},
}
"""What asks for the time of day, by the module it belongs to."""
PURE = (
    *(f"safety/{name}" for name in ("causes", "channel", "signal_quality", "supervisor")),
    "timing",
)


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
    timing.begin(0.004)
    assert timing.finish(0.006) == pytest.approx(0.01)
    timing.begin(0.01)
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


def wall_clocks(source: str) -> set[str]:
    """Names by which a module asks for the time of day, or could."""
    found = set[str]()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = {alias.name for alias in node.names}
            found |= names & {"datetime", "calendar", "email.utils"}
            found |= {
                f"{a.name} as {a.asname}" for a in node.names if a.name == "time" and a.asname
            }
        elif isinstance(node, ast.ImportFrom) and node.module in WALL:
            found |= {alias.name for alias in node.names} & (
                WALL["time"] | {"*", "datetime", "date"}
            )
        elif isinstance(node, ast.Attribute):
            owner = getattr(node.value, "id", getattr(node.value, "attr", ""))
            of = "time" if owner == "time" else "datetime" if owner in ("datetime", "date") else ""
            found |= {f"{owner}.{node.attr}"} if of and node.attr in WALL[of] else set()
            found |= {node.attr} & {"CLOCK_REALTIME"}
    return found


def test_T4_no_module_between_bytes_and_motion_asks_for_the_time_of_day() -> None:
    assert len(MODULES) > 50
    for path in MODULES:
        assert not wall_clocks((LIBRARY / path).read_text(encoding="utf-8")), path


@pytest.mark.parametrize(
    "source",
    [
        "import time\ntime.time()",
        "import time as t",
        "from time import time_ns",
        "import datetime",
        "from datetime import datetime\ndatetime.now()",
        "import time\ntime.clock_gettime(time.CLOCK_REALTIME)",
    ],
)
def test_T4_such_a_question_is_seen(source: str) -> None:
    assert wall_clocks(source)


@pytest.mark.parametrize("module", PURE)
def test_T4_nothing_here_can_read_a_clock(module: str) -> None:
    """A step of the wall clock has no effect on what never asks for it."""
    path = LIBRARY / "hardware" / f"{module}.py"
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
        "itertools",
        "math",
        "numpy",
        "re",
        "statistics",
    }


class FakeWorld:
    """A body, its clock and a control in one; reading takes as long as it is told."""

    def __init__(self, start: float, durations: list[float]) -> None:
        self.time = start
        self.durations = durations
        self.calls: list[str] = []
        self.read_at: list[float] = []
        self.due: list[float] = []

    @property
    def clock(self) -> FakeWorld:
        return self

    def now(self) -> float:
        return self.time

    def sleep_until(self, t: float) -> None:
        self.calls.append("sleep")
        self.due.append(t)
        self.time = max(self.time, t)

    def read(self) -> AntennaFrame:
        self.calls.append("read")
        self.read_at.append(self.time)
        self.time += self.durations[len(self.read_at) - 1]
        return AntennaFrame(t=np.array([self.time]), counts=np.zeros((1, 2)))

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.calls.append("decide")
        return JointCommand(
            yaw=np.full((1, 5), frame.t), leg=np.zeros((1, 6, 2)), antenna=np.zeros((1, 2))
        )

    def write(self, command: JointCommand) -> None:
        self.calls.append("write")
        self.written = command

    def run(self) -> int:
        return run_loop(self, self, PERIOD, lambda *_: len(self.read_at) < len(self.durations))


def test_every_tick_is_due_a_whole_number_of_periods_after_the_start() -> None:
    world = FakeWorld(5.0, [0.001] * 500)
    world.run()
    assert world.due == [5.0 + n * PERIOD for n in range(1, 500)]


def test_T1_an_overrun_leaves_out_the_ticks_it_covers_and_delays_none_after() -> None:
    world = FakeWorld(0.0, [0.001, 0.025, 0.001, 0.001, 0.001])
    world.run()
    assert world.read_at == pytest.approx([0.0, 0.01, 0.04, 0.05, 0.06])


def test_it_reads_decides_writes_and_then_waits() -> None:
    world = FakeWorld(0.0, [0.0, 0.0])
    world.run()
    assert world.calls == ["read", "decide", "write", "sleep", "read", "decide", "write"]


def test_it_ends_when_it_is_told_to_and_says_how_many_ticks_it_ran() -> None:
    assert FakeWorld(0.0, [0.0] * 17).run() == 17


def test_what_is_written_is_what_was_decided_on_what_was_read() -> None:
    world = FakeWorld(3.0, [0.004])
    seen: list[tuple[AntennaFrame, JointCommand]] = []
    run_loop(world, world, PERIOD, lambda frame, command: bool(seen.append((frame, command))))
    frame, command = seen[0]
    assert command is world.written
    assert frame.t == pytest.approx([3.004])
    assert command.yaw[0, 0] == pytest.approx(3.004)
