"""A board that falls silent, in real time, over two pseudo-terminals: until what does it walk?"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from esp32_streams import BOOT, encoded, hello
from hardware_rig import FREE
from pty_server import PtyServer
from servo_rig import servos
from stated import stated

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import drive
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.esp32.wire import Sample
from antennate.hardware.ports.serial_line import SerialPort
from antennate.hardware.safety.session import Session
from antennate.host import HostClock, claim, urgent
from antennate.params.safety import SupervisorParams
from antennate.twin.serve import Terminal
from dynamixel_bus.model import EXTENDED_MODE
from dynamixel_bus.servo_bus import ServoBus

LIMIT = 0.1
"""Time from the last valid sample to the HOLD on the bus [s], as the row says."""
CONFIG = DriveConfig(
    robot=stated(),
    controller="open",
    dry_run=1.0,
    touch_check=False,
    limits=SupervisorParams(repeats=100, repeat_time=1e-6),
)
"""However often it holds, it is no FAULT."""


class Servos(ServoBus):
    """Real servos are not delayed by a busy host: neither is the thread that serves these."""

    claimed = False

    def next_time(self) -> float | None:
        if not self.claimed:
            self.claimed = True
            claim()
        return super().next_time()


class Board(threading.Thread):
    """Samples at 100 Hz in real time, but for some silences; at its end the drive is over.

    Attributes:
        last: When the last sample before each silence was sent [s].
    """

    def __init__(self, terminal: Terminal, silences: int, seed: int) -> None:
        super().__init__(daemon=True)
        self._terminal, self._chance = terminal, np.random.default_rng(seed)
        self._silences = silences
        self.last: list[float] = []
        self.over = threading.Event()

    def run(self) -> None:
        claim()  # nor is a real board
        begin = sent = due = time.monotonic()
        seq, greeted = 0, -1.0
        for end in self._ends():
            while (now := time.monotonic() - begin) < end:
                left, right = np.rint(self._chance.normal(FREE, 2.5, 2)).astype(int).tolist()
                sample = Sample(BOOT, seq, round(1e6 * now) % 2**30, left, right, 0, 0)
                self._terminal.write((hello() if now - greeted >= 1 else b"") + encoded(sample))
                greeted, sent = now if now - greeted >= 1 else greeted, time.monotonic()
                seq, due = seq + 1, due + 0.01
                time.sleep(max(due - sent, 0.0))
            self.last.append(sent)
            due += 0.3 + self._chance.uniform(0.0, 0.01)  # at another phase of the loop
            time.sleep(due - time.monotonic())
            seq += 30  # of samples that it took and could not send
        self.over.set()

    def _ends(self) -> Iterator[float]:
        """When each silence begins, at a random phase of the loop [s]."""
        end = 3.5
        for _ in range(self._silences):
            yield end
            end += 0.3 + 0.8 + self._chance.uniform(0.0, 0.1)


def walking(silences: int, seed: int) -> list[float]:
    """One drive: the time from each last sample to the HOLD on the bus [s]."""
    made = servos()
    for servo in made:
        if 6 <= servo.get("id") <= 17:
            servo.set("operating_mode", EXTENDED_MODE)
        else:
            servo.place(2048.0)
    goals: list[tuple[float, tuple[int, ...]]] = []
    bus = Servos(made)

    def note() -> None:
        said = tuple(servo.get("goal_position") for servo in made)
        goals.append((time.monotonic(), said))

    bus.on_goals = note
    terminal = Terminal()
    board = Board(terminal, silences, seed)

    def go_on(session: Session, t: float) -> None:
        if board.over.is_set():
            raise KeyboardInterrupt

    board.start()
    with PtyServer(bus) as server, urgent():
        ports = SerialPort(terminal.path, BOARD_BAUD), SerialPort(server.path, 1_000_000)
        try:
            report = drive(prepare(CONFIG, *ports, HostClock()), CONFIG, arm=True, on_tick=go_on)
        finally:
            board.join()
            for port in ports:
                port.close()
            terminal.close()
    assert report.safe
    return [held for last in board.last if (held := first_hold(goals, last)) is not None]


def first_hold(goals: list[tuple[float, tuple[int, ...]]], last: float) -> float | None:
    """Time from the last sample to the first goals that are those before, and stay so [s].

    None if it did not walk before, as after a FAULT: this machine may starve the servos.
    """
    silent = [(t, said) for t, said in goals if last - 0.1 < t < last + 0.3]
    if len(silent) < 10 or silent[0][1] == silent[5][1]:
        return None
    held = silent[-1][1]
    first = next(i for i, (_, said) in enumerate(silent) if said == held)
    assert all(said == held for _, said in silent[first:])
    return silent[first + 1][0] - last


def silences(wanted: int, at_once: int, drives: int) -> list[float]:
    """That many silences of walking robots, of at most so many drives."""
    held: list[float] = []
    for seed in range(drives):
        held += walking(at_once, seed)
        if len(held) >= wanted:
            break
    assert len(held) >= wanted
    return held


@pytest.mark.slow
def test_L8_fifty_silences_on_the_wall_clock() -> None:
    held = silences(50, at_once=13, drives=8)
    least, most = 1e3 * min(held), 1e3 * max(held)
    sys.stdout.write(f"{len(held)} times HOLD, {least:.0f} to {most:.0f} ms after a sample\n")
    assert max(held) <= LIMIT
