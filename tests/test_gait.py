"""The serpenoid wave and the legs: hand-computed commands, steering, and legs that stay apart."""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from antennate.control.gait import Gait, targets
from antennate.errors import ConfigError
from antennate.params.base import from_values
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.sim.parts import build_robot
from antennate.types import JointCommand, Maneuver

ROBOT = RobotSpec()
PARAMS = GaitParams(
    frequency=0.5,
    wave_number=1.0,
    amplitude=math.radians(25),
    body_phase=math.radians(200),
    turn_offset=0.35,
    offset_rate=1.5,
)
PERIOD = 0.01


def pose_at(phase: float, offset: float = 0.0, params: GaitParams = PARAMS) -> JointCommand:
    return targets(params, ROBOT, np.array([phase]), np.array([offset]))


def walk(gait: Gait, maneuvers: list[Maneuver]) -> tuple[np.ndarray, np.ndarray]:
    """Yaw (n, 5) and leg (n, 6, 2) of one robot that is given these maneuvers."""
    commands = [gait.step(np.array([m])) for m in maneuvers]
    return np.array([p.yaw[0] for p in commands]), np.array([p.leg[0] for p in commands])


def test_the_body_wave_agrees_with_hand_computed_angles() -> None:
    # joint j at phase 0: 25 deg * sin(72 deg * j + 200 deg), so of 272, 344, 56, 128 and 200 deg
    expected = [-24.98477, -6.89093, 20.72594, 19.70027, -8.55050]
    assert np.degrees(pose_at(0.0).yaw[0]) == pytest.approx(expected, abs=1e-4)


def test_the_crest_travels_from_head_to_tail() -> None:
    quarter = pose_at(2 * math.pi / 5).yaw[0]
    assert quarter[1:] == pytest.approx(pose_at(0.0).yaw[0][:4])


def test_each_leg_lags_the_one_before_by_a_sixth_of_a_wave() -> None:
    lag = -np.diff(pose_at(1.0).leg[0], axis=0)
    assert lag == pytest.approx(np.full((5, 2), math.pi / 3))


def test_left_and_right_legs_are_half_a_turn_apart() -> None:
    leg = pose_at(1.0).leg[0]
    assert leg[:, 1] - leg[:, 0] == pytest.approx(np.full(6, math.pi))


def test_the_first_left_leg_turns_with_the_phase() -> None:
    assert pose_at(12.5).leg[0, 0, 0] == pytest.approx(12.5)


def test_the_offset_adds_to_every_joint_and_to_no_leg() -> None:
    straight, bent = pose_at(0.4), pose_at(0.4, offset=0.07)
    assert bent.yaw - straight.yaw == pytest.approx(np.full((1, 5), 0.07))
    assert (bent.leg == straight.leg).all()


def test_no_joint_bends_so_far_that_legs_meet() -> None:
    """Legs reach 33 of the 60 mm to the middle between two links, and keep 1 mm, at 100 mm."""
    bend = 2 * math.atan((60 - 33 - 1) / 100)
    for offset in (0.52, -0.52):
        yaw = pose_at(0.4, offset).yaw[0]
        wanted = np.clip(pose_at(0.4).yaw[0] + offset, -bend, bend)
        assert yaw == pytest.approx(wanted)
        assert abs(yaw).max() == pytest.approx(bend)


def test_half_a_cycle_and_the_opposite_offset_mirror_the_pose() -> None:
    here, there = pose_at(0.7, 0.2), pose_at(0.7 + math.pi, -0.2)
    assert there.yaw == pytest.approx(-here.yaw)
    assert np.cos(there.leg) == pytest.approx(np.cos(here.leg[:, :, ::-1]))
    assert np.sin(there.leg) == pytest.approx(np.sin(here.leg[:, :, ::-1]))


def test_one_cycle_takes_one_over_the_frequency() -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    walk(gait, [Maneuver.FORWARD] * 200)
    assert gait.phase == pytest.approx([2 * math.pi])


