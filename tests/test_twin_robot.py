"""The twin robot: the hardware code cannot tell it from the simulation it is made of."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from recorded import robot_for
from twin_rig import on_twin, simulated

from antennate.control.gait import targets
from antennate.control.registry import BUILT_IN, make_controller
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.joints import CommandError, Joints
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.trial import draw_trial, scene_of
from antennate.sim.world import World
from antennate.twin.config import Passage, TwinConfig, watched
from antennate.types import AntennaFrame, JointCommand, Maneuver

ROBOT = RobotSpec()
LONG = RobotSpec(link_pitch=0.3)  # its legs stay apart up to a right angle
CLEAR = 2 * math.atan((60 - 33 - 1) / 100)  # those of ROBOT, by their reach and width in mm
MIRRORED = RobotSpec.model_validate(
    {
        "yaw": {"ids": (5, 4, 3, 2, 1), "directions": (-1,) * 5, "zeros": (1500,) * 5},
        "legs": {"ids": tuple(range(40, 52)), "directions": (1, -1) * 6, "zeros": (0,) * 12},
        "antennae": {"ids": (61, 60), "directions": (-1, 1), "zeros": (1024, 3072)},
    }
)


def command(yaw: float = 0.0, leg: float = 0.0) -> JointCommand:
    return JointCommand(
        yaw=np.full((1, 5), yaw), leg=np.full((1, 6, 2), leg), antenna=np.zeros((1, 2))
    )


def test_a_quarter_turn_is_1024_ticks_from_the_middle_and_directions_count() -> None:
    ticks = Joints(LONG).ticks(command(yaw=math.pi / 2, leg=4 * math.pi))
    assert ticks[:5].tolist() == [3072] * 5
    assert ticks[5:17].tolist() == [2048 + 2 * 4096] * 12
    mirrored = MIRRORED.model_copy(update={"link_pitch": LONG.link_pitch})
    assert Joints(mirrored).ticks(command(yaw=math.pi / 2))[:5].tolist() == [1500 - 1024] * 5


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"yaw": {"ids": (1, 2)}}, "yaw.ids: expected one for each of the 5 joints, found 2"),
        (
            {"antennae": {**ROBOT.antennae.model_dump(), "ids": (1, 19)}},
            "ids: expected each once, found 1",
        ),
        ({"yaw": {**ROBOT.yaw.model_dump(), "zeros": (2048,) * 4 + (100,)}}, "quarter turn"),
    ],
)
def test_a_description_that_no_robot_can_have_is_refused(
    change: dict[str, object], said: str
) -> None:
    with pytest.raises(ValidationError, match=said):
        RobotSpec.model_validate(change)


def test_a_description_needs_only_what_differs() -> None:
    ids = (101, 102, 103, 104, 105)
    found = RobotSpec.model_validate({"yaw": {"ids": ids}})
    assert found.yaw == ROBOT.yaw.model_copy(update={"ids": ids})
    assert (found.legs, found.antennae) == (ROBOT.legs, ROBOT.antennae)


@pytest.mark.parametrize("robot", [ROBOT, MIRRORED])
def test_ticks_and_back_lose_half_a_tick_at_most(robot: RobotSpec) -> None:
    joints, rng = Joints(robot), np.random.default_rng(5)
    sent = JointCommand(
        yaw=rng.uniform(-0.5, 0.5, (1, 5)),
        leg=rng.uniform(-300, 300, (1, 6, 2)),
        antenna=rng.uniform(-1, 1, (1, 2)),
    )
    back = joints.command(joints.ticks(sent))
    half = math.pi / 4096 * (1 + 1e-9)
    for name in ("yaw", "leg", "antenna"):
        np.testing.assert_allclose(getattr(back, name), getattr(sent, name), atol=half, rtol=0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e4])
def test_B14_a_goal_that_is_not_finite_or_too_far_is_refused_as_a_whole(bad: float) -> None:
    sent = command()
    sent.leg[0, 3, 1] = bad
    with pytest.raises(CommandError, match="servo 13"):
        Joints(ROBOT).ticks(sent)


def test_B14_a_pose_of_two_robots_is_refused() -> None:
    two = JointCommand(np.zeros((2, 5)), np.zeros((2, 6, 2)), np.zeros((2, 2)))
    with pytest.raises(CommandError, match=r"found shape \(2, 5\)"):
        Joints(ROBOT).ticks(two)


def test_B14_a_yaw_or_an_antenna_beyond_its_limit_is_refused_as_a_whole() -> None:
    narrow = RobotSpec.model_validate(
        {
            "yaw": {**ROBOT.yaw.model_dump(), "limit": 0.4},
            "antennae": {**ROBOT.antennae.model_dump(), "limit": 0.5},
        }
    )
    joints = Joints(narrow)
    joints.ticks(command(yaw=-0.4))
    with pytest.raises(CommandError, match=r"within 0\.4 rad for servo 1, found -0\.401"):
        joints.ticks(command(yaw=-0.401))
    sent = command()
    sent.antenna[0, 1] = 0.501
    with pytest.raises(CommandError, match=r"within 0\.5 rad for servo 19, found 0\.501"):
        joints.ticks(sent)


@given(
    angles=st.lists(st.floats(-2.0, 2.0) | st.floats(), min_size=19, max_size=19),
    robot=st.sampled_from([ROBOT, MIRRORED]),
)
def test_B14_what_is_not_refused_lies_within_one_turn_but_for_legs(
    angles: list[float], robot: RobotSpec
) -> None:
    said = np.array(angles)
    one = JointCommand(
        yaw=said[None, :5], leg=said[None, 5:17].reshape(1, 6, 2), antenna=said[None, 17:]
    )
    limits = (CLEAR,) * 5 + (math.inf,) * 12 + (math.pi / 2,) * 2
    fit = all(abs(a) <= limit + 1e-9 for a, limit in zip(angles, limits, strict=True))
    try:
        ticks = Joints(robot).ticks(one)
    except CommandError:
        edge = any(abs(a) > limit - 1e-3 for a, limit in zip(angles, limits, strict=True))
        assert edge or not all(abs(a) <= 1600 for a in angles)
        return
    body = np.delete(ticks, range(5, 17))
    assert fit
    assert ((body >= 0) & (body <= 4095)).all()
    assert (abs(ticks[5:17]) <= 1_048_575).all()


@pytest.mark.parametrize("name", BUILT_IN)
def test_no_pose_of_a_gait_is_beyond_the_limits(name: str) -> None:
    robot, params = robot_for(name), ControlParams()
    joints = Joints(robot)
    offset = max(params.gait.turn_offset, params.escape.turn_offset)
    for sign in (-1.0, 1.0):
        for phase in np.linspace(0.0, 2 * math.pi, 100):
            joints.ticks(targets(params.gait, robot, np.array([phase]), np.array([sign * offset])))
    control = make_controller(name, params, robot)
    rng = np.random.default_rng(3)
    for tick in range(1000):
        counts = rng.uniform(0.0, 4095.0, (1, 2))
        joints.ticks(control.step(AntennaFrame(t=np.array([0.01 * tick]), counts=counts)))


@pytest.mark.parametrize(
    ("name", "trial", "robot", "limit", "end"),
    [
        pytest.param("closed", 1, ROBOT, 100.0, "success", marks=pytest.mark.slow),
        pytest.param("paper", 0, MIRRORED, 10.0, "timeout", marks=pytest.mark.slow),
        ("timed", 0, ROBOT, 8.0, "timeout"),
    ],
)
def test_a_whole_trial_through_bytes_is_decided_like_the_pure_simulation(
    name: str, trial: int, robot: RobotSpec, limit: float, end: str
) -> None:
    config = TunnelConfig(seed=0, robot=robot, time_limit=limit)
    pure = simulated(config, name, trial)
    twin = on_twin(config, name, trial)
    assert pure.status == end
    assert len({Maneuver.FORWARD, Maneuver.REVERSE} & set(pure.maneuvers)) == 2
    assert twin == pure


def test_a_servo_of_the_twin_tells_angles_about_its_own_zero() -> None:
    """It comes to its goal whatever its zero is off; the joint then is off by so much."""
    config = TwinConfig(scene="flat")
    control = config.control
    drawn = draw_trial(config, scene_of(config), config.trial, control.gait, control.period)
    bias = drawn.chance.joint_bias
    assert min(map(abs, bias)) > 1e-4
    twin, _ = watched(config)
    joints = Joints(config.robot)
    goals = joints.ticks(command(yaw=0.2))
    for at_rest in (True, False):
        if not at_rest:
            for servo, goal in zip(twin.servos, np.asarray(goals).tolist(), strict=True):
                servo.set("torque_enable", 1)
                servo.set("goal_position", goal)
            twin.advance(2.0)
        told = joints.angles(np.array([servo.motion.shaft.position for servo in twin.servos]))
        off = twin.world.drives() - told
        assert off[:5] == pytest.approx(bias, abs=1e-9)
        assert off[5:] == pytest.approx(0.0, abs=1e-9)
    assert told[:5] == pytest.approx(0.2, abs=0.02)


def test_the_twin_tells_when_its_head_passes_the_exit() -> None:
    tunnel = TunnelScene().draw(RobotSpec(), np.random.default_rng(0))
    passage, length = Passage(tunnel), tunnel.length
    direction = tunnel.centre[-1] - tunnel.centre[-2]
    beyond = tunnel.centre[-1] + 0.1 * direction / np.hypot(*direction)
    for tick in range(1, 41):
        head = tunnel.centre[0] if tick <= 20 else beyond
        passage.watch(cast(World, SimpleNamespace(head=head, t=0.01 * tick)))
        if tick == 20:
            assert passage.summary == f"the head came 0.00 m of {length:.2f} m"
    assert passage.passed == pytest.approx(0.3), "the second look of ten ticks after it came out"
    assert passage.summary == "the head passed the exit after 0.3 s of walking"
