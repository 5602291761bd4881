"""The robot as URDF: links, joints and their limits, masses and inertias, shapes.

URDF has one joint a link, and the frame of a link lies on its joint. So a link has the axes of the
body of the simulated robot, moved to where it turns. Between two servos that turn one body stands a
link of nearly no mass, as readers want one; the body has so much less. A locked pitch joint, which
the simulation holds by a spring, is left out. Capsules are a cylinder and two spheres, a leg a
cylinder.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.places import SPEED_LIMIT
from antennate.sim.world import PREFIX, add_robot, new_spec
from antennate.types import Floats

BETWEEN_MASS = 1e-6
"""Mass of a link between two servos, taken from the link behind it [kg]."""
BETWEEN_INERTIA = 1e-9
"""Inertia of such a link about any axis [kg·m²]."""
_GEOMS = mujoco.mjtGeom
_FOR_MUJOCO = {"fusestatic": "false", "discardvisual": "false"}
"""So MuJoCo's reader keeps link0, which it fixes to the world, and shapes that touch nothing;
yourdfpy passes over it."""
LACKS = (
    "springs: antenna hinges and locked pitch joints",
    "the law of the servos: gain, delay, armature, friction that grows with the load",
    "contact: friction, stiffness, which parts may touch; the crown of a leg",
    "sensors: flex, touch, joints, head",
    "a free base: most readers fix link0 to the world",
)
"""What the simulated robot has and URDF cannot hold."""


class _Joint(NamedTuple):
    """A joint as URDF has it.

    Attributes:
        name: Its name.
        axis: In the frame of its link, shape (3,).
        limit: Largest angle either way [rad], inf where there is none.
        effort: Largest torque of its servo [N·m], 0 without one.
        fastest: Fastest that its goal moves [rad/s]; without a servo what no sound world exceeds.
        damping: [N·m·s/rad].
        friction: [N·m].
    """

    name: str
    axis: Floats
    limit: float
    effort: float
    fastest: float
    damping: float
    friction: float


def to_urdf(robot: RobotSpec, title: str) -> str:
    """The robot as URDF.

    Args:
        robot: The robot.
        title: First line of the comment on top.
    """
    physics = PhysicsParams()
    spec = new_spec(physics)
    add_robot(spec, robot, physics)
    model = spec.compile()
    root = Element("robot", name="robot")
    SubElement(SubElement(root, "mujoco"), "compiler", _FOR_MUJOCO)
    anchors = {0: np.zeros(3), 1: np.zeros(3)}
    _add_link(root, model, 1, anchors[1])
    for body in range(2, model.nbody):
        joints = list(_joints(model, robot, body))
        first = model.body_jntadr[body]
        anchors[body] = model.jnt_pos[first]
        _add_chain(root, model, body, joints, anchors)
        _add_link(root, model, body, anchors[body], between=max(0, len(joints) - 1))
    ElementTree.indent(root)
    lines = [title, "m, kg, s, rad, N·m; x ahead, y left, z up.", "URDF cannot hold:"]
    comment = "\n".join([*lines, *(f"  - {what}" for what in LACKS)])
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n<!--\n{comment}\n-->\n{text}\n'


def _joints(model: mujoco.MjModel, robot: RobotSpec, body: int) -> Iterator[_Joint]:
    """The joints that turn a body, the outer one first, without those that are locked."""
    driven = dict(
        zip(robot.joint_names, zip(robot.limits, robot.fastest, strict=True), strict=True)
    )
    locked = set(robot.pitch_names) - driven.keys()
    first = model.body_jntadr[body]
    for i in range(first, first + model.body_jntnum[body]):
        name = _name(model.joint(i).name)
        if name in locked:
            continue
        limit, fastest = driven.get(name, (float(model.jnt_range[i, 1]), SPEED_LIMIT))
        dof = model.jnt_dofadr[i]
        yield _Joint(
            name=name,
            axis=model.jnt_axis[i],
            limit=limit,
            effort=_effort(model, i),
            fastest=fastest,
            damping=float(model.dof_damping[dof]),
            friction=float(model.dof_frictionloss[dof]),
        )


def _effort(model: mujoco.MjModel, joint: int) -> float:
    """Largest torque of the servo of a joint [N·m], 0 without one."""
    servo = np.flatnonzero(model.actuator_trnid[:, 0] == joint)
    return float(model.actuator_forcerange[servo, 1].max(initial=0.0))


def _add_chain(
    root: Element,
    model: mujoco.MjModel,
    body: int,
    joints: Sequence[_Joint],
    anchors: dict[int, Floats],
) -> None:
    """Add the joints from the parent of a body to it, with links between them."""
    parent = int(model.body_parentid[body])
    above, place = _name(model.body(parent).name), _place(model, body, anchors)
    for joint in joints:
        below = _name(model.body(body).name)
        if joint is not joints[-1]:
            below = f"{below}_{joint.name}"
            _add_inertial(SubElement(root, "link", name=below), BETWEEN_MASS, np.zeros(3), None)
        kind = "revolute" if math.isfinite(joint.limit) else "continuous"
        element = SubElement(root, "joint", name=joint.name, type=kind)
        SubElement(element, "parent", link=above)
        SubElement(element, "child", link=below)
        SubElement(element, "origin", place)
        SubElement(element, "axis", xyz=_words(joint.axis))
        ends = {"lower": _word(-joint.limit), "upper": _word(joint.limit)}
        forces = {"effort": _word(joint.effort), "velocity": _word(joint.fastest)}
        SubElement(element, "limit", (ends if kind == "revolute" else {}) | forces)
        losses = {"damping": _word(joint.damping), "friction": _word(joint.friction)}
        SubElement(element, "dynamics", losses)
        above, place = below, _origin(np.zeros(3), np.eye(3))


def _place(model: mujoco.MjModel, body: int, anchors: dict[int, Floats]) -> dict[str, str]:
    """Where the joint of a body is in the frame of the link above it."""
    turn = _matrix(model.body_quat[body])
    above = anchors[int(model.body_parentid[body])]
    return _origin(model.body_pos[body] + turn @ anchors[body] - above, turn)


def _add_link(
    root: Element, model: mujoco.MjModel, body: int, anchor: Floats, between: int = 0
) -> None:
    """Add the link of a body, less what the links between its joints have.

    The innermost joint of it is at `anchor` in its frame [m], shape (3,).
    """
    link = SubElement(root, "link", name=_name(model.body(body).name))
    turn = _matrix(model.body_iquat[body])
    inertia = turn @ np.diag(model.body_inertia[body] - between * BETWEEN_INERTIA) @ turn.T
    mass = float(model.body_mass[body]) - between * BETWEEN_MASS
    place = model.body_ipos[body] - anchor
    _add_inertial(link, mass, place, inertia)
    first = model.body_geomadr[body]
    geoms = np.arange(first, first + model.body_geomnum[body])
    touching = geoms[(model.geom_contype[geoms] | model.geom_conaffinity[geoms]) != 0]
    for use, several in (("visual", geoms), ("collision", touching)):
        for geom in several.tolist():
            for origin, name, shape in _shapes(model, geom, anchor):
                element = SubElement(link, use)
                SubElement(element, "origin", origin)
                SubElement(SubElement(element, "geometry"), name, shape)


def _add_inertial(link: Element, mass: float, place: Floats, inertia: Floats | None) -> None:
    if inertia is None:
        inertia = BETWEEN_INERTIA * np.eye(3)
    element = SubElement(link, "inertial")
    SubElement(element, "origin", _origin(place, np.eye(3)))
    SubElement(element, "mass", value=_word(mass))
    parts = {f"i{'xyz'[i]}{'xyz'[j]}": inertia[i, j] for i in range(3) for j in range(i, 3)}
    SubElement(element, "inertia", {name: _word(value) for name, value in parts.items()})


def _shapes(
    model: mujoco.MjModel, geom: int, anchor: Floats
) -> Iterator[tuple[dict[str, str], str, dict[str, str]]]:
    """Origin, element and sizes of the shapes that stand for a geom."""
    size, turn = model.geom_size[geom], _matrix(model.geom_quat[geom])
    place = model.geom_pos[geom] - anchor
    radius = {"radius": _word(size[0])}
    if model.geom_type[geom] == _GEOMS.mjGEOM_SPHERE:
        yield _origin(place, turn), "sphere", radius
    elif model.geom_type[geom] == _GEOMS.mjGEOM_CAPSULE:
        yield _origin(place, turn), "cylinder", {**radius, "length": _word(2 * size[1])}
        for end in (-size[1], size[1]):
            yield _origin(place + end * turn[:, 2], turn), "sphere", radius
    else:  # a leg, round in its x-z plane
        upright = turn @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        yield _origin(place, upright), "cylinder", {**radius, "length": _word(2 * size[1])}


def _matrix(quaternion: Floats) -> Floats:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _origin(place: Floats, turn: Floats) -> dict[str, str]:
    """Place and turn as `xyz` and `rpy`: about the fixed x, then y, then z."""
    pitch = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    roll, yaw = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    if math.hypot(turn[0, 0], turn[1, 0]) < 1e-9:  # x points up or down: roll and yaw are one
        roll, yaw = math.atan2(-turn[1, 2], turn[1, 1]), 0.0
    return {"xyz": _words(place), "rpy": _words([roll, pitch, yaw])}


def _name(name: str) -> str:
    return name.removeprefix(PREFIX)


def _words(values: Floats | Sequence[float]) -> str:
    return " ".join(map(_word, values))


def _word(value: float) -> str:
    """A number in as few digits as bring it back; zero without a sign."""
    return repr(float(value) + 0.0)
