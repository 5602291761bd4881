"""The one loop: order of calls, its end, and due times that never drift."""

from __future__ import annotations

import numpy as np
import pytest

from antennate.control.loop import run_loop
from antennate.types import AntennaFrame, JointCommand

PERIOD = 0.01


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
