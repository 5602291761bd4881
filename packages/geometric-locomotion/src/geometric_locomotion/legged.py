"""A body of links on legs, quasi-static: loads, twist, step, yaw and work of a gait cycle.

A cycle is walked in small steps of the gait phase P. Each step solves two convex problems, neither
of which has a fitted constant:

    loads    min  Σ G h + ½ K θ²,  h ≥ reach at every foot
             over height, roll, pitch and the bends θ of the pitch joints
    motion   min  Σ μ N |v| + ½ k (goal − q)² / ΔP + ½ d q'²
             over the body twist ξ and the rates q' of the yaw joints

G is the weight of a link, h the height of an axle, N the load of a foot, v the velocity of its
lowest point, q a yaw joint on a servo of stiffness k that brakes with d. The feet drag with Coulomb
friction, so the dissipation is Σ μ N |v|. Inertia is left out: all rates are per radian of phase.
Links run head first, left before right; x is forward, y to the left.

Friction that does not depend on the rate makes a gait geometric: arXiv 2207.10604.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from geometric_locomotion.lie import se2_exp
from geometric_locomotion.types import Floats, Ints

GIVE = 2e-5
"""How far one foot that bears the whole weight sinks in [m]: as good as rigid."""
ROUNDING = 1e-3
"""Speed below which friction fades [m/rad]: 3 % of a foot that rolls."""
_FINE, _SMALL = 1e-9, 1e-6
"""When loads and motion are exact enough: shares of the energies of GIVE and of ROUNDING."""
_STIFF = 1e6
"""Stiffness of yaw joints that move as they are told [N·m/rad]."""
_SIGNS = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Body:
    """What is the same at all phases.

    Attributes:
        link_pitch: Joint spacing [m].
        link_weight: Weight of each link with its legs [N], shape (L,).
        pitch_stiffness: Stiffness K of a pitch joint [N·m/rad].
        yaw_stiffness: Stiffness k of a yaw joint about its goal [N·m/rad].
        yaw_braking: Torque d that a turning yaw joint loses [N·m], per radian of it and of phase.
        friction: Friction μ of a foot on the floor.
    """

    link_pitch: float
    link_weight: Floats
    pitch_stiffness: float
    yaw_stiffness: float
    yaw_braking: float
    friction: float

    @property
    def links(self) -> int:
        """Number of links L."""
        return len(self.link_weight)

    @property
    def weight(self) -> float:
        """Weight [N]."""
        return float(self.link_weight.sum())


@dataclass(frozen=True)
class Feet:
    """The feet at some phases, each in the frame of its link.

    Attributes:
        reach: Depth of the lowest point under the axle [m], shape (..., L, 2).
        place: Its plan position from the middle of the link [m], shape (..., L, 2, 2).
        slide: Plan velocity of the foot there against its link [m/rad], shape (..., L, 2, 2).
    """

    reach: Floats
    place: Floats
    slide: Floats

    def at(self, phase: int) -> Feet:
        """The feet at one of the phases of the second axis."""
        return Feet(self.reach[:, phase], self.place[:, phase], self.slide[:, phase])


@dataclass(frozen=True)
class Cycle:
    """A cycle of each of G gaits in n steps.

    Attributes:
        step: Displacement of the middle along the mean axis of the body a cycle [m], shape (G,).
        yaw: Turn a cycle [rad], positive to the left, shape (G,).
        work: Work against friction a cycle [J], shape (G,).
        cost: Cost of transport, work over weight and size of the step, shape (G,).
        torque: Largest torque of a yaw servo [N·m], shape (G,).
        twist: Twist of the head link (x, y, yaw) [m/rad, m/rad, 1], shape (G, n, 3).
        bend: Yaw joints after each step [rad], shape (G, n, L - 1).
        load: Load of each foot [N], shape (G, n, L, 2).
    """

    step: Floats
    yaw: Floats
    work: Floats
    cost: Floats
    torque: Floats
    twist: Floats
    bend: Floats
    load: Floats


def rolling_feet(
    radius: float, eccentricity: float, lateral: float, angle: Floats, rate: float = 1.0
) -> Feet:
    """Eccentric rings that turn about the pitch axis, longest downwards at the angle 0.

    Args:
        radius: Outer radius R [m].
        eccentricity: Distance e of the ring's middle from its axle [m].
        lateral: Distance of a foot from the middle of its link [m].
        angle: Angle of each leg [rad], shape (..., L, 2).
        rate: Turn per radian of gait phase.
    """
    reach = radius + eccentricity * np.cos(angle)
    across = np.broadcast_to(lateral * _SIGNS, angle.shape)
    place = np.stack([-eccentricity * np.sin(angle), across], -1)
    slide = np.stack([-rate * reach, np.zeros_like(reach)], -1)
    return Feet(reach, place, slide)


def lifting_feet(
    radius: float, thickness: float, length: float, hip: float, out: float, angle: Floats
) -> Feet:
    """Round feet on legs that turn about the roll axis, upwards at a positive angle.

    What a foot slides while its leg turns is left out: it mostly turns in the air.

    Args:
        radius: Radius of a foot, an ellipsoid, along and down [m].
        thickness: Its size to the side [m].
        length: Depth of its middle under the hip at the angle 0 [m].
        hip: Distance of the hip from the middle of the link [m].
        out: Distance of its middle from the hip to the side at the angle 0 [m].
        angle: Angle of each leg [rad], shape (..., L, 2).
    """
    cos, sin = np.cos(angle), np.sin(angle)
    side = 0.5 * thickness
    depth = np.hypot(radius * cos, side * sin)
    reach = length * cos - out * sin + depth
    across = hip + out * cos + length * sin + (radius**2 - side**2) * sin * cos / depth
    place = np.stack([np.zeros_like(angle), _SIGNS * across], -1)
    return Feet(reach, place, np.zeros_like(place))


def _across(vector: Floats) -> Floats:
    """Plan vectors, shape (..., 2), turned by a right angle to the left."""
    return np.stack([-vector[..., 1], vector[..., 0]], -1)


def _turned(vector: Floats, heading: Floats) -> Floats:
    """Plan vectors, shape (..., 2), turned by headings [rad], shape (...)."""
    return np.cos(heading)[..., None] * vector + np.sin(heading)[..., None] * _across(vector)


@dataclass(frozen=True)
class Plan:
    """Plan of G bodies in the frame of their head links.

    Attributes:
        heading: Heading of each link [rad], shape (G, L).
        middle: Middle of each link [m], shape (G, L, 2).
        joint: Joints [m], shape (G, L - 1, 2).
    """

    heading: Floats
    middle: Floats
    joint: Floats

    @classmethod
    def of(cls, link_pitch: float, bend: Floats) -> Plan:
        """The plan at yaw angles [rad], shape (G, L - 1)."""
        heading = np.concatenate([np.zeros((len(bend), 1)), np.cumsum(bend, 1)], 1)
        half = 0.5 * link_pitch * np.stack([np.cos(heading), np.sin(heading)], -1)
        behind = -np.cumsum(half[:, :-1] + half[:, 1:], 1)
        middle = np.concatenate([np.zeros((len(bend), 1, 2)), behind], 1)
        return cls(heading, middle, middle[:, :-1] - half[:, :-1])


class _Convex(Protocol):
    """A convex function of each of G rows of numbers."""

    def value(self, at: Floats) -> Floats:
        """Value of each row, shape (G,)."""
        ...

    def slopes(self, at: Floats) -> tuple[Floats, Floats]:
        """Gradient (G, U) and Hessian (G, U, U)."""
        ...


def _least(function: _Convex, at: Floats, small: float, steps: int = 40) -> Floats:
    """Where a convex function is least, by Newton's method with halved steps, shape (G, U)."""
    value = function.value(at)
    for _ in range(steps):
        slope, curve = function.slopes(at)
        step = -np.linalg.solve(curve, slope[..., None])[..., 0]
        gain = -(slope * step).sum(1)
        if gain.max() < small:
            break
        size, worse = np.ones(len(at)), np.ones(len(at), bool)
        while worse.any() and size.min() > 1e-7:
            ahead = at + size[:, None] * step
            reached = function.value(ahead)
            worse = reached > value - 1e-4 * size * gain + small
            size = np.where(worse, 0.5 * size, size)
        at = at + size[:, None] * step
        value = function.value(at)
    return at


