"""How long the running mean is when the board samples at another rate than the loop runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from esp32_streams import BOOT, encoded, hello
from hardware_rig import BENT, FREE, PERIOD
from twin_rig import Bare

from antennate.control.registry import make_controller
from antennate.hardware.esp32.board import Board
from antennate.hardware.esp32.wire import Sample
from antennate.params.control import ControlParams
from antennate.params.safety import SupervisorParams

WAY = 0.002
"""Of a frame to the host [s]."""
WARM_UP = 2.0
"""Time until the board's clock is known [s]."""
WINDOW = ControlParams().conditioning.averaging_time


class Stream:
    """A board that samples at a rate from some phase on, and is bent from a sample on; a clock."""

    def __init__(self, rate: int, phase: float) -> None:
        self._rate, self._phase, self._seq, self._t = rate, phase, 0, 0.0
        self.bent_from = 1 << 31

    def now(self) -> float:
        return self._t

    def sleep_until(self, t: float) -> None:
        self._t = t

    def read(self, most: int, timeout: float) -> bytes:
        said = b""
        while (taken := self._phase + self._seq / self._rate) + WAY <= self._t:
            counts = int(BENT if self._seq >= self.bent_from else FREE)
            sample = Sample(BOOT, self._seq, round(1e6 * taken), counts, counts, 0, 0)
            said += (hello() if self._seq == 0 else b"") + encoded(sample)
            self._seq += 1
        return said

    def write(self, data: bytes) -> None:
        """Nobody listens."""

    def drain(self) -> int:
        return 0

    def bend(self) -> None:
        """From the next sample on."""
        self.bent_from = self._seq


def levels(rate: int, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Bending level and age of the frame [s] of each tick from that of the bend on."""
    stream = Stream(rate, phase)
    board = Board(stream, SupervisorParams().stale_age)
    body: Any = Bare(board, None, stream)  # type: ignore[arg-type]
    control, found, stamps = make_controller("paper", ControlParams()), [], []
    for tick in range(round(WARM_UP / PERIOD) + 60):
        stream.sleep_until(tick * PERIOD)
        frame = body.read()
        control.step(frame)
        if tick == round(WARM_UP / PERIOD):
            stream.bend()
        found.append(control.level[0, 0])
        stamps.append(float(frame.t[0]))
    begin = round(WARM_UP / PERIOD)
    return np.array(found[begin:]), np.array(stamps[begin:])


@pytest.mark.parametrize("rate", [25, 50, 78, 100, 118, 200, 1000])
@pytest.mark.parametrize("phase", [0.0, 0.0031, 0.0077])
def test_L16_the_averaging_window_is_right_within_one_sample(rate: int, phase: float) -> None:
    """From the first reading of a step to the last one before it; and what lies in between."""
    b, stamps = levels(rate, phase)
    assert np.isfinite(b).all()
    first = int(np.argmax(b != b[0]))
    last = int(np.argmax(b == b[-1]))
    sample = max(1 / rate, PERIOD)
    assert abs((last - first + 1) * PERIOD - WINDOW) <= 1 / rate
    used = np.unique(stamps[last - round(WINDOW / PERIOD) + 1 : last + 1])
    assert abs(len(used) * sample - WINDOW) <= sample + 1e-9
    assert abs(stamps[last] - stamps[first] + sample - WINDOW) <= sample + 1e-9


@pytest.mark.parametrize("phase", [0.0, 0.0031, 0.0077])
def test_L16_at_10_Hz_there_is_no_window_and_the_robot_holds(phase: float) -> None:
    """Half of all samples would be older than 50 ms when they are used (L10)."""
    b, _ = levels(10, phase)
    assert np.isnan(b).all()
