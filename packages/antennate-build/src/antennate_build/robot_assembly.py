"""A robot put together: where parts and servos of its links stand, and what meets when."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from antennate_build import checks, kernel, link_parts
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.checks import Check, Meeting, Named, Up
from antennate_build.kernel import Solid
from antennate_build.link_layout import LinkLayout, part_names
from antennate_build.mounts import Mount

QUARTER = math.pi / 2.0
YAWS, PITCHES = 7, 9
"""Angles of the joints between links that are tried, from one limit to the other."""


@dataclass(frozen=True)
class RobotSolids:
    """The parts of a robot's links, each in its own frame, and how they go together.

    Attributes:
        layout: Sizes.
        base: Base servo of the antennae; None without antennae.
        horn: Height of the face of its horn over the plane of the antennae [mm].
    """

    layout: LinkLayout
    base: Mount | None
    horn: float = 0.0

    @cached_property
    def printed(self) -> dict[str, Solid]:
        """Printed parts by name."""
        layout = self.layout
        parts = {
            "frame_head": link_parts.frame(layout, first=True, last=False),
            "frame": link_parts.frame(layout, first=False, last=False),
            "frame_tail": link_parts.frame(layout, first=False, last=True),
            "hinge": link_parts.hinge(layout.yaw, layout.reach),
            "leg": link_parts.leg(layout),
            "tread": link_parts.tread(layout),
        }
        if layout.pitch is not None:
            parts["hinge_pitch"] = link_parts.hinge(layout.pitch, layout.reach)
        if self.base is not None:
            parts["cabin"] = link_parts.cabin(layout)
            parts["head_plate"] = link_parts.head_plate(layout, self.base, self.horn)
        return {name: parts[name] for name in part_names(layout, self.base is not None)}

    @property
    def counts(self) -> dict[str, int]:
        """How many of each printed part."""
        robot, joints = self.layout.robot, self.layout.robot.links - 1
        known = {
            "frame": robot.links - 2,
            "hinge": joints,
            "hinge_pitch": joints,
            "leg": robot.leg_count,
            "tread": robot.leg_count,
        }
        return {name: known.get(name, 1) for name in self.printed}

    def link(self, number: int) -> list[Named]:
        """Parts and servos of a link in its frame, without legs; its hinge at the rear is one."""
        layout, last = self.layout, self.layout.robot.links - 1
        name = "frame_head" if number == 0 else "frame_tail" if number == last else "frame"
        leg = _upright(link_parts.servo(layout.leg), layout.leg)
        left = kernel.moved(leg, (0.0, layout.wall - layout.leg.z[0], 0.0))
        parts: list[Named] = [(name, self.printed[name]), ("servo leg_left", left)]
        parts.append(("servo leg_right", kernel.mirrored(left, "y")))
        if number:
            yaw = kernel.turned(link_parts.servo(layout.yaw), -QUARTER)
            parts.append(("servo yaw", kernel.moved(yaw, (layout.axis, 0.0, 0.0))))
        elif self.base is not None:
            parts.append(("cabin", self.printed["cabin"]))
            parts.append(("head_plate", self.printed["head_plate"]))
            parts += self._bases()
        if number == last:
            parts.append(("battery", link_parts.battery(layout)))
        if number < last and layout.pitch is None:
            parts.append(("hinge", kernel.moved(self.printed["hinge"], (layout.rear, 0.0, 0.0))))
        elif number < last and layout.pitch is not None:
            pitch = _upright(link_parts.servo(layout.pitch), layout.pitch, forward=True)
            parts.append(("servo pitch", kernel.moved(pitch, (layout.rear, 0.0, 0.0))))
        return parts

    def bodies(self, number: int) -> list[Named]:
        """Parts and servos that move with a link, in its frame: what joins it to the one ahead."""
        joint = self.joint() if number else []
        away = self.layout.pitch_length
        return [*self.link(number), *((n, kernel.moved(s, (away, 0.0, 0.0))) for n, s in joint)]

    def _bases(self) -> list[Named]:
        """Base servos of the antennae, upside down."""
        assert self.base is not None  # noqa: S101 the caller looked
        robot = self.layout.robot
        place, apart = 500.0 * robot.link_pitch, 500.0 * robot.antenna.base_spacing
        solid = kernel.turned(link_parts.servo(self.base), math.pi, "x")
        solid = kernel.turned(solid, QUARTER)
        up = self.horn + self.base.horn.top
        return [
            (f"servo antenna_{side}", kernel.moved(solid, (place, sign * apart, up)))
            for side, sign in (("left", 1.0), ("right", -1.0))
        ]

    def joint(self, pitch: float = 0.0) -> list[Named]:
        """The two hinges of a joint that servos pitch, in the frame of the link ahead of it."""
        layout = self.layout
        if layout.pitch is None:
            return []
        ahead = kernel.turned(self.printed["hinge_pitch"], -QUARTER, "x")
        ahead = kernel.moved(kernel.turned(ahead, math.pi, "y"), (layout.rear, 0.0, 0.0))
        place = layout.axis - layout.pitch_length
        behind = kernel.moved(self.printed["hinge"], (place, 0.0, 0.0))
        about = (layout.rear, 0.0, 0.0)
        parts = (("hinge_pitch", ahead), ("hinge", behind))
        return [(name, kernel.turned(solid, pitch, "y", about)) for name, solid in parts]

    def legs(self, angle: float = 0.0) -> list[Named]:
        """Legs with their treads in the frame of a link."""
        parts: list[Named] = []
        out = self.layout.wall - self.layout.leg.z[0] + self.layout.leg.horn.top
        for name in ("leg", "tread"):
            solid = kernel.turned(self.printed[name], angle)
            solid = kernel.turned(kernel.turned(solid, -QUARTER, "x"), math.pi, "y")
            left = kernel.moved(solid, (0.0, out, 0.0))
            parts += [(name, left), (name, kernel.mirrored(left, "y"))]
        return parts

    def swept(self) -> list[Named]:
        """All that the legs of a link may touch as they turn."""
        robot = self.layout.robot
        radius = 1e3 * (robot.leg_radius + robot.leg_eccentricity)
        out, width = 500.0 * robot.width, 1e3 * robot.leg_width
        left = kernel.rod(radius, (0.0, out, 0.0), -width, "y")
        return [("leg", left), ("leg", kernel.mirrored(left, "y"))]

    def behind(self, parts: list[Named], yaw: float, pitch: float = 0.0) -> list[Named]:
        """Parts of a link in the frame of the link ahead, at angles of the joint between."""
        layout, put = self.layout, []
        for name, solid in parts:
            moved = kernel.turned(solid, yaw, "z", (layout.axis, 0.0, 0.0))
            moved = kernel.moved(moved, (-layout.pitch_length, 0.0, 0.0))
            put.append((name, kernel.turned(moved, pitch, "y", (layout.rear, 0.0, 0.0))))
        return put

    def whole(self) -> list[Named]:
        """The robot, straight, in the frame of its head; without antennae."""
        parts: list[Named] = []
        for n in range(self.layout.robot.links):
            own = [*self.link(n), *self.legs(0.9 * n)]
            own += self.joint() if n < self.layout.robot.links - 1 else []
            away = -n * self.layout.pitch_length
            parts += [(name, kernel.moved(solid, (away, 0.0, 0.0))) for name, solid in own]
        return parts


def up_of(part: str) -> Up:
    """Direction of a part's frame that points up while it is printed."""
    if part.startswith("hinge"):
        return "-x"
    return {"cabin": "x", "head_plate": "-z"}.get(part, "z")  # pyright: ignore[reportReturnType]


