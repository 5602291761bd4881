"""What simple estimates look at in a window: a few numbers made of readings and joints alone.

They know the robot as it is drawn, not the antenna at hand: nominal springs, gain and zeros.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from antennate.antenna.sensor import counts as readings_at
from antennate.experiments.bench import running_mean
from antennate.robots.antenna import SensorParams
from antennate.types import Bools, Floats
from antennate_lab.dataset.columns import Windows
from antennate_lab.dataset.config import DatasetConfig, Kind

Number = TypeVar("Number", np.float64, np.bool_)
_FLEX = np.linspace(0.0, 3.0, 3001)
"""Flex at which the curve of the sensor is looked at [rad]."""


def flex_from(sensor: SensorParams, counts: Floats) -> Floats:
    """Size of the flex [rad] that gives these readings at rest, same shape."""
    curve = readings_at(sensor, _FLEX)
    order = np.argsort(curve, kind="stable")
    return np.interp(counts, curve[order], _FLEX[order])


@dataclass(frozen=True, slots=True)
class Felt:
    """Flex and joints of both antennae in n windows.

    Attributes:
        flex: Size of the flex by side [rad], each of shape (n, HISTORY).
        base: Angle of the base about its mounting angle by side [rad], same shapes.
        touch: Whether the flex says that it touches, same shapes.
    """

    flex: dict[str, Floats]
    base: dict[str, Floats]
    touch: dict[str, Bools]


def felt(config: DatasetConfig, kind: Kind, windows: Windows) -> Felt:
    """What both antennae felt; readings and angles are averaged alike."""
    least = config.walk.touch_flex if kind == "walk" else config.touch_flex
    length = max(1, round(config.averaging_time * config.rate))
    flex, base = {}, {}
    for side in ("left", "right"):
        counts = running_mean(windows[f"counts_{side}"].astype(float), length)
        flex[side] = flex_from(config.robot.antenna.sensor, counts)
        joint = windows[f"antenna_{side[0]}_base"].astype(float)
        base[side] = running_mean(joint, length)
    touch = {side: values >= least for side, values in flex.items()}
    return Felt(flex, base, touch)


def near_left(seen: Felt) -> Bools:
    """Whether the left antenna is bent more than the right one on the whole, shape (n,)."""
    return seen.flex["left"].sum(axis=1) >= seen.flex["right"].sum(axis=1)


def chosen(left: Bools, pair: Mapping[str, NDArray[Number]]) -> NDArray[Number]:
    """The values of the left antenna where it is asked for, else those of the right one."""
    return np.where(left[:, None], pair["left"], pair["right"])


def features(config: DatasetConfig, kind: Kind, windows: Windows) -> Floats:
    """Features of n windows, shape (n, k)."""
    seen = felt(config, kind, windows)
    if kind == "gap":
        return np.hstack([_of_sweep(seen.flex[s], seen.base[s], seen.touch[s]) for s in seen.flex])
    left = near_left(seen)
    flex, touch = chosen(left, seen.flex), chosen(left, seen.touch)
    turn = head_turn(config, kind, windows, left)
    if kind == "push":
        return _of_push(flex, touch, turn)
    angle = chosen(left, seen.base) + turn
    later = np.arange(flex.shape[1]) >= flex.shape[1] // 2
    halves = [
        value
        for part in (~later, later)
        for value in (flex[:, part].max(axis=1), touch[:, part].mean(axis=1))
    ]
    return np.column_stack([_of_sweep(flex, angle, touch), flex.mean(axis=1), *halves])


def head_turn(config: DatasetConfig, kind: Kind, windows: Windows, left: Bools) -> Floats:
    """Turn of the head towards the antenna that is bent, off the body [rad], (n, HISTORY).

    In a push it is the angle of the first yaw joint; in a walk that of the head to the line from
    the last link to the first.
    """
    sign = np.where(left, 1.0, -1.0)[:, None]
    if kind == "push":
        return -sign * windows[config.robot.yaw_names[0]].astype(float)
    return sign * head_pose(config, windows)[2]


def head_pose(config: DatasetConfig, windows: Windows) -> tuple[Floats, Floats, Floats]:
    """Head off the middle of the body, x along the line from the last link to the first.

    In a walk this line keeps its direction within 0.01 rad, while head and body swing.

    Returns:
        Place ahead and to the left [m] and angle to the left [rad], each of shape (n, HISTORY).
    """
    robot = config.robot
    yaw = np.stack([windows[name].astype(float) for name in robot.yaw_names], axis=-1)
    heading = np.concatenate([np.zeros((*yaw.shape[:-1], 1)), np.cumsum(yaw, axis=-1)], axis=-1)
    along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    steps = -robot.link_pitch / 2.0 * (along[..., :-1, :] + along[..., 1:, :])
    start = np.zeros((*steps.shape[:-2], 1, 2))
    links = np.concatenate([start, np.cumsum(steps, axis=-2)], axis=-2)
    ahead = links[..., 0, :] - links[..., -1, :]
    axis = np.arctan2(ahead[..., 1], ahead[..., 0])
    x, y = np.moveaxis(-links.mean(axis=-2), -1, 0)
    c, s = np.cos(axis), np.sin(axis)
    return c * x + s * y, c * y - s * x, -axis


def _of_sweep(flex: Floats, angle: Floats, touch: Bools) -> Floats:
    """First touch, largest flex and share of touch of sweeps, shape (n, 4)."""
    rows = np.arange(len(flex))
    first, peak = touch.argmax(axis=1), flex.argmax(axis=1)
    return np.column_stack(
        [
            np.sin(np.where(touch.any(axis=1), angle[rows, first], angle.max(axis=1))),
            flex[rows, peak],
            angle[rows, peak],
            touch.mean(axis=1),
        ]
    )


def _of_push(flex: Floats, touch: Bools, turn: Floats) -> Floats:
    """Slope of the flex over the turn, largest and last flex, turn while it touches, (n, 4)."""
    begin, end = pushed(touch, turn)
    return np.column_stack([slopes(flex, touch, turn), flex.max(axis=1), flex[:, -1], end - begin])


def pushed(touch: Bools, turn: Floats) -> tuple[Floats, Floats]:
    """Turn at the first touch and at the end [rad], each of shape (n,)."""
    first = np.where(touch.any(axis=1), touch.argmax(axis=1), touch.shape[1] - 1)
    return turn[np.arange(len(turn)), first], turn[:, -1]


def slopes(flex: Floats, touch: Bools, turn: Floats) -> Floats:
    """Slope of the flex over the turn of the head while it touches, by least squares, (n,)."""
    count = np.maximum(touch.sum(axis=1, keepdims=True), 1)
    x = np.where(touch, turn - (turn * touch).sum(axis=1, keepdims=True) / count, 0.0)
    y = np.where(touch, flex - (flex * touch).sum(axis=1, keepdims=True) / count, 0.0)
    return (x * y).sum(axis=1) / np.maximum((x * x).sum(axis=1), 1e-9)
