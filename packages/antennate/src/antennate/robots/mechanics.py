"""The legged body of a robot, from its description alone, and what its gaits come to.

Nothing here is fitted: geometry, masses, friction and servos are those of the `RobotSpec`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams, LiftParams
from antennate.params.scene import GRAVITY
from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats
from geometric_locomotion.legged import (
    Body,
    Cycle,
    Feet,
    Plan,
    cycle,
    lifting_feet,
    rolling_feet,
    twists,
)
from geometric_locomotion.twist import TwistMap, Wave

PHASES = 48
"""Steps of a cycle; 96 change speeds by less than 2 %."""
_TURN = 2.0 * math.pi
_INSTANT = 1e-6
"""Step of phase for velocities of the mean frame [rad]."""
_STIFF, _CALM = 1e4, 1e-6
"""Stiffness of a yaw joint that follows its goal [N·m/rad], frequency without any lag [Hz]."""
_SIDES = np.array([0.0, math.pi])


def body_of(robot: RobotSpec, frequency: float) -> Body:
    """The body of a robot that walks at a frequency [Hz]."""
    weight = GRAVITY * (np.array(robot.link_masses) + 2 * robot.leg_mass)
    weight[0] += GRAVITY * robot.antenna_count * robot.antenna.mass
    pitch = robot.servo_of(robot.pitch).stiffness
    yaw = robot.servo_of(robot.yaw)
    return Body(
        link_pitch=robot.link_pitch,
        link_weight=weight,
        pitch_stiffness=pitch if robot.pitch_count else robot.pitch.stiffness,
        yaw_stiffness=yaw.stiffness,
        yaw_braking=_TURN * frequency * yaw.damping,
        friction=robot.leg_friction,
    )


def feet_of(robot: RobotSpec, gait: GaitParams, wave_number: Floats, phase: Floats) -> Feet:
    """The feet at n evenly spread gait phases, one set for each of G wave numbers.

    Legs follow their goals as their servos do: rolling ones lag by a constant angle.
    """
    servo, omega = robot.servo_of(robot.legs), _TURN * gait.frequency
    lateral = (robot.width - robot.leg_width) / 2
    if robot.legs.kind == "rolling":
        lag = omega * servo.damping / servo.stiffness
        link = np.arange(robot.links) / robot.links
        angle = phase[:, None] - lag - _TURN * wave_number[:, None, None] * link
        angle = angle[..., None] + _SIDES
        return rolling_feet(robot.leg_radius, robot.leg_eccentricity, lateral, angle)
    angle = _stepping(robot.links, gait.lift, servo, phase, omega)
    angle = np.broadcast_to(angle, (len(wave_number), *angle.shape))
    shape = robot.leg_radius, robot.leg_width, robot.leg_eccentricity
    return lifting_feet(*shape, robot.hip, lateral - robot.hip, angle)


def _stepping(
    links: int, lift: LiftParams, servo: ServoParams, phase: Floats, omega: float
) -> Floats:
    """Angles of lifting legs on unloaded servos [rad], shape (n, L, 2).

    A servo turns at its full speed until it is near enough for less than full drive, from there it
    comes to rest with the time constant of its braking.
    """
    own = phase[:, None] - lift.begin - lift.lag * np.arange(links)
    part = (own[..., None] - _SIDES) / _TURN % 1.0
    goal = np.where(part < lift.share, lift.lifted, lift.stance)
    step, near = _TURN / len(phase) / omega, servo.stall_torque / servo.stiffness
    angle, angles = goal[0], []
    for towards in (*goal, *goal):
        error = towards - angle
        full = np.clip((abs(error) - near) / servo.no_load_speed, 0.0, step)
        left = abs(error) - full * servo.no_load_speed
        left = left * np.exp(-(step - full) * servo.stiffness / servo.damping)
        angle = towards - np.copysign(left, error)
        angles.append(angle)
    return np.array(angles[len(phase) :])


def goals_of(robot: RobotSpec, wave: Wave, phase: Floats) -> Floats:
    """Goals of the yaw joints as the gait sends them [rad], shape (G, n, L - 1)."""
    amplitude, number, lead, offset = (part[:, None, None] for part in _arrays(wave))
    joint = np.arange(1, robot.links) / robot.yaw_count
    goal = amplitude * np.sin(_TURN * number * joint + lead - phase[:, None]) + offset
    return np.clip(goal, -robot.yaw_limit, robot.yaw_limit)


def _arrays(wave: Wave) -> list[Floats]:
    parts = np.broadcast_arrays(*(np.atleast_1d(np.asarray(part, float)) for part in wave))
    return [np.array(part) for part in parts]


def cycles(
    robot: RobotSpec, gait: GaitParams, wave: Wave, phases: int = PHASES, stiff: bool = False
) -> Cycle:
    """Cycles of G body waves on a robot.

    Args:
        robot: The robot.
        gait: Frequency, and the step of lifting legs; its body wave is not read.
        wave: The body waves, numbers or arrays of shape (G,).
        phases: Steps n of a cycle.
        stiff: Whether all joints follow their goals at once, as those of stiff servos would.
    """
    wave = Wave(*_arrays(wave))
    frequency = _CALM if stiff else gait.frequency
    gait = gait.model_copy(update={"frequency": frequency})
    phase = _TURN * np.arange(phases) / phases
    goal = goals_of(robot, wave, phase)
    feet = feet_of(robot, gait, np.asarray(wave.wave_number), phase + math.pi / phases)
    body = body_of(robot, frequency)
    return cycle(replace(body, yaw_stiffness=_STIFF) if stiff else body, goal, feet)


def phase_twists(
    robot: RobotSpec, wave: Wave, body: Floats, leg: Floats, body_rate: float, leg_rate: float
) -> Floats:
    """Twists of the mean frame where body and legs have phases of their own, shape (G, 3).

    The mean frame sits in the middle of the links and has their mean heading. The yaw joints follow
    their goals: A sin(2 pi xi j / Y - body).

    Args:
        robot: A robot with rolling legs.
        wave: One body wave; its lead and offset are not read.
        body: Phase of the body wave [rad], shape (G,).
        leg: Phase of the legs [rad], shape (G,).
        body_rate: Rate of the body's phase, 1 in a gait.
        leg_rate: Rate of the legs' phase, 1 in a gait.
    """
    joint = _TURN * wave.wave_number * np.arange(1, robot.links) / robot.yaw_count
    angle = joint - body[:, None]
    bend = wave.amplitude * np.sin(angle)
    rate = -body_rate * wave.amplitude * np.cos(angle)
    link = _TURN * wave.wave_number * np.arange(robot.links) / robot.links
    legs = (leg[:, None] - link)[..., None] + _SIDES
    lateral = (robot.width - robot.leg_width) / 2
    feet = rolling_feet(robot.leg_radius, robot.leg_eccentricity, lateral, legs, leg_rate)
    head = twists(body_of(robot, 0.0), bend, rate, feet)
    plan, ahead = (Plan.of(robot.link_pitch, bend + t * rate) for t in (0.0, _INSTANT))
    heading, middle = plan.heading.mean(1), plan.middle.mean(1)
    turning = (ahead.heading.mean(1) - heading) / _INSTANT
    moving = (ahead.middle.mean(1) - middle) / _INSTANT
    x = head[:, 0] - head[:, 2] * middle[:, 1] + moving[:, 0]
    y = head[:, 1] + head[:, 2] * middle[:, 0] + moving[:, 1]
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([cos * x + sin * y, cos * y - sin * x, head[:, 2] + turning], 1)


def wave_of(gait: GaitParams, offset: float = 0.0) -> Wave:
    """The body wave of a gait, with an offset [rad]."""
    return Wave(gait.amplitude, gait.wave_number, gait.body_phase, offset)


def require_wave(robot: RobotSpec, gait: GaitParams) -> None:
    """Check that the yaw joints can make the body wave of a gait."""
    if gait.amplitude > robot.yaw_limit + 1e-9:
        raise ConfigError(
            f"gait.amplitude: expected at most {robot.yaw_limit:.4g} rad, the limit of the yaw "
            f"joints of this robot, found {gait.amplitude:g}"
        )
    fastest = _TURN * gait.frequency * gait.amplitude
    if fastest > robot.yaw.fastest:
        raise ConfigError(
            f"gait: expected yaw joints that move at most {robot.yaw.fastest:g} rad/s "
            f"(yaw.fastest), found an amplitude of {gait.amplitude:g} rad at {gait.frequency:g} "
            f"Hz, which needs {fastest:.3g}"
        )


def phase_law(links: int, wave_number: Floats | float) -> Floats:
    """Lead of the body over rolling legs that walks fastest on stiff servos [rad].

    The left legs at mid-body are at mid-stance as the body is bent to the left there most. Servos
    that give way make the body late; the goals have to lead by less then.

    Args:
        links: Number of links.
        wave_number: Waves along the body.
    """
    joint, leg = links / 2 / (links - 1), (links - 1) / 2 / links
    return (1.5 * math.pi - _TURN * np.asarray(wave_number, float) * (joint - leg)) % _TURN


def best_lead(
    robot: RobotSpec, gait: GaitParams, wave: Wave, about: float = math.pi, phases: int = PHASES
) -> Floats:
    """Lead at which each of G body waves walks fastest [rad], shape (G,).

    Args:
        robot: The robot.
        gait: As for `cycles`.
        wave: The body waves; leads are tried about theirs.
        about: How far to either side leads are tried [rad], in steps of a twelfth at most of it.
        phases: Steps of a cycle.
    """
    amplitude, number, lead, offset = _arrays(wave)
    tried = lead[:, None] + np.linspace(-about, about, 13)
    many = [np.repeat(part, 13) for part in (amplitude, number, offset)]
    walked = cycles(robot, gait, Wave(many[0], many[1], tried.ravel(), many[2]), phases)
    best, _ = peaks(tried, walked.step.reshape(tried.shape))
    return best % _TURN


def peaks(at: Floats, value: Floats) -> tuple[Floats, Floats]:
    """Places and heights of the largest values of curves, by a parabola through five of them.

    Args:
        at: Evenly spaced places, shape (G, n).
        value: Values there, shape (G, n).
    """
    width = min(5, at.shape[1])
    best, height = np.empty(len(at)), np.empty(len(at))
    for row, (x, y) in enumerate(zip(at, value, strict=True)):
        first = int(np.clip(y.argmax() - width // 2, 0, len(x) - width))
        near = slice(first, first + width)
        parabola = np.polynomial.Polynomial.fit(x[near], y[near], min(2, width - 1))
        ends = [p for p in parabola.deriv().roots() if x[near][0] <= p.real <= x[near][-1]]
        top = max([*(p.real for p in ends), x[y.argmax()]], key=parabola)
        best[row], height[row] = top, parabola(top)
    return best, height


def twist_map(
    robot: RobotSpec, gait: GaitParams, amplitudes: int = 7, offsets: int = 7, phases: int = 24
) -> TwistMap:
    """The twist map of a robot at the frequency and the wave number of a gait, about a second.

    Args:
        robot: A robot with rolling legs.
        gait: The gait; its amplitude, lead and offset are what the map varies.
        amplitudes: Amplitudes of the table, from 0 to the limit of the yaw joints.
        offsets: Offsets of the table, from 0 to 0.35 rad or that limit.
        phases: Steps of a cycle.
    """
    if robot.legs.kind != "rolling":
        raise ConfigError("twist map: expected a robot with rolling legs, found lifting ones")
    amplitude = np.linspace(0.0, robot.yaw_limit, amplitudes)
    offset = np.linspace(0.0, min(0.35, robot.yaw_limit), offsets)
    few = np.array([0.4, 1.0]) * robot.yaw_limit
    law = float(phase_law(robot.links, gait.wave_number)) - 0.3  # the servos' lag, about
    lead = best_lead(robot, gait, Wave(few, gait.wave_number, law, 0.0), 0.7, phases)
    lead = np.interp(amplitude, few, np.unwrap(lead))
    grid = np.meshgrid(amplitude, offset, indexing="ij")
    leads = np.broadcast_to(lead[:, None], grid[0].shape)
    wave = Wave(grid[0].ravel(), gait.wave_number, leads.ravel(), grid[1].ravel())
    walked = cycles(robot, gait, wave, phases)
    step, yaw = (part.reshape(grid[0].shape) for part in (walked.step, walked.yaw))
    curvature = np.maximum(-yaw / np.maximum(step, 1e-6), 0.0)
    curvature[:, 0] = 0.0
    return TwistMap(amplitude, offset, lead, gait.wave_number, gait.frequency * step, curvature)
