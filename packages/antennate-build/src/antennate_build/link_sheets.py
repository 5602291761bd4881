"""The sheet of a link, and the picture of a robot."""

from __future__ import annotations

from matplotlib.figure import Figure

from antennate import figures as style
from antennate_build import kernel, sheet
from antennate_build.checks import Named
from antennate_build.link_layout import PLATE
from antennate_build.robot_assembly import RobotSolids
from antennate_build.sheet import View

COLOURS = {
    "servo": "#7B838D",
    "hinge": "#CFE0F2",
    "battery": "#F0C27B",
    "leg": "#CFE8D2",
    "tread": "#5A5A5A",
    "cabin": "#F2D0D0",
    "head": "#E0D3EC",
}
"""Colours by the first word of a part's name; all others are those of printed parts."""
_ABOVE = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
_SIDE = ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
_FRONT = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def colour(name: str) -> str:
    """Colour of a part."""
    word = name.replace("_", " ").partition(" ")[0]
    return COLOURS.get(word, "#F6E3C5")


@style.styled
def link_sheet(robot: RobotSolids) -> Figure:
    """A link with its servos from three sides, with its sizes and its hinge."""
    layout, spec = robot.layout, robot.layout.robot
    notes = (
        "3 : 4; servos grey",
        f"{layout.print.material.upper()}, plates {PLATE:g}",
        f"holes: {layout.leg.source.partition(';')[0]}",
    )
    figure, axes = sheet.new(sheet.A3, "Link", notes)
    scale, number = 0.75, min(1, spec.links - 1)
    parts = [*robot.link(number), *robot.legs()]
    views = {
        "from above": ((115.0, 205.0), _ABOVE),
        "from the right": ((115.0, 85.0), _SIDE),
        "from the front": ((290.0, 85.0), _FRONT),
    }
    for words, (at, seen) in views.items():
        View(axes, at, scale, *seen).draw(kernel.together([solid for _, solid in parts]))
        sheet.text(
            axes,
            (14.0, at[1] + 70.0 - 22.0 * (at[1] < 100)) if at[0] < 200 else (220.0, at[1] + 48.0),
            words,
            weight="bold",
        )
    above, side, front = (View(axes, at, scale, *seen) for at, seen in views.values())
    half, out = layout.pitch_length / 2.0, 500.0 * spec.width
    above.length(
        (-half, -out, 0), (half, -out, 0), (0, -14), f"{layout.pitch_length:g} from joint to joint"
    )
    above.length((half, -out, 0), (half, out, 0), (26, 0), f"{2 * out:g}")
    above.length((layout.axis, 0, 0), (0, 0, 0), (0, 38), f"{layout.axis:.1f} to the yaw axis")
    side.length(
        (half + 12, 0, layout.floor),
        (half + 12, 0, layout.leg.x),
        (8, 0),
        f"{layout.leg.x - layout.floor:.2f}",
    )
    low = -1e3 * (spec.leg_radius + spec.leg_eccentricity)
    side.length((-half, 0, low), (-half, 0, 0), (-10, 0), f"{-low:g}")
    front.length(
        (0, -layout.wall, layout.floor),
        (0, layout.wall, layout.floor),
        (0, -22),
        f"{2 * layout.wall:g} between leg servos",
    )
    oblique = View(axes, (305.0, 195.0), 0.55, (0.55, -0.6, 0.6), (0.0, 0.0, 1.0))
    oblique.scene([(solid, colour(name)) for name, solid in parts], 5.0)
    return figure


def shaded(parts: list[Named]) -> Figure:
    """The robot as one sees it, straight."""
    view, figure = sheet.picture(9.0, 5.0, ((0.55, 0.6, 0.6), (0.0, 0.0, 1.0)))
    view.scene([(solid, colour(name)) for name, solid in parts], 9.0)
    return figure
