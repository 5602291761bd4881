"""What hands do to put an antenna together, in order; the file assembly.md and its sheet say it."""

from __future__ import annotations

from collections.abc import Sequence

from antennate_build import flange
from antennate_build.layout import STRIPS, AntennaLayout, segment_names
from antennate_build.link_layout import BATTERY, LinkLayout
from antennate_build.mounts import Mount


def antenna_steps(layout: AntennaLayout, mount: Mount) -> tuple[str, ...]:
    """Steps from printed parts and springs to an antenna on its servo."""
    hinge, count = layout.hinge, layout.antenna.hinges
    screws = len(flange.screw_places(mount, layout.antenna.roll))
    screw = mount.horn.screw.name.partition(" M")[2]
    thickness = STRIPS[layout.antenna.sensor.kind][1]
    sensor = "flex sensor" if layout.antenna.sensor.kind == "flex" else "pressure strip"
    last = "pins" if count > 1 else "pin"
    names = segment_names(layout)
    alike = "".join(
        f" Segment {n} is one more print of {name}."
        for n, name in enumerate(names, 1)
        if name in names[: n - 1]
    )
    return (
        f"Clear the holes of the legs with a drill of {hinge.leg_hole:.1f} mm, those of the pins "
        f"with {hinge.pin + layout.print.play_mm:.1f} mm (inner arms: a pin turns freely) and "
        f"{hinge.pin:.1f} mm (outer arms: it sits tight).",
        f"Screw the bracket onto the horn with {screws} screws M{screw} x "
        f"{flange.SCREW_LENGTH:g}, its arms along the antenna while the servo is at its zero.",
        "Push the lower leg of the stiffest spring into the hole of the bracket, up to the coil.",
        "Slide segment 1 onto the upper leg, its inner arms between those of the bracket.",
        "Push a pin from above through arms and spring, its flat towards the legs.",
        "So go on with springs and segments up to the tip; segment and spring "
        f"{count} are last.{alike}"
        if count > 1
        else "Bend the hinge by hand to both stops.",
        f"Bend each hinge by hand to both stops. It comes back by itself; a drop of glue at the "
        f"lower end keeps the {last}.",
        f"Lay the {sensor} ({thickness:g} mm thick) onto the arms, its contacts over the bracket, "
        "and slide a cover below the lips of each pair of posts. It must slide when a hinge bends.",
        "Fix the contacts of the sensor at the bracket with a drop of glue; lead its wires along "
        "the servo with a loop of 30 mm.",
    )


def link_steps(layout: LinkLayout, base: Mount | None) -> tuple[str, ...]:
    """Steps from printed frames and servos to a robot, tail first."""
    robot, leg, size = layout.robot, layout.leg, " x ".join(f"{edge:g}" for edge in BATTERY)
    joint = (
        "bolt a hinge to the rear wall of the link ahead with four M3 x 10"
        if layout.pitch is None
        else "bolt hinge and hinge_pitch together, web to web, with four M3 x 10, and put "
        "hinge_pitch onto the pitch servo of the link ahead"
    )
    pitch = (
        ()
        if layout.pitch is None
        else (
            "Screw a pitch servo onto the floor of each link but the tail, from below, its shaft "
            "across and behind.",
        )
    )
    head = (
        ()
        if base is None
        else (
            "Screw both base servos into the head plate, horns down, and bolt the plate to the "
            "front wall of the head with eight M3 x 10. The antennae hang below, upside down.",
            "Lay ESP32 and converter into the cabin; its flaps go under the upper screws of the "
            "leg servos of the head, which are 8 mm long there.",
        )
    )
    return (
        "Set the ids of all servos with `antennate setup` before they are built in.",
        f"Screw two leg servos to the side walls of each of the {robot.links} frames from inside, "
        f"{len(leg.back)} screws each; their long ends point backward, their plugs to the gap.",
        "Push a yaw servo into the cradle of each frame but the head, its horn up, and screw it "
        "from both sides.",
        *pitch,
        f"At each joint {joint}; then screw the arms of the hinge to horn and idler of the yaw "
        "servo behind.",
        "Pull a tread over each leg and screw the leg onto its horn; all rings point down at zero.",
        f"Lay the battery, at most {size} mm, across the floor of the tail behind its yaw servo; a "
        "cable tie through the slots at both sides holds it and the fuse.",
        "Lead the cables along the floor through the holes of the hinges, with a loop at each "
        "joint, and tie them at the slots.",
        *head,
    )


def as_markdown(title: str, steps: Sequence[str]) -> str:
    """A page with numbered steps."""
    lines = [f"{n}. {step}" for n, step in enumerate(steps, 1)]
    return "\n".join([f"# {title}", "", *lines, ""])
