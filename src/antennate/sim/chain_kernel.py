"""The planar chain, compiled: the engine's equations of a bench, for one antenna alone.

Coordinates are x and y of the carriage and the angles from the x axis of the base and of every
link. A change from hinge angles to these is linear and constant, so that a step is the engine's
step: implicit in the damping of joints and servos (its `implicitfast`), contacts and stops soft as
its `solref` and `solimp` say, friction in an elliptic cone. Its contact problem is a quadratic one
in pieces: forces f of all contacts minimise f A f / 2 + s(j + A f), where A is the inverse inertia
at the contacts, j what misses the wanted acceleration without forces, and s the cost of a miss.
Newton's method ends when no contact changes between free, sticking and sliding.

Nothing else imports this file before a chain is made, as numba takes long to import.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from antennate.types import Floats

MOST_TOUCHES = 64
"""Contacts and stops at one time; beyond, a trial is invalid."""
CROWDED, BURST = -1, -2
"""What `drive` returns in place of a success: too many contacts, or a state out of bounds."""
_SKIN = 0.002
"""Pairs of link and obstacle farther apart are left out until the chain may have met them [m]."""
_ITERATIONS, _HALVINGS = 100, 40
_SMALL_TURN = 5e-3
"""Turns in a step up to this need five terms of their series only [rad]."""
_ANGLE_LIMIT, _SPEED_LIMIT = 6.3, 1e4
"""No hinge of a sound bench turns farther [rad]; no coordinate is faster [m/s or rad/s]."""
_RULES = {"cache": True, "fastmath": {"contract", "nsz", "arcp", "reassoc"}, "error_model": "numpy"}


class Model(NamedTuple):
    """A bench in numbers; base and n links make n + 1 bodies, the base one without length.

    Attributes:
        timestep: Physics step [s].
        length: Length of each body [m], shape (n + 1,).
        moment: Mass beyond each body's end and its own half, times its length [kg·m], same shape.
        inertia: Inertia of each about its joint with all mass beyond at its end [kg·m²].
        armature: Of each joint [kg·m²]; `stiffness` [N·m/rad], `damping` [N·m·s/rad].
        stop: Largest angle of each joint [rad].
        stop_weight: Inverse inertia of each joint when straight [1/(kg·m²)].
        touch_weight: Mean inverse mass at the middle of each body when straight [1/kg].
        mass: All that the carriage moves, itself included [kg].
        weight: What gravity pulls on [kg].
        gravity: In the plane [m/s²], shape (2,).
        torque: Largest torque of the base servo [N·m].
        servo: Gains of the slides' servos [N/m], [N·s/m], shape (2,).
        radius: Of the antenna [m].
        friction: Against all obstacles.
        impratio: Stiffness of friction over that of the normal.
        touch: Time constant [s], and least and largest impedance and their width [m] of contacts,
            shape (4,); `stopping` of stops.
        obstacles: Ends and radius of each capsule [m], shape (m, 5); a ball's ends are the same.
        probe_mass: Mass of the rod [kg], which is the last obstacle; 0 without.
    """

    timestep: float
    length: Floats
    moment: Floats
    inertia: Floats
    armature: Floats
    stiffness: Floats
    damping: Floats
    stop: Floats
    stop_weight: Floats
    touch_weight: Floats
    mass: float
    weight: float
    gravity: Floats
    torque: float
    servo: Floats
    radius: float
    friction: float
    impratio: float
    touch: Floats
    stopping: Floats
    obstacles: Floats
    probe_mass: float


class _Touches(NamedTuple):
    """Contacts and stops of one step; each has two rows, along and across its normal.

    Attributes:
        rows: Jacobian, shape (2 k, n + 5); the last two columns are the rod's.
        missed: Acceleration wanted, later what misses it without forces, shape (2 k,).
        hardness: Of both rows, shape (2 k,).
        grip: Friction, 0 for a stop, shape (k,).
        force: Shape (2 k,) [N or N·m].
        normal: Of contacts, away from the obstacle, shape (k, 2).
    """

    rows: Floats
    missed: Floats
    hardness: Floats
    grip: Floats
    force: Floats
    normal: Floats


@njit(**_RULES)
def _factor(matrix, size):
    """Cholesky in place, in the lower half; the diagonal holds inverses."""
    for j in range(size):
        for i in range(j, size):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = 1.0 / math.sqrt(rest) if i == j else rest * matrix[j, j]


@njit(**_RULES)
def _forward(matrix, vector, size):
    for i in range(size):
        rest = vector[i]
        for k in range(i):
            rest -= matrix[i, k] * vector[k]
        vector[i] = rest * matrix[i, i]


@njit(**_RULES)
def _backward(matrix, vector, size):
    for i in range(size - 1, -1, -1):
        value = vector[i] * matrix[i, i]
        vector[i] = value
        for k in range(i):
            vector[k] -= matrix[i, k] * value


@njit(**_RULES)
def _dynamics(model, q, v, cosine, sine, command, inertia, force):
    """Inertia, lower half, and force of springs, servos, weight and spin on each coordinate."""
    count, gravity, servo = len(model.length), model.gravity, model.servo
    inertia[0, 0] = inertia[1, 1] = model.mass
    inertia[1, 0] = 0.0
    for d in range(2):
        drive = servo[0] * (command[d] - q[d]) + servo[1] * (command[2 + d] - v[d])
        force[d] = drive + model.weight * gravity[d]
    for i in range(count):
        c, s, moment, spin = cosine[i], sine[i], model.moment[i], v[2 + i] * v[2 + i]
        inertia[2 + i, 0] = -moment * s
        inertia[2 + i, 1] = moment * c
        force[0] += moment * c * spin
        force[1] += moment * s * spin
        pull = moment * (gravity[1] * c - gravity[0] * s)
        for j in range(i):
            lever = model.length[j] * moment
            inertia[2 + i, 2 + j] = lever * (c * cosine[j] + s * sine[j])
            across = lever * (s * cosine[j] - c * sine[j])
            pull -= across * v[2 + j] * v[2 + j]
            force[2 + j] += across * spin
        inertia[2 + i, 2 + i] = model.inertia[i]
        force[2 + i] = pull
    drive = model.stiffness[0] * (command[4] - q[2])
    force[2] += min(max(drive, -model.torque), model.torque) - model.damping[0] * v[2]
    inertia[2, 2] += model.armature[0]
    for i in range(1, count):
        turn, speed = q[2 + i] - q[1 + i], v[2 + i] - v[1 + i]
        torque = model.stiffness[i] * turn + model.damping[i] * speed
        force[2 + i] -= torque
        force[1 + i] += torque
        inertia[2 + i, 2 + i] += model.armature[i]
        inertia[1 + i, 1 + i] += model.armature[i]
        inertia[2 + i, 1 + i] -= model.armature[i]


@njit(**_RULES)
def _damped(model, inertia, size, out):
    """Inertia plus timestep times damping, lower half."""
    h = model.timestep
    for i in range(size):
        for j in range(i + 1):
            out[i, j] = inertia[i, j]
    for i in range(2):
        out[i, i] += h * model.servo[1]
    out[2, 2] += h * model.damping[0]
    for i in range(3, size):
        give = h * model.damping[i - 2]
        out[i, i] += give
        out[i - 1, i - 1] += give
        out[i, i - 1] -= give


@njit(**_RULES)
def _nearest(obstacle, x, y, c, s, length):
    """Nearest points of a link from x, y along c, s and an obstacle's axis: share of the link's
    length, and the point of the obstacle."""
    ax, ay = obstacle[0], obstacle[1]
    bx, by = obstacle[2] - ax, obstacle[3] - ay
    dx, dy = ax - x, ay - y
    along = length * length
    if bx == 0.0 and by == 0.0:
        share = (dx * c + dy * s) / length
        return min(max(share, 0.0), 1.0), ax, ay
    ux, uy = length * c, length * s
    square, both = bx * bx + by * by, ux * bx + uy * by
    du, db = dx * ux + dy * uy, dx * bx + dy * by
    away = along * square - both * both
    share = (du * square - db * both) / away if away > 1e-15 else 0.5
    share = min(max(share, 0.0), 1.0)
    other = (share * both - db) / square
    if other < 0.0 or other > 1.0:
        other = min(max(other, 0.0), 1.0)
        share = min(max((du + other * both) / along, 0.0), 1.0)
    return share, ax + other * bx, ay + other * by


@njit(**_RULES)
def _pairs(model, joints, cosine, sine, reach, found):
    """Links and obstacles nearer than `reach` [m] to one another."""
    count = 0
    for i in range(1, len(model.length)):
        x, y, c, s = joints[i, 0], joints[i, 1], cosine[i], sine[i]
        for k in range(len(model.obstacles)):
            obstacle = model.obstacles[k]
            share, px, py = _nearest(obstacle, x, y, c, s, model.length[i])
            way = share * model.length[i]
            near = reach + model.radius + obstacle[4]
            if (x + way * c - px) ** 2 + (y + way * s - py) ** 2 < near * near:
                found[count, 0], found[count, 1] = i, k
                count += 1
    return count


@njit(**_RULES)
def _hardness(rule, weight, depth):
    """Inverse of the softness of a contact, its pull back and its damping, as the engine's."""
    low, high, width = rule[1], rule[2], rule[3]
    share = min(abs(depth) / width, 1.0)
    bent = 2.0 * share * share if share < 0.5 else 1.0 - 2.0 * (1.0 - share) ** 2
    impedance = low + bent * (high - low)
    hardness = impedance / ((1.0 - impedance) * weight)
    pull = -impedance * depth / (high * rule[0]) ** 2
    return hardness, pull, 2.0 / (high * rule[0])


