"""A step of a protocol in the simulation: its commands go in, what a robot feels comes out.

Each step starts from the posture that was measured at its beginning, so that nothing that went
wrong before counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from antennate.params.scene import HookParams, PhysicsParams, VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.hook import Hook
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.world import PREFIX, World, add_robot, new_spec, world_spec
from antennate.types import Floats, JointCommand

PHYSICS = PhysicsParams()
SETTLING, CALMING = 0.5, 0.8
"""Time for which the first command is held before a step begins [s], and what is left there of all
speeds after a tick: hanging, a robot would bob for seconds."""
HEIGHT = 0.1
"""How much higher than on the floor a robot hangs [m], so that no end that sags is below 0."""
_CALM = VariationParams(joint_bias=0.0, slip_log_sd=0.0, reading_noise=0.0)
_SILENT = {"gyro_bias": 0.0, "gyro_noise": 0.0, "accel_bias": 0.0, "accel_noise": 0.0}


@dataclass(frozen=True)
class Course:
    """One step of a protocol at n ticks that are a control period apart.

    Attributes:
        name: Name of the step.
        hook: What held the middle link, the legs in the air; None for a robot on the floor.
        period: Control period [s].
        cycle: Period of the gait [s], 0 where there is none.
        commands: Commanded angles of all joints [rad], shape (n, J).
        positions: Measured angles of all joints [rad], shape (n, J).
        gyro: Angular velocity of the head [rad/s], shape (n, 3), or (n, 0) without a sensor.
        counts: Readings of the antennae [counts], shape (n, 2), or (n, 0) without antennae.
        poses: Place x, y [m] and heading [rad] of the head by motion capture, shape (n, 3), NaN in
            gaps; None without.
    """

    name: str
    hook: HookParams | None
    period: float
    cycle: float
    commands: Floats
    positions: Floats
    gyro: Floats
    counts: Floats
    poses: Floats | None = None

    @property
    def hanging(self) -> bool:
        """Whether the robot hung."""
        return self.hook is not None


def simulated(
    robot: RobotSpec,
    course: Course,
    look: Callable[[World], object] = lambda world: None,
    wander: float = 0.0,
    seed: Sequence[int] = (0,),
) -> Course:
    """What the simulation of a robot makes of the commands of a course.

    Args:
        robot: The robot.
        course: Its commands, and the posture in which it begins.
        look: Called with the world at each tick of the course.
        wander: Standard deviation of the logarithm of the friction of legs that wanders.
        seed: Of how it wanders.

    Raises:
        SimulationError: The robot falls over or flies apart.
    """
    robot = _silent(robot)
    world = world_of(robot, course.hook, course.positions[0])
    sim = SimRobot(1, robot, course.period, PHYSICS.timestep)
    variation = _CALM.model_copy(update={"slip_log_sd": wander})
    chance = Disturbance(np.random.default_rng(list(seed)), variation, robot, course.period)
    sim.load(0, world, chance)
    before = round(SETTLING / course.period)
    places: list[tuple[float, float, float]] = []
    felt, rows = [], np.concatenate([course.commands[:1]] * before + [course.commands])
    for tick, command in enumerate(commands(robot, rows)):
        felt.append(sim.read())
        if tick >= before:
            look(world)
            places.append((*world.head[:2].tolist(), world.heading))
        else:
            world.data.qvel *= CALMING
        sim.write(command)
        sim.sleep_until((tick + 1) * course.period)
    for failure in sim.failures.values():
        raise failure
    frames = felt[before:]
    return replace(
        course,
        positions=np.concatenate([frame.positions for frame in frames]),
        gyro=np.concatenate([frame.angular_velocity for frame in frames]).reshape(len(frames), -1),
        counts=np.concatenate([frame.counts for frame in frames])[:, : robot.antenna_count],
        poses=None if course.poses is None else _seen(np.array(places), course.poses),
    )


def _seen(places: Floats, measured: Floats) -> Floats:
    """Poses of a simulation where motion capture has some, shape (n, 3)."""
    whole = np.column_stack([places[:, :2], np.unwrap(places[:, 2])])
    return np.where(np.isfinite(measured), whole, np.nan)


def _silent(robot: RobotSpec) -> RobotSpec:
    """A robot whose inertial sensor has neither bias nor noise."""
    return robot.model_copy(update={"imu": robot.imu.model_copy(update=_SILENT)})


def world_of(robot: RobotSpec, hook: HookParams | None, angles: Floats) -> World:
    """The robot with its joints at some angles [rad], on a bare floor or in the air by a hook."""
    spec = world_spec(PHYSICS, robot) if hook is None else new_spec(PHYSICS)
    if hook is not None:
        add_robot(spec, robot, PHYSICS)
        spec.body(PREFIX + robot.link_names[0]).pos[2] += HEIGHT
        if hook.firm:
            held = spec.add_equality(
                type=mujoco.mjtEq.mjEQ_WELD,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                name1=PREFIX + robot.link_names[robot.links // 2],
            )
            held.solref[0] = PHYSICS.contact_time
    world = World(spec.compile(), robot)
    world.place_drives(angles)
    if hook is not None and not hook.firm:
        spring = Hook(world, hook)
        spring.grasp()
        world.forces = spring.pull
    return world


def commands(robot: RobotSpec, rows: Floats) -> Iterator[JointCommand]:
    """Commands of rows of angles of all joints in the robot's order [rad], shape (n, J)."""
    shapes = robot.command_shapes(len(rows))
    ends = np.cumsum([math.prod(shape[1:]) for shape in shapes.values()])
    pairs = zip(shapes.items(), np.split(rows, ends[:-1], axis=1), strict=True)
    parts = {name: part.reshape(shape) for (name, shape), part in pairs}
    for tick in range(len(rows)):
        yield JointCommand(**{name: part[tick : tick + 1] for name, part in parts.items()})