def _upright(servo: Solid, mount: Mount, forward: bool = False) -> Solid:
    """A servo whose shaft points to the left, its case backward, or forward."""
    solid = kernel.turned(servo, -QUARTER, "x")
    return kernel.turned(solid, QUARTER if forward else -QUARTER, "y")


def at_head(robot: RobotSolids, antenna: AntennaSolids, turn: float = 0.0) -> list[Named]:
    """Both antennae, straight, in the frame of the head.

    Args:
        robot: The links.
        antenna: The antenna.
        turn: Angle of both bases from their mounting angle, outwards [rad].
    """
    spec = robot.layout.robot
    place, apart = 500.0 * spec.link_pitch, 500.0 * spec.antenna.base_spacing
    parts: list[Named] = []
    for side, sign in ((0, 1.0), (1, -1.0)):
        hung = antenna.hung(side, sign * (spec.antenna.base_angle + turn))
        where = (place, sign * apart, 0.0)
        parts += [(part.part, kernel.moved(part.solid, where)) for part in hung]
    return parts


def base_check(robot: RobotSolids, antenna: AntennaSolids) -> tuple[Check, str, float | None]:
    """Antennae and head at angles of the base servos, what limits these, and where [rad].

    Antennae that lie along the body may meet the leg servos before the limit of their bases.
    """
    limit, head = robot.layout.robot.antennae.limit, robot.link(0)
    good: list[Meeting] = []
    free, told, least = limit, "", None
    for share in np.linspace(0.0, 1.0, YAWS):
        found = [
            each
            for turn in {-limit * share, limit * share}
            for each in checks.between(
                head, at_head(robot, antenna, float(turn)), f"at {math.degrees(turn):.0f} deg"
            )
        ]
        worst = checks.worst(found)
        if worst is not None and worst.volume > checks.LARGEST_OVERLAP and share > 0.0:
            free = least = limit * (share - 1.0 / (YAWS - 1))
            told = (
                f"Bases: {' and '.join(worst.parts)} meet {worst.where}; robot.toml limits them to "
                f"{math.degrees(free):.0f} deg in place of {math.degrees(limit):.0f}."
            )
            break
        good += found
    name = f"antennae and head, bases up to {math.degrees(free):.0f} deg either way"
    return checks.judged(name, good), told, least


