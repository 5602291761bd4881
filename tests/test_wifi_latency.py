"""Delays of a WiFi radio that sleeps, before a whole session, in invented time."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import pytest
from esp32_streams import hello
from hardware_rig import LIMIT
from twin_rig import Rig, rig

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.esp32 import datagram, frame
from antennate.hardware.esp32.board import Board, BoardReader
from antennate.hardware.ports.network import Verifier
from antennate.hardware.safety.session import Session
from antennate.params.hardware import NetworkParams
from antennate.twin.config import TwinConfig
from antennate.types import State

KEY = bytes(range(32))


class PowerSaving:
    """A twin's board whose radio hears and speaks only when it wakes up; a Port in invented time.

    Args:
        twin: The robot and its clock.
        wake: Time between two wakings from 1 s on [s], 0 for a radio that never sleeps.
    """

    def __init__(self, twin: Rig, wake: float) -> None:
        self._twin, self._wake = twin, wake
        self._host = Verifier(KEY, bytes(16), NetworkParams())
        self._board = datagram.Speaker(datagram.Signer(KEY), 1, hello(1), frame.SAMPLE_FRAME_SIZE)
        self._up: deque[tuple[float, bytes]] = deque()
        self._down: deque[tuple[float, bytes]] = deque()

    def _arrival(self, t: float) -> float:
        """When what is sent at t arrives [s]."""
        asleep = self._wake and t > 1.0
        return 0.003 + (self._wake * (math.floor(t / self._wake) + 1.0) if asleep else t)

    def read(self, most: int, timeout: float) -> bytes:
        now = self._twin.clock.now()
        if (ask := self._host.due_ask(now)) is not None:
            self._down.append((self._arrival(now), ask))
        while self._down and self._down[0][0] <= now:
            answer = self._board.answer(self._down.popleft()[1], "host", round(1e3 * now))
            assert answer is not None
            self._up.append((self._arrival(now), answer))
        for found in self._twin.robot.take().split(b"\0"):
            whole = b"\0" + found + b"\0"
            signed = len(whole) == frame.SAMPLE_FRAME_SIZE and self._board.sign(
                whole, round(1e3 * now)
            )
            if signed:
                self._up.append((self._arrival(now), bytes(signed)))
        heard = b""
        while self._up and self._up[0][0] <= now:
            heard += self._host.take(self._up.popleft()[1], now)[0]
        return heard

    def write(self, data: bytes) -> None:
        raise AssertionError

    def drain(self) -> int:
        raise AssertionError


@pytest.mark.parametrize("beacons", [*(pytest.param(n, marks=pytest.mark.slow) for n in (0, 1)), 3])
def test_L11_no_decision_on_a_sample_that_power_saving_made_old(beacons: int) -> None:
    """While it walks the radio begins to wake every 1 to 3 beacons of 102.4 ms."""
    twin = rig(TwinConfig())
    session = twin.session
    session.board = Board(PowerSaving(twin, 0.1024 * beacons), LIMIT)
    session.reader = BoardReader(session.board, twin.clock)
    states: list[State] = []
    ages: list[float] = []

    def look(session: Session, t: float) -> None:
        out, newest = session.outputs, session.board.clock.newest
        assert out is not None
        if t > 1.0:
            states.append(out.state)
        if out.move:
            assert newest is not None
            ages.append(t - 1e-6 * newest.sample.ticks)

    drive(session, DriveConfig(dry_run=0.5, duration=3.0), arm=True, on_tick=look)
    assert ages
    assert max(ages) - min(ages) <= LIMIT + 1e-3  # the shortest delay cannot be known
    held = np.array(states) >= State.HOLD
    assert held.any() == (beacons > 0)
    failed = np.array(states) >= State.FAULT
    assert np.count_nonzero(np.diff(failed)) <= 2  # to FAULT, and to OFF as the drive ends
