"""The first motion after torque came on: slow, all joints together, and the gait waits for it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from twin_rig import rig

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.safety.session import Session
from antennate.params.safety import SupervisorParams
from antennate.twin.config import TwinConfig
from antennate.types import State

TICK = 2 * math.pi / 4096
PERIOD = 0.01
LIMIT = 5.26
"""Fastest that a goal of a leg moves [rad/s]: robot.legs.fastest."""
ROUNDING = TICK / PERIOD
"""Speed of one tick of the servo in one of the loop [rad/s]."""


class Seen:
    """Goals of all servos [ticks] and the gait's phase after each packet that moves."""

    def __init__(self, approach: float, duration: float) -> None:
        made = rig(TwinConfig())
        limits = SupervisorParams(approach=approach)
        session = Session(
            made.session.board,
            made.session.actuators,
            made.clock,
            made.session.control.controller,
            PERIOD,
            made.session.quality,
            limits,
        )
        self.goals: list[list[int]] = []
        self.phases: list[float] = []
        self.times: list[float] = []
        controller = made.session.control.controller

        def note(session: Session, now: float) -> None:
            if session.tally.sent > len(self.goals):
                self.goals.append([s.get("goal_position") for s in made.robot.servos])
                self.phases.append(float(controller.phase[0]))  # type: ignore[attr-defined]
                self.times.append(float(session.frame.t[0]))

        orders = DriveConfig(dry_run=0.5, duration=duration, touch_check=False, stand=0.1)
        self.report = drive(session, orders, arm=True, on_tick=note)
        self.limited = session.tally.limited

    @property
    def speeds(self) -> np.ndarray:
        """Fastest goal of each packet against the one before [rad/s]."""
        return abs(np.diff(self.goals, axis=0)).max(axis=1) * TICK / PERIOD


def test_without_an_approach_the_first_motion_runs_at_the_limit() -> None:
    """What was so before: at the start of trial 0 in each of the first 100 packets."""
    seen = Seen(approach=LIMIT, duration=1.5)
    assert int((seen.speeds[:100] >= LIMIT - ROUNDING).sum()) == 100


@pytest.mark.ci
def test_the_first_motion_is_slow_and_the_gait_begins_where_it_ends() -> None:
    seen = Seen(approach=1.0, duration=4.0)
    assert seen.report.worst <= State.DEGRADED
    assert int((seen.speeds[:100] >= LIMIT - ROUNDING).sum()) == 0
    waits = int(np.argmax(np.diff(seen.phases) > 0.0))
    assert 50 < waits < math.pi / 1.0 / PERIOD + 5  # half a turn at most
    assert seen.speeds[:waits].max() <= 1.0 + ROUNDING
    assert np.diff(seen.phases)[waits:].min() > 0.0
    assert seen.speeds[waits:].max() <= 1.2 * math.pi + ROUNDING  # a leg at 0.6 Hz
    assert seen.limited == 0
    assert np.ptp(seen.times[: waits - 1]) == pytest.approx(0.0, abs=1e-9)  # the controller's own
