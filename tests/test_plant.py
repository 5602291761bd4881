"""What a real robot has beside the ideal one: delay, backlash, unequal friction, springs, gains."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from antennate.cli import main
from antennate.params.scene import GRAVITY, PhysicsParams, VariationParams
from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec
from antennate.sim.export.folder import export_mjcf, export_urdf
from antennate.sim.export.mjcf import difference
from antennate.sim.parts import build_robot
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import PREFIX, World, compile_world
from antennate.twin.robot import TwinRobot
from antennate.types import Floats

PHYSICS, PERIOD = PhysicsParams(), 0.01
DEGREE = math.radians(1.0)
STILL = VariationParams(joint_bias=0, slip_log_sd=0, reading_noise=0)
LEGS = {"friction_factors": (0.5, 1.0) * 6}
PLAY = {"backlash": (0.0, DEGREE, 0.0, 0.0, 0.0)}


def robot_with(delay: float = 0.0, **more: Any) -> RobotSpec:
    """A robot all of whose servos have a delay."""
    servos = {name: {"delay": delay} for name in ("xc430_w240", "xl330_m288")}
    return RobotSpec.model_validate({"servos": servos, **more})


def standing(robot: RobotSpec, height: float = 0.0) -> World:
    """A straight robot on the floor, or without weight above it."""
    world = World(compile_world(PHYSICS, robot), robot)
    if height:
        world.model.opt.gravity[:] = 0.0
    world.place(0.0, 0.0, 0.0, np.zeros(5), np.zeros((6, 2)), ground=height)
    return world


def chirped(delay: float) -> Floats:
    """Answer of a leg in the air to a chirp of 1 to 6 Hz that it is told in each step [rad]."""
    world = standing(robot_with(delay), height=1.0)
    t = np.arange(0.0, 5.0, PHYSICS.timestep)
    goal = 0.05 * np.sin(2 * math.pi * (1.0 + 0.5 * t) * t)
    goal[t > 4.5] = 0.0
    command, angles = world.drives(), np.empty(len(t))
    for i, wanted in enumerate(goal):
        command[5] = wanted
        world.command_finite(command)
        world.advance(1)
        angles[i] = world.drives()[5]
    return angles


@pytest.mark.parametrize("delay", [0.004, 0.0205, 0.05])
def test_the_phase_of_a_chirp_grows_by_the_delay(delay: float) -> None:
    prompt, late = np.fft.rfft(chirped(0.0)), np.fft.rfft(chirped(delay))
    frequency = np.fft.rfftfreq(2500, PHYSICS.timestep)
    inside = (frequency > 1.0) & (frequency < 5.0)
    lag = -np.unwrap(np.angle(late / prompt)[inside])
    np.testing.assert_allclose(lag, 2 * math.pi * frequency[inside] * delay, atol=0.02)


def test_until_its_first_goal_arrives_a_servo_holds_where_it_was_put() -> None:
    world = standing(robot_with(0.03), height=1.0)
    world.place(0.0, 0.0, 0.0, np.full(5, 0.2), np.full((6, 2), 1.0), ground=1.0)
    start = world.state()
    for _ in range(2):
        world.command(np.zeros(19))
        world.advance(15)
        np.testing.assert_allclose(world.drives()[:17], [0.2] * 5 + [1.0] * 12, atol=1e-6)
        world.advance(15)
        assert (world.drives()[5:17] < 0.99).all()
        world.restore(start)


def twin_of(robot: RobotSpec) -> TwinRobot:
    """A twin whose servos have torque, on a bare floor."""
    body = SimRobot(1, robot, PERIOD, PHYSICS.timestep)
    chance = Disturbance(np.random.default_rng(0), STILL, robot, PERIOD)
    body.load(0, standing(robot), chance)
    twin = TwinRobot(body, robot, PERIOD, boot_id=1)
    for servo in twin.servos:
        servo.set("torque_enable", 1)
    return twin


def base_of(twin: TwinRobot, until: float) -> list[float]:
    """The left antenna's base in each tick until a time [rad]."""
    angles: list[float] = []
    while twin.t < until - 1e-9:
        twin.advance(twin.due)
        angles.append(float(twin.world.drives()[17]))
    return angles


def test_a_goal_reaches_the_shaft_of_a_twin_after_the_delay() -> None:
    paths: list[Floats] = []
    for delay in (0.0, 0.02):
        twin = twin_of(robot_with(delay))
        base_of(twin, 0.1)
        twin.servos[17].set("goal_position", 2048 + 300)
        paths.append(np.array(base_of(twin, 0.5)))
    prompt, late = paths
    assert prompt[-1] > 0.3, "it turned"
    assert abs(late[:2]).max() < 1e-3
    np.testing.assert_allclose(late[2:], prompt[:-2], atol=2e-3)


