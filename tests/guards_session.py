"""Guards of the session: what may be sent, and what a controller may do."""

from __future__ import annotations

import dataclasses
import math
import signal
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import test_approach
import test_bad_controllers
import test_deadlines
import test_dynamixel_bus as test_bus
import test_jog
import test_release
import test_session
import test_signals
import test_timing
import test_twin_robot
import test_unmeasured
from guard_tools import Guard, around, before, constant, put

from antennate.control import loop
from antennate.hardware import joints
from antennate.hardware.driving import connect
from antennate.hardware.dynamixel import actuators
from antennate.hardware.dynamixel.actuators import DynamixelActuators
from antennate.hardware.safety import deadlines, session, torque
from antennate.hardware.safety.controller import StepResult, SupervisedController
from antennate.hardware.safety.supervisor import Outputs, Supervisor
from antennate.hardware.setup.jog import Jog
from antennate.host import StopOnce
from antennate.robots.spec import RobotSpec
from dynamixel_bus.port import PortError

controller_fails = test_session.test_B8_servos_stop_within_120_ms_when_only_the_controller_fails


def always_watch(old: Any, self: Any, command: Any) -> None:
    old(self, command)
    out = self.outputs
    if out.torque and not out.feed_watchdog:
        self.actuators.look()


def once(old: Any, self: Any, again: bool = False) -> list[int]:
    return [] if again else old(self)


def cleared(old: Any, self: Any, now: float, inputs: Any) -> Outputs:
    return dataclasses.replace(old(self, now, inputs), clear=True)


def raising(old: Any, self: Any) -> None:
    old(self)
    if self.bus_error:
        raise PortError(self.bus_error)


def finite_goals(old: Any, self: Any, angles: Any) -> Any:
    return old(self, np.nan_to_num(angles))


def always_sound(old: Any, self: Any, frame_: Any) -> Any:
    self.sound = True
    return old(self, frame_)


def careless(old: Any, self: Any, frame_: Any) -> Any:
    self.result = StepResult(decided_at=self.now())
    return self.controller.step(frame_)


def an_exception_alone(old: Any, self: Any, number: int, frame: Any) -> None:
    try:
        old(self, number, frame)
    finally:
        self.received = False


def unasked(self: Any, time: float) -> None:
    end = self.clock.now() + time
    while self.actuators.enabled and self.clock.now() < end:
        self.actuators.command(None)
        self.clock.sleep_until(self.clock.now() + self.period)


def forget_the_loss(self: Any, time: float) -> None:
    self.lost = False


def as_if_measured(old: Any, self: Any, *of_joint: Any) -> None:
    old(self, *of_joint[:-1], True)


UNASKED = property(lambda _: "", lambda _, why: None)


