"""The columns of a data set: what each is, its unit, and whether a robot has it or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from antennate.robots.spec import RobotSpec
from antennate_lab.dataset.config import HISTORY, Kind

Role = Literal["key", "input", "label", "truth"]
"""Which row it is; what the robot reads; what is to be estimated; what else only the simulation
knows."""
Windows = dict[str, Any]
"""Columns of some windows by name, arrays of shape (n,) or (n, HISTORY)."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        name: Its name.
        unit: Its unit, "1" if it has none.
        role: What it is for.
        meaning: What it holds.
        dtype: Type of its numbers, as NumPy names it; "str" for text.
        size: Numbers in a cell.
    """

    name: str
    unit: str
    role: Role
    meaning: str
    dtype: str = "float64"
    size: int = 1


@dataclass(frozen=True, slots=True)
class Task:
    """One quantity to be estimated.

    Attributes:
        name: What results call it.
        kind: Kind of the episodes, and name of the file.
        label: Its column.
        unit: Unit of the label.
        about: What it is.
        title: What figures call it.
    """

    name: str
    kind: Kind
    label: str
    unit: str
    about: str
    title: str


TASKS = (
    Task(
        "distance",
        "walk",
        "distance_m",
        "m",
        "distance of the middle of the head from the wall, mean over the window",
        "Distance to the wall",
    ),
    Task(
        "angle",
        "walk",
        "angle_rad",
        "rad",
        "angle of the body to the wall, mean over the window, positive towards the wall",
        "Angle of the wall",
    ),
    Task("gap", "gap", "gap_m", "m", "width of the gap, wall to wall", "Width of the gap"),
    Task(
        "place",
        "push",
        "place_m",
        "m",
        "place of the contact at the end of the window, along the antenna from its base",
        "Place of contact",
    ),
    Task(
        "base_to_tip",
        "gap",
        "base_to_tip_m",
        "m",
        "distance from base to tip of the left antenna where it is bent most in the window",
        "Base to tip (comparison)",
    ),
)
"""The last one stands beside a published figure; the other four are the tasks."""

_KEYS = (
    Column("episode", "1", "key", "number of the episode", "int32"),
    Column("window", "1", "key", "number of the window among those of its episode", "int16"),
    Column("split", "1", "key", "train, validation, test, test_antenna or test_speed", "str"),
)
_COUNTS = tuple(
    Column(f"counts_{side}", "count", "input", f"readings of the {side} antenna", "int16", HISTORY)
    for side in ("left", "right")
)
_SETTING = (
    Column("profile", "1", "truth", "springs of the antennae", "str"),
    Column("speed_factor", "1", "truth", "speed of the episode over the usual one"),
)
_FLEX = "flex under the flex sensor, largest size in the window"
_TRUTH: dict[Kind, tuple[Column, ...]] = {
    "walk": (
        Column("side", "1", "truth", "side of the wall", "str"),
        Column("antenna_touch", "1", "truth", "share of the samples with an antenna at the wall"),
        Column("body_touch", "1", "truth", "share of the samples with legs or body at the wall"),
        Column("friction", "1", "truth", "friction of the antennae against the wall"),
        Column("end_s", "s", "truth", "time of the last sample since the start"),
    ),
    "gap": (
        Column("distance_left_m", "m", "truth", "distance of the left wall from its base"),
        Column("distance_right_m", "m", "truth", "distance of the right wall from its base"),
        Column(
            "tilt_rad", "rad", "truth", "angle of the robot to the walls, positive to the right"
        ),
        Column("flex_left_rad", "rad", "truth", f"left antenna: {_FLEX}"),
        Column("flex_right_rad", "rad", "truth", f"right antenna: {_FLEX}"),
    ),
    "push": (
        Column("side", "1", "truth", "antenna that meets the post", "str"),
        Column("first_place_m", "m", "truth", "place that the straight antenna would meet"),
        Column("force_n", "N", "truth", "force of the post, mean over the last sample"),
        Column("flex_rad", "rad", "truth", _FLEX),
        Column("friction", "1", "truth", "friction of the antenna against the post"),
    ),
}


def joints_of(kind: Kind, robot: RobotSpec) -> tuple[str, ...]:
    """Names of the joints whose angles a file holds, in the order of the robot's joints."""
    names = robot.joint_names
    if kind == "walk":
        return names
    bases = tuple(name for name in names if name.endswith("_base"))
    return (robot.yaw_names[0], *bases) if kind == "push" else bases


def columns_of(kind: Kind, robot: RobotSpec) -> tuple[Column, ...]:
    """The columns of a file, in their order."""
    joints = (
        Column(name, "rad", "input", f"angle of the joint {name}", "float32", HISTORY)
        for name in joints_of(kind, robot)
    )
    labels = (Column(t.label, t.unit, "label", t.about) for t in TASKS if t.kind == kind)
    return (*_KEYS, *_COUNTS, *joints, *labels, *_TRUTH[kind], *_SETTING)


def joined(columns: tuple[Column, ...], parts: list[Windows]) -> Windows:
    """Windows of many episodes below one another, each column of its own type."""
    return {
        column.name: np.concatenate(
            [np.zeros((0, HISTORY) if column.size > 1 else 0), *(p[column.name] for p in parts)]
        ).astype(column.dtype)
        if column.dtype != "str"
        else np.array([text for part in parts for text in part[column.name]], dtype=str)
        for column in columns
    }
