"""What hands do to put an antenna together, in order; the file assembly.md and its sheet say it."""

from __future__ import annotations

from collections.abc import Sequence

from antennate_build import antenna_parts
from antennate_build.layout import STRIPS, AntennaLayout
from antennate_build.mounts import Mount


def antenna_steps(layout: AntennaLayout, mount: Mount, roll: float = 0.0) -> tuple[str, ...]:
    """Steps from printed parts and springs to an antenna on its servo."""
    hinge, count = layout.hinge, layout.antenna.hinges
    screws = len(antenna_parts.screw_places(mount, roll))
    screw = mount.horn.screw.name.partition(" M")[2]
    thickness = STRIPS[layout.antenna.sensor.kind][1]
    sensor = "flex sensor" if layout.antenna.sensor.kind == "flex" else "pressure strip"
    last = "pins" if count > 1 else "pin"
    return (
        f"Clear the holes of the legs with a drill of {hinge.leg_hole:.1f} mm, those of the pins "
        f"with {hinge.pin + layout.print.play_mm:.1f} mm (inner arms: a pin turns freely) and "
        f"{hinge.pin:.1f} mm (outer arms: it sits tight).",
        f"Screw the bracket onto the horn with {screws} screws M{screw} x "
        f"{antenna_parts.SCREW_LENGTH:g}; the servo is at its zero and the arms point along the antenna.",
        "Push the lower leg of the stiffest spring into the hole of the bracket, up to the coil.",
        "Slide segment 1 onto the upper leg, its inner arms between those of the bracket.",
        "Push a pin from above through arms and spring, its flat towards the legs.",
        f"So go on with springs and segments up to the tip; segment and spring {count} are last."
        if count > 1
        else "Bend the hinge by hand to both stops.",
        f"Bend each hinge by hand to both stops. It comes back by itself; a drop of glue at the "
        f"lower end keeps the {last}.",
        f"Lay the {sensor} ({thickness:g} mm thick) onto the arms, its contacts over the bracket, "
        "and slide a cover below the lips of each pair of posts. It must slide when a hinge bends.",
        "Fix the contacts of the sensor at the bracket with a drop of glue; lead its wires along "
        "the servo with a loop of 30 mm.",
    )


def as_markdown(title: str, steps: Sequence[str]) -> str:
    """A page with numbered steps."""
    lines = [f"{n}. {step}" for n, step in enumerate(steps, 1)]
    return "\n".join([f"# {title}", "", *lines, ""])
