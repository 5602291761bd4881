"""The robot and its antennae as parts, and which kinds of geoms can touch.

An antenna is a base servo hinge and a chain of sprung links, along x, bending about z. Positive
angles bend towards the tail once it is mounted: on the left as it is, on the right turned half
about its own axis, which mirrors it.

The head (link 0) of a robot carries the free joint and looks along +x; every further link hangs
behind the one before. A link is a spine along x and a cross-beam along y that houses the two leg
servos. The foot of a leg is a crowned ring; that of a rolling leg sits off its axle.

Two geoms collide if the `contype` of one meets the `conaffinity` of the other. The robot never
touches itself; only legs touch the floor; everything of the robot touches obstacles and ground,
which is a floor with steps and holes. In a scene, geoms with the engine's default bits (1 and 1)
become obstacles, planes the floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from antennate.errors import ConfigError
from antennate.files import read_limited
from antennate.robots.antenna import BASE, AntennaSpec
from antennate.robots.servos import ServoParams
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.sim.engine import mujoco
from antennate.types import SIDE_SIGN, SIDES

FLOOR_BIT = 1
OBSTACLE_BIT = 2
LEG_BIT = 4
BODY_BIT = 8
ANTENNA_BIT = 16
GROUND_BIT = 32
GROUND_FRICTION = 0.3
"""Friction of ground against all but legs, which have their own (assumed: as the body)."""


Side = Literal["left", "right"]
STOPS: dict[str, Any] = {"limited": mujoco.mjtLimited.mjLIMITED_TRUE, "range": [-math.pi, math.pi]}
"""Ends of a joint that does not turn without end: half a turn either way (assumed)."""
PLAY = "_play"
"""What the name of the hinge of a joint's backlash ends with, after that of the joint."""
LARGEST_MESH = 20_000_000
"""Most bytes of a mesh."""
_HIDDEN = 3
"""Group of geoms that no viewer shows."""
_PLAY_STOP = (0.004, 1.0)
"""Time constant of the ends of the play [s], the stiffest at the usual timestep, and damping."""


def mounting_quaternion(angle: float, side: Side) -> tuple[float, float, float, float]:
    """How to turn the part on a body whose x is the heading, y the left and z up.

    Args:
        angle: From the heading outwards [rad].
        side: The right antenna is the mirror image of the left one: half a turn about its own axis
            makes its positive angles bend towards the tail too.

    Returns:
        Unit quaternion, real part first.
    """
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    if side not in ("left", "right"):
        raise ConfigError(f"side: expected left or right, found {side}")
    return (c, 0.0, 0.0, s) if side == "left" else (0.0, c, -s, 0.0)


def build_antenna(
    params: AntennaSpec, servo: ServoParams | None = None, side: Side = "left"
) -> mujoco.MjSpec:
    """The part as an uncompiled spec: bodies `base`, `hinge0` and so on, actuator `base`.

    Args:
        params: The antenna.
        servo: Model of the servo that turns its base; an XL330-M288 if absent.
        side: The right one is mounted upside down, so that it bends upwards the other way.
    """
    spec, drive = mujoco.MjSpec(), params.base(servo)
    up = math.sin(params.roll) if side == "left" else -math.sin(params.roll)
    axis = [0.0, 0.0 - up, math.cos(params.roll)]
    spec.compiler.degree = False
    base = spec.worldbody.add_body(name=BASE)
    base.add_joint(
        name=BASE,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, 0, 1],
        damping=drive.damping,
        armature=drive.armature,
        **STOPS,
    )
    actuator = spec.add_actuator(name=BASE, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=BASE)
    actuator.set_to_position(kp=drive.stiffness)
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-drive.torque, drive.torque]

    parent, where = base, [0.0, 0.0, 0.0]
    hinges = zip(params.hinge_names, params.hinge_stiffness(), params.hinge_ranges, strict=True)
    for name, k, most in hinges:
        parent = parent.add_body(name=name, pos=where)
        parent.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=axis,
            stiffness=k,
            damping=params.damping_time * k,
            armature=params.armature,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[-most, most],
            solref_limit=[params.stop_time, 1.0],
        )
        parent.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, params.link_length, 0, 0],
            size=[params.radius, 0, 0],
            mass=params.link_mass,
            friction=[params.friction, 0, 0],
            condim=3,
            contype=ANTENNA_BIT,
            conaffinity=OBSTACLE_BIT | GROUND_BIT,
        )
        where = [params.link_length, 0.0, 0.0]
    base.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[params.radius, 0, 0],
        mass=params.base_mass,
        contype=0,
        conaffinity=0,
    )
    return spec


