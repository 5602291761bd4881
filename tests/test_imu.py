"""The inertial sensor of simulated robots: against physics, and a peer in the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest

from antennate.control.policy.contract import contract_of, require_match
from antennate.control.policy.interface import PolicyInterface
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import ControlParams
from antennate.params.scene import PhysicsParams, VariationParams
from antennate.robots.imu import ImuParams, bias_of, measured, noise_of
from antennate.robots.parts import bill
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.imu import Imu
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import draw_trial, scene_of
from antennate.sim.world import PREFIX, World, compile_world, world_spec
from antennate.types import Floats, JointCommand

G = 9.81
PERIOD = 0.01
QUIET = {"gyro_noise": 0.0, "gyro_bias": 0.0, "accel_noise": 0.0, "accel_bias": 0.0}
SENSOR = ImuParams(kind="head", **QUIET)
ROBOT = RobotSpec.named("scuttle3d").model_copy(update={"imu": SENSOR})
PLAIN = ROBOT.model_copy(update={"imu": ImuParams()})
STILL = VariationParams(reading_noise=0.0, slip_log_sd=0.0, joint_bias=0.0)


def turned(axis: tuple[float, float, float], angle: float) -> Floats:
    """The quaternion of a turn about an axis [rad]."""
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * np.array(axis))])


def states(quaternion: Floats, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Floats:
    """One row of what the sensor is given."""
    return np.concatenate([quaternion, velocity, np.zeros(3)])[None]


def felt(sensor: Imu, t: float, state: Floats) -> tuple[Floats, Floats]:
    """One sample without errors: angular velocity and specific force, shape (3,)."""
    counts = sensor.step(np.array([t]), state, np.zeros((1, 6)))
    rate, force = measured(SENSOR, counts)
    return rate[0], force[0]


def test_a_head_at_rest_feels_gravity_upwards() -> None:
    sensor = Imu(SENSOR, 1)
    for tick in range(3):
        rate, force = felt(sensor, PERIOD * tick, states(turned((0, 0, 1), 2.0)))
        np.testing.assert_allclose(rate, 0.0)
        np.testing.assert_allclose(force, [0.0, 0.0, G], atol=SENSOR.accel_step)


@pytest.mark.parametrize(
    ("axis", "force"),
    [
        ((0, -1, 0), (0.5, 0.0, math.sqrt(0.75))),  # nose up: x points up in part
        ((1, 0, 0), (0.0, 0.5, math.sqrt(0.75))),  # rolled to the right: y points up in part
    ],
)
def test_a_tilted_head_feels_gravity_along_its_axes(
    axis: tuple[float, float, float], force: tuple[float, float, float]
) -> None:
    _, found = felt(Imu(SENSOR, 1), 0.0, states(turned(axis, math.pi / 6)))
    np.testing.assert_allclose(found, G * np.array(force), atol=SENSOR.accel_step)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
@pytest.mark.parametrize("speed", [-3.0, 0.7, 12.0])
def test_samples_of_a_turn_sum_up_to_its_angle(
    axis: tuple[float, float, float], speed: float
) -> None:
    sensor = Imu(SENSOR, 1)
    felt(sensor, 0.0, states(turned(axis, 0.3)))
    total = np.zeros(3)
    for tick in range(1, 101):
        state = states(turned(axis, 0.3 + speed * PERIOD * tick))
        total += PERIOD * felt(sensor, PERIOD * tick, state)[0]
    np.testing.assert_allclose(total, np.array(axis) * speed, atol=SENSOR.gyro_step)


def test_a_head_on_a_circle_feels_the_centripetal_acceleration() -> None:
    """Speed v on a circle of radius r, to the left: v²/r to the left, and g upwards."""
    v, r = 0.4, 0.25
    sensor = Imu(SENSOR, 1)
    rate, force = np.zeros(3), np.zeros(3)
    for tick in range(5):
        angle = v / r * PERIOD * tick
        velocity = (v * math.cos(angle), v * math.sin(angle), 0.0)
        rate, force = felt(sensor, PERIOD * tick, states(turned((0, 0, 1), angle), velocity))
    np.testing.assert_allclose(rate, [0.0, 0.0, v / r], atol=SENSOR.gyro_step)
    np.testing.assert_allclose(force, [0.0, v * v / r, G], atol=2 * SENSOR.accel_step)


def test_gravity_is_felt_in_the_mean_attitude_of_a_sample() -> None:
    """A head that pitches through the level: forward and back cancel out."""
    sensor = Imu(SENSOR, 1)
    felt(sensor, 0.0, states(turned((0, 1, 0), -0.05)))
    _, force = felt(sensor, PERIOD, states(turned((0, 1, 0), 0.05)))
    np.testing.assert_allclose(force, [0.0, 0.0, G], atol=SENSOR.accel_step)


def test_readings_end_at_the_range() -> None:
    sensor = Imu(SENSOR, 1)
    felt(sensor, 0.0, states(turned((0, 0, 1), 0.0)))
    rate, force = felt(sensor, PERIOD, states(turned((0, 0, 1), -0.2), (5.0, 0.0, 0.0)))
    assert rate[2] == pytest.approx(-math.radians(1000.0), abs=SENSOR.gyro_step)
    assert force[0] == pytest.approx(7.995 * G, abs=SENSOR.accel_step)


def test_noise_has_the_density_that_is_given() -> None:
    """At 100 Hz: 3.8 mdeg/s/√Hz and 80 µg/√Hz over 50 Hz."""
    noise = noise_of(ImuParams(), np.random.default_rng(1), 40_000, 0.01).std(axis=0)
    expected = [math.radians(3.8e-3) * math.sqrt(50.0)] * 3 + [80e-6 * G * math.sqrt(50.0)] * 3
    np.testing.assert_allclose(noise, expected, rtol=0.02)
    zeros = [bias_of(ImuParams(), np.random.default_rng(seed)) for seed in range(4000)]
    expected = [math.radians(1.0)] * 3 + [0.020 * G] * 3
    np.testing.assert_allclose(np.std(zeros, axis=0), expected, rtol=0.05)


def test_means_agree_with_the_engines_own_sensors() -> None:
    """A gyroscope and an accelerometer of MuJoCo in the head, averaged over each period."""
    physics = PhysicsParams()
    spec = world_spec(physics, ROBOT)
    head = spec.body(PREFIX + ROBOT.link_names[0])
    head.add_site(name="imu")
    for kind in (mujoco.mjtSensor.mjSENS_GYRO, mujoco.mjtSensor.mjSENS_ACCELEROMETER):
        spec.add_sensor(type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="imu")
    world = World(spec.compile(), ROBOT)
    world.place(0.0, 0.0, 0.4, np.zeros(5), np.zeros((6, 2)))
    sensor, places, data = Imu(SENSOR, 1), world.places, world.data
    substeps = round(PERIOD / physics.timestep)

    def state() -> Floats:
        attitude = data.qpos[places.root + 3 : places.root + 7]
        return np.concatenate([attitude, data.qvel[places.root_speed :][:6]])[None]

    felt(sensor, 0.0, state())
    own, peers = list[Floats](), list[Floats]()
    for tick in range(1, 101):
        drive = np.zeros(len(ROBOT.joint_names))
        drive[:5] = 0.2 * math.sin(6.0 * PERIOD * tick)
        drive[5:17] = 3.0 * PERIOD * tick
        world.command(drive)
        for _ in range(substeps):
            world.step(1)
            peers.append(data.sensordata.copy())  # of the state before the step
        own.append(np.concatenate(felt(sensor, data.time, state())))
    rates = np.array(peers)[1:, :3]  # the engine turns a body by its new velocity
    rates = np.mean(rates[: 99 * substeps].reshape(99, substeps, 3), axis=1)
    forces = np.mean(np.array(peers)[:, 3:].reshape(100, substeps, 3), axis=1)
    found = np.array(own)
    spread = rates.std(axis=0).max(), forces.std(axis=0).max()
    assert spread[0] > 0.1
    assert spread[1] > 0.1
    assert np.sqrt(np.mean((found[:99, :3] - rates) ** 2, axis=0)).max() < 0.02 * spread[0]
    assert np.sqrt(np.mean((found[:, 3:] - forces) ** 2, axis=0)).max() < 0.02 * spread[1]


def robot_with(spec: RobotSpec, batch: int, seed: int = 3) -> SimRobot:
    """Simulated robots that stand."""
    robot = SimRobot(batch, spec, PERIOD, PhysicsParams().timestep)
    for row in range(batch):
        rng = np.random.default_rng(seed + row)
        world = World(compile_world(PhysicsParams(), spec), spec)
        world.place(0.0, 0.0, 0.0, np.zeros(5), np.zeros((6, 2)))
        robot.load(row, world, Disturbance(rng, VariationParams(), spec, PERIOD))
    return robot


def walk(robot: SimRobot, spec: RobotSpec, ticks: int) -> list[Floats]:
    """Frames of a walk: t, counts and positions, then what an inertial sensor felt."""
    frames = []
    for tick in range(ticks):
        frame = robot.read()
        batch = len(frame.t)
        parts = frame.t[:, None], frame.counts, frame.positions
        motion = frame.angular_velocity, frame.linear_acceleration
        frames.append(np.concatenate([*parts, *(m.reshape(batch, -1) for m in motion)], axis=1))
        command = {name: np.zeros(shape) for name, shape in spec.command_shapes(batch).items()}
        command["yaw"][:] = 0.3 * math.sin(4.0 * PERIOD * tick)
        command["leg"][:] = 2.0 * PERIOD * tick
        robot.write(JointCommand(**command))
        robot.sleep_until(PERIOD * (tick + 1))
    return frames


def test_a_standing_robot_feels_gravity() -> None:
    frames = walk(robot_with(ROBOT, 2), ROBOT, 1)
    np.testing.assert_allclose(frames[0][:, -6:-3], 0.0, atol=SENSOR.gyro_step)
    np.testing.assert_allclose(frames[0][:, -3:], [[0.0, 0.0, G]] * 2, atol=SENSOR.accel_step)


def test_a_robot_among_things_that_move_feels_its_own_head() -> None:
    """The sensor of a batch, fed by the engine's state of the joint that is named so."""
    config = TunnelConfig(robot=ROBOT)
    start = draw_trial(config, scene_of(config), 0, config.control.gait, PERIOD)
    model, data = start.world.model, start.world.data
    root = model.joint(PREFIX + "root")
    assert root.dofadr[0] > 0  # cylinders come before the robot
    robot, sensor = SimRobot(1, ROBOT, PERIOD, config.physics.timestep), Imu(SENSOR, 1)
    robot.load(0, start.world, start.chance)
    turns = list[Floats]()
    for tick in range(30):
        frame = robot.read()
        attitude = data.qpos[root.qposadr[0] + 3 :][:4]
        state = np.concatenate([attitude, data.qvel[root.dofadr[0] :][:6]])[None]
        rate, force = felt(sensor, data.time, state)
        np.testing.assert_array_equal(frame.angular_velocity[0], rate)
        np.testing.assert_array_equal(frame.linear_acceleration[0], force)
        turns.append(rate)
        shapes = ROBOT.command_shapes().items()
        command = {name: np.zeros(shape) for name, shape in shapes}
        command["yaw"][:] = 0.3 * math.sin(4.0 * PERIOD * tick)
        robot.write(JointCommand(**command))
        robot.sleep_until(PERIOD * (tick + 1))
    assert np.array(turns)[:, 2].std() > 0.02