@njit(**_RULES)
def _stops(model, q, v, touches):
    """Joints beyond their stops."""
    count = 0
    size = len(model.length)
    for i in range(size):
        turn = q[2 + i] - (q[1 + i] if i else 0.0)
        depth = model.stop[i] - abs(turn)
        if depth < 0.0 and count < MOST_TOUCHES:
            at, sign = 2 * count, -1.0 if turn > 0.0 else 1.0
            touches.rows[at : at + 2] = 0.0
            touches.rows[at, 2 + i] = sign
            speed = sign * v[2 + i]
            if i:
                touches.rows[at, 1 + i] = -sign
                speed -= sign * v[1 + i]
            hard, pull, drag = _hardness(model.stopping, model.stop_weight[i], depth)
            touches.missed[at], touches.missed[at + 1] = pull - drag * speed, 0.0
            touches.hardness[at], touches.hardness[at + 1] = hard, 0.0
            touches.grip[count] = 0.0
            count += 1
    return count


@njit(**_RULES)
def _contacts(model, v, joints, cosine, sine, pairs, pair_count, first, touches):
    """Pairs that overlap, written behind the first ones; returns how many touches there are."""
    count, rod = first, len(model.obstacles) - 1 if model.probe_mass > 0.0 else -1
    size = len(model.length) + 2
    for p in range(pair_count):
        i, k = pairs[p, 0], pairs[p, 1]
        x, y, c, s = joints[i, 0], joints[i, 1], cosine[i], sine[i]
        share, px, py = _nearest(model.obstacles[k], x, y, c, s, model.length[i])
        way = share * model.length[i]
        nx, ny = x + way * c - px, y + way * s - py
        apart = math.sqrt(nx * nx + ny * ny)
        depth = apart - model.radius - model.obstacles[k, 4]
        if depth >= 0.0 or apart < 1e-12:
            continue
        if count == MOST_TOUCHES:
            return CROWDED
        nx, ny = nx / apart, ny / apart
        middle = model.obstacles[k, 4] + 0.5 * depth
        px, py = px + middle * nx, py + middle * ny
        weight = model.touch_weight[i]
        for r in range(2):
            ex, ey = (nx, ny) if r == 0 else (-ny, nx)
            row = touches.rows[2 * count + r]
            row[0], row[1] = ex, ey
            for j in range(i):
                row[2 + j] = model.length[j] * (ey * cosine[j] - ex * sine[j])
            row[2 + i] = ey * (px - x) - ex * (py - y)
            row[3 + i :] = 0.0
            speed = 0.0
            for j in range(3 + i):
                speed += row[j] * v[j]
            if k == rod:
                row[size], row[size + 1] = -ex, -ey
                speed -= ex * v[size] + ey * v[size + 1]
            touches.missed[2 * count + r] = speed
        if k == rod:
            weight += 2.0 / (3.0 * model.probe_mass)
        hard, pull, drag = _hardness(model.touch, weight, depth)
        touches.missed[2 * count] = pull - drag * touches.missed[2 * count]
        touches.missed[2 * count + 1] *= -drag
        touches.hardness[2 * count] = hard
        touches.hardness[2 * count + 1] = hard * model.impratio
        touches.grip[count] = model.friction
        touches.normal[count, 0], touches.normal[count, 1] = nx, ny
        count += 1
    return count