def test_reverse_retraces_the_poses_backwards() -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    yaw, leg = walk(gait, [Maneuver.FORWARD] * 150)
    yaw_back, leg_back = walk(gait, [Maneuver.REVERSE] * 149)
    assert yaw_back == pytest.approx(yaw[-2::-1], abs=1e-9)
    assert leg_back == pytest.approx(leg[-2::-1], abs=1e-9)


def test_hold_keeps_the_pose() -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    yaw, leg = walk(gait, [Maneuver.TURN_L] * 7 + [Maneuver.HOLD] * 20)
    assert (yaw[6:] == yaw[6]).all()
    assert (leg[6:] == leg[6]).all()


@given(st.lists(st.tuples(st.sampled_from(list(Maneuver)), st.integers(1, 40)), max_size=12))
def test_no_target_jumps_however_the_maneuvers_switch(plan: list[tuple[Maneuver, int]]) -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    yaw, leg = walk(gait, [Maneuver.FORWARD] + [m for m, n in plan for _ in range(n)])
    turn = 2 * math.pi * 0.5 * PERIOD
    assert abs(np.diff(yaw, axis=0)).max(initial=0) <= math.radians(25) * turn + 1.5 * PERIOD + 1e-9
    assert abs(np.diff(leg, axis=0)).max(initial=0) <= turn + 1e-9


@pytest.mark.parametrize(("maneuver", "sign"), [(Maneuver.TURN_L, -1), (Maneuver.TURN_R, 1)])
def test_the_offset_ramps_at_its_rate_and_stays_at_its_size(maneuver: Maneuver, sign: int) -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    walk(gait, [maneuver] * 10)
    assert gait.offset == pytest.approx([sign * 0.15])
    walk(gait, [maneuver] * 40)
    assert gait.offset == pytest.approx([sign * 0.35])
    walk(gait, [Maneuver.FORWARD] * 40)
    assert gait.offset == pytest.approx([0.0])


def test_a_turn_may_be_tighter_than_the_gaits_own() -> None:
    gait = Gait(PARAMS, ROBOT, 1, PERIOD)
    for _ in range(100):
        gait.step(np.array([Maneuver.TURN_R]), 0.52)
    assert gait.offset == pytest.approx([0.52])


SWEEPING = PARAMS.model_copy(
    update={"antenna_mean": 0.1, "antenna_amplitude": 0.4, "antenna_frequency": 0.8}
)


def test_the_antenna_bases_stay_where_they_are_mounted_unless_told() -> None:
    gait = Gait(GaitParams(), ROBOT, 3, PERIOD)
    for maneuver in Maneuver:
        assert (gait.step(np.full(3, maneuver)).antenna == np.zeros((3, 2))).all()
    held = Gait(GaitParams(antenna_mean=-0.3), ROBOT, 1, PERIOD)
    assert held.step(np.array([Maneuver.FORWARD])).antenna.tolist() == [[-0.3, -0.3]]