def test_without_torque_no_goal_that_is_under_way_moves_a_shaft() -> None:
    twin = twin_of(robot_with(0.05))
    base_of(twin, 0.1)
    twin.servos[17].set("goal_position", 2048 + 600)
    base_of(twin, 0.12)
    twin.servos[17].set("torque_enable", 0)
    assert max(base_of(twin, 0.4)) < 1e-3


def turned(world: World, torque: float) -> tuple[float, float]:
    """Angles of the horn of yaw2 and of its link under a load between links 1 and 2 [rad]."""
    model, data, headings = world.model, world.data, list[float]()
    for name, sign in (("link1", -1.0), ("link2", 1.0)):
        data.xfrc_applied[model.body(PREFIX + name).id, 5] = sign * torque
    world.command(np.zeros(19))
    world.advance(2000)
    for name in ("link1", "link2"):
        x, y = data.xmat[model.body(PREFIX + name).id, [0, 3]]
        headings.append(math.atan2(y, x))
    return float(world.drives()[1]), headings[1] - headings[0]


@pytest.mark.parametrize("backlash", [0.0, DEGREE, 3 * DEGREE])
def test_backlash_is_a_dead_zone_between_horn_and_link(backlash: float) -> None:
    robot = RobotSpec.model_validate({"yaw": {"backlash": (0.0, backlash, 0.0, 0.0, 0.0)}})
    world, torque = standing(robot, height=1.0), 0.1
    (horn, link), (other, back) = turned(world, torque), turned(world, -torque)
    stiffness = ServoParams().stiffness
    assert horn - other == pytest.approx(2 * torque / stiffness, rel=0.01), "what it measures"
    assert (link - back) - (horn - other) == pytest.approx(backlash, rel=0.02, abs=1e-9)


def test_a_robot_without_backlash_delay_and_factors_is_the_same_to_the_bit() -> None:
    plain = {"yaw": {"backlash": (0.0,) * 5}, "legs": {"friction_factors": (1.0,) * 12}}
    models = [compile_world(PHYSICS, r) for r in (RobotSpec(), robot_with(**plain))]
    assert not difference(*models)


def pulls(world: World) -> Floats:
    """Forces ahead of the floor on the left and on the right legs [N], shape (2,)."""
    model, data, force, total = world.model, world.data, np.zeros(6), np.zeros(2)
    for i, contact in enumerate(data.contact):
        mujoco.mj_contactForce(model, data, i, force)
        ahead = float(force[:3] @ contact.frame.reshape(3, 3)[:, 0])
        on_leg = 1.0 if contact.geom[1] in world.places.leg_geoms else -1.0
        total[int(contact.pos[1] < 0.0)] += on_leg * ahead
    return total


@pytest.mark.parametrize(("left", "right"), [(1.0, 1.0), (0.5, 1.0), (1.0, 0.5)])
def test_legs_that_are_dragged_brake_with_their_friction_times_half_the_weight(
    left: float, right: float
) -> None:
    robot = RobotSpec.model_validate({"legs": {"friction_factors": (left, right) * 6}})
    world = standing(robot)
    root, total, ticks = world.places.root_speed, np.zeros(2), 500
    world.command(np.zeros(19))
    world.advance(250)
    world.model.dof_armature[root + np.array([0, 1, 5])] = 1e4  # drags it straight ahead
    world.data.qvel[root] = 0.05
    world.advance(50)
    for _ in range(ticks):
        world.advance(1)
        total += pulls(world)
    half = robot.leg_friction * robot.mass * GRAVITY / 2
    np.testing.assert_allclose(-total / ticks / half, [left, right], rtol=0.05)


@pytest.mark.parametrize(("factors", "way"), [((0.5, 1.0), -1.0), ((1.0, 0.5), 1.0)])
def test_a_robot_that_slides_turns_towards_its_better_legs(
    factors: tuple[float, float], way: float
) -> None:
    robot = RobotSpec.model_validate({"legs": {"friction_factors": factors * 6}})
    world = standing(robot)
    world.command(np.zeros(19))
    world.advance(250)
    world.model.opt.gravity[0] = 1.2 * robot.leg_friction * GRAVITY  # a slope too steep to stand on
    world.advance(200)
    assert world.head[0] > 0.1
    assert way * world.heading > 0.04


def test_chance_keeps_the_factors_of_the_legs() -> None:
    robot = RobotSpec.model_validate({"leg_friction": 0.8, "legs": LEGS})
    chance = Disturbance(np.random.default_rng(0), STILL, robot, PERIOD)
    np.testing.assert_allclose(chance.leg_friction(0), [0.4, 0.8] * 6)


