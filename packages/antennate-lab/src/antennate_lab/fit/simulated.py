"""A step of a protocol in the simulation: its commands go in, what a robot feels comes out.

Each step starts from the posture that was measured at its beginning, so that nothing that went
wrong before counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from antennate.params.scene import PhysicsParams, VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import PREFIX, World, add_robot, compile_world, new_spec
from antennate.types import Floats, JointCommand

PHYSICS = PhysicsParams()
SETTLING = 1.0
"""Time for which the first command is held before a step begins [s]."""
HEIGHT = 0.1
"""How much higher than on the floor a robot hangs [m], so that no end that sags is below 0."""
_CALM = VariationParams(joint_bias=0.0, slip_log_sd=0.0, reading_noise=0.0)
_SILENT = {"gyro_bias": 0.0, "gyro_noise": 0.0, "accel_bias": 0.0, "accel_noise": 0.0}


@dataclass(frozen=True)
class Course:
    """One step of a protocol at n ticks that are a control period apart.

    Attributes:
        name: Name of the step.
        hanging: Whether the middle link was held, the legs in the air; else the robot stood.
        period: Control period [s].
        cycle: Period of the gait [s], 0 where there is none.
        commands: Commanded angles of all joints [rad], shape (n, J).
        positions: Measured angles of all joints [rad], shape (n, J).
        gyro: Angular velocity of the head [rad/s], shape (n, 3), or (n, 0) without a sensor.
        counts: Readings of the antennae [counts], shape (n, 2), or (n, 0) without antennae.
    """

    name: str
    hanging: bool
    period: float
    cycle: float
    commands: Floats
    positions: Floats
    gyro: Floats
    counts: Floats


def simulated(
    robot: RobotSpec, course: Course, look: Callable[[World], object] = lambda world: None
) -> Course:
    """What the simulation of a robot makes of the commands of a course.

    Args:
        robot: The robot.
        course: Its commands, and the posture in which it begins.
        look: Called with the world at each tick of the course.

    Raises:
        SimulationError: The robot falls over or flies apart.
    """
    robot = _silent(robot)
    world = world_of(robot, course.hanging)
    world.place_drives(course.positions[0])
    sim = SimRobot(1, robot, course.period, PHYSICS.timestep)
    sim.load(0, world, Disturbance(np.random.default_rng(0), _CALM, robot, course.period))
    before = round(SETTLING / course.period)
    felt = []
    for tick, angles in enumerate([*[course.commands[0]] * before, *course.commands]):
        felt.append(sim.read())
        if tick >= before:
            look(world)
        sim.write(command(robot, angles))
        sim.sleep_until((tick + 1) * course.period)
    for failure in sim.failures.values():
        raise failure
    frames = felt[before:]
    return replace(
        course,
        positions=np.concatenate([frame.positions for frame in frames]),
        gyro=np.concatenate([frame.angular_velocity for frame in frames]).reshape(len(frames), -1),
        counts=np.concatenate([frame.counts for frame in frames])[:, : robot.antenna_count],
    )


def _silent(robot: RobotSpec) -> RobotSpec:
    """A robot whose inertial sensor has neither bias nor noise."""
    return robot.model_copy(update={"imu": robot.imu.model_copy(update=_SILENT)})


def world_of(robot: RobotSpec, hanging: bool) -> World:
    """The robot on a bare floor, or held by its middle link in the air."""
    if not hanging:
        return World(compile_world(PHYSICS, robot), robot)
    spec = new_spec(PHYSICS)
    add_robot(spec, robot, PHYSICS)
    spec.body(PREFIX + robot.link_names[0]).pos[2] += HEIGHT
    held = spec.add_equality(
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1=PREFIX + robot.link_names[robot.links // 2],
    )
    held.solref[0] = PHYSICS.contact_time
    return World(spec.compile(), robot)


def command(robot: RobotSpec, angles: Floats) -> JointCommand:
    """Angles of all joints in the robot's order, as a command."""
    shapes = robot.command_shapes()
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes.values()])
    parts = np.split(angles, ends[:-1])
    pairs = zip(shapes.items(), parts, strict=True)
    return JointCommand(**{name: part.reshape(shape) for (name, shape), part in pairs})