def test_the_antenna_bases_sweep_at_their_own_pace_and_stand_in_a_hold() -> None:
    """Row 0 walks, turns and backs off: 0.1 + 0.4 sin(2 pi 0.8 t); row 1 holds from 0.5 s on."""
    gait, plan = (
        Gait(SWEEPING, ROBOT, 2, PERIOD),
        [Maneuver.FORWARD, Maneuver.TURN_L, Maneuver.REVERSE],
    )
    swept = []
    for tick in range(150):
        maneuvers = [plan[tick // 50], plan[0] if tick < 50 else Maneuver.HOLD]
        swept.append(gait.step(np.array(maneuvers)).antenna)
    t = PERIOD * np.arange(1, 151)
    alone = 0.1 + 0.4 * np.sin(2 * math.pi * 0.8 * t)
    held = 0.1 + 0.4 * np.sin(2 * math.pi * 0.8 * np.minimum(t, 0.5))
    for side in (0, 1):
        assert np.array(swept)[:, 0, side] == pytest.approx(alone)
        assert np.array(swept)[:, 1, side] == pytest.approx(held)
    gait.reset(np.array([1]))
    assert gait.sweep[1] == 0.0
    assert gait.sweep[0] == pytest.approx(2 * math.pi * 0.8 * 1.5)


def test_reset_starts_its_rows_at_a_phase_and_straight() -> None:
    gait = Gait(PARAMS, ROBOT, 2, PERIOD)
    gait.step(np.array([Maneuver.TURN_R, Maneuver.TURN_R]))
    gait.reset(np.array([1]), 2.0)
    assert gait.phase.tolist() == [pytest.approx(0.01 * math.pi), 2.0]
    assert gait.offset.tolist() == [pytest.approx(0.015), 0.0]


QUARTER_TURN = [math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0]


def rings(robot: RobotSpec) -> mujoco.MjModel:
    """The robot with flat rings for legs, as they are printed, in place of crowned ones."""
    spec = build_robot(robot)
    for geom in spec.geoms:
        if geom.name in robot.leg_names:
            geom.type = mujoco.mjtGeom.mjGEOM_CYLINDER
            geom.size = [robot.leg_radius, robot.leg_width / 2, 0.0]
            geom.quat = QUARTER_TURN
    return spec.compile()


def gap(model: mujoco.MjModel, robot: RobotSpec, yaw: np.ndarray, leg: np.ndarray) -> float:
    """Smallest distance between two legs of one side [m]."""
    data = mujoco.MjData(model)
    for name, angle in zip((*robot.yaw_names, *robot.leg_names), (*yaw, *leg), strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    ids = [model.geom(name).id for name in robot.leg_names]
    sides = (ids[0::2], ids[1::2])
    return min(
        mujoco.mj_geomDistance(model, data, front, rear, 1.0, None)
        for side in sides
        for front, rear in pairwise(side)
    )


ROBOTS = (RobotSpec(), RobotSpec(links=4, link_pitch=0.15), RobotSpec(leg_radius=0.03, width=0.16))


@pytest.mark.parametrize("robot", ROBOTS)
def test_at_the_largest_bend_no_leg_touches_another_at_any_angle(robot: RobotSpec) -> None:
    model, chance = rings(robot), np.random.default_rng(1)
    for _ in range(50):
        yaw = robot.yaw_limit * chance.choice([-1.0, 1.0], robot.yaw_count)
        leg = chance.choice([-0.5, 0.5, 0.0, 1.0], robot.leg_count) * math.pi
        assert gap(model, robot, yaw, leg) > 0.0


def test_beyond_it_legs_touch() -> None:
    robot = RobotSpec()
    yaw = np.full(robot.yaw_count, robot.clear_bend + math.radians(3.0))
    leg = np.array([[math.pi / 2, math.pi / 2], [-math.pi / 2, -math.pi / 2]] * 3).ravel()
    assert gap(rings(robot), robot, yaw, leg) < 0.0


@pytest.mark.parametrize("offset", [0.0, 0.3, -0.9])
def test_the_gait_keeps_within_it(offset: float) -> None:
    robot = RobotSpec()
    phase = np.linspace(0.0, 2.0 * math.pi, 37)
    command = targets(GaitParams(), robot, phase, np.full(37, offset))
    assert np.abs(command.yaw).max() <= robot.yaw_limit
    model = rings(robot)
    poses = zip(command.yaw, command.leg.reshape(37, -1), strict=True)
    assert min(gap(model, robot, yaw, leg) for yaw, leg in poses) > 0.0


def test_a_limit_at_which_legs_meet_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"yaw\.limit.*expected at most 0\.509 rad.*found 1"):
        from_values(RobotSpec, {"yaw": {"limit": 1.0}})
    with pytest.raises(ConfigError, match=r"link_pitch.*legs do not touch"):
        from_values(RobotSpec, {"link_pitch": 0.05})
    assert RobotSpec.model_validate({"yaw": {"limit": 0.3}}).yaw_limit == 0.3
