"""How a servo in position mode moves a load: drive, torque-speed line, friction, inertia.

    drive    u = clip(gain (goal - q), -1, 1),   gain = P / divisor · 4096 / 2π / 885
    motor    τ = stall · v · u - stall / no_load_speed · ω
    friction |f| ≤ friction + load_friction · |τ|,   against the motion; it holds a shaft at rest
    shaft    (armature + inertia) ω' = τ + f - gravity · sin q

v is the supply over the voltage at which stall torque and no-load speed are given. Without torque
u and τ are 0. Only numbers go in and come out; any number of servos and recordings at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.dxl.model import position_gain
from antennate.robots.servos import ServoParams
from antennate.types import Bools, Floats

NAMES = (
    "gain_divisor",
    "stall_torque",
    "no_load_speed",
    "armature",
    "friction",
    "load_friction",
)
"""Parameters of the model, as `ServoParams` names them, in the order of an array of them."""
STEP = 0.002
"""Time step of the replay [s]; the position loop holds its drive for one."""


@dataclass(frozen=True)
class Course:
    """What F servos were told, and what hung on them, at T times that are `STEP` apart.

    A shaft begins where it was measured, and again wherever torque is switched.

    Attributes:
        goal: Goal positions [rad], shape (T, F).
        torque: Whether torque was on, shape (T, F).
        supply: Supply over the nominal voltage, shape (T, F).
        position: Measured positions [rad], shape (T, F).
        speed: Measured speeds [rad/s], shape (T, F).
        p_gain: Gain of the position loop as its register held it, shape (F,).
        inertia: Inertia of the load [kg·m²], shape (F,).
        gravity: Torque of the load's weight at a right angle [N·m], shape (F,); 0 rad hangs down.
    """

    goal: Floats
    torque: Bools
    supply: Floats
    position: Floats
    speed: Floats
    p_gain: Floats
    inertia: Floats
    gravity: Floats

    @property
    def begins(self) -> Bools:
        """Where a shaft begins from its measurement, shape (T, F)."""
        switched = self.torque[1:] != self.torque[:-1]
        return np.vstack([np.ones((1, self.torque.shape[1]), bool), switched])


def values_of(servo: ServoParams) -> Floats:
    """The parameters of a servo in the order of NAMES, shape (6,)."""
    return np.array([getattr(servo, name) for name in NAMES])


def replay(values: Floats, course: Course, every: int = 1) -> Floats:
    """Positions [rad] of servos that are told what a course says, shape (T / every, B, F).

    Args:
        values: Parameters of B servo models in the order of NAMES, shape (B, 6).
        course: What F of each are told.
        every: Only every so many times are kept.
    """
    divisor, stall, fastest, armature, dry, loaded = values.T[:, :, None]
    gain = position_gain(course.p_gain, divisor)
    inertia = armature + course.inertia
    braking = stall / fastest
    faded = np.exp(-STEP * braking / inertia)  # share of a speed that braking leaves after a step
    braked = (1.0 - faded) / braking  # speed that a torque adds in a step
    found = np.empty((-(-len(course.goal) // every), *gain.shape))
    begins = course.begins
    ever = np.flatnonzero(begins.any(axis=1)).tolist()
    q = w = np.zeros(gain.shape)
    for i, goal in enumerate(course.goal):
        if i in ever:
            q = np.where(begins[i], course.position[i], q)
            w = np.where(begins[i], course.speed[i], w)
        if i % every == 0:
            found[i // every] = q
        on = course.torque[i]
        driven = stall * course.supply[i] * np.clip(gain * (goal - q), -1.0, 1.0) * on
        q = q + 0.5 * STEP * w
        grip = dry + loaded * abs(driven - braking * w * on)
        added = np.where(on, braked, STEP / inertia)
        free = np.where(on, faded, 1.0) * w + added * (driven - course.gravity * np.sin(q))
        # what friction leaves; it stops a shaft, and does not turn it back
        w = np.copysign(np.maximum(abs(free) - added * grip, 0.0), free)
        q = q + 0.5 * STEP * w
    return found