@njit(**_RULES)
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


@njit(**_RULES)
def _slope(phase, hard, hard_across, grip):
    """Second derivatives of the cost of one contact in a phase: along, both, across."""
    if phase == 0:
        return 0.0, 0.0, 0.0
    if phase == 1:
        return hard, 0.0, hard_across
    soft = hard / (1.0 + grip * grip * hard / hard_across)
    sign = grip if phase == 2 else -grip
    return soft, -sign * soft, sign * sign * soft


@njit(**_RULES)
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


@njit(**_RULES)
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


@njit(**_RULES)
def _press(count, touches, coupling, miss, system, step, phase, tried):
    """Forces of all touches by Newton's method, into `touches.force`."""
    size, force = 2 * count, touches.force
    for i in range(size):
        force[i], miss[i] = 0.0, touches.missed[i]
    energy = _energy(count, touches, coupling, miss, force, phase)
    for _ in range(_ITERATIONS):
        for i in range(count):
            a, b = 2 * i, 2 * i + 1
            aa, ab, bb = _slope(
                phase[i], touches.hardness[a], touches.hardness[b], touches.grip[i]
            )
            for j in range(size):
                system[a, j] = aa * coupling[a, j] + ab * coupling[b, j]
                system[b, j] = ab * coupling[a, j] + bb * coupling[b, j]
            system[a, a] += 1.0
            system[b, b] += 1.0
            step[a] = -(force[a] + aa * miss[a] + ab * miss[b])
            step[b] = -(force[b] + ab * miss[a] + bb * miss[b])
        _eliminate(system, step, size)
        share, before = 1.0, energy
        for i in range(count):
            tried[count + i] = phase[i]
        for _ in range(_HALVINGS):
            for i in range(size):
                force[i] += share * step[i]
            for i in range(size):
                value = touches.missed[i]
                for j in range(size):
                    value += coupling[i, j] * force[j]
                miss[i] = value
            energy = _energy(count, touches, coupling, miss, force, tried)
            if energy <= before + 1e-12 * abs(before):
                break
            for i in range(size):
                force[i] -= share * step[i]
            share *= 0.5
        same = True
        for i in range(count):
            same = same and tried[i] == tried[count + i]
            phase[i] = tried[i]
        if same and share == 1.0:
            return


