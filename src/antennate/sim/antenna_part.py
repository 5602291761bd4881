"""One antenna as a part: a base servo hinge and a chain of sprung links, along x, bending about z.

Positive angles bend towards the tail once the part is mounted: on the left as it is, on the right
turned half about its own axis, which mirrors it.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from antennate.errors import ConfigError
from antennate.robots.antenna import BASE, AntennaSpec
from antennate.robots.servos import ServoParams
from antennate.sim import layers
from antennate.sim.engine import mujoco

Side = Literal["left", "right"]
STOPS: dict[str, Any] = {"limited": mujoco.mjtLimited.mjLIMITED_TRUE, "range": [-math.pi, math.pi]}
"""Ends of a joint that does not turn without end: half a turn either way (assumed)."""


def mounting_quaternion(angle: float, side: Side) -> tuple[float, float, float, float]:
    """How to turn the part on a body whose x is the heading, y the left and z up.

    Args:
        angle: From the heading outwards [rad].
        side: The right antenna is the mirror image of the left one: half a turn about its own axis
            makes its positive angles bend towards the tail too.

    Returns:
        Unit quaternion, real part first.

    Raises:
        ConfigError: The side is unknown.
    """
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    if side not in ("left", "right"):
        raise ConfigError(f"side: expected left or right, found {side}")
    return (c, 0.0, 0.0, s) if side == "left" else (0.0, c, -s, 0.0)


def build(params: AntennaSpec, servo: ServoParams | None = None) -> mujoco.MjSpec:
    """The part as an uncompiled spec: bodies `base`, `hinge0` and so on, actuator `base`.

    Args:
        params: The antenna.
        servo: Model of the servo that turns its base; an XL330-M288 if absent.
    """
    spec, drive = mujoco.MjSpec(), params.base(servo)
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
    for name, k in zip(params.hinge_names, params.hinge_stiffness(), strict=True):
        parent = parent.add_body(name=name, pos=where)
        parent.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, 1],
            stiffness=k,
            damping=params.damping_time * k,
            armature=params.armature,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[-params.range, params.range],
        )
        parent.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, params.link_length, 0, 0],
            size=[params.radius, 0, 0],
            mass=params.link_mass,
            friction=[params.friction, 0, 0],
            condim=3,
            contype=layers.ANTENNA,
            conaffinity=layers.OBSTACLE,
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