def robot_checks(robot: RobotSolids, tick: Callable[[], object]) -> list[Check]:
    """Parts of a link among each other, and two links at every angle of the joint between."""
    layout, last = robot.layout, robot.layout.robot.links - 1
    found = []
    for n in sorted({0, 1, last}):
        own = robot.link(n)
        meetings = [
            Meeting(checks.overlap(a, b), (x, y), "")
            for i, (x, a) in enumerate(own)
            for y, b in own[i + 1 :]
        ]
        meetings += list(checks.between(own, robot.swept(), "as it turns"))
        name = "head" if n == 0 else "tail" if n == last else "link"
        found.append(checks.judged(f"parts of the {name}, legs turning", meetings))
        tick()
    limit = layout.robot.yaw_limit
    found.append(_joint(robot, "yaw", limit, YAWS))
    tick()
    if layout.pitch is not None:
        found.append(_joint(robot, "pitch", layout.robot.pitch.limit, PITCHES))
        tick()
    return found


def _joint(robot: RobotSolids, name: str, limit: float, angles: int) -> Check:
    """Two links at angles of one joint between them."""
    ahead = [*robot.link(0), *robot.swept()]
    behind = [*robot.link(robot.layout.robot.links - 1), *robot.swept()]
    meetings: list[Meeting] = []
    for angle in np.linspace(-limit, limit, angles):
        turn = {"yaw": (float(angle), 0.0), "pitch": (0.0, float(angle))}[name]
        where = f"at {math.degrees(angle):.0f} deg"
        there = robot.behind(behind, *turn)
        joint = robot.joint(turn[1])
        meetings += checks.between(ahead, joint, where)
        meetings += checks.between([*ahead, *joint], there, where)
    degrees = math.degrees(limit)
    return checks.judged(f"two links, {name} up to {degrees:.0f} deg either way", meetings)