def test_springs_a_fifth_stiffer_bend_a_fifth_less() -> None:
    antenna = {"sensor_stiffness_n_mm_per_deg": 0.0}
    robot = RobotSpec.model_validate({"antenna": antenna, "antennae": {"right_stiffness": 1.2}})
    model = build_robot(robot).compile()  # its head is held
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    bends: list[float] = []
    for side in ("l", "r"):
        hinges = [f"antenna_{side}_{name}" for name in robot.antenna.hinge_names]
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        tip = model.body(hinges[-1]).id
        data.xfrc_applied[tip, :3] = -1e-3 * data.xmat[tip].reshape(3, 3)[:, 1]
        mujoco.mj_step(model, data, 3000)
        bends.append(sum(float(data.joint(name).qpos[0]) for name in hinges))
    assert abs(bends[0]) > 0.01
    assert bends[1] / bends[0] == pytest.approx(1 / 1.2, rel=1e-3)


def test_the_right_flex_sensor_feels_its_share_of_the_bend() -> None:
    """Resistance 10 kOhm (1 + a bend) over 10 kOhm at 3.3 V, by the converter's line fit."""
    sensor = {"hysteresis": 0.0, "creep": (0.0, 0.0)}
    robot = RobotSpec.model_validate(
        {"antenna": {"sensor": sensor}, "antennae": {"right_gain": 0.8}}
    )
    world = standing(robot)
    world.data.qpos[world.places.hinges] = 0.1
    body = SimRobot(1, robot, PERIOD, PHYSICS.timestep)
    body.load(0, world, Disturbance(np.random.default_rng(0), STILL, robot, PERIOD))
    bend = 0.1 * robot.antenna.sensed_hinges * np.array([1.0, 0.8])
    volts = 3.3 / (2.0 + robot.antenna.sensor.bend_gain * bend)
    expected = (volts - 0.142) / (196602 / 65536 / 4096 * 1.1)
    np.testing.assert_allclose(body.read().counts[0], expected, atol=0.51)


def test_a_group_of_joints_has_a_gain_of_its_own() -> None:
    robot = RobotSpec.model_validate({"yaw": {"gain_factor": 2.0}})
    model = compile_world(PHYSICS, robot)
    gains = {n: model.actuator(PREFIX + n).gainprm[0] for n in ("yaw3", "leg_r2")}
    assert gains["yaw3"] == pytest.approx(2.0 * ServoParams().stiffness)
    assert gains["leg_r2"] == pytest.approx(ServoParams().stiffness)
    pulled = twin_of(robot).servos[0].motion.params.position_gain
    assert pulled == pytest.approx(2.0 * ServoParams().position_gain)


def test_exports_hold_delay_play_and_friction() -> None:
    robot = robot_with(0.013, yaw=PLAY, legs=LEGS, antennae={"right_gain": 0.8})
    done = export_mjcf(robot)
    assert done.result["walk_difference_m"] == 0.0
    assert not done.result["model_difference"]
    root = ElementTree.fromstring(done.files["robot.xml"])
    servo = {each.get("name"): each for each in root.iter("position")}["leg_l0"]
    assert float(servo.get("delay", 0)) == 0.013
    root = ElementTree.fromstring(export_urdf(robot).files["robot.urdf"])
    joints = {each.get("name"): each for each in root.iter("joint")}
    assert [name for name in joints if "play" in (name or "")] == ["yaw2_play"]
    limit = joints["yaw2_play"].find("limit")
    assert limit is not None
    assert float(limit.get("upper", 0)) == pytest.approx(DEGREE / 2)


@pytest.mark.ci
def test_a_trial_runs_with_all_of_it(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        "servos = { xc430_w240 = { delay = 0.013 } }\n"
        "yaw = { backlash = [0.0, 0.0175, 0.0, 0.0, 0.0], gain_factor = 1.5 }\n"
        "legs = { friction_factors = [0.5, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1] }\n"
        "antennae = { right_stiffness = 1.2, right_gain = 0.8 }\n"
    )
    words = "tunnel --trials 1 --controllers open --time-limit 1 --scene flat --workers 1"
    assert main([*words.split(), "--robot", str(file), "--out", str(tmp_path / "run")]) == 0


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"yaw": {"backlash": (0.01,)}}, "yaw.backlash: expected one for each of the 5 joints"),
        (
            {"legs": {"friction_factors": (1.0,) * 6}},
            "legs.friction_factors: expected one for each of the 12 joints, found 6",
        ),
        ({"yaw": {"backlash": (-0.01,) * 5}}, "greater than or equal to 0"),
        ({"legs": {"friction_factors": (0.0,) * 12}}, "greater than 0"),
        ({"servos": {"xc430_w240": {"delay": 0.06}}}, "less than or equal to 0.05"),
    ],
)
def test_what_no_robot_has_is_refused(values: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        RobotSpec.model_validate(values)
