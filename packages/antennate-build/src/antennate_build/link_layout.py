"""The sizes of a robot's links, all that follow from its description. Lengths are in mm.

A link's frame lies in its middle, at the height of its axles: x forward, y left, z up. The servos
of the legs lie along x, their horns outward. The yaw servo stands at the front, its shaft upright;
a hinge, an arm above and one below it, joins it to the link ahead. Where servos pitch the links,
the pitch servo lies at the rear of the link ahead and the joint is two hinges, back to back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from antennate.errors import ConfigError
from antennate.robots.spec import RobotSpec
from antennate_build.mounts import Mount, mount_of
from antennate_build.printing import PrintParams

PLATE = 3.0
"""Thickness of plates that carry servos [mm] (assumed: screws of the e-manual take 3 mm)."""
_ROOM = 1.3
"""Gap between a turning servo and the hinge about it [mm]."""
_LEG_ROOM = 2.0
"""Gap between legs and frame [mm]."""
CABIN = (64.0, 56.0, 18.0)
"""Inside of the cabin along x and y, and its height [mm]: an ESP32 board of 55 x 28 (ESP32-DevKitC,
Espressif), beside it a step-down converter of up to 51 x 22 [assumed]."""
BATTERY = (35.0, 72.0, 22.0)
"""Largest battery along x, y and z [mm]: usual size of three cells of 1.3 to 1.5 Ah (assumed)."""
TREAD = 1.5
"""Thickness of the tread of a leg [mm] (assumed: a ring of soft plastic, or of rubber)."""


@dataclass(frozen=True)
class LinkLayout:
    """Sizes of the links of one robot.

    Attributes:
        robot: What they are made from.
        print: How they are printed.
        leg: Case of the leg servos.
        yaw: Case of the yaw servos.
        pitch: Case of the pitch servos; None if pitch is locked.
        reach: From the axis of a joint to the inside of the web of its hinge [mm].
        axis: Place of the yaw axis at the front of a link along x [mm].
        rear: Place of the axis at its rear along x, that of the pitch servo or of the hinge [mm].
        wall: Place of the outside of the side walls, where leg servos lean [mm].
        floor: Lower side of the floor along z [mm].
        front: Front end of the floor [mm].
        back: Rear end of it [mm].
        deck: Lower side of the cabin along z, above what turns [mm].
        tray: Rear end of its tray along x, before what turns [mm].
    """

    robot: RobotSpec
    print: PrintParams
    leg: Mount
    yaw: Mount
    pitch: Mount | None
    reach: float
    axis: float
    rear: float
    wall: float
    floor: float
    front: float
    back: float
    deck: float
    tray: float

    @property
    def pitch_length(self) -> float:
        """Distance of the links' middles [mm]."""
        return 1e3 * self.robot.link_pitch


def part_names(layout: LinkLayout, antennae: bool) -> tuple[str, ...]:
    """Printed parts of the links of a robot."""
    frames = ("frame_head", *(("frame",) * (layout.robot.links > 2)), "frame_tail")
    pitch = ("hinge_pitch",) if layout.pitch is not None else ()
    head = ("cabin", "head_plate") if antennae else ()
    return (*frames, "hinge", *pitch, "leg", "tread", *head)


def link_layout(robot: RobotSpec, params: PrintParams, head: float = 0.0) -> LinkLayout:
    """Sizes of the links of a robot.

    Args:
        robot: The robot.
        params: How its links are printed.
        head: Height of the base servos of its antennae over the axles [mm].

    Raises:
        ConfigError: Its legs do not roll, the hole pattern of a servo is not known, or its servos
            do not fit into its links.
    """
    if robot.legs.kind != "rolling":
        raise ConfigError(
            f"robot.legs.kind: expected rolling legs, whose links are known, found "
            f"{robot.legs.kind}; `antennate build ROBOT --what antenna` builds its antenna alone"
        )
    leg = mount_of(robot.legs.servo, "robot.legs.servo")
    yaw = mount_of(robot.yaw.servo, "robot.yaw.servo")
    pitch = mount_of(robot.pitch.servo, "robot.pitch.servo") if robot.pitch_count else None
    for mount, where in ((leg, "legs"), (yaw, "yaw"), (pitch, "pitch")):
        if mount is not None and not mount.sides:
            raise ConfigError(
                f"robot.{where}.servo: expected a servo with holes in the sides of its case, such "
                f"as xc430_w240, found one with a case {mount.name}"
            )
    half = 500.0 * robot.link_pitch
    reach = max(_swing(m) for m in (yaw, pitch) if m is not None) + _ROOM
    offset = reach + PLATE if pitch else 0.0  # the two axes of a joint stand apart by twice that
    axis, rear = half - offset, -half + offset
    wall = 500.0 * robot.width - 1e3 * robot.leg_width - leg.horn.top + leg.z[0]
    layout = LinkLayout(
        robot=robot,
        print=params,
        leg=leg,
        yaw=yaw,
        pitch=pitch,
        reach=reach,
        axis=axis,
        rear=rear,
        wall=wall,
        floor=yaw.z[0] - 0.25,
        front=axis + yaw.y[1] - 3.0,
        back=rear - 2.0 if pitch else rear + reach + PLATE,
        deck=max(math.hypot(reach + PLATE, 14.0), head) + 1.0 if pitch else leg.x,
        tray=rear + pitch.horn.top + PLATE + 1.5 if pitch else leg.y[0],
    )
    _require_room(layout)
    return layout


def _swing(mount: Mount) -> float:
    """How far a case reaches from its shaft towards its near end."""
    return math.hypot(mount.x, mount.y[1])


def _require_room(layout: LinkLayout) -> None:
    """Refuse links whose servos do not fit."""
    robot, yaw, leg = layout.robot, layout.yaw, layout.leg
    rear = layout.rear - (layout.pitch.y[0] if layout.pitch else -layout.reach - 2.0 * PLATE)
    used = rear - (layout.axis + yaw.y[0] - PLATE) + 1.0
    if used > 0.0:
        least = 1e-3 * (layout.pitch_length + used)
        raise ConfigError(
            f"robot.link_pitch: expected at least {math.ceil(1e3 * least) / 1e3:g} m for links "
            f"with a servo of {yaw.length:g} mm for yaw"
            f"{' and one for pitch' * bool(layout.pitch)}, found {robot.link_pitch:g} m"
        )
    inside = max(yaw.x, layout.pitch.horn.top if layout.pitch else 0.0) + PLATE + 1.0
    if layout.wall - PLATE < inside:
        more = 2e-3 * (inside + PLATE - layout.wall)
        raise ConfigError(
            f"robot.width: expected at least {robot.width + more:.3f} m for leg servos of "
            f"{leg.z[1] - leg.z[0]:g} mm at both sides of the yaw servo, found {robot.width:g} m"
        )
    inner = 1e3 * robot.leg_radius - TREAD - PLATE
    hub = leg.horn.circle / 2.0 + leg.horn.screw.clearance / 2.0 + layout.print.wall_mm
    if 1e3 * robot.leg_eccentricity + hub > 1e3 * robot.leg_radius - TREAD:
        raise ConfigError(
            f"robot.leg_radius: expected a ring that holds the horn {hub:.1f} mm in radius, "
            f"{1e3 * robot.leg_eccentricity:g} mm off its middle, found {robot.leg_radius:g} m "
            f"with {inner:.1f} mm inside"
        )