_YAW, _PITCH, _ELEVATION = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)


def axle_height(params: RobotSpec) -> float:
    """Height of the leg axles with a leg at mid-stance [m]."""
    return params.leg_radius + params.leg_eccentricity


def build_robot(params: RobotSpec) -> mujoco.MjSpec:
    """The part as an uncompiled spec whose first body is the head, axle height at z = 0."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    parent = spec.worldbody
    for i, name in enumerate(params.link_names):
        link = parent.add_body(name=name, pos=[-params.link_pitch if i else 0.0, 0.0, 0.0])
        if i:
            _add_link_joints(spec, link, i, params)
        _add_link_shape(link, params)
        for s, sign in enumerate(SIDE_SIGN if params.leg_count else ()):
            _add_leg(spec, link, len(SIDES) * i + s, sign, params)
        parent = link
    if params.antenna_count:
        _attach_antennae(spec, params)
    for body in params.bodies:
        part = spec.body(body.name)
        part.mass, part.ipos, part.fullinertia = body.mass, body.centre, body.inertia
    if params.meshes:
        add_meshes(spec, Path(params.meshes))
    return spec


def add_meshes(spec: mujoco.MjSpec, folder: Path) -> None:
    """Draw bodies by the meshes of a folder, NAME.stl in mm in the frame of the body.

    Args:
        spec: The robot; it is changed. Shapes that touch stay as they are, and are hidden.
        folder: Where the meshes are; a body without one is drawn as it is.

    Raises:
        ConfigError: It holds none, or one that cannot be read.
    """
    found = {body: folder / f"{body.name}.stl" for body in spec.bodies if body.name}
    found = {body: file for body, file in found.items() if file.is_file()}
    if not found:
        raise ConfigError(f"robot.meshes: expected a folder with files such as link0.stl: {folder}")
    for body, file in found.items():
        for geom in body.geoms:
            geom.group = _HIDDEN
        spec.assets[file.name] = read_limited(file, LARGEST_MESH, ConfigError)
        spec.add_mesh(name=body.name, file=file.name, scale=[1e-3] * 3)
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=body.name, mass=0.0)
        geom.contype = geom.conaffinity = 0


def _add_hinge(
    body: mujoco.MjsBody,
    name: str,
    axis: Sequence[float],
    at: Sequence[float],
    servo: ServoParams,
    **more: Any,
) -> None:
    """A hinge with the friction and the inertia of its servo."""
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=axis,
        pos=at,
        damping=servo.damping,
        armature=servo.armature,
        frictionloss=servo.friction,
        **more,
    )


def _add_servo(spec: mujoco.MjSpec, joint: str, servo: ServoParams) -> None:
    """A position servo on its torque-speed line: clipped drive minus the joint's damping."""
    actuator = spec.add_actuator(name=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint)
    actuator.set_to_position(kp=servo.stiffness)
    actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
    actuator.forcerange = [-servo.stall_torque, servo.stall_torque]
    actuator.delay = servo.delay


def _add_link_joints(spec: mujoco.MjSpec, link: mujoco.MjsBody, i: int, params: RobotSpec) -> None:
    """A yaw joint with its servo, and a pitch joint that is locked or has one too."""
    at = [params.link_pitch / 2, 0.0, 0.0]
    yaw, pitch = params.yaw_names[i - 1], params.pitch_names[i - 1]
    servo = params.servo_of(params.yaw)
    _add_hinge(link, yaw, _YAW, at, servo, **STOPS)
    _add_servo(spec, yaw, servo)
    if backlash := params.backlash[i - 1]:
        link.add_joint(
            name=yaw + PLAY,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=_YAW,
            pos=at,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[-backlash / 2, backlash / 2],
            solref_limit=_PLAY_STOP,
        )
    servo = params.servo_of(params.pitch)
    more = STOPS if params.pitch_count else {"stiffness": params.pitch.stiffness}
    _add_hinge(link, pitch, _PITCH, at, servo, **more)
    if params.pitch_count:
        _add_servo(spec, pitch, servo)


