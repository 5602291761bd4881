"""A twin in lock-step whose clock is served, on a thread of its own, over wires of any kind."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue

import numpy as np

from antennate.control.controllers import RuleController, closed_loop
from antennate.experiments.tunnel.run import TunnelConfig, prepare
from antennate.hardware.ports.finder import finder
from antennate.hardware.ports.port import PortError
from antennate.params import ControlParams
from antennate.robots.body import RobotParams
from antennate.robots.layout import LayoutParams
from antennate.twin.ends import End, Terminal
from antennate.twin.faults import Faults, read
from antennate.twin.robot import TwinRobot
from antennate.twin.serve import TwinServer


def closed(control: ControlParams, robot: RobotParams, batch: int) -> RuleController:
    """The controller `closed` with the gait phase of trial 0, as `drive --controller` takes it."""
    made = closed_loop(control, robot, batch)
    made.reset(np.array([0]), prepare(TunnelConfig(seed=0), 0).phase)
    return made


class Late:
    """A wire some of whose bytes come late, each way, by chance."""

    def __init__(self, end: End, longest: float) -> None:
        self._end, self._longest = end, longest
        self._chance = random.Random(1)
        self._said: SimpleQueue[bytes] = SimpleQueue()
        self._start()
        self.path, self.fileno, self.baud = end.path, end.fileno, end.baud

    @property
    def taken(self) -> bool:
        return self._end.taken

    def read(self) -> bytes:
        self._dawdle()
        return self._end.read()

    def write(self, data: bytes) -> int:
        cut = len(data) // 2
        for part in filter(None, (data[:cut], data[cut:])):
            self._said.put(part)
        return len(data)

    def clear(self) -> None:
        self._stop()
        self._end.clear()
        self._start()

    def close(self) -> None:
        self._stop()
        self._end.close()

    def _start(self) -> None:
        self._thread = threading.Thread(target=self._deliver, daemon=True)
        self._thread.start()

    def _stop(self) -> None:
        self._said.put(b"")
        self._thread.join()

    def _deliver(self) -> None:
        while part := self._said.get():
            self._dawdle()
            self._end.write(part)

    def _dawdle(self) -> None:
        if self._chance.random() < 0.05:
            time.sleep(self._chance.uniform(0.0, self._longest))


def terminals() -> list[End]:
    """Board, bus and clock on three pseudo-terminals."""
    return [Terminal(), Terminal(), Terminal()]


@contextmanager
def served(
    robot: TwinRobot, ends: Callable[[], list[End]] = terminals, faults: tuple[str, ...] = ()
) -> Iterator[dict[str, str]]:
    """Serve a robot; where its wires are."""
    over = threading.Event()
    demands = Faults([read(text) for text in faults], LayoutParams().ids)
    with TwinServer(robot, demands, *ends()) as server:
        thread = threading.Thread(
            target=server.run_lockstep, args=(lambda t: not over.is_set(),), daemon=True
        )
        thread.start()
        try:
            yield server.paths
        finally:
            over.set()
            with suppress(PortError):  # a word wakes it
                line = finder(server.paths["clock"], 115_200)()
                line.write(b"\n")
                line.close()
            thread.join()