@dataclass(frozen=True)
class _Standing:
    """Energy of an elastic body [J] over its height, roll, pitch and pitch joints.

    Attributes:
        rise: What these raise the feet by, shape (G, F, U).
        reach: Reach of the feet [m], shape (G, F).
        pull: What they lower the weight by [N or N·m], shape (G, U).
        spring: Stiffness of the body, shape (U, U).
        stiffness: Stiffness of a foot [N/m].
    """

    rise: Floats
    reach: Floats
    pull: Floats
    spring: Floats
    stiffness: float

    @classmethod
    def of(cls, body: Body, plan: Plan, foot: Floats, reach: Floats) -> _Standing:
        links = np.arange(body.links)
        pull = -np.einsum("l,glu->gu", body.link_weight, cls._rise(plan, plan.middle, links))
        springs = [1e-9 * body.weight] * 3 + [body.pitch_stiffness] * (body.links - 1)
        rise = cls._rise(plan, foot, np.repeat(links, 2))
        return cls(rise, reach, pull, np.diag(springs), body.weight / GIVE)

    @staticmethod
    def _rise(plan: Plan, point: Floats, link: Ints) -> Floats:
        """What the coordinates raise points of links by, shape (G, points, U)."""
        behind_head = plan.heading[:, None, 1:]
        away = point[:, :, None] - plan.joint[:, None]
        rise = -np.sin(behind_head) * away[..., 1] - np.cos(behind_head) * away[..., 0]
        rise = np.where(link[:, None] > np.arange(rise.shape[-1]), rise, 0.0)
        rigid = np.stack([np.ones_like(point[..., 0]), point[..., 1], -point[..., 0]], -1)
        return np.concatenate([rigid, rise], -1)

    def load(self, at: Floats) -> Floats:
        """Loads of the feet [N], shape (G, F)."""
        sunk = self.reach - np.einsum("gfu,gu->gf", self.rise, at)
        return self.stiffness * np.maximum(sunk, 0.0)

    def value(self, at: Floats) -> Floats:
        bent = 0.5 * np.einsum("gu,u,gu->g", at, np.diag(self.spring), at)
        load = self.load(at)
        return bent - (self.pull * at).sum(1) + 0.5 * (load**2).sum(1) / self.stiffness

    def slopes(self, at: Floats) -> tuple[Floats, Floats]:
        load = self.load(at)
        slope = at @ self.spring - self.pull - np.einsum("gfu,gf->gu", self.rise, load)
        bears = np.where(load > 0.0, self.stiffness, 1e-6 * self.stiffness)  # else it might tip
        return slope, self.spring + np.swapaxes(self.rise, 1, 2) @ (bears[..., None] * self.rise)