@njit(**_RULES)
def _resist(model, size, count, inertia, touches, work, free, force, rod_force):
    """Add the forces of touches to those on the coordinates and on the rod.

    The inertia is factored in place; `work` holds L^-1 J', and A = J M^-1 J' its products.
    """
    coupling, miss, system, step, phase, tried = work[1:]
    _factor(inertia, size)
    for i in range(size):
        free[i] = force[i]
    _forward(inertia, free, size)
    held = 1.0 / model.probe_mass if model.probe_mass > 0.0 else 0.0
    for a in range(2 * count):
        row, half = touches.rows[a], work[0][a]
        for i in range(size):
            half[i] = row[i]
        _forward(inertia, half, size)
        value = -touches.missed[a]
        for i in range(size):
            value += half[i] * free[i]
        value += held * (row[size] * rod_force[0] + row[size + 1] * rod_force[1])
        touches.missed[a] = value
        for b in range(a + 1):
            value = held * (
                row[size] * touches.rows[b, size] + row[size + 1] * touches.rows[b, size + 1]
            )
            for i in range(size):
                value += half[i] * work[0][b, i]
            coupling[a, b] = coupling[b, a] = value
    _press(count, touches, coupling, miss, system, step, phase, tried)
    for a in range(2 * count):
        for i in range(size):
            force[i] += touches.rows[a, i] * touches.force[a]
        for i in range(2):
            rod_force[i] += touches.rows[a, size + i] * touches.force[a]


@njit(**_RULES)
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


@njit(**_RULES)
def _place(model, q, cosine, sine, joints):
    joints[0, 0], joints[0, 1] = q[0], q[1]
    for i in range(len(model.length)):
        joints[i + 1, 0] = joints[i, 0] + model.length[i] * cosine[i]
        joints[i + 1, 1] = joints[i, 1] + model.length[i] * sine[i]


