"""Our antenna and our robot on a flat floor, rebuilt for PyBullet from their numbers."""

from __future__ import annotations

import math
from importlib import metadata
from typing import Any

import pybullet
from answering import Job, answer

FREE = [0.0, 0.0, 0.0, 1.0]
ALONG = [0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4)]
"""A capsule of PyBullet lies along z; this turns it to x."""
ACROSS = [math.sin(math.pi / 4), 0.0, 0.0, math.cos(math.pi / 4)]
"""The same to y."""


class Chain:
    """Links of one multibody, collected one after the other."""

    def __init__(self, client: int) -> None:
        self._client = client
        self.links: list[dict[str, Any]] = []

    def add(self, parent: int, at: list[float], axis: list[float], mass: float, shape: int) -> int:
        """A link on a hinge; its number, from 1."""
        self.links.append({"p": parent, "at": at, "axis": axis, "mass": mass, "shape": shape})
        return len(self.links)

    def make(self, mass: float, shape: int, at: list[float], flags: int = 0) -> int:
        """The body."""
        links = self.links
        return pybullet.createMultiBody(
            baseMass=mass,
            baseCollisionShapeIndex=shape,
            basePosition=at,
            linkMasses=[link["mass"] for link in links],
            linkCollisionShapeIndices=[link["shape"] for link in links],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[link["at"] for link in links],
            linkOrientations=[FREE] * len(links),
            linkInertialFramePositions=[[0.0, 0.0, 0.0]] * len(links),
            linkInertialFrameOrientations=[FREE] * len(links),
            linkParentIndices=[link["p"] for link in links],
            linkJointTypes=[pybullet.JOINT_REVOLUTE] * len(links),
            linkJointAxis=[link["axis"] for link in links],
            flags=flags,
            physicsClientId=self._client,
        )


def capsule(client: int, radius: float, length: float, middle: list[float], turn: list[float]):
    return pybullet.createCollisionShape(
        pybullet.GEOM_CAPSULE,
        radius=radius,
        height=length,
        collisionFramePosition=middle,
        collisionFrameOrientation=turn,
        physicsClientId=client,
    )


def antenna(told: dict[str, Any]) -> Job:
    """Hinges with explicit springs, a base that swings, and a sphere in the way."""
    client = pybullet.connect(pybullet.DIRECT)
    spec, step = told["antenna"], told["step"]
    count = len(spec["stiffness"])
    link = spec["length"] / count
    chain, parent = Chain(client), 0
    parent = chain.add(parent, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.001, -1)
    for i in range(count):
        shape = capsule(client, spec["radius"], link, [link / 2, 0.0, 0.0], ALONG)
        at = [link if i else 0.0, 0.0, 0.0]
        parent = chain.add(parent, at, [0.0, 0.0, 1.0], spec["link_mass"], shape)
    body = chain.make(0.0, -1, [0.0, 0.0, 0.0])
    x, y, radius = told["ball"]
    ball = pybullet.createCollisionShape(
        pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client
    )
    pybullet.createMultiBody(0.0, ball, basePosition=[x, y, 0.0], physicsClientId=client)
    pybullet.setTimeStep(step, physicsClientId=client)
    hinges = list(range(1, count + 1))
    for joint in range(count + 1):
        pybullet.changeDynamics(
            body,
            joint,
            lateralFriction=spec["friction"],
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            localInertiaDiagonal=[spec["armature"]] * 3,
            physicsClientId=client,
        )
    pybullet.setJointMotorControlArray(
        body, hinges, pybullet.VELOCITY_CONTROL, forces=[0.0] * count, physicsClientId=client
    )
    damping = [spec["damping_time"] * k for k in spec["stiffness"]]
    ticks = [0]
    substeps = round(told["command"] / step)

    def go_on(seconds: float) -> None:
        for _ in range(round(seconds / told["command"])):
            angle = told["swing"] * math.sin(2 * math.pi * ticks[0] * told["command"])
            ticks[0] += 1
            pybullet.setJointMotorControl2(
                body, 0, pybullet.POSITION_CONTROL, angle, force=0.5, physicsClientId=client
            )
            for _ in range(substeps):
                states = pybullet.getJointStates(body, hinges, physicsClientId=client)
                torques = [
                    -k * state[0] - c * state[1]
                    for k, c, state in zip(spec["stiffness"], damping, states, strict=True)
                ]
                pybullet.setJointMotorControlArray(
                    body, hinges, pybullet.TORQUE_CONTROL, forces=torques, physicsClientId=client
                )
                pybullet.stepSimulation(physicsClientId=client)
        states = pybullet.getJointStates(body, hinges, physicsClientId=client)
        if not max(abs(state[0]) for state in states) < math.pi:
            raise SystemExit("the antenna has left all bounds")

    return go_on, {"size": f"{count} hinges, step {1e3 * step:g} ms"}


