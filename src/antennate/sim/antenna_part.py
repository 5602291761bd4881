"""One antenna as a part: a base servo hinge and a chain of sprung links, along x, bending about z.

Positive angles bend towards the tail once the part is mounted: on the left as it is, on the right
turned half about its own axis, which mirrors it.
"""

from __future__ import annotations

import mujoco

from antennate.robots.antenna import BASE, AntennaSpec
from antennate.sim import layers


def build(params: AntennaSpec) -> mujoco.MjSpec:
    """The part as an uncompiled spec: bodies `base`, `hinge0` and so on, actuator `base`."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    base = spec.worldbody.add_body(name=BASE)
    base.add_joint(
        name=BASE,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, 0, 1],
        damping=params.base_damping,
        armature=params.base_armature,
    )
    servo = spec.add_actuator(name=BASE, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=BASE)
    servo.set_to_position(kp=params.base_stiffness)

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