@njit(**_RULES)
def _sound(count, q, v):
    """Whether a state is finite and within bounds."""
    for i in range(count + 4):
        if not abs(v[i]) < _SPEED_LIMIT:
            return False
    for i in range(count):
        if not abs(q[2 + i] - (q[1 + i] if i else 0.0)) < _ANGLE_LIMIT:
            return False
    return True


@njit(**_RULES)
def drive(model, q, v, commands, steps, states, forces, touching):
    """Step through commands and write what came of each.

    Args:
        model: The bench.
        q: Coordinates and the rod's place, shape (n + 5,); changed.
        v: Their speeds; changed.
        commands: Place and speed of the carriage, angle of the base, place and speed of the rod,
            shape (k, 9).
        steps: Physics steps of each.
        states: Coordinates after each, shape (k, n + 5).
        forces: Force of all obstacles on the antenna in the last step of each [N], shape (k, 2).
        touching: Whether any pressed in it, shape (k,).

    Returns:
        `len(commands)`; or CROWDED or BURST, and the number of the command before it.
    """
    count, h, rod = len(model.length), model.timestep, len(model.obstacles) - 1
    size, most = count + 2, 2 * MOST_TOUCHES
    inertia, damped = np.zeros((size, size)), np.zeros((size, size))
    force, free, rod_force = np.zeros(size), np.zeros(size), np.zeros(2)
    cosine, sine, joints = np.cos(q[2:size]), np.sin(q[2:size]), np.zeros((count + 1, 2))
    touches = _Touches(
        np.zeros((most, size + 2)),
        np.zeros(most),
        np.zeros(most),
        np.zeros(MOST_TOUCHES),
        np.zeros(most),
        np.zeros((MOST_TOUCHES, 2)),
    )
    phases = np.zeros(MOST_TOUCHES, np.int64)
    work = (
        np.zeros((most, size)),
        np.zeros((most, most)),
        np.zeros(most),
        np.zeros((most, most)),
        np.zeros(most),
        phases,
        np.zeros(2 * MOST_TOUCHES, np.int64),
    )
    pairs = np.zeros((count * max(1, len(model.obstacles)), 2), np.int64)
    pair_count, slack = 0, -1.0
    for k in range(len(commands)):
        command, stops, touched = commands[k], 0, 0
        for i in range(count):
            cosine[i], sine[i] = math.cos(q[2 + i]), math.sin(q[2 + i])
        for _ in range(steps):
            if model.probe_mass > 0.0:
                for d in range(2):
                    model.obstacles[rod, d] = model.obstacles[rod, 2 + d] = q[size + d]
                    rod_force[d] = model.servo[0] * (command[5 + d] - q[size + d])
                    rod_force[d] += model.servo[1] * (command[7 + d] - v[size + d])
            _place(model, q, cosine, sine, joints)
            if slack < 0.0:
                pair_count, slack = _pairs(model, joints, cosine, sine, _SKIN, pairs), _SKIN
            _dynamics(model, q, v, cosine, sine, command, inertia, force)
            _damped(model, inertia, size, damped)
            stops = _stops(model, q, v, touches)
            touched = _contacts(
                model, v, joints, cosine, sine, pairs, pair_count, stops, touches
            )
            if touched < 0:
                return CROWDED, k
            if touched > 0:
                _resist(model, size, touched, inertia, touches, work, free, force, rod_force)
            _factor(damped, size)
            _forward(damped, force, size)
            _backward(damped, force, size)
            for i in range(size):
                v[i] += h * force[i]
                q[i] += h * v[i]
                slack -= h * abs(v[i]) * (1.0 if i < 2 else model.length[i - 2])
            if model.probe_mass > 0.0:
                for d in range(2):
                    v[size + d] += h * rod_force[d] / (model.probe_mass + h * model.servo[1])
                    q[size + d] += h * v[size + d]
                    slack -= h * abs(v[size + d])
            _turn(count, q, v, h, cosine, sine)
        if not _sound(count, q, v):
            return BURST, k
        states[k] = q
        forces[k], touching[k] = 0.0, False
        for i in range(stops, touched):
            along, across = touches.force[2 * i], touches.force[2 * i + 1]
            nx, ny = touches.normal[i, 0], touches.normal[i, 1]
            forces[k, 0] += along * nx - across * ny
            forces[k, 1] += along * ny + across * nx
            touching[k] = touching[k] or along > 0.0
    return len(commands), len(commands)
