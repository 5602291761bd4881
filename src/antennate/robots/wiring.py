"""The wiring diagram of a robot: servos in plan on their bus, what feeds them, and the board."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from antennate import figures as style
from antennate.robots.servos import ServoParams
from antennate.robots.sides import SIDES
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.robots.supply import Supply, servos_of, supply

Place = tuple[float, float]

_PITCH, _SIDE, _RAIL, _GROUND = 2.5, 1.35, -2.55, -2.85
"""Distance of links, of legs from the middle, and heights of the two power lines, in boxes."""
_HEIGHT = 0.62
"""Of a box."""
_CONVERTER = -1.9
"""Height of the line of the lower voltage."""
_LEFT = -4.9
_DATA, _MAIN, _LOW = style.SERIES[0], "#C80000", "#FF8C00"
"""Blue, red and orange, as the legend calls them."""


@style.styled
def wiring(robot: RobotSpec) -> Figure:
    """The diagram; the order of the bus is that of the cable, head first."""
    power, places = supply(robot), _places(robot)
    left, right = _LEFT - 0.9, (robot.links - 1) * _PITCH + 0.8
    low, high = -3.4, 2.9
    figure = Figure(figsize=(0.8 * (right - left), 0.8 * (high - low)))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    servos = dict(zip(robot.joint_names, servos_of(robot), strict=True))
    order = _cable(robot)
    _bus(axes, [places[name] for name in order])
    _feeds(axes, robot, power, order, places, servos)
    for name, servo_id in zip(robot.joint_names, robot.ids, strict=True):
        kind = servos[name]
        colour = _MAIN if kind.voltage == power.rails[0].voltage else _LOW
        width = 0.9 if colour == _MAIN else 1.15
        _box(axes, places[name], f"{servo_id}  {name}\n{kind.product}", colour, width)
    _electronics(axes, power, bool(robot.antenna_count))
    _legend(axes, power)
    return figure


def _places(robot: RobotSpec) -> dict[str, Place]:
    """Where each joint stands in the picture, head to the left."""
    found: dict[str, Place] = {}
    for side, prefix, y in zip(SIDES, ANTENNA_PREFIXES, (0.7, -0.7), strict=True):
        for name in robot.joint_names:
            if name.startswith(prefix):
                found[name] = (-1.35, y)
            elif name.startswith(f"leg_{side}"):
                link = int(name.removeprefix(f"leg_{side}"))
                found[name] = (link * _PITCH, _SIDE if y > 0 else -_SIDE)
    shift = 0.4 if robot.pitch_count else 0.0
    for j in range(1, robot.links):
        found[f"yaw{j}"] = ((j - 0.5) * _PITCH, shift)
        found[f"pitch{j}"] = ((j - 0.5) * _PITCH, -shift)
    return found


def _cable(robot: RobotSpec) -> list[str]:
    """Joints in the order in which the cable reaches them."""
    names = robot.joint_names
    order = [name for prefix in ANTENNA_PREFIXES for name in names if name.startswith(prefix)]
    for link in range(robot.links):
        order += [f"{kind}{link}" for kind in ("yaw", "pitch") if f"{kind}{link}" in names]
        order += [f"leg_{side}{link}" for side in SIDES]
    return order


def _bus(axes: Axes, places: Sequence[Place]) -> None:
    start = (_LEFT + 2.05, 0.0)
    x, y = zip(start, *places, strict=True)
    axes.plot(x, y, color=_DATA, linewidth=1.6, zorder=1)


def _feeds(
    axes: Axes,
    robot: RobotSpec,
    power: Supply,
    order: Sequence[str],
    places: dict[str, Place],
    servos: dict[str, ServoParams],
) -> None:
    """The lines of both voltages and of ground, and where they reach the cable."""
    end = (robot.links - 1) * _PITCH
    main = [name for name in order if servos[name].voltage == power.rails[0].voltage]
    axes.plot([_LEFT, end], [_RAIL, _RAIL], color=_MAIN, linewidth=2.5, zorder=1)
    axes.plot([_LEFT, end], [_GROUND, _GROUND], color=style.INK, linewidth=2.5, zorder=1)
    _voltage(axes, (_LEFT + 0.1, _RAIL + 0.04), power.rails[0].voltage, _MAIN)
    for name in main[:: power.per_feed]:
        x, y = places[name]
        _feed(axes, (x - 0.64, _RAIL), (x, y + 0.1), _MAIN)
        _feed(axes, (x - 0.57, _GROUND), (x, y - 0.1), style.INK)
    for name in order:
        x, y = places[name]
        if servos[name].voltage != power.rails[0].voltage:
            _feed(axes, (x - 0.76, _CONVERTER), (x, y + 0.1), _LOW)
            _feed(axes, (x - 0.69, _GROUND), (x, y - 0.1), style.INK)


def _feed(axes: Axes, start: Place, end: Place, colour: str) -> None:
    """A wire that leaves a line upwards, then goes to the right."""
    (at, line), (x, y) = start, end
    axes.plot([at, at, x], [line, y, y], color=colour, linewidth=0.9, zorder=0)
    axes.plot([at], [line], "o", color=colour, markersize=4)


def _voltage(axes: Axes, place: Place, voltage: float, colour: str) -> None:
    """The voltage of a line, written on it."""
    x, y = place
    axes.text(x, y, f"{voltage:g} V", color=colour, fontsize=7, weight="bold", va="bottom")


def _box(axes: Axes, place: Place, text: str, colour: str, width: float) -> None:
    x, y = place
    shape = FancyBboxPatch(
        (x - width / 2, y - _HEIGHT / 2),
        width,
        _HEIGHT,
        boxstyle="round,pad=0.05",
        edgecolor=colour,
        facecolor="white",
        linewidth=1.3,
        zorder=2,
    )
    axes.add_patch(shape)
    axes.text(x, y, text, ha="center", va="center", fontsize=6.5, zorder=3)


def _electronics(axes: Axes, power: Supply, antennae: bool) -> None:
    """Battery, fuse, stop, converter and adapter at the left, and the board of the antennae."""
    main, ink = power.rails[0].voltage, style.INK
    x, mid, right = _LEFT, _LEFT + 0.0, _LEFT + 1.75
    for y, text, colour in (
        (2.4, f"battery {main:g} V\n{power.least_capacity:.1f} Ah or more", _MAIN),
        (1.3, f"fuse {power.fuse:g} A", _MAIN),
        (0.2, f"emergency stop\n{power.stall:.0f} A", _MAIN),
    ):
        _box(axes, (x, y), text, colour, 1.4)
    axes.plot([mid, mid], [2.4, _RAIL], color=_MAIN, linewidth=2.5, zorder=1)
    axes.plot([x - 0.8, x - 0.8, x], [2.4, _GROUND, _GROUND], color=ink, linewidth=2.5, zorder=1)
    axes.plot([x - 0.8, x - 0.7], [2.4, 2.4], color=ink, linewidth=2.5, zorder=1)
    _box(axes, (right, 0.0), "USB adapter\n(U2D2)", _DATA, 1.2)
    _box(axes, (right, 2.4), "computer", ink, 1.2)
    axes.plot([right, right], [0.0, 2.4], color=_DATA, linewidth=1.6, zorder=1)
    if antennae:
        _board(axes, right)
    for rail in power.rails[1:]:
        at, text = right - 0.15, f"converter {rail.voltage:g} V\n{rail.stall:.1f} A"
        _box(axes, (at, _CONVERTER), text, _LOW, 1.3)
        axes.plot([at, at], [_RAIL, _CONVERTER], color=_MAIN, linewidth=1.4, zorder=1)
        axes.plot([at, -2.11], [_CONVERTER, _CONVERTER], color=_LOW, linewidth=1.4, zorder=1)
        _voltage(axes, (-2.56, _CONVERTER + 0.06), rail.voltage, _LOW)
        axes.plot([at + 0.4] * 2, [_GROUND, _CONVERTER], color=ink, linewidth=0.9, zorder=0)
        axes.plot([at + 0.4], [_GROUND], "o", color=ink, markersize=4)


def _board(axes: Axes, x: float) -> None:
    """The board of the antennae and their dividers, right of the computer at x."""
    ink = style.INK
    _box(axes, (x + 1.8, 2.4), "ESP32 board\n3V3, GPIO34, 35", ink, 1.4)
    _box(axes, (x + 4.0, 2.4), "two dividers:\nflex sensor above,\nresistor to ground", ink, 1.7)
    axes.plot([x, x + 4.0], [2.4, 2.4], color=ink, linewidth=1.0, zorder=1)
    axes.plot([x + 0.85, x + 0.85], [2.4, _GROUND], color=ink, linewidth=0.9, zorder=0)
    axes.plot([x + 0.85], [_GROUND], "o", color=ink, markersize=4)


def _legend(axes: Axes, power: Supply) -> None:
    main, *others = power.rails
    lines = [f"red: {main.voltage:g} V, a feed for each {power.per_feed} servos of the chain"]
    lines += [
        f"orange: {rail.voltage:g} V; {main.voltage:g} V destroys the servos on it: no wire of the "
        "supply between the two"
        for rail in others
    ]
    lines += ["blue: data of the servo bus", "black: ground, common to all"]
    axes.text(_LEFT - 0.8, -3.05, "     ".join(lines), fontsize=7, color=style.MUTED, va="top")
