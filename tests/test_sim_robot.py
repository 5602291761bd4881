"""What the engine received: every value is read back from the compiled model."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate.params.scene import PhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.robots.spec import RobotSpec
from antennate.sim.world import PREFIX, World, compile_world

N_MM_PER_DEG = 1e-3 * 180 / math.pi
DAMPING = 1.7 / (65 * 2 * math.pi / 60)
ROBOT = RobotSpec()
SERVOS = (*ROBOT.yaw_names, *ROBOT.leg_names)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return compile_world(PhysicsParams(), RobotSpec())


def bent(model: mujoco.MjModel, angle: float) -> tuple[World, np.ndarray]:
    """A world with every antenna hinge at an angle, and its tips (2, 3)."""
    long = SensorParams(active_length=0.12)  # over all six hinges
    world = World(model, RobotSpec(antenna=AntennaSpec(sensor=long)))
    for side in "lr":
        for i in range(6):
            world.data.joint(f"{PREFIX}antenna_{side}_hinge{i}").qpos[0] = angle
    mujoco.mj_kinematics(model, world.data)
    tips = []
    for side in "lr":
        last = world.data.body(f"{PREFIX}antenna_{side}_hinge5")
        tips.append(last.xpos + last.xmat.reshape(3, 3)[:, 0] * 0.02)
    return world, np.array(tips)


@pytest.mark.parametrize("side", ["l", "r"])
def test_hinges_are_as_stiff_as_spring_and_film_together(model: mujoco.MjModel, side: str) -> None:
    stiffness = [model.joint(f"{PREFIX}antenna_{side}_hinge{i}").stiffness[0] for i in range(6)]
    springs = [0.274, 0.137, 0.137, 0.0913, 0.0913, 0.0913]  # the paper's table, N·mm/deg
    film = [0.048] * 5 + [0.0]  # 95.3 mm of film reach the first five of six 20 mm links
    expected = [(s + f) * N_MM_PER_DEG for s, f in zip(springs, film, strict=True)]
    assert stiffness == pytest.approx(expected, rel=1e-3)


def test_hinge_damping_is_forty_milliseconds_of_stiffness(model: mujoco.MjModel) -> None:
    joint = model.joint(f"{PREFIX}antenna_l_hinge2")
    assert model.dof_damping[joint.dofadr[0]] == pytest.approx(0.04 * joint.stiffness[0])


def test_hinge_ranges_are_radians_not_degrees(model: mujoco.MjModel) -> None:
    joint = model.joint(f"{PREFIX}antenna_r_hinge3")
    assert joint.range == pytest.approx([-1.4, 1.4])
    assert model.jnt_limited[joint.id]


def test_the_robot_weighs_two_kilograms(model: mujoco.MjModel) -> None:
    assert model.body_mass.sum() == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("name", SERVOS)
def test_servos_saturate_at_the_stall_torque(model: mujoco.MjModel, name: str) -> None:
    actuator = model.actuator(PREFIX + name)
    assert actuator.forcerange == pytest.approx([-1.7, 1.7])
    assert actuator.forcelimited[0] == 1
    assert actuator.ctrllimited[0] == 0


@pytest.mark.parametrize("name", SERVOS)
def test_full_drive_is_balanced_by_damping_at_the_no_load_speed(
    model: mujoco.MjModel, name: str
) -> None:
    assert model.dof_damping[model.joint(PREFIX + name).dofadr[0]] == pytest.approx(DAMPING)


def test_friction_of_a_gear_grows_with_the_torque_of_its_motor() -> None:
    gear = {"friction": 0.02, "load_friction": 0.4}
    robot = RobotSpec.model_validate({"servos": {"xc430_w240": gear}})
    world = World(compile_world(PhysicsParams(), robot), robot)
    world.command(np.full(19, 0.4))
    world.step(20)
    data, dofs = world.data, [world.model.joint(PREFIX + n).dofadr[0] for n in SERVOS]
    force = np.array([data.actuator(PREFIX + n).force[0] for n in SERVOS])
    motor = force - DAMPING * data.qvel[dofs]
    assert abs(motor).max() > 0.5
    world.step(1)
    assert world.model.dof_frictionloss[dofs] == pytest.approx(0.02 + 0.4 * abs(motor))


def test_the_base_of_an_antenna_pulls_no_harder_than_its_servo() -> None:
    for changes, torque in (({}, 0.52), ({"base_torque": 0.05}, 0.05)):  # XL330-M288 at 5 V
        robot = RobotSpec.model_validate({"antenna": changes})
        world = World(compile_world(PhysicsParams(), robot), robot)
        world.command(np.full(19, 1.5))
        world.step(1)
        assert world.drive_torques()[-2:] == pytest.approx([torque, torque])


@pytest.mark.parametrize(
    ("robot", "stall", "rpm", "p_gain", "divisor"),
    [
        ({}, 0.52, 103, 400, 256),
        ({"antennae": {"servo": "xc430_w240"}}, 1.7, 65, 700, 128),
        ({"servos": {"xl330_m288": {"p_gain": 800}}}, 0.52, 103, 800, 256),
    ],
)
def test_the_base_of_an_antenna_is_held_as_its_servo_holds(
    robot: dict[str, object], stall: float, rpm: float, p_gain: float, divisor: float
) -> None:
    """Full drive, 885 counts, at 885 divisor / p_gain of 4096 ticks a turn off the goal."""
    model = compile_world(PhysicsParams(), RobotSpec.model_validate(robot))
    for name in (PREFIX + joint for joint in ROBOT.joint_names[-2:]):
        stiffness = stall * p_gain / divisor * 4096 / (2 * math.pi) / 885
        assert model.actuator(name).gainprm[0] == pytest.approx(stiffness)
        damping = stall / (rpm * 2 * math.pi / 60)
        assert model.dof_damping[model.joint(name).dofadr[0]] == pytest.approx(damping)


@pytest.mark.parametrize("name", SERVOS)
def test_every_actuator_drives_the_joint_of_its_name(model: mujoco.MjModel, name: str) -> None:
    target = int(model.actuator(PREFIX + name).trnid[0])
    assert model.joint(target).name == PREFIX + name


def test_commands_follow_the_order_of_the_anatomy(model: mujoco.MjModel) -> None:
    world = World(model, RobotSpec())
    world.command(np.arange(19.0))
    names = (*SERVOS, "antenna_l_base", "antenna_r_base")
    assert [world.data.actuator(PREFIX + n).ctrl[0] for n in names] == list(range(19))


def test_links_hang_behind_one_another_head_first(model: mujoco.MjModel) -> None:
    world, _ = bent(model, 0.0)
    assert world.links() == pytest.approx(np.array([[-0.12 * i, 0.0] for i in range(6)]))


def test_legs_stand_at_the_sides_that_their_names_say(model: mujoco.MjModel) -> None:
    world, _ = bent(model, 0.0)
    lateral = [world.data.body(PREFIX + n).xpos[1] for n in ROBOT.leg_names]
    assert lateral == pytest.approx([0.092, -0.092] * 6)  # 0.20 m over legs 16 mm wide


def test_a_leg_at_angle_zero_is_at_its_longest_and_touches_the_floor(model: mujoco.MjModel) -> None:
    world, _ = bent(model, 0.0)
    for name in ROBOT.leg_names:
        ring = world.data.geom(PREFIX + name).xpos
        assert ring[2] == pytest.approx(0.025)  # centre one radius over the floor
        assert world.data.body(PREFIX + name).xpos[2] - ring[2] == pytest.approx(0.008)


def test_legs_bring_their_own_friction_to_a_contact(model: mujoco.MjModel) -> None:
    for name in ROBOT.leg_names:
        geom = model.geom(PREFIX + name)
        assert geom.priority[0] > model.geom("floor").priority[0]
        assert geom.friction[0] == pytest.approx(0.6)


def test_the_pitch_joints_are_locked_stiffly(model: mujoco.MjModel) -> None:
    # the weight of a link, a sixth of all, on a lever of one link must bend it by less than 1 deg
    torque = 2.0 * 9.81 / 6 * 0.12
    for name in ROBOT.pitch_names:
        assert torque / model.joint(PREFIX + name).stiffness[0] < math.radians(1)


def test_straight_antennae_point_forward_and_mirror_each_other(model: mujoco.MjModel) -> None:
    _, (left, right) = bent(model, 0.0)
    reach = 0.12 * math.cos(math.radians(47))
    aside = 0.02 + 0.12 * math.sin(math.radians(47))
    assert left == pytest.approx([0.06 + reach, aside, 0.033])
    assert right == pytest.approx([0.06 + reach, -aside, 0.033])


def test_positive_angles_bend_both_tips_towards_the_tail(model: mujoco.MjModel) -> None:
    world, (left, right) = bent(model, 0.2)
    straight = bent(model, 0.0)[1][0]
    assert left[0] < straight[0] - 0.03
    assert right == pytest.approx(left * [1, -1, 1])
    angles = world.data.qpos[world.places.hinges]
    assert angles.sum(axis=1) == pytest.approx([1.2, 1.2])


def test_bent_antennae_follow_the_chain_of_links(model: mujoco.MjModel) -> None:
    _, (left, _) = bent(model, 0.2)
    headings = math.radians(47) + 0.2 * np.arange(1, 7)
    assert left[0] == pytest.approx(0.06 + 0.02 * np.cos(headings).sum())
    assert left[1] == pytest.approx(0.02 + 0.02 * np.sin(headings).sum())


def test_contacts_have_the_projects_softness(model: mujoco.MjModel) -> None:
    assert model.geom_solref == pytest.approx(np.tile([0.004, 1.0], (model.ngeom, 1)))
    assert model.geom_solimp[:, :3] == pytest.approx(
        np.tile([0.95, 0.99, 0.0005], (model.ngeom, 1))
    )


def test_the_silent_reset_is_off_and_sleep_is_on(model: mujoco.MjModel) -> None:
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP


def test_the_numerics_are_the_projects(model: mujoco.MjModel) -> None:
    assert model.opt.timestep == 0.002
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert model.opt.gravity == pytest.approx([0, 0, -9.81])


def test_of_the_robot_legs_alone_touch_legs(model: mujoco.MjModel) -> None:
    robot = [i for i in range(model.ngeom) if model.geom(i).name.startswith(PREFIX)]
    kind, meets = model.geom_contype[robot], model.geom_conaffinity[robot]
    leg = np.array([model.geom(i).name.removeprefix(PREFIX) in ROBOT.leg_names for i in robot])
    touching = (kind[:, None] & meets[None, :]) != 0
    assert (touching == (leg[:, None] & leg[None, :])).all()
    assert ROBOT.links * 4 + 12 == len([i for i in robot if model.geom(i).name])