SESSION = [
    Guard(
        "zeros and directions that nobody measured",
        put(RobotSpec, "unstated", constant(())),
        test_unmeasured.test_the_doctor_names_every_number_that_nobody_has_measured,
    ),
    Guard(
        "no torque without them, whoever asks",
        lambda patch: patch.setattr(session.Session, "unfit", UNASKED, raising=False),
        test_unmeasured.test_a_session_of_such_a_robot_gets_no_torque,
    ),
    Guard(
        "nor by ports that Python opened",
        put(connect, "zeros_lack", constant("")),
        partial(
            test_unmeasured.test_ports_that_python_opened_give_such_a_robot_no_torque,
            RobotSpec(),
            (),
            "all joints, found none; `",
        ),
    ),
    Guard(
        "way of a joint moved by keys without them",
        around(Jog, "__init__", as_if_measured),
        test_unmeasured.test_jog_moves_a_joint_without_a_zero_a_little_from_where_it_stands,
    ),
    Guard(
        "goals that are NaN",
        around(joints.Joints, "positions", finite_goals),
        partial(
            test_twin_robot.test_B14_a_goal_that_is_not_finite_or_too_far_is_refused_as_a_whole,
            math.nan,
        ),
    ),
    Guard(
        "speed of goals",
        put(joints.Joints, "reach", constant(1e6)),
        test_session.test_B10_torque_comes_on_with_goals_where_servos_stand_and_they_move_slowly,
    ),
    Guard(
        "slow approach to the first command",
        put(DynamixelActuators, "away", constant(0)),
        test_approach.test_the_first_motion_is_slow_and_the_gait_begins_where_it_ends,
    ),
    Guard(
        "watchdog of a joint moved by keys",
        put(torque, "arm_watchdogs", constant(None)),
        test_jog.test_a_program_that_dies_leaves_a_joint_that_stands,
    ),
    Guard(
        "speed and force of a joint moved by keys",
        put(torque, "limit_speed", constant(None)),
        test_jog.test_it_turns_by_its_step_slowly_and_lets_go,
    ),
    Guard(
        "gait stands still while held",
        around(Supervisor, "step", cleared),
        test_session.test_L9_the_gait_stands_still_during_a_hold_so_that_no_leg_has_to_catch_up,
    ),
    Guard(
        "every tick decided after a failure, at half pace too",
        around(SupervisedController, "step", always_sound),
        partial(controller_fails, 10.5),
    ),
    Guard(
        "no packet without a decision",
        around(session.Session, "write", always_watch),
        partial(controller_fails, 11.1),
    ),
    Guard(
        "servos that kept their torque",
        around(DynamixelActuators, "disable", once),
        test_release.test_B19_servos_that_kept_their_torque_in_off_are_told_again_until_they_let_go,
    ),
    Guard(
        "command held before the torque goes",
        put(session.Session, "stand", constant(None)),
        test_release.test_B19_the_pose_is_held_for_as_long_as_told_before_the_torque_goes,
    ),
    Guard(
        "supervisor asked while the command is held",
        put(session.Session, "stand", unasked),
        test_deadlines.test_the_supervisor_is_asked_while_a_robot_stands,
    ),
    Guard(
        "longest time that the command is held",
        put(deadlines, "STAND", 3.0),
        test_deadlines.test_a_robot_stands_for_two_seconds_at_most,
    ),
    Guard(
        "order of deadlines",
        put(deadlines, "require_order", constant(None)),
        test_deadlines.test_a_session_refuses_them_too,
    ),
    Guard(
        "no goal before the release of a lost bus",
        before(session.Session, "stand", forget_the_loss),
        test_release.test_B6_B19_no_goal_is_sent_before_the_release_once_the_bus_was_lost,
    ),
    Guard(
        "signals while the torque goes off",
        before(StopOnce, "receive", lambda self, *_: vars(self).update(closed=False, within=None)),
        partial(test_signals.test_B19_no_signal_is_heard_once_the_walk_is_over_of_itself, "stand"),
        by=(KeyboardInterrupt,),
    ),
    Guard(
        "signals that a controller swallows",
        around(StopOnce, "receive", an_exception_alone),
        partial(
            test_signals.test_B19_a_signal_that_a_controller_swallows_ends_the_walk_all_the_same,
            signal.SIGINT,
        ),
    ),
    Guard(
        "commands that a controller changes later",
        put(joints.Joints, "plain", lambda self, command: command),
        test_bad_controllers.test_B14_a_pose_that_a_controller_changes_later_stays_as_it_was_judged,
    ),
    Guard(
        "exceptions of the controller end nothing",
        around(SupervisedController, "step", careless),
        partial(controller_fails, 11.1),
        by=(ValueError,),
    ),
    Guard(
        "dead wire ends nothing",
        around(actuators.ServoMonitor, "step", raising),
        test_bus.test_a_dead_wire_is_noted_by_the_watch_and_ends_nothing,
        by=(PortError,),
    ),
    Guard(
        "no burst after an overrun",
        put(loop, "math", SimpleNamespace(ceil=constant(0))),
        test_timing.test_T1_an_overrun_leaves_out_the_ticks_it_covers_and_delays_none_after,
    ),
]
