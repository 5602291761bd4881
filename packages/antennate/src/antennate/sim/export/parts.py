"""What an exported model has besides the robot that is simulated: sensors, sites and limits.

Nothing here changes how it moves. The robot itself is that of `world_spec`.
"""

from __future__ import annotations

from antennate.params.scene import PhysicsParams
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.sim.attach import add_sensors
from antennate.sim.engine import mujoco
from antennate.sim.places import Gears
from antennate.sim.scenes.scene import SceneInstance
from antennate.sim.world import PREFIX, World, add_robot, new_spec, world_spec
from antennate.types import Floats

START = "start"
"""Keyframe of the robot at the start of its scene."""
PERIOD = "control_period"
"""Numeric: time between two commands [s]."""
GEARS = "gear_friction"
"""Numeric: friction of each actuator's gear as a share of the torque of its motor."""
_HEAD = {
    "head_position": mujoco.mjtSensor.mjSENS_FRAMEPOS,
    "head_orientation": mujoco.mjtSensor.mjSENS_FRAMEQUAT,
    "head_gyro": mujoco.mjtSensor.mjSENS_GYRO,
    "head_accelerometer": mujoco.mjtSensor.mjSENS_ACCELEROMETER,
}


def lone_robot(physics: PhysicsParams, robot: RobotSpec, period: float) -> mujoco.MjSpec:
    """The robot without floor and scene, with its readings."""
    spec = new_spec(physics)
    add_robot(spec, robot, physics)
    _add_readings(spec, robot, period)
    return spec


def robot_in_scene(
    physics: PhysicsParams,
    world: World,
    scene: SceneInstance,
    period: float,
) -> mujoco.MjSpec:
    """The robot in a scene, with its readings and the keyframe `start`.

    Args:
        physics: The numerics.
        world: The same robot in the same scene, at its start.
        scene: The scene.
        period: Time between two commands [s].
    """
    spec = world_spec(physics, world.robot, scene)
    _add_readings(spec, world.robot, period)
    spec.add_key(name=START, qpos=world.data.qpos.copy())
    return spec


def gear_shares(model: mujoco.MjModel, robot: RobotSpec) -> Floats:
    """Friction of the gear of each actuator as a share of its motor's torque, shape (nu,)."""
    gears = Gears(model, robot, PREFIX)
    shares = 0.0 * model.actuator_gainprm[:, 0]
    shares[gears.drive] = gears.share
    return shares


def _add_readings(spec: mujoco.MjSpec, robot: RobotSpec, period: float) -> None:
    """Add sensors of servos, antennae and head, limits of goals, and numbers for a driver."""
    spec.modelname = "robot"
    for name, limit in zip(robot.joint_names, robot.limits, strict=True):
        actuator = spec.actuator(PREFIX + name)
        if limit < float("inf"):
            actuator.ctrlrange = [-limit, limit]
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE
        _add_sensor(spec, f"{name}_angle", "JOINTPOS", "JOINT", name)
        _add_sensor(spec, f"{name}_speed", "JOINTVEL", "JOINT", name)
        _add_sensor(spec, f"{name}_torque", "ACTUATORFRC", "ACTUATOR", name)
    for prefix in ANTENNA_PREFIXES[: robot.antenna_count]:
        add_sensors(spec, robot.antenna, PREFIX + prefix)
        flex = spec.add_tendon(name=f"{PREFIX}{prefix}flex")
        for hinge in robot.antenna.hinge_names[: robot.antenna.sensed_hinges]:
            flex.wrap_joint(PREFIX + prefix + hinge, 1.0)
        _add_sensor(spec, f"{prefix}flex", "TENDONPOS", "TENDON", f"{prefix}flex")
    head = spec.body(PREFIX + robot.link_names[0]).add_site(name=f"{PREFIX}head", group=4)
    for name, kind in _HEAD.items():
        spec.add_sensor(
            name=PREFIX + name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=head.name
        )
    spec.add_numeric(name=PERIOD, data=[period], size=1)
    shares = gear_shares(spec.compile(), robot)
    if shares.any():
        spec.add_numeric(name=GEARS, data=shares, size=len(shares))


def _add_sensor(spec: mujoco.MjSpec, name: str, kind: str, part: str, target: str) -> None:
    spec.add_sensor(
        name=PREFIX + name,
        type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"),
        objtype=getattr(mujoco.mjtObj, f"mjOBJ_{part}"),
        objname=PREFIX + target,
    )
