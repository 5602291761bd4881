"""Legs that turn without end: near the servos' limit the robot stands still, and goes on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from twin_rig import Rig, rig

from antennate.control.registry import make_controller
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.safety.session import Session
from antennate.params.control import ControlParams
from antennate.telemetry.header import Header
from antennate.telemetry.replay import replay
from antennate.telemetry.ticks import Tick
from antennate.twin.config import TwinConfig
from antennate.types import AntennaFrame, JointCommand, State
from dynamixel_bus.servo_bus import Fault, Trouble

LEGS = slice(5, 17)
REACH = math.ceil(5.26 * 0.01 / (2 * math.pi / 4096))
CONFIG = DriveConfig(dry_run=0.5, duration=4.0)


class Walk:
    """A walk, what the controller decided in it, and what every servo was told."""

    def __init__(self, turns: int, duration: float = 4.0, act: Any = None) -> None:
        self.rig: Rig = rig(TwinConfig())
        for servo in self.rig.robot.servos[LEGS]:
            servo.turn(turns)
        self.goals: list[list[int]] = []
        self.torque: list[list[bool]] = []
        self.standing: list[bool] = []
        self.states: list[State] = []
        self.frames: list[float] = []
        self.maneuvers: list[int] = []
        self.ticks: list[Tick] = []
        self._act = act
        session = self.rig.session
        think = session.control.controller.step

        def step(frame: AntennaFrame) -> JointCommand:
            command = think(frame)
            if session.outputs is not None and session.outputs.clear:
                self.frames.append(float(frame.t[0]))
                self.maneuvers.append(int(session.control.controller.maneuver[0]))
            return command

        session.control.controller.step = step  # type: ignore[method-assign]
        config = CONFIG.model_copy(update={"duration": duration})
        self.report = drive(session, config, arm=True, on_tick=self._note)

    def _note(self, session: Session, t: float) -> None:
        assert session.outputs is not None
        self.ticks.append(Tick.of(session, t))
        if session.outputs.torque:
            servos = self.rig.robot.servos
            self.goals.append([servo.get("goal_position") for servo in servos])
            self.torque.append([servo.torque for servo in servos])
            self.standing.append(session.actuators.turns.standing)
            self.states.append(session.outputs.state)
        if self._act is not None:
            self._act(self, session)


@pytest.fixture(scope="module")
def far() -> Walk:
    """Started at 249 turns: past 250 they are forgotten, where 256 are the end."""
    return Walk(249, duration=4.5)


def test_legs_near_the_limit_forget_their_turns_and_the_walk_goes_on(far: Walk) -> None:
    assert min(far.goals[0][LEGS]) > 249 * 4096
    assert far.rig.session.actuators.turns.forgotten == 12
    assert max(abs(np.array(far.goals[-1][LEGS]))) < 4 * 4096
    assert max(far.states[30:]) <= State.DEGRADED
    first, last = far.standing.index(True), len(far.standing) - far.standing[::-1].index(True)
    assert last - first < 75
    walked = np.ptp(np.array(far.goals)[last:, LEGS], axis=0)
    assert (walked > 4096).all()


def test_no_goal_jumps_but_by_whole_turns(far: Walk) -> None:
    steps = np.diff(np.array(far.goals), axis=0)
    turned = 4096 * np.rint(steps / 4096)
    assert abs(steps - turned).max() <= REACH
    assert np.count_nonzero(turned) == 12


def test_one_leg_at_a_time_is_without_torque_and_all_have_it_afterwards(far: Walk) -> None:
    off = (~np.array(far.torque)).sum(axis=1)
    assert off.max() == 1
    assert np.array(far.torque)[:, :5].all()
    assert off[-1] == 0
    assert far.report.safe


def test_G7_its_log_replays_alike_for_the_controller_was_not_asked_meanwhile(far: Walk) -> None:
    found = replay(
        far.ticks, make_controller("closed"), Header(controller="closed", params=ControlParams())
    )
    assert (len(found.maneuvers), found.different, found.commands) == (len(far.ticks), 0, 0)


def test_the_maneuvers_are_those_of_a_walk_without_it(far: Walk) -> None:
    """The controller's time stands still with the robot, so that no maneuver is cut short."""
    plain = Walk(0, duration=2.7)
    assert plain.rig.session.actuators.turns.forgotten == 0
    n = 250
    assert far.maneuvers[:n] == plain.maneuvers[:n]
    assert np.diff(far.frames).max() <= 0.0101


@pytest.mark.parametrize("fault", [Fault.SILENT, Fault.BAD_CRC])
def test_a_leg_that_does_not_answer_is_a_fault_and_never_pulls_to_a_far_goal(fault: Fault) -> None:
    away: list[float] = []

    def spoil(walk: Walk, session: Session) -> None:
        if session.actuators.turns.forgotten == 3:
            walk.rig.robot.bus.trouble[9] = Trouble(fault)
        servos = [servo for servo in walk.rig.robot.servos if servo.torque]
        away.extend(abs(servo.get("goal_position") - servo.position) for servo in servos)

    walk = Walk(253, duration=1.5, act=spoil)
    assert walk.states[-1] >= State.FAULT
    assert max(away) < 1024
    on = {servo.get("id") for servo in walk.rig.robot.servos if servo.torque}
    assert on <= set(walk.report.on) == {9}


def test_lost_answers_do_not_keep_legs_from_forgetting() -> None:
    def lose(walk: Walk, session: Session) -> None:
        walk.rig.robot.bus.loss = 0.01

    walk = Walk(253, duration=1.6, act=lose)
    assert walk.rig.session.actuators.turns.forgotten == 12
    assert max(walk.states) <= State.HOLD


def test_T7_while_it_holds_no_further_leg_loses_its_torque() -> None:
    """The board falls silent while the fourth leg forgets; that one gets its torque back."""

    def silence(walk: Walk, session: Session) -> None:
        walk.rig.robot.board_silent |= session.actuators.turns.forgotten == 3

    walk = Walk(253, duration=1.8, act=silence)
    assert walk.rig.session.actuators.turns.forgotten < 12
    held = len(walk.states) - walk.states[::-1].index(State.OK)
    assert State.HOLD in walk.states[held:]
    loose = [row.count(False) for row in walk.torque]
    begun = sum(now > before for before, now in zip(loose[held:], loose[held + 1 :], strict=False))
    assert begun == 0
    assert loose[-1] == 0


def test_B10_legs_that_have_forgotten_go_on_from_where_they_were_when_the_board_is_back() -> None:
    def blink(walk: Walk, session: Session) -> None:
        walk.rig.robot.board_silent = (
            session.actuators.turns.forgotten == 3 and len(walk.goals) < 150
        )

    walk = Walk(253, duration=2.8, act=blink)
    assert walk.rig.session.actuators.turns.forgotten == 12
    assert not any(row.count(False) > 1 for row in walk.torque)
    assert walk.states[-1] <= State.DEGRADED


def test_a_leg_without_torque_to_forget_its_turns_is_not_reported() -> None:
    """Every look at a servo falls on the leg whose torque is off, or on one that has it."""
    disarmed: list[int] = []

    def look(walk: Walk, session: Session) -> None:
        off = [servo.get("id") for servo in walk.rig.robot.servos if not servo.torque]
        if session.actuators.state.armed:
            for servo in off or [6]:
                session.actuators.state.guard(servo)
        disarmed.extend(session.actuators.state.disarmed)

    walk = Walk(253, duration=1.4, act=look)
    assert walk.rig.session.actuators.turns.forgotten == 12
    assert not disarmed
