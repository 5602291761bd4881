"""Estimates by mechanics alone: nothing is fitted, the antenna is the nominal one.

- Gap: the statics say how far the wall is that a frictionless tip touches at a base angle and a
  flex; the median over the samples that touch, of both sides, and the distance of the bases.
- Wall beside a walk: the same for each sample, with the head where the yaw joints put it and the
  body moving on as its legs roll; samples in which the flex grows alone count. Of all angles of
  the wall the one at which they agree best, one that they cannot be told by counting as far off.
- Place: of all places along the antenna the one at which the statics bend the antenna as far as it
  is bent, and at which the head has turned by then as far as it has.
- Base to tip: an arc bent as evenly as the part under the flex sensor.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from antennate.antenna.statics import Chain, equilibrium, shape, with_profile
from antennate.experiments.sweep.estimates import wall_distance
from antennate.robots.antenna import AntennaSpec
from antennate.types import Bools, Floats
from antennate_lab.dataset.columns import Windows
from antennate_lab.dataset.config import DatasetConfig
from antennate_lab.dataset.features import (
    chosen,
    felt,
    head_pose,
    head_turn,
    near_left,
    pushed,
)
from antennate_lab.gait.physics import rolling_speed

_ANGLES = np.linspace(-0.2, 0.5, 36)
"""Angles of a wall that are tried [rad]."""
_FAR = 0.02
"""What one sample may differ by at most, so that few do not decide [m]."""
_PLACES = np.linspace(0.25, 1.0, 76)
"""Places of a contact that are tried, over the length of the antenna."""
_FLEXES = np.linspace(0.0, 2.0, 81)
"""Flex of the tables [rad]."""


def closed_form(config: DatasetConfig, task: str, windows: Windows) -> Floats:
    """Estimates of a task for n windows, shape (n,); NaN where the mechanics cannot tell."""
    if task in ("distance", "angle"):
        return _walls(config, windows)[0 if task == "distance" else 1]
    return {"gap": _gaps, "place": _places, "base_to_tip": _tips}[task](config, windows)


def nominal(config: DatasetConfig) -> AntennaSpec:
    """The antenna as it is drawn."""
    return with_profile(config.robot.antenna, config.profile)


def _gaps(config: DatasetConfig, windows: Windows) -> Floats:
    seen, antenna = felt(config, "gap", windows), nominal(config)
    width = np.full(len(windows["counts_left"]), antenna.base_spacing)
    for side, flex in seen.flex.items():
        angle = seen.base[side] + antenna.base_angle
        width += _median(_distances(antenna, angle, flex), seen.touch[side])
    return width


def _distances(antenna: AntennaSpec, angle: Floats, flex: Floats) -> Floats:
    """Distance of the wall for each sample [m], same shape."""
    return wall_distance(antenna, angle.ravel(), flex.ravel()).reshape(flex.shape)


def _median(values: Floats, which: Bools) -> Floats:
    """Median of each row over those that are asked for and known; NaN without any, shape (n,)."""
    known = np.where(which & np.isfinite(values), values, np.nan)
    some = np.isfinite(known).any(axis=1)
    known[~some] = 0.0
    return np.where(some, np.nanmedian(known, axis=1), np.nan)


def _walls(config: DatasetConfig, windows: Windows) -> tuple[Floats, Floats]:
    """Distance and angle of the wall beside a walk, each of shape (n,)."""
    seen, antenna = felt(config, "walk", windows), nominal(config)
    left = near_left(seen)
    sign = np.where(left, 1.0, -1.0)[:, None]
    x, y, turn = head_pose(config, windows)
    y, turn = sign * y, sign * turn
    x = x + _ways(config, windows)
    ahead, aside = config.robot.link_pitch / 2.0, antenna.base_spacing / 2.0
    base_x = x + ahead * np.cos(turn) - aside * np.sin(turn)
    base_y = y + ahead * np.sin(turn) + aside * np.cos(turn)
    flex, touch = chosen(left, seen.flex), chosen(left, seen.touch)
    touch = touch & (np.diff(flex, axis=1, prepend=flex[:, :1]) > 0)
    count = np.maximum(touch.sum(axis=1), 1)
    heading = chosen(left, seen.base) + antenna.base_angle + turn
    best = np.full(len(x), np.inf)
    distance, wall = np.full(len(x), np.nan), np.full(len(x), np.nan)
    for angle in _ANGLES.tolist():
        across = math.sin(angle) * base_x + math.cos(angle) * base_y
        line = _distances(antenna, heading + angle, flex) + across
        middle = _median(line, touch)
        off = np.fmin(abs(line - middle[:, None]), _FAR)
        spread = np.where(np.isfinite(middle), (off * touch).sum(axis=1) / count, np.inf)
        better = spread < best
        head = (math.sin(angle) * x + math.cos(angle) * y).mean(axis=1)
        best = np.where(better, spread, best)
        distance = np.where(better, middle - head, distance)
        wall = np.where(better, angle, wall)
    return distance, wall


def _ways(config: DatasetConfig, windows: Windows) -> Floats:
    """Way of the body since the window began [m], as its legs roll, shape (n, HISTORY)."""
    legs = np.stack([windows[name].astype(float) for name in config.robot.leg_names])
    phase = legs.mean(axis=0)
    cycle = rolling_speed(config.gait, config.robot) / config.gait.frequency
    return cycle * (phase - phase[:, :1]) / (2.0 * math.pi)


def _tips(config: DatasetConfig, windows: Windows) -> Floats:
    antenna = nominal(config)
    bend = felt(config, "gap", windows).flex["left"].max(axis=1)
    bend *= antenna.hinges / antenna.sensed_hinges
    return antenna.length * np.sinc(bend / 2.0 / math.pi)


def _places(config: DatasetConfig, windows: Windows) -> Floats:
    seen, antenna = felt(config, "push", windows), nominal(config)
    left = near_left(seen)
    turn = head_turn(config, "push", windows, left)
    flex, touch = chosen(left, seen.flex), chosen(left, seen.touch)
    begin, end = pushed(touch, turn)
    lever, gap = config.robot.link_pitch, antenna.radius + config.push.post_radius
    return contact_places(antenna, lever, gap, config.touch_flex, begin, end, flex[:, -1])


def contact_places(
    antenna: AntennaSpec,
    pitch: float,
    gap: float,
    threshold: float,
    begin: Floats,
    end: Floats,
    flex: Floats,
) -> Floats:
    """Place of a frictionless contact at the end of turns of the head [m], shape (n,).

    Args:
        antenna: The antenna, on the left.
        pitch: Distance of the yaw joint behind the antenna's base [m].
        gap: Distance of the middle of the post from that of the antenna [m].
        threshold: Flex [rad] at which the turn is `begin`.
        begin: Turn of the head there [rad], shape (n,).
        end: Turn at the end [rad], shape (n,).
        flex: Size of the flex there [rad], shape (n,).

    Returns:
        Places; NaN where no place fits.
    """
    stiffness = antenna.hinge_stiffness()
    contacts = _contacts(stiffness, antenna.link_length, antenna.sensed_hinges, gap)
    early = _first_order(antenna, pitch)
    error = np.full((len(_PLACES), len(flex)), np.nan)
    for i, points in enumerate(contacts):
        x, y = (np.interp(flex, _FLEXES, points[:, k], right=np.nan) for k in (0, 1))
        post = _turned(np.stack([x, y]), end, antenna, pitch)
        # beside the straight antenna when it touched
        error[i] = _off(post, begin - threshold / early[i], antenna, pitch) - gap
    return _root(_PLACES * antenna.length, error)


def _turned(point: Floats, turn: Floats, antenna: AntennaSpec, pitch: float) -> Floats:
    """Points in the frame of the antenna (2, n) in that of the yaw joint [m]."""
    heading = turn + antenna.base_angle
    aside = antenna.base_spacing / 2.0
    c, s, a, b = np.cos(turn), np.sin(turn), np.cos(heading), np.sin(heading)
    return np.stack(
        [
            c * pitch - s * aside + a * point[0] - b * point[1],
            s * pitch + c * aside + b * point[0] + a * point[1],
        ]
    )


def _off(point: Floats, turn: Floats, antenna: AntennaSpec, pitch: float) -> Floats:
    """Distance of points (2, n) to the left of the straight antenna at a turn [m], shape (n,)."""
    base = _turned(np.zeros((2, len(turn))), turn, antenna, pitch)
    heading = turn + antenna.base_angle
    return np.cos(heading) * (point[1] - base[1]) - np.sin(heading) * (point[0] - base[0])


def _first_order(antenna: AntennaSpec, pitch: float) -> Floats:
    """Slope of the flex over the turn of the head at each place, for small bends.

    A force f at s bends the flex by f sum (s - s_i) / k_i over the sensed hinges and moves the
    contact by f sum (s - s_i)^2 / k_i over all; the head moves it by (s + c) a radian.
    """
    lever = pitch * math.cos(antenna.base_angle)
    lever += antenna.base_spacing / 2.0 * math.sin(antenna.base_angle)
    stiffness = np.array(antenna.hinge_stiffness())
    place = _PLACES * antenna.length
    arms = np.maximum(place[:, None] - antenna.link_length * np.arange(len(stiffness)), 0.0)
    bend = (arms / stiffness)[:, : antenna.sensed_hinges].sum(axis=1)
    return (place + lever) * bend / (arms**2 / stiffness).sum(axis=1)


@cache
def _contacts(stiffness: tuple[float, ...], link: float, sensed: int, gap: float) -> Floats:
    """Where a post that touches at each place lies once the antenna is bent by each flex.

    Returns:
        Points [m] in the frame of the antenna, (places, flexes, 2); NaN where no load bends so far.
    """
    chain = Chain(np.full(len(stiffness), link), np.array(stiffness))
    points = np.full((len(_PLACES), len(_FLEXES), 2), np.nan)
    sizes = np.linspace(0.0, 1.0, 101) ** 1.5 * 3.0 * stiffness[0] / chain.length
    for i, share in enumerate(_PLACES.tolist()):
        place = share * chain.length
        force = np.stack([np.zeros_like(sizes), -sizes / share], axis=1)
        rest = equilibrium(chain, np.full(len(sizes), place), force, follower=True)
        bend = -rest.angles[:, :sensed].sum(axis=1)
        good = rest.solved & np.append(True, np.diff(bend) > 0)
        count = len(good) if good.all() else int(np.argmin(good))
        joints = shape(chain, rest.angles)
        number = min(int(place / link), len(stiffness) - 1)
        part = place / link - number
        contact = (1.0 - part) * joints[:, number] + part * joints[:, number + 1]
        heading = rest.angles[:, : number + 1].sum(axis=1)
        contact += gap * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        for k in (0, 1):
            points[i, :, k] = np.interp(_FLEXES, bend[:count], contact[:count, k], right=np.nan)
    return points


def _root(grid: Floats, error: Floats) -> Floats:
    """Where the errors (g, n) over a grid (g,) change sign for the first time, shape (n,)."""
    change = np.sign(error[:-1]) * np.sign(error[1:]) <= 0
    some = change.any(axis=0)
    at, column = change.argmax(axis=0), np.arange(error.shape[1])
    low, high = error[at, column], error[at + 1, column]
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(high != low, low / (low - high), 0.0)
    return np.where(some, grid[at] + share * (grid[at + 1] - grid[at]), np.nan)