@dataclass(frozen=True)
class _Moving:
    """Dissipation over twist and rates of the yaw joints [J per radian of phase].

    Attributes:
        drag: Friction of the feet [N], shape (G, F).
        drift: Velocity of the feet on a body at rest [m/rad], shape (G, F, 2).
        moves: What twist and rates add to it, shape (G, F, 2, U).
        goal: Rates that lead to the goals [1], shape (G, L - 1).
        spring: Stiffness of a servo times the step of the phase [N·m].
        braking: Its braking [N·m].
    """

    drag: Floats
    drift: Floats
    moves: Floats
    goal: Floats
    spring: float
    braking: float

    @classmethod
    def of(
        cls,
        body: Body,
        plan: Plan,
        foot: Floats,
        load: Floats,
        drift: Floats,
        goal: Floats,
        h: float,
    ) -> _Moving:
        lever = foot[:, :, None] - plan.joint[:, None]
        links = np.repeat(np.arange(body.links), 2)
        behind = links[:, None] > np.arange(body.links - 1)
        moves = np.zeros((*foot.shape, body.links + 2))
        moves[..., 0, 0] = moves[..., 1, 1] = 1.0
        moves[..., 2] = _across(foot)
        moves[..., 3:] = np.swapaxes(np.where(behind[..., None], _across(lever), 0.0), 2, 3)
        spring = body.yaw_stiffness * h
        return cls(body.friction * load, drift, moves, goal, spring, body.yaw_braking)

    def slip(self, at: Floats) -> tuple[Floats, Floats]:
        """Velocity of the feet (G, F, 2), and its rounded size (G, F) [m/rad]."""
        slip = self.drift + np.einsum("gfiu,gu->gfi", self.moves, at)
        return slip, np.sqrt((slip**2).sum(-1) + ROUNDING**2)

    def value(self, at: Floats) -> Floats:
        rate = at[:, 3:]
        servo = self.spring * (self.goal - rate) ** 2 + self.braking * rate**2
        return (self.drag * self.slip(at)[1]).sum(1) + 0.5 * servo.sum(1)

    def slopes(self, at: Floats) -> tuple[Floats, Floats]:
        slip, speed = self.slip(at)
        along = np.einsum("gfiu,gfi->gfu", self.moves, slip / speed[..., None])
        slope = np.einsum("gf,gfu->gu", self.drag, along)
        slope[:, 3:] += self.braking * at[:, 3:] - self.spring * (self.goal - at[:, 3:])
        weight = self.drag / speed
        flat = self.moves.reshape(len(at), -1, at.shape[1])
        curve = np.swapaxes(flat, 1, 2) @ (np.repeat(weight, 2, 1)[..., None] * flat)
        curve -= np.swapaxes(along, 1, 2) @ (weight[..., None] * along)
        servo = [1e-9] * 3 + [self.spring + self.braking] * (at.shape[1] - 3)
        return slope, curve + np.diag(servo)


