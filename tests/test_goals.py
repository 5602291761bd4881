"""A robot that walks by goals of its joints from elsewhere, in invented time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from antennate.hardware.driving.goals import GoalController
from antennate.params.control import ControlParams
from antennate.params.hardware import GoalsParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Floats, JointCommand, Maneuver, joint_angles

ROBOT = RobotSpec()
COUNT = len(ROBOT.joint_names)
FREE = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), 1872.0))
NOTHING = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), math.nan))
ANGLES = np.linspace(-0.2, 0.2, COUNT)


class Peer:
    """Goals at a time [s], of an age [s]."""

    def __init__(self) -> None:
        self.t, self.came = 0.0, None
        self.robot = GoalController(
            ControlParams(), ROBOT, GoalsParams(release=0.2), self.newest, lambda: self.t
        )

    def newest(self) -> tuple[Sequence[float], float] | None:
        came, self.came = self.came, None
        return came

    def step(self, t: float, angles: Floats | None = None, age: float = 0.0) -> JointCommand:
        self.t = t
        self.came = None if angles is None else (angles.tolist(), age)
        return self.robot.step(FREE)


def angles_of(command: JointCommand) -> Floats:
    return joint_angles(command, ROBOT.command_shapes())[0]


@pytest.fixture
def peer() -> Peer:
    return Peer()


def test_it_stands_before_the_first_goals(peer: Peer) -> None:
    first = angles_of(peer.step(0.0))
    assert peer.robot.maneuver == Maneuver.HOLD
    assert np.isfinite(first).all()
    np.testing.assert_array_equal(angles_of(peer.step(5.0)), first)


def test_goals_are_the_targets_of_the_joints_in_their_order(peer: Peer) -> None:
    np.testing.assert_array_equal(angles_of(peer.step(0.0, ANGLES)), ANGLES)
    assert peer.robot.maneuver == Maneuver.FORWARD


def test_goals_that_are_stale_hold_where_they_led(peer: Peer) -> None:
    peer.step(0.0, ANGLES)
    assert peer.robot.maneuver == Maneuver.FORWARD
    peer.step(0.19)
    assert peer.robot.maneuver == Maneuver.FORWARD
    held = peer.step(0.21)
    assert peer.robot.maneuver == Maneuver.HOLD
    np.testing.assert_array_equal(angles_of(held), ANGLES)
    peer.step(0.3, -ANGLES)
    assert peer.robot.maneuver == Maneuver.FORWARD


def test_goals_that_come_late_lead_nowhere(peer: Peer) -> None:
    """As those of a process that stood still."""
    peer.step(0.0, ANGLES)
    held = peer.step(1.0, -ANGLES, age=0.5)
    assert peer.robot.maneuver == Maneuver.HOLD
    np.testing.assert_array_equal(angles_of(held), ANGLES)


def test_it_holds_where_a_reading_cannot_be_used(peer: Peer) -> None:
    peer.step(0.0, ANGLES)
    peer.came = ((-ANGLES).tolist(), 0.0)
    held = peer.robot.step(NOTHING)
    assert peer.robot.maneuver == Maneuver.HOLD
    np.testing.assert_array_equal(angles_of(held), ANGLES)
