"""Deadlines of a robot with torque: their order, and what stands before the torque goes off."""

from __future__ import annotations

import pytest
from test_release import GOAL, ticked, writes
from twin_rig import rig

from antennate.errors import ConfigError
from antennate.hardware.config import DriveConfig
from antennate.hardware.safety import deadlines
from antennate.params.safety import SupervisorParams
from antennate.twin.config import TwinConfig
from antennate.types import State

PERIOD = 0.01


def test_an_answer_comes_before_the_watchdogs_and_they_act_before_a_pause() -> None:
    """Five units of 20 ms (e-manual of the XC430-W240, bus watchdog)."""
    limits = SupervisorParams()
    assert pytest.approx(5 * 0.020) == deadlines.WATCHDOG
    assert PERIOD < deadlines.ANSWER < deadlines.WATCHDOG < limits.longest_pause
    deadlines.require_order(limits, PERIOD)


def test_a_session_refuses_them_too() -> None:
    """Whoever makes one, whatever the parameters were checked for."""
    late = SupervisorParams().model_copy(update={"longest_pause": 0.09})
    made = rig(TwinConfig()).session
    with pytest.raises(ConfigError, match=r"at 0\.1 s, limits\.longest_pause at 0\.09 s"):
        type(made)(
            made.board,
            made.actuators,
            made.clock,
            made.control.controller,
            made.period,
            made.quality,
            late,
        )


def test_a_robot_stands_for_two_seconds_at_most() -> None:
    made = rig(TwinConfig())
    ticked(made, 0.7, lambda t: None)
    seen, begin = writes(made), made.clock.now()
    made.session.stand(60.0)
    assert made.clock.now() - begin == pytest.approx(2.0, abs=2 * PERIOD)
    goals = {data for _, address, data in seen if address == GOAL}
    assert len(goals) == 1
    assert made.session.actuators.enabled


def test_the_supervisor_is_asked_while_a_robot_stands() -> None:
    """A supply that is empty takes the torque off at once, not after the stand."""
    made = rig(TwinConfig())
    ticked(made, 0.7, lambda t: None)
    made.session.actuators.state.supply = 9.0
    begin = made.clock.now()
    made.session.stand(1.0)
    assert made.session.outputs is not None
    assert made.session.outputs.state is State.OFF
    assert made.clock.now() - begin < 0.2
    assert not any(servo.torque for servo in made.robot.servos)


def test_the_longest_stand_of_a_drive_is_that_of_the_session() -> None:
    assert DriveConfig(stand=deadlines.STAND).stand == 2.0