def _add_link_shape(link: mujoco.MjsBody, params: RobotSpec) -> None:
    half_spine = max(params.link_pitch / 2 - params.body_radius, 1e-3)
    half_beam = max(params.width / 2 - params.leg_width - params.body_radius, 1e-3)
    for half, along_x in ((half_spine, True), (half_beam, False)):
        end = [half, 0.0, 0.0] if along_x else [0.0, half, 0.0]
        link.add_geom(
            name=f"{link.name}_{'spine' if along_x else 'beam'}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[-end[0], -end[1], 0.0, end[0], end[1], 0.0],
            size=[params.body_radius, 0, 0],
            mass=params.link_mass / 2,
            friction=[params.body_friction, 0, 0],
            condim=3,
            contype=BODY_BIT,
            conaffinity=OBSTACLE_BIT | GROUND_BIT,
        )


def _add_leg(
    spec: mujoco.MjSpec, link: mujoco.MjsBody, i: int, sign: float, params: RobotSpec
) -> None:
    """A rolling leg turns about its axle; a lifting one about the spine, upwards if positive."""
    name = params.leg_names[i]
    lateral = sign * (params.width - params.leg_width) / 2
    lifting = params.legs.kind == "lifting"
    hip = sign * params.hip if lifting else lateral
    servo = params.servo_of(params.legs)
    leg = link.add_body(name=name, pos=[0.0, hip, 0.0])
    _add_hinge(leg, name, [sign, 0.0, 0.0] if lifting else _PITCH, [0.0, 0.0, 0.0], servo)
    leg.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        pos=[0.0, lateral - hip, -params.leg_eccentricity],
        size=[params.leg_radius, params.leg_width / 2, params.leg_radius],
        mass=params.leg_mass,
        friction=[params.leg_frictions[i], 0, 0],
        priority=1,
        condim=3,
        contype=LEG_BIT,
        conaffinity=FLOOR_BIT | OBSTACLE_BIT | LEG_BIT | GROUND_BIT,
    )
    _add_servo(spec, name, servo)


def _attach_antennae(spec: mujoco.MjSpec, params: RobotSpec) -> None:
    head = spec.body(params.link_names[0])
    servo = params.servo_of(params.antennae)
    count = params.antenna_count
    aside = params.antenna.base_spacing / 2 if count > 1 else 0.0
    for i, (prefix, sign) in enumerate(zip(ANTENNA_PREFIXES[:count], SIDE_SIGN, strict=False)):
        side = "left" if sign > 0 else "right"
        turn = mounting_quaternion(params.antenna.base_angle, side)
        place = [params.link_pitch / 2, sign * aside, 0.0]
        antenna = params.antenna if sign > 0 else params.right_antenna
        part = build_antenna(antenna, servo, side)
        if params.elevation_count:
            carrier = _add_elevation(spec, head, params.elevation_names[i], place, sign, params)
            frame = carrier.add_frame(quat=mounting_quaternion(0.0, side))
        else:
            frame = head.add_frame(pos=place, quat=turn)
        spec.attach(part, frame=frame, prefix=prefix)
        spec.actuator(prefix + BASE).delay = servo.delay


def _add_elevation(
    spec: mujoco.MjSpec,
    head: mujoco.MjsBody,
    name: str,
    place: Sequence[float],
    sign: float,
    params: RobotSpec,
) -> mujoco.MjsBody:
    """The body that carries an antenna's base and turns it up; x is the antenna's direction."""
    servo = params.servo_of(params.elevation)
    half = sign * params.antenna.base_angle / 2
    body = head.add_body(name=name, pos=place, quat=[math.cos(half), 0.0, 0.0, math.sin(half)])
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=_ELEVATION,
        damping=servo.damping,
        armature=servo.armature,
        **STOPS,
    )
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[params.body_radius / 2, 0, 0],
        mass=params.elevation.mass,
        contype=0,
        conaffinity=0,
    )
    _add_servo(spec, name, servo)
    return body
