"""Poses that a plugged-in controller must not have: refused whole, counted, the last goal held."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from twin_rig import rig

from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.supervisor import Supervisor
from antennate.params.safety import SupervisorParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.ticks import Tick
from antennate.twin.config import TwinConfig
from antennate.types import JointCommand, State

SHAPES = {"yaw": (1, 5), "leg": (1, 6, 2), "antenna": (1, 2)}
LIMITED = [*range(5), 17, 18]
"""Joints that have limits."""


SOUND = object()
"""In place of a command: the controller's own."""


class Robot:
    """An armed robot of whose commands one can be replaced."""

    def __init__(self, limits: SupervisorParams) -> None:
        made = rig(TwinConfig())
        self.session, self._servos = made.session, made.robot.servos
        self.session.supervisor = Supervisor(limits)
        self.controller_step = self.session.control.controller.step
        for _ in range(150):
            self.step()
        self.session.orders.arm = True
        for _ in range(50):
            self.step()

    def step(self, command: Any = SOUND) -> State:
        """One tick, with a command in place of the controller's if given."""
        session = self.session

        def said(frame: Any) -> Any:
            self.sound = self.controller_step(frame)
            return self.sound if command is SOUND else command

        session.control.controller.step = said
        begin = session.clock.now()
        session.write(session.control.step(session.read()))
        session.clock.sleep_until(begin + session.period)
        assert session.outputs is not None
        return session.outputs.state

    @property
    def goals(self) -> list[int]:
        return [servo.get("goal_position") for servo in self._servos]


@functools.cache
def robot() -> Robot:
    """One for all examples, whom no repetition makes a FAULT."""
    return Robot(SupervisorParams(repeats=100, repeat_time=1e-6))


def sound_angles() -> np.ndarray:
    command = robot().sound
    return np.concatenate([getattr(command, name).ravel() for name in SHAPES])


def pose_of(angles: Any, dtype: Any = float) -> JointCommand:
    angles = np.asarray(angles, dtype)
    return JointCommand(angles[None, :5], angles[None, 5:17].reshape(1, 6, 2), angles[None, 17:])


def one_changed(at: int, value: float) -> JointCommand:
    angles = sound_angles()
    angles[at] = value
    return pose_of(angles)


def part_of_shape(name: str, shape: tuple[int, ...]) -> JointCommand:
    parts = {n: np.zeros(s) for n, s in SHAPES.items()} | {name: np.zeros(shape)}
    return JointCommand(**parts)


anywhere = st.integers(0, 18)
beyond = st.floats(1.61, 1e308) | st.floats(-1e308, -1.61)
not_finite = st.builds(one_changed, anywhere, st.sampled_from([math.nan, math.inf, -math.inf]))
out_of_limits = st.builds(one_changed, st.sampled_from(LIMITED), beyond)
too_many_turns = st.builds(one_changed, st.integers(5, 16), st.floats(1700.0, 1e308))
shapes = st.lists(st.integers(0, 7), max_size=4).map(tuple)
wrong_shape = (
    st.tuples(st.sampled_from(sorted(SHAPES)), shapes)
    .filter(lambda drawn: SHAPES[drawn[0]] != drawn[1])
    .map(lambda drawn: part_of_shape(*drawn))
)
no_pose = st.sampled_from(
    [
        None,
        3.0,
        "command",
        np.zeros(19),
        [0.0] * 19,
        JointCommand(None, None, None),
        JointCommand("a", "b", "c"),
    ]  # type: ignore[arg-type]
)
BAD = {
    "not finite": not_finite,
    "out of limits": out_of_limits,
    "too many turns": too_many_turns,
    "wrong shape": wrong_shape,
    "no command": no_pose,
}


@pytest.mark.parametrize("kind", list(BAD))
@settings(max_examples=25)
@given(data=st.data())
def test_B14_a_bad_pose_is_refused_as_a_whole_and_counted_and_the_goal_held(
    kind: str, data: st.DataObject
) -> None:
    made = robot()
    assert made.step() in (State.OK, State.DEGRADED)
    before, refused, sent = made.goals, made.session.control.refused, made.session.tally.sent
    bad = data.draw(BAD[kind])
    assert made.step(bad) is State.HOLD
    assert made.goals == before
    assert (made.session.control.refused, made.session.tally.sent) == (refused + 1, sent)
    out = made.session.outputs
    assert out is not None
    first = out.causes[0]
    assert first.cause is Cause.BAD_COMMAND
    assert "expected" in first.detail
    assert made.session.actuators.state.bus_error == ""
    tick = Tick.of(made.session, 1.0)
    assert Tick.unpack(tick.pack()).refused == refused + 1


@given(seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_B14_a_pose_within_all_limits_is_not_refused(seed: int) -> None:
    angles = sound_angles() + np.random.default_rng(seed).uniform(
        -0.05, 0.05, len(RobotSpec().joint_names)
    )
    made, refused = robot(), robot().session.control.refused
    assert made.step(pose_of(np.clip(angles, -1.5, 1.5))) in (State.OK, State.DEGRADED)
    assert made.session.control.refused == refused


def test_B14_poses_refused_again_and_again_are_a_fault_that_says_so() -> None:
    made = Robot(SupervisorParams())
    states = [made.step(part_of_shape("leg", (1, 12))) for _ in range(3)]
    assert states == [State.HOLD, State.HOLD, State.FAULT]
    assert made.session.outputs is not None
    assert "found shape (1, 12)" in made.session.outputs.causes[0].text


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("contact", np.zeros(2, int)),
        ("contact", np.zeros((1, 3), int)),
        ("contact", "none"),
        ("maneuver", 0),
        ("maneuver", np.array([0.0])),
        ("maneuver", None),
    ],
)
def test_a_decision_that_is_none_is_a_failure_of_the_controller(name: str, said: Any) -> None:
    made = Robot(SupervisorParams())
    decision, command = made.session.control.decision, made.sound

    class Odd:
        maneuver, contact = np.array([0]), np.array([[0, 0]])

        def step(self, frame: Any) -> JointCommand:
            return command

    setattr(Odd, name, said)
    made.session.control.controller = Odd()
    made.session.write(made.session.control.step(made.session.read()))
    out = made.session.outputs
    assert out is not None
    assert out.state >= State.HOLD
    assert out.causes[0].cause is Cause.FAILED
    assert f"expected {name} of shape (1," in out.causes[0].text
    assert made.session.control.decision == decision
    assert Tick.of(made.session, 1.0).maneuver == decision.maneuver