def test_the_sensor_changes_nothing_else() -> None:
    noisy = ROBOT.model_copy(update={"imu": ImuParams(kind="head")})
    with_imu = np.array(walk(robot_with(noisy, 2), noisy, 120))
    without = np.array(walk(robot_with(PLAIN, 2), PLAIN, 120))
    assert without.shape[2] == with_imu.shape[2] - 6
    np.testing.assert_array_equal(with_imu[:, :, :-6], without)
    assert np.isfinite(with_imu).all()
    assert (with_imu[:, 0] != with_imu[:, 1]).any(axis=0)[-6:].all()  # each has its own errors


def test_an_empty_row_feels_nothing() -> None:
    robot = SimRobot(2, ROBOT, PERIOD, PhysicsParams().timestep)
    frame = robot.read()
    assert frame.angular_velocity.shape == frame.linear_acceleration.shape == (2, 3)
    assert np.isnan(frame.angular_velocity).all()
    assert np.isnan(frame.linear_acceleration).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gyro_range": 30.0}, "imu.*gyro_range: expected 1 to 32768 times gyro_step"),
        ({"accel_step": 0.001}, "imu.*accel_range: expected 1 to 32768 times accel_step"),
        ({"gyro_step": 0.0}, "imu.gyro_step"),
        ({"accel_range": 5.0}, "imu.accel_range"),
    ],
)
def test_what_16_bits_cannot_hold_is_refused(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        RobotSpec(imu={"kind": "head", **changes})  # pyright: ignore[reportArgumentType]


def test_a_robot_without_antennae_has_no_board_for_it() -> None:
    with pytest.raises(ConfigError, match=r"imu\.kind: expected none for a robot without antennae"):
        RobotSpec(antennae={"kind": "none"}, imu={"kind": "head"})  # pyright: ignore[reportArgumentType]


def test_the_parts_of_a_robot_with_one_have_it() -> None:
    parts = {part.item for part in bill(ROBOT)} - {part.item for part in bill(PLAIN)}
    assert parts == {"breakout of an LSM6DSOX"}


def test_a_robot_without_one_is_written_as_before_there_were_any() -> None:
    assert "imu" not in RobotSpec().model_dump(mode="json")
    assert "imu" not in RobotSpec().model_dump_json()
    assert RobotSpec.model_validate(ROBOT.model_dump()) == ROBOT
    changed = RobotSpec(imu={"gyro_range": 5.0})  # pyright: ignore[reportArgumentType]
    assert RobotSpec.model_validate_json(changed.model_dump_json()) == changed


def test_policies_do_not_depend_on_a_sensor_that_they_do_not_observe() -> None:
    interface, control = PolicyInterface(), ControlParams()
    made, other = (contract_of(interface, control, robot) for robot in (PLAIN, ROBOT))
    assert made.robot_hash == other.robot_hash
    assert "imu" not in made.robot
    require_match(made, control, ROBOT, "a file")