def twists(body: Body, bend: Floats, rate: Floats, feet: Feet) -> Floats:
    """Twists of the head (x, y, yaw) [m/rad, m/rad, 1] as shapes change, shape (G, 3).

    The yaw joints move as they are told, whatever their stiffness.

    Args:
        body: The body.
        bend: Yaw joints [rad], shape (G, L - 1).
        rate: Their rates per radian of gait phase, shape (G, L - 1).
        feet: The feet, shapes (G, L, 2) and (G, L, 2, 2).
    """
    plan = Plan.of(body.link_pitch, bend)
    stand = np.zeros((len(bend), body.links + 2))
    stand[:, 0] = feet.reach.max((1, 2))
    foot, drift = _feet(plan, feet)
    standing = _Standing.of(body, plan, foot, feet.reach.reshape(len(bend), -1))
    load = standing.load(_least(standing, stand, _FINE * body.weight * GIVE))
    moving = _Moving.of(body, plan, foot, load, drift, rate, 1.0)
    moving = replace(moving, spring=_STIFF, braking=0.0)
    start = np.concatenate([np.zeros((len(bend), 3)), rate], 1)
    return _least(moving, start, _SMALL * body.friction * body.weight * ROUNDING)[:, :3]


def _feet(plan: Plan, feet: Feet) -> tuple[Floats, Floats]:
    """Plan positions [m] and velocities [m/rad] of the feet on a body at rest, (G, F, 2)."""
    heading = plan.heading[..., None]
    place = plan.middle[:, :, None] + _turned(feet.place, heading)
    shape = len(place), -1, 2
    return place.reshape(shape), _turned(feet.slide, heading).reshape(shape)


