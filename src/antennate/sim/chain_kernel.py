"""The planar chain, compiled: the engine's equations of a bench, for one antenna alone.

Coordinates are x and y of the carriage and the angles from the x axis of the base and of every
link. A change from hinge angles to these is linear and constant, so that a step is the engine's
step: implicit in the damping of joints and servos (its `implicitfast`), contacts and stops soft as
its `solref` and `solimp` say, friction in an elliptic cone. Its contact problem is a quadratic one
in pieces: forces f of all contacts minimise f A f / 2 + s(j + A f), where A is the inverse inertia
at the contacts, j what misses the wanted acceleration without forces, and s the cost of a miss.
Newton's method ends when no contact changes between free, sticking and sliding.

Nothing imports this file before a chain is made, as numba takes long to import. It is one file
because numba keeps what it compiled as long as the file of `drive` is the same, and looks at no
other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from antennate.types import Floats, Ints

MOST_TOUCHES = 64
"""Contacts and stops at one time; beyond, a trial is invalid."""
CROWDED, BURST = 1, 2
"""How `drive` ends if not well: too many touches, or a state out of bounds."""
_SKIN = 0.002
"""Pairs of link and obstacle farther apart are left out until the chain may have met them [m]."""
_PARALLEL = 1e-4
"""Sine of the angle up to which the engine takes two capsules as parallel."""
_NOTHING = -2
"""What a stop touches; no rod is -1."""
_ITERATIONS, _HALVINGS = 100, 40
"""Most steps of Newton's method, and halvings of one."""
_SMALL_TURN = 5e-3
"""Turns in a step up to this need five terms of their series only [rad]."""
_ANGLE_LIMIT, _SPEED_LIMIT = 6.3, 1e4
"""No hinge of a sound bench turns farther [rad]; no coordinate is faster [m/s or rad/s]."""
_RULES = {"fastmath": {"contract", "nsz", "arcp", "reassoc"}, "error_model": "numpy"}
_PART = {**_RULES, "forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class Model(NamedTuple):
    """A bench in numbers; base and n links make n + 1 bodies, the base one without length.

    Attributes:
        timestep: Physics step [s].
        length: Length of each body [m], shape (n + 1,).
        link_mass: Mass of each, at its middle [kg]; `inertia` about its joint [kg·m²].
        armature: Of each joint [kg·m²]; `stiffness` [N·m/rad], `damping` [N·m·s/rad].
        stop: Largest angle of each joint [rad].
        stop_weight: Inverse inertia of each joint when straight [1/(kg·m²)].
        touch_weight: Mean inverse mass at the middle of each body when straight [1/kg].
        mass: Mass of the carriage, which has no weight [kg]; of the rod as well.
        gravity: In the plane [m/s²], shape (2,).
        torque: Largest torque of the base servo [N·m].
        servo: Gains of the slides' servos [N/m], [N·s/m], shape (2,).
        radius: Of the antenna [m].
        friction: Against all obstacles.
        impratio: Stiffness of friction over that of the normal.
        touch: Of contacts the least impedance, what the largest adds, the inverse of the depth of
            the largest [1/m], stiffness [1/s²] and damping [1/s], shape (5,); `stopping` of stops.
        obstacles: Ends and radius of each capsule [m], shape (m, 5); a ball's ends are the same.
        rod: Which of them is the rod, -1 without one.
    """

    timestep: float
    length: Floats
    link_mass: Floats
    inertia: Floats
    armature: Floats
    stiffness: Floats
    damping: Floats
    stop: Floats
    stop_weight: Floats
    touch_weight: Floats
    mass: float
    gravity: Floats
    torque: float
    servo: Floats
    radius: float
    friction: float
    impratio: float
    touch: Floats
    stopping: Floats
    obstacles: Floats
    rod: int


class _Touches(NamedTuple):
    """Contacts and stops of one step; each has two rows, along and across its normal.

    Attributes:
        link: Link that is touched, or whose joint is stopped, shape (k,).
        obstacle: Which obstacle it touches, `_NOTHING` for a stop.
        place: Where [m], shape (k, 2); `normal` away from the obstacle, zeros for a stop.
        turn: Direction in which a stop turns its joint, 0 for a contact.
        grip: Friction, 0 for a stop, shape (k,).
        hardness: Inverse softness of each row, shape (2 k,).
        missed: Wanted acceleration, later what misses it without forces, shape (2 k,).
        force: [N or N·m], shape (2 k,).
    """

    link: Ints
    obstacle: Ints
    place: Floats
    normal: Floats
    turn: Floats
    grip: Floats
    hardness: Floats
    missed: Floats
    force: Floats


@njit(**_PART)
def _smooth(model, q, v, arms, command, torque, pull):
    """Torque on each joint and force on the carriage of springs, servos, weight and spin.

    Spin and weight are what it takes to keep all joints from speeding up, from the tip inwards.
    """
    count, gravity, servo, mass = len(model.length), model.gravity, model.servo, model.link_mass
    ax, ay = -gravity[0], -gravity[1]
    for i in range(count):
        spin = v[2 + i] * v[2 + i]
        pull[i, 0] = mass[i] * (ax - 0.5 * spin * arms[i, 0])
        pull[i, 1] = mass[i] * (ay - 0.5 * spin * arms[i, 1])
        ax -= spin * arms[i, 0]
        ay -= spin * arms[i, 1]
    fx, fy, moment = 0.0, 0.0, 0.0
    for i in range(count - 1, -1, -1):
        moment += arms[i, 0] * (fy + 0.5 * pull[i, 1]) - arms[i, 1] * (fx + 0.5 * pull[i, 0])
        fx += pull[i, 0]
        fy += pull[i, 1]
        before, slow = (q[1 + i], v[1 + i]) if i else (command[4], 0.0)
        spring = model.stiffness[i] * (before - q[2 + i])
        if i == 0:
            spring = min(max(spring, -model.torque), model.torque)
        torque[2 + i] = spring - model.damping[i] * (v[2 + i] - slow) - moment
    torque[0] = servo[0] * (command[0] - q[0]) + servo[1] * (command[2] - v[0]) - fx
    torque[1] = servo[0] * (command[1] - q[1]) + servo[1] * (command[3] - v[1]) - fy


@njit(**_PART)
def _fold(model, arms, ahead, chain):
    """Inertia of all that each joint carries, from the tip inwards.

    Args:
        model: The bench.
        arms: From each joint to the next [m], shape (n + 1, 2).
        ahead: Time of damping that counts as inertia [s]: the timestep for an implicit step.
        chain: Written, shape (n + 2, 4). Of each joint the row of that inertia, angle and x and y,
            and the inverse of its own; last of the carriage the inverse inertia xx, xy and yy.
    """
    turning, tx, ty, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    last = len(model.length)
    for i in range(last - 1, -1, -1):
        dx, dy, mass = arms[i, 0], arms[i, 1], model.link_mass[i]
        kx, ky = tx - xx * dy + xy * dx, ty - xy * dy + yy * dx
        turning += dx * (ty + ky) - dy * (tx + kx) + model.inertia[i]
        tx, ty = kx - 0.5 * mass * dy, ky + 0.5 * mass * dx
        own = 1.0 / (turning + model.armature[i] + ahead * model.damping[i])
        chain[i, 0], chain[i, 1], chain[i, 2], chain[i, 3] = turning, tx, ty, own
        gx, gy = tx * own, ty * own
        xx += mass - tx * gx
        xy -= tx * gy
        yy += mass - ty * gy
        tx -= turning * gx
        ty -= turning * gy
        turning -= turning * turning * own
    heavy = model.mass + ahead * model.servo[1]
    xx, yy = xx + heavy, yy + heavy
    inverse = 1.0 / (xx * yy - xy * xy)
    chain[last, 0], chain[last, 1], chain[last, 2] = yy * inverse, -xy * inverse, xx * inverse


@njit(**_PART)
def _inward(arms, chain, link, torque):
    """What is left of torques up to a link, and of the carriage's force, once joints give way."""
    moment, fx, fy = 0.0, 0.0, 0.0
    for i in range(link, -1, -1):
        moment += arms[i, 0] * fy - arms[i, 1] * fx
        left = torque[2 + i] - moment
        torque[2 + i] = left
        share = left * chain[i, 3]
        moment += chain[i, 0] * share
        fx += chain[i, 1] * share
        fy += chain[i, 2] * share
    torque[0] -= fx
    torque[1] -= fy


@njit(**_PART)
def _outward(arms, chain, torque):
    """Accelerations of the carriage and the angles of all bodies, in place of what is left."""
    last = len(arms)
    fx, fy = torque[0], torque[1]
    ax = chain[last, 0] * fx + chain[last, 1] * fy
    ay = chain[last, 1] * fx + chain[last, 2] * fy
    torque[0], torque[1], angle = ax, ay, 0.0
    for i in range(last):
        held = chain[i, 0] * angle + chain[i, 1] * ax + chain[i, 2] * ay
        angle += (torque[2 + i] - held) * chain[i, 3]
        torque[2 + i] = angle
        ax -= arms[i, 1] * angle
        ay += arms[i, 0] * angle


@njit(**_PART)
def _nearest(obstacle, x, y, c, s, length, second):
    """Where a link from x, y along c, s and an obstacle's axis are nearest.

    A link along a bar touches it at both ends of what they share.

    Returns:
        Way along the link [m], and the point of the obstacle; for the `second` of two places a
        way below 0 where there is one only.
    """
    ax, ay = obstacle[0], obstacle[1]
    bx, by = obstacle[2] - ax, obstacle[3] - ay
    dx, dy = ax - x, ay - y
    along = dx * c + dy * s
    if bx == 0.0 and by == 0.0:
        return -1.0 if second else min(max(along, 0.0), length), ax, ay
    square, both, across = bx * bx + by * by, c * bx + s * by, dx * bx + dy * by
    low, high = max(0.0, min(along, along + both)), min(length, max(along, along + both))
    if abs(c * by - s * bx) <= _PARALLEL * math.sqrt(square) and low < high:
        way = low if second else high
        other = (way * both - across) / square
        return way, ax + other * bx, ay + other * by
    apart = square - both * both
    way = (along * square - across * both) / apart if apart > 1e-12 * square else 0.5 * length
    way = min(max(way, 0.0), length)
    other = (way * both - across) / square
    if other < 0.0 or other > 1.0:
        other = min(max(other, 0.0), 1.0)
        way = min(max(along + other * both, 0.0), length)
    return -1.0 if second else way, ax + other * bx, ay + other * by


@njit(**_PART)
def _pairs(model, joints, cosine, sine, reach, pairs):
    """Links and obstacles nearer than `reach` [m] to one another."""
    count = 0
    for i in range(1, len(model.length)):
        x, y, c, s = joints[i, 0], joints[i, 1], cosine[i], sine[i]
        for k in range(len(model.obstacles)):
            obstacle = model.obstacles[k]
            way, px, py = _nearest(obstacle, x, y, c, s, model.length[i], False)
            near = reach + model.radius + obstacle[4]
            if (x + way * c - px) ** 2 + (y + way * s - py) ** 2 < near * near:
                pairs[count, 0], pairs[count, 1] = i, k
                count += 1
    return count


@njit(**_PART)
def _hardness(rule, weight, depth):
    """Inverse of the softness of a contact, its pull back and its damping, as the engine's."""
    share = min(-depth * rule[2], 1.0)
    bent = 2.0 * share * share if share < 0.5 else 1.0 - 2.0 * (1.0 - share) ** 2
    impedance = rule[0] + bent * rule[1]
    hardness = impedance / ((1.0 - impedance) * weight)
    return hardness, -impedance * depth * rule[3], rule[4]


@njit(**_PART)
def _begin(touches, at, link, obstacle, turn):
    """A touch; what lasts begins with the forces of the step before."""
    if touches.link[at] != link or touches.obstacle[at] != obstacle:
        touches.force[2 * at] = touches.force[2 * at + 1] = 0.0
    touches.link[at], touches.obstacle[at], touches.turn[at] = link, obstacle, turn


@njit(**_PART)
def _stops(model, q, v, touches):
    """Joints beyond their stops."""
    count = 0
    for i in range(len(model.length)):
        turn = q[2 + i] - (q[1 + i] if i else 0.0)
        depth = model.stop[i] - abs(turn)
        if depth < 0.0 and count < MOST_TOUCHES:
            sign = -1.0 if turn > 0.0 else 1.0
            speed = sign * (v[2 + i] - (v[1 + i] if i else 0.0))
            hard, pull, drag = _hardness(model.stopping, model.stop_weight[i], depth)
            _begin(touches, count, i, _NOTHING, sign)
            touches.normal[count] = 0.0
            touches.grip[count] = 0.0
            touches.hardness[2 * count], touches.hardness[2 * count + 1] = hard, 0.0
            touches.missed[2 * count], touches.missed[2 * count + 1] = pull - drag * speed, 0.0
            count += 1
    return count


@njit(**_PART)
def _contacts(model, v, joints, arms, cosine, sine, pairs, pair_count, first, touches):
    """Pairs that overlap, written behind the first ones; returns how many touches, or -1."""
    count, rod = first, len(model.length) + 2
    for p in range(2 * pair_count):
        i, k, second = pairs[p // 2, 0], pairs[p // 2, 1], p % 2 == 1
        x, y, c, s = joints[i, 0], joints[i, 1], cosine[i], sine[i]
        way, px, py = _nearest(model.obstacles[k], x, y, c, s, model.length[i], second)
        if way < 0.0:
            continue
        nx, ny = x + way * c - px, y + way * s - py
        reach = model.radius + model.obstacles[k, 4]
        square = nx * nx + ny * ny
        if square >= reach * reach or square < 1e-24:
            continue
        if count == MOST_TOUCHES:
            return -1
        apart = math.sqrt(square)
        depth = apart - reach
        nx, ny = nx / apart, ny / apart
        middle = model.obstacles[k, 4] + 0.5 * depth
        px, py = px + middle * nx, py + middle * ny
        vx, vy, weight = v[0] - (py - y) * v[2 + i], v[1] + (px - x) * v[2 + i], 0.0
        for j in range(1, i):
            vx -= arms[j, 1] * v[2 + j]
            vy += arms[j, 0] * v[2 + j]
        if k == model.rod:
            vx, vy, weight = vx - v[rod], vy - v[rod + 1], 2.0 / (3.0 * model.mass)
        hard, pull, drag = _hardness(model.touch, model.touch_weight[i] + weight, depth)
        _begin(touches, count, i, k, 0.0)
        touches.place[count, 0], touches.place[count, 1] = px, py
        touches.normal[count, 0], touches.normal[count, 1] = nx, ny
        touches.grip[count] = model.friction
        touches.hardness[2 * count] = hard
        touches.hardness[2 * count + 1] = hard * model.impratio
        touches.missed[2 * count] = pull - drag * (nx * vx + ny * vy)
        touches.missed[2 * count + 1] = -drag * (nx * vy - ny * vx)
        count += 1
    return count


@njit(**_PART)
def _cost(along, across, hard, hard_across, grip):
    """Cost of a miss of one contact and its phase: 0 free, 1 sticking, 2 and 3 sliding."""
    slip = abs(across)
    if along >= grip * slip:
        return 0.0, 0
    ratio = hard / hard_across if hard_across > 0.0 else 0.0
    if along * grip * ratio + slip <= 0.0 or hard_across == 0.0:
        return 0.5 * (hard * along * along + hard_across * across * across), 1
    short = along - grip * slip
    return 0.5 * hard / (1.0 + grip * grip * ratio) * short * short, 2 if across > 0.0 else 3


@njit(**_PART)
def _slope(phase, hard, hard_across, grip):
    """Second derivatives of the cost of one contact in a phase: along, both, across."""
    if phase == 0:
        return 0.0, 0.0, 0.0
    if phase == 1:
        return hard, 0.0, hard_across
    soft = hard / (1.0 + grip * grip * hard / hard_across)
    sign = grip if phase == 2 else -grip
    return soft, -sign * soft, sign * sign * soft


@njit(**_PART)
def _energy(count, touches, coupling, miss, force, phase):
    total = 0.0
    for i in range(count):
        a, b = 2 * i, 2 * i + 1
        cost, phase[i] = _cost(
            miss[a], miss[b], touches.hardness[a], touches.hardness[b], touches.grip[i]
        )
        total += cost
        for j in range(2 * count):
            total += 0.5 * (force[a] * coupling[a, j] + force[b] * coupling[b, j]) * force[j]
    return total


@njit(**_PART)
def _eliminate(matrix, vector, size):
    """Solve in place, with pivots."""
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(size):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            vector[k], vector[pivot] = vector[pivot], vector[k]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, size):
                matrix[i, j] -= factor * matrix[k, j]
            vector[i] -= factor * vector[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            vector[k] -= matrix[k, j] * vector[j]
        vector[k] /= matrix[k, k]


@njit(**_PART)
def _missed(size, touches, coupling, miss):
    """What misses the wanted acceleration with the forces as they are."""
    for i in range(size):
        value = touches.missed[i]
        for j in range(size):
            value += coupling[i, j] * touches.force[j]
        miss[i] = value


@njit(**_PART)
def _towards(count, touches, coupling, miss, system, step, phase):
    """Newton's step from the forces as they are, if no touch changes its phase."""
    for i in range(count):
        a, b = 2 * i, 2 * i + 1
        aa, ab, bb = _slope(phase[i], touches.hardness[a], touches.hardness[b], touches.grip[i])
        for j in range(2 * count):
            system[a, j] = aa * coupling[a, j] + ab * coupling[b, j]
            system[b, j] = ab * coupling[a, j] + bb * coupling[b, j]
        system[a, a] += 1.0
        system[b, b] += 1.0
        step[a] = -(touches.force[a] + aa * miss[a] + ab * miss[b])
        step[b] = -(touches.force[b] + ab * miss[a] + bb * miss[b])
    _eliminate(system, step, 2 * count)


@njit(**_PART)
def _press(count, touches, coupling, miss, system, step, phase):
    """Forces of all touches by Newton's method, into `touches.force`."""
    size, force = 2 * count, touches.force
    _missed(size, touches, coupling, miss)
    energy = _energy(count, touches, coupling, miss, force, phase)
    for _ in range(_ITERATIONS):
        _towards(count, touches, coupling, miss, system, step, phase)
        share, before = 1.0, energy
        for i in range(count):
            phase[count + i] = phase[i]
        for _ in range(_HALVINGS):
            for i in range(size):
                force[i] += share * step[i]
            _missed(size, touches, coupling, miss)
            energy = _energy(count, touches, coupling, miss, force, phase)
            if energy <= before + 1e-12 * abs(before):
                break
            for i in range(size):
                force[i] -= share * step[i]
            share *= 0.5
        changed = 0
        for i in range(count):
            changed += phase[i] != phase[count + i]
        if changed == 0 and share == 1.0:
            return


@njit(**_PART)
def _resist(model, joints, arms, count, touches, work, torque, rod_force):
    """Add what touches exert to the torques on all joints and the forces on carriage and rod."""
    chain, free, rows, coupling, miss, system, step, phase = work
    last = len(model.length)
    for i in range(last + 2):
        free[i] = torque[i]
    _inward(arms, chain, last - 1, free)
    for a in range(2 * count):
        k, row = a // 2, rows[a]
        i, nx, ny = touches.link[k], touches.normal[k, 0], touches.normal[k, 1]
        ex, ey = (nx, ny) if a % 2 == 0 else (-ny, nx)
        px, py = touches.place[k, 0], touches.place[k, 1]
        row[0], row[1] = ex, ey
        for j in range(i + 1):
            row[2 + j] = (px - joints[j, 0]) * ey - (py - joints[j, 1]) * ex
        row[2 + i] += touches.turn[k] if a % 2 == 0 else 0.0
        _inward(arms, chain, i, row)
        bx = chain[last, 0] * row[0] + chain[last, 1] * row[1]
        by = chain[last, 1] * row[0] + chain[last, 2] * row[1]
        give = 1.0 / model.mass if touches.obstacle[k] == model.rod and model.rod >= 0 else 0.0
        value = bx * free[0] + by * free[1] - give * (ex * rod_force[0] + ey * rod_force[1])
        for j in range(i + 1):
            value += row[2 + j] * chain[j, 3] * free[2 + j]
        touches.missed[a] = value - touches.missed[a]
        for b in range(a + 1):
            value, other = bx * rows[b, 0] + by * rows[b, 1], b // 2
            for j in range(min(i, touches.link[other]) + 1):
                value += row[2 + j] * chain[j, 3] * rows[b, 2 + j]
            if give > 0.0 and touches.obstacle[other] == model.rod:
                ox, oy = touches.normal[other, 0], touches.normal[other, 1]
                value += give * (ex * ox + ey * oy if b % 2 == 0 else ey * ox - ex * oy)
            coupling[a, b] = coupling[b, a] = value
    _press(count, touches, coupling, miss, system, step, phase)
    _exert(model, joints, count, touches, torque, rod_force)


@njit(**_PART)
def _exert(model, joints, count, touches, torque, rod_force):
    """Add the forces of all touches."""
    for k in range(count):
        i, along, across = touches.link[k], touches.force[2 * k], touches.force[2 * k + 1]
        fx = along * touches.normal[k, 0] - across * touches.normal[k, 1]
        fy = along * touches.normal[k, 1] + across * touches.normal[k, 0]
        torque[0] += fx
        torque[1] += fy
        for j in range(i + 1):
            dx, dy = touches.place[k, 0] - joints[j, 0], touches.place[k, 1] - joints[j, 1]
            torque[2 + j] += dx * fy - dy * fx
        torque[2 + i] += along * touches.turn[k]
        if touches.obstacle[k] == model.rod:
            rod_force[0] -= fx
            rod_force[1] -= fy


@njit(**_PART)
def _turn(count, q, v, h, cosine, sine):
    """Sines and cosines of all bodies after a step."""
    for i in range(count):
        t = h * v[2 + i]
        if abs(t) < _SMALL_TURN:
            tt = t * t
            c, s = 1.0 - tt * (0.5 - tt / 24.0), t * (1.0 - tt * (1.0 / 6.0 - tt / 120.0))
            cosine[i], sine[i] = c * cosine[i] - s * sine[i], c * sine[i] + s * cosine[i]
        else:
            cosine[i], sine[i] = math.cos(q[2 + i]), math.sin(q[2 + i])


@njit(**_PART)
def _place(model, q, cosine, sine, arms, joints):
    """Where all joints are, and the way from each to the next."""
    x, y = q[0], q[1]
    for i in range(len(model.length)):
        joints[i, 0], joints[i, 1] = x, y
        arms[i, 0], arms[i, 1] = model.length[i] * cosine[i], model.length[i] * sine[i]
        x += arms[i, 0]
        y += arms[i, 1]


@njit(**_PART)
def _sound(count, q, v):
    """Whether a state is finite and within bounds."""
    wrong = 0
    for i in range(count + 4):
        wrong += not abs(v[i]) < _SPEED_LIMIT
    for i in range(count):
        wrong += not abs(q[2 + i] - (q[1 + i] if i else 0.0)) < _ANGLE_LIMIT
    return wrong == 0


@njit(**_PART)
def _lead_rod(model, q, v, command, rod_force):
    """Put the rod where it is, and let its servos act."""
    size, rod = len(model.length) + 2, model.rod
    for d in range(2):
        model.obstacles[rod, d] = model.obstacles[rod, 2 + d] = q[size + d]
        rod_force[d] = model.servo[0] * (command[5 + d] - q[size + d])
        rod_force[d] += model.servo[1] * (command[7 + d] - v[size + d])


@njit(**_PART)
def _advance(model, q, v, torque, rod_force):
    """Step speeds, then coordinates; the most that anything moved towards anything [m]."""
    h, size, moved = model.timestep, len(model.length) + 2, 0.0
    for i in range(size):
        v[i] += h * torque[i]
        q[i] += h * v[i]
        moved += h * abs(v[i]) * (1.0 if i < 2 else model.length[i - 2])
    for d in range(2 if model.rod >= 0 else 0):
        v[size + d] += h * rod_force[d] / (model.mass + h * model.servo[1])
        q[size + d] += h * v[size + d]
        moved += h * abs(v[size + d])
    return moved


@njit(**_PART)
def _felt(touches, first, count, force):
    """Force of all contacts on the antenna; whether any presses."""
    force[:], pressed = 0.0, False
    for i in range(first, count):
        along, across = touches.force[2 * i], touches.force[2 * i + 1]
        nx, ny = touches.normal[i, 0], touches.normal[i, 1]
        force[0] += along * nx - across * ny
        force[1] += along * ny + across * nx
        pressed = pressed or along > 0.0
    return pressed


@njit(**_PART)
def _room(count):
    """Arrays for the touches of a step, and for what `_resist` works out."""
    most, size = 2 * MOST_TOUCHES, count + 2
    touches = _Touches(
        np.zeros(MOST_TOUCHES, np.int64),
        np.zeros(MOST_TOUCHES, np.int64),
        np.zeros((MOST_TOUCHES, 2)),
        np.zeros((MOST_TOUCHES, 2)),
        np.zeros(MOST_TOUCHES),
        np.zeros(MOST_TOUCHES),
        np.zeros(most),
        np.zeros(most),
        np.zeros(most),
    )
    work = (
        np.zeros((count + 1, 4)),
        np.zeros(size),
        np.zeros((most, size)),
        np.zeros((most, most)),
        np.zeros(most),
        np.zeros((most, most)),
        np.zeros(most),
        np.zeros(most, np.int64),
    )
    return touches, work


@njit(**_RULES, cache=True)
def drive(model, q, v, commands, steps, states, forces, touching):
    """Step through commands and write what came of each.

    Args:
        model: The bench; where its rod is changes.
        q: Coordinates and the rod's place, shape (n + 5,); changed.
        v: Their speeds; changed.
        commands: Place and speed of the carriage, angle of the base, place and speed of the rod,
            shape (k, 9).
        steps: Physics steps of each.
        states: Written: coordinates after each, shape (k, n + 5).
        forces: Written: force of all obstacles on the antenna in the last step of each [N], shape
            (k, 2).
        touching: Written: whether any pressed in it, shape (k,).

    Returns:
        0, CROWDED or BURST; and how many commands were carried out.
    """
    count = len(model.length)
    size = count + 2
    chain, torque, pull = np.zeros((count + 1, 4)), np.zeros(size), np.zeros((count, 2))
    cosine, sine, joints = np.cos(q[2:size]), np.sin(q[2:size]), np.zeros((count, 2))
    arms, rod_force = np.zeros((count, 2)), np.zeros(2)
    touches, work = _room(count)
    pairs = np.zeros((count * max(1, len(model.obstacles)), 2), np.int64)
    pair_count, slack = 0, -1.0
    for k in range(len(commands)):
        stops, touched = 0, 0
        for i in range(count):
            cosine[i], sine[i] = math.cos(q[2 + i]), math.sin(q[2 + i])
        for _ in range(steps):
            if model.rod >= 0:
                _lead_rod(model, q, v, commands[k], rod_force)
            _place(model, q, cosine, sine, arms, joints)
            if slack < 0.0:
                pair_count, slack = _pairs(model, joints, cosine, sine, _SKIN, pairs), _SKIN
            _smooth(model, q, v, arms, commands[k], torque, pull)
            stops = _stops(model, q, v, touches)
            touched = _contacts(
                model, v, joints, arms, cosine, sine, pairs, pair_count, stops, touches
            )
            if touched < 0:
                return CROWDED, k
            _fold(model, arms, model.timestep, chain)
            if touched > 0:
                _fold(model, arms, 0.0, work[0])
                _resist(model, joints, arms, touched, touches, work, torque, rod_force)
            _inward(arms, chain, count - 1, torque)
            _outward(arms, chain, torque)
            slack -= _advance(model, q, v, torque, rod_force)
            _turn(count, q, v, model.timestep, cosine, sine)
        if not _sound(count, q, v):
            return BURST, k
        states[k] = q
        touching[k] = _felt(touches, stops, touched, forces[k])
    return 0, len(commands)