def walk(told: dict[str, Any]) -> Job:
    """Links on yaw and pitch hinges, and a leg on each side that rolls on a floor."""
    client = pybullet.connect(pybullet.DIRECT)
    spec, step = told["robot"], 0.002
    pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    pybullet.setTimeStep(step, physicsClientId=client)
    floor = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    pybullet.createMultiBody(0.0, floor, physicsClientId=client)
    beam = capsule(client, spec["body_radius"], spec["width"] * 0.7, [0.0, 0.0, 0.0], ACROSS)
    chain, yaws, legs, pitches = Chain(client), [], [], []
    parent = 0
    for i in range(spec["links"]):
        if i:
            at = [-spec["link_pitch"] / 2, 0.0, 0.0]
            yaw = chain.add(parent, at, [0.0, 0.0, 1.0], 0.02, -1)
            pitch = chain.add(yaw, [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.02, -1)
            parent = chain.add(pitch, at, [0.0, 0.0, 1.0], spec["link_mass"], beam)
            yaws.append(yaw - 1)
            pitches += [pitch - 1, parent - 1]
        for sign in (1.0, -1.0):
            wheel = pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER,
                radius=spec["leg_radius"],
                height=spec["leg_width"],
                collisionFramePosition=[0.0, 0.0, -spec["leg_eccentricity"]],
                collisionFrameOrientation=ACROSS,
                physicsClientId=client,
            )
            at = [0.0, sign * (spec["width"] - spec["leg_width"]) / 2, 0.0]
            legs.append(chain.add(parent, at, [0.0, 1.0, 0.0], spec["leg_mass"], wheel) - 1)
    height = spec["leg_radius"] + spec["leg_eccentricity"] + 0.002
    body = chain.make(spec["link_mass"], beam, [0.0, 0.0, height])
    joints = yaws + legs + pitches
    for leg in legs:
        pybullet.changeDynamics(
            body, leg, lateralFriction=spec["leg_friction"], physicsClientId=client
        )
    ticks = [0]

    def go_on(seconds: float) -> None:
        for _ in range(round(seconds / told["command"])):
            phase = 2 * math.pi * ticks[0] * told["command"]
            ticks[0] += 1
            targets = [
                0.4 * math.sin(2 * math.pi * j / len(yaws) - phase) for j in range(len(yaws))
            ]
            targets += [phase - math.pi * i for i in range(len(legs))]
            targets += [0.0] * len(pitches)
            pybullet.setJointMotorControlArray(
                body,
                joints,
                pybullet.POSITION_CONTROL,
                targetPositions=targets,
                forces=[1.5] * len(joints),
                physicsClientId=client,
            )
            for _ in range(round(told["command"] / step)):
                pybullet.stepSimulation(physicsClientId=client)
        place, _ = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
        if not 0.0 < place[2] < 0.3:
            raise SystemExit("the robot has left the floor")

    return go_on, {"size": f"{spec['links']} links, {len(legs)} legs, step {1e3 * step:g} ms"}


if __name__ == "__main__":
    answer(
        metadata.version("pybullet"),
        lambda told: {"antenna": antenna(told), "walk": walk(told)},
    )
