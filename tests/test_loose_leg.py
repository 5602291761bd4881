"""A leg without torque may be turned: what is checked before it gets its torque back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import servo_rig
from test_turns import Walk

from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.dynamixel.leg_turns import LegTurns
from antennate.hardware.joints import Joints
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.session import Session
from antennate.robots.spec import RobotSpec
from antennate.types import Floats, State
from dynamixel_bus.packets import StatusError
from dynamixel_bus.servo import Servo

LEG = 6
AT = LEG - 1
FAR = 253 * 4096
GOAL = 116
ALLOWED = 5
"""Row B10: most ticks between goal and position when torque comes on."""
FORGETTING, HOLDING = 1, 2


class Stand:
    """Nineteen servos that stand with torque, the legs near the end of what they count."""

    def __init__(self) -> None:
        self.rig = servo_rig.Rig()
        self.leg = self.rig.servo(LEG)
        for servo in self.rig.twin.servos:
            if LEG <= servo.get("id") <= 17:
                servo.set("operating_mode", 4)
                servo.place(servo.position + FAR)
            servo.set("goal_position", round(servo.position))
            servo.set("torque_enable", 1)
        self.turns = LegTurns(self.rig.bus, Joints(RobotSpec()))
        self.goals: Floats = np.array([servo.position for servo in self.rig.twin.servos])
        self.n, self.moved = 0, 0.0

    def tick(self, moved: float = 0.0) -> None:
        """A tick of a session that stands still; positions seem to have moved so far [ticks]."""
        self.n += 1
        self.moved += moved
        seen = {s.get("id"): round(s.position + self.moved) for s in self.rig.twin.servos}
        self.turns.begin(self.goals)
        self.turns.step(self.goals, seen)
        sent = {i: round(g).to_bytes(4, "little") for i, g in enumerate(self.goals.tolist(), 1)}
        self.rig.bus.write_all(GOAL, sent)
        self.rig.link.sleep(max(0.01 * self.n - self.rig.link.now(), 0.0))

    def until(self, stage: int) -> None:
        """Ticks until the first leg is at this stage."""
        while self.turns.stage != stage:
            assert self.n < 100
            self.tick()

    def until_held(self) -> None:
        """Ticks until the first leg has its torque back."""
        while not self.turns.forgotten:
            assert self.n < 100
            self.tick()


def deaf_to_goals(servo: Servo) -> Callable[..., StatusError]:
    """Its `write`, but goals get lost."""
    write = servo.write
    return lambda at, data: StatusError.NONE if at == GOAL else write(at, data)


@pytest.mark.parametrize("slip", [-600, -6, 600, 5000])
def test_B10_a_leg_that_was_turned_while_loose_gets_torque_where_it_stands(slip: int) -> None:
    stand = Stand()
    stand.until(HOLDING)
    stood = stand.leg.position
    assert not stand.leg.torque
    stand.leg.place(stood + slip)
    stand.until_held()
    assert stand.leg.torque
    assert abs(stand.leg.get("goal_position") - stand.leg.position) <= ALLOWED
    assert stand.leg.position == pytest.approx(stood + slip, abs=ALLOWED)
    assert stand.goals[AT] == stand.leg.get("goal_position")


def test_B10_a_leg_that_goes_on_sinking_gets_torque_where_it_is_by_then() -> None:
    """Two turns in a second, 82 ticks in a tick."""
    stand = Stand()
    stand.until(HOLDING)
    for _ in range(20):
        if not stand.leg.torque:
            stand.leg.place(stand.leg.position - 82)
            stand.tick()
    assert stand.leg.torque
    assert abs(stand.leg.get("goal_position") - stand.leg.position) <= ALLOWED


def test_B10_a_leg_that_does_not_take_its_goal_gets_no_torque() -> None:
    stand = Stand()
    stand.until(HOLDING)
    stand.leg.write = deaf_to_goals(stand.leg)  # type: ignore[method-assign]
    stand.leg.place(stand.leg.position + 600)
    with pytest.raises(BringUpError, match="servo 6 to get its torque back"):
        stand.until_held()
    assert not stand.leg.torque


def test_a_leg_whose_torque_came_back_is_not_cleared() -> None:
    """Its goal is 253 turns away from where it would be then."""
    stand = Stand()
    stand.until(FORGETTING)
    stand.leg.set("torque_enable", 1)
    with pytest.raises(BringUpError, match="servo 6 to forget its turns"):
        stand.until_held()
    assert stand.leg.position > FAR


def test_a_leg_that_did_not_forget_gets_no_torque() -> None:
    stand = Stand()
    stand.until(FORGETTING)
    stand.leg.clear_turns = lambda: StatusError.NONE  # type: ignore[method-assign]
    with pytest.raises(BringUpError, match="servo 6 to forget its turns"):
        stand.until_held()
    assert not stand.leg.torque


@pytest.mark.parametrize("slip", [-1300, 1300])
def test_a_leg_turned_so_far_that_its_turns_cannot_be_told_gets_no_torque(slip: int) -> None:
    """A third of a turn, where half a turn could be either way."""
    stand = Stand()
    stand.until(FORGETTING)
    stand.leg.place(stand.leg.position + slip)
    with pytest.raises(BringUpError, match="servo 6 to forget its turns"):
        stand.until_held()
    assert not stand.leg.torque


def test_no_leg_loses_its_torque_before_all_have_stood_still_for_five_ticks() -> None:
    stand = Stand()
    for n in range(25):
        stand.tick(moved=3.0 if n < 20 else 0.0)
        assert all(servo.torque for servo in stand.rig.twin.servos)
    stand.until(FORGETTING)
    assert stand.n in (26, 27)


class Paused:
    """A walk that is stopped for a time while a leg is loose, which somebody turns meanwhile."""

    def __init__(self, pause: float) -> None:
        self.pause = pause
        self.leg: Any = None
        self.loose: list[bool] = []
        self.causes: set[Cause] = set()
        self.away: list[float] = []
        self.walk = Walk(253, duration=pause + 2.0, act=self)

    def __call__(self, walk: Walk, session: Session) -> None:
        out = session.outputs
        if self.leg is None and session.actuators.turns.stage == HOLDING:
            assert session.actuators.turns.loose is not None
            self.leg = walk.rig.robot.servos[
                session.actuators.joints.ids.index(session.actuators.turns.loose)
            ]
            walk.rig.clock.sleep_until(walk.rig.clock.now() + self.pause)
            self.leg.turn(600 / 4096)
        elif self.leg is not None and out is not None:
            self.loose.append(not self.leg.torque)
            self.causes |= {active.cause for active in out.causes}
            if self.leg.torque:
                self.away.append(abs(self.leg.get("goal_position") - self.leg.position))
            session.orders.arm = len(self.loose) != 50


@pytest.mark.ci
def test_B10_after_a_pause_a_loose_leg_waits_for_an_arm_event() -> None:
    story = Paused(5.0)
    assert Cause.PAUSE in story.causes
    assert story.loose[:50] == [True] * 50
    assert max(story.walk.states) is State.FAULT
    assert not any(story.loose[52:])
    assert story.away[0] <= ALLOWED
    assert story.walk.states[-1] <= State.DEGRADED
    assert story.walk.report.safe