def cycle(body: Body, goal: Floats, feet: Feet) -> Cycle:
    """The cycle of G gaits, the second one from a start at the goals.

    Args:
        body: The body.
        goal: Goals of the yaw joints at n evenly spread phases from 0 on [rad], (G, n, L - 1).
        feet: The feet half a step after each, shapes (G, n, L, 2) and (G, n, L, 2, 2).
    """
    gaits, phases, joints = goal.shape
    h = 2.0 * math.pi / phases
    bend = goal[:, 0]
    stand = np.zeros((gaits, joints + 3))
    stand[:, 0] = feet.reach.max()
    move = np.zeros((gaits, joints + 3))
    rows: list[tuple[Floats, ...]] = []
    for k in range(2 * phases):
        now, after = feet.at(k % phases), goal[:, (k + 1) % phases]
        plan = Plan.of(body.link_pitch, bend + 0.5 * (after - goal[:, k % phases]))
        foot, drift = _feet(plan, now)
        standing = _Standing.of(body, plan, foot, now.reach.reshape(gaits, -1))
        stand = _least(standing, stand, _FINE * body.weight * GIVE)
        load = standing.load(stand)
        moving = _Moving.of(body, plan, foot, load, drift, (after - bend) / h, h)
        move = _least(moving, move, _SMALL * body.friction * body.weight * ROUNDING)
        bend = bend + h * move[:, 3:]
        torque = body.yaw_stiffness * (after - bend) - body.yaw_braking * move[:, 3:]
        power = (moving.drag * moving.slip(move)[1]).sum(1)
        rows.append((move[:, :3], bend, load, torque, power))
    twist, bends, loads, torques, powers = (
        np.stack(part, 1) for part in zip(*rows[phases:], strict=True)
    )
    step, yaw = _displacement(body, h * twist, bends)
    work = h * powers.sum(1)
    cost = work / (body.weight * np.maximum(abs(step), 1e-9))
    load = loads.reshape(gaits, phases, -1, 2)
    return Cycle(step, yaw, work, cost, abs(torques).max((1, 2)), twist, bends, load)


def _displacement(body: Body, moved: Floats, bend: Floats) -> tuple[Floats, Floats]:
    """Step [m] and yaw [rad] a cycle, shapes (G,); the step is a mean over where a cycle starts.

    Args:
        body: The body.
        moved: Twist of the head in each step times its phase, shape (G, n, 3).
        bend: Yaw joints after each step [rad], shape (G, n, L - 1).
    """
    gaits, phases, _ = moved.shape
    pose = np.broadcast_to(np.eye(3), (gaits, 3, 3))
    centre = np.zeros((gaits, 2 * phases, 2))
    toward = np.zeros((gaits, 2 * phases))
    turn = np.cumsum(np.concatenate([moved[..., 2]] * 2, 1), 1)
    for k in range(2 * phases):
        pose = pose @ se2_exp(moved[:, k % phases])
        middle = Plan.of(body.link_pitch, bend[:, k % phases]).middle
        centre[:, k] = pose[:, :2, 2] + np.einsum("gij,gj->gi", pose[:, :2, :2], middle.mean(1))
        half = body.links // 2
        axis = middle[:, :half].mean(1) - middle[:, half:].mean(1)
        toward[:, k] = turn[:, k] + np.arctan2(axis[:, 1], axis[:, 0])
    gain = centre[:, phases:] - centre[:, :phases]
    sums = np.cumsum(toward, 1)
    axis = (sums[:, phases:] - sums[:, :phases]) / phases
    step = gain[..., 0] * np.cos(axis) + gain[..., 1] * np.sin(axis)
    return step.mean(1), turn[:, phases - 1]
