"""The wiring diagram of a robot: servos in plan on their bus, what feeds them, and the board."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from antennate import figures as style
from antennate.robots.antenna import BASE
from antennate.robots.parts import Supply, supply
from antennate.robots.servos import ServoParams
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.types import SIDES

Place = tuple[float, float]

_ROW = 0.56
"""Distance from a row of servos to the next; all lengths are in inches."""
_LEFT, _MIDDLE, _RIGHT = 1.2, 2.45, 3.7
"""Columns of servos."""
_GROUND, _RAIL = 0.1, 0.25
"""Places of the two power lines."""
_SUPPLY, _ADAPTER, _BOARD = 0.9, 2.15, 3.6
"""Columns above the servos: battery to converter, computer and adapter, antenna board."""
_TOP, _STEP = -0.35, 0.72
"""Height of the first boxes above the servos, and from one to the next."""
_ANTENNAE, _CONVERTER, _FIRST = -2.8, -3.3, -3.95
"""Heights of the antennae's servos, of the converter and of the first row of legs."""
_ASIDE, _WIDE = 3.69, 1.36
"""Column of the right antenna's servos where there are two rows, and width of their boxes."""
_HEIGHT, _LETTERS = 0.3, 8
"""Height of a box, and of its letters [points]."""
_DATA, _MAIN, _LOW = style.SERIES[0], "#C80000", "#FF8C00"
"""Blue, red and orange, as the legend calls them."""


@style.styled
def wiring(robot: RobotSpec) -> Figure:
    """The diagram; the order of the bus is that of the cable, head first."""
    power, places = supply(robot), _places(robot)
    end = _FIRST - _lower(robot) - 2 * (robot.links - 1) * _ROW if robot.leg_count else _CONVERTER
    legend = _told(power)
    low = end - 0.5 - 0.16 * legend.count("\n") - 0.2
    figure = Figure(figsize=(style.WIDTH, -low))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, style.WIDTH)
    axes.set_ylim(low, 0.0)
    servos = dict(zip(robot.joint_names, robot.joint_servos, strict=True))
    order = _cable(robot)
    _bus(axes, [places[name] for name in order])
    converter = _CONVERTER - _lower(robot)
    _feeds(axes, power, order, places, servos, converter)
    for name, servo_id in zip(robot.joint_names, robot.ids, strict=True):
        kind = servos[name]
        colour = _MAIN if kind.voltage == power.rails[0].voltage else _LOW
        width = (
            0.92
            if not name.startswith(ANTENNA_PREFIXES)
            else _WIDE
            if robot.elevation_count
            else 1.24
        )
        _box(axes, places[name], f"{servo_id}  {name}\n{kind.product}", colour, width)
    _electronics(axes, power, robot, converter)
    axes.text(0.1, end - 0.45, legend, fontsize=_LETTERS, va="top", linespacing=1.4)
    return figure


def _lower(robot: RobotSpec) -> float:
    """How much lower all below the first row of antenna servos stands than without a second one."""
    return _ROW if robot.elevation_count else 0.0


def _places(robot: RobotSpec) -> dict[str, Place]:
    """Where each joint stands in the picture, head to the top."""
    places: dict[str, Place] = {}
    lower = _lower(robot)
    first, columns = _FIRST - lower, (_ADAPTER, _BOARD if not lower else _ASIDE)
    for side, prefix, column in zip(SIDES, ANTENNA_PREFIXES, columns, strict=True):
        for name in robot.joint_names:
            if name.startswith(prefix):
                row = _ANTENNAE - (lower if name.endswith(BASE) else 0.0)
                places[name] = (column, row)
            elif name.startswith(f"leg_{side}"):
                link = int(name.removeprefix(f"leg_{side}"))
                places[name] = (_LEFT if side == SIDES[0] else _RIGHT, first - 2 * link * _ROW)
    shift = 0.57 if robot.pitch_count else 0.0
    for j in range(1, robot.links):
        places[f"yaw{j}"] = (_MIDDLE - shift, first - (2 * j - 1) * _ROW)
        places[f"pitch{j}"] = (_MIDDLE + shift, first - (2 * j - 1) * _ROW)
    return places


def _cable(robot: RobotSpec) -> list[str]:
    """Joints in the order in which the cable reaches them.

    Of the antennae first what stands on the head, then what that carries, back from the right.
    """
    names = robot.joint_names
    bases = [name for name in names if name.endswith(BASE)]
    order = [*robot.elevation_names, *(reversed(bases) if robot.elevation_count else bases)]
    for link in range(robot.links):
        order += [f"{kind}{link}" for kind in ("yaw", "pitch") if f"{kind}{link}" in names]
        order += [name for side in SIDES if (name := f"leg_{side}{link}") in names]
    return order


def _bus(axes: Axes, places: Sequence[Place]) -> None:
    """The cable from the adapter on; it enters the first servo from above, beside its feed."""
    (x, y), *_ = places
    way = [(_ADAPTER, y)] if x == _ADAPTER else []
    way = way or [(_ADAPTER, y + 0.4), (x + 0.35, y + 0.4), (x + 0.35, y)]
    x, y = zip((_ADAPTER, _TOP - _STEP), *way, *places, strict=True)
    axes.plot(x, y, color=_DATA, linewidth=1.6, zorder=1)


def _feeds(
    axes: Axes,
    power: Supply,
    order: Sequence[str],
    places: dict[str, Place],
    servos: dict[str, ServoParams],
    converter: float,
) -> None:
    """The lines of both voltages and of ground, and where they reach the cable."""
    end, below = min(y for _, y in places.values()) + 0.24, _TOP - 2 * _STEP - 0.35
    _line(axes, [(_SUPPLY, _TOP), (_SUPPLY, below), (_RAIL, below), (_RAIL, end)], _MAIN, 2.5)
    _line(axes, [(_SUPPLY, _TOP), (_GROUND, _TOP), (_GROUND, end)], style.INK, 2.5)
    _voltage(axes, (_RAIL + 0.06, below - 0.2), power.rails[0].voltage, _MAIN)
    main = [name for name in order if servos[name].voltage == power.rails[0].voltage]
    for name in main[:: power.per_feed]:
        _feed(axes, _RAIL, places[name], _MAIN)
    for name in [*main[:: power.per_feed], *(name for name in order if name not in main)]:
        _feed(axes, _GROUND, places[name], style.INK)
    aside = 0.0 if converter == _CONVERTER else 0.4  # beside the cable between two rows
    for x, y in ((places[name][0] + aside, places[name][1]) for name in order if name not in main):
        _line(axes, [(_SUPPLY, converter), (x, converter), (x, y)], _LOW, 1.4)


def _feed(axes: Axes, line: float, place: Place, colour: str) -> None:
    """A wire that leaves a power line to the right, then goes down to a servo."""
    x, y = place
    aside, above = (0.1, 0.29) if line == _RAIL else (-0.1, 0.24)
    _line(axes, [(line, y + above), (x + aside, y + above), (x + aside, y)], colour, 0.9)
    _joint(axes, (line, y + above), colour)


def _line(axes: Axes, places: Sequence[Place], colour: str, width: float) -> None:
    x, y = zip(*places, strict=True)
    axes.plot(x, y, color=colour, linewidth=width, zorder=1 if width > 1 else 0)


def _joint(axes: Axes, place: Place, colour: str) -> None:
    axes.plot(*place, "o", color=colour, markersize=4)


def _voltage(axes: Axes, place: Place, voltage: float, colour: str) -> None:
    """The voltage of a line, written beside it."""
    x, y = place
    axes.text(x, y, f"{voltage:g} V", color=colour, fontsize=_LETTERS, weight="bold", va="bottom")


def _box(
    axes: Axes, place: Place, text: str, colour: str, width: float, height: float = _HEIGHT
) -> None:
    x, y = place
    shape = FancyBboxPatch(
        (x - width / 2, y - height / 2),
        width,
        height,
        boxstyle="round,pad=0.04",
        edgecolor=colour,
        facecolor="white",
        linewidth=1.3,
        zorder=2,
    )
    axes.add_patch(shape)
    axes.text(x, y, text, ha="center", va="center", fontsize=_LETTERS, zorder=3)


def _electronics(axes: Axes, power: Supply, robot: RobotSpec, converter: float) -> None:
    """Battery, fuse, stop, converter and adapter above, and the board of the antennae."""
    main = power.rails[0].voltage
    battery = f"battery {main:g} V\n{power.least_capacity:.1f} Ah or more\ncan feed a stall"
    for step, text in enumerate(
        (
            battery if power.on_cells else f"supply {main:g} V\n{power.stall:.1f} A or more",
            f"fuse {power.fuse:g} A",
            f"emergency stop\n{power.stall:.2g} A",
        )
    ):
        height = 0.42 if "\n" in text.partition("\n")[2] else _HEIGHT
        _box(axes, (_SUPPLY, _TOP - step * _STEP), text, _MAIN, 1.06, height)
    _line(axes, [(_ADAPTER, _TOP), (_ADAPTER, _TOP - _STEP)], _DATA, 1.6)
    _box(axes, (_ADAPTER, _TOP), "computer", style.INK, 0.9)
    _box(axes, (_ADAPTER, _TOP - _STEP), "USB adapter\n(U2D2)", _DATA, 0.9)
    if robot.antenna_count:
        _board(axes, robot.has_imu, robot.antenna_count)
    for rail in power.rails[1:]:
        text = f"converter {rail.voltage:g} V\n{rail.stall:.1f} A"
        _box(axes, (_SUPPLY, converter), text, _LOW, 1.0)
        for line, y, colour in ((_RAIL, 0.07, _MAIN), (_GROUND, -0.07, style.INK)):
            _line(axes, [(line, converter + y), (_SUPPLY, converter + y)], colour, 1.4)
            _joint(axes, (line, converter + y), colour)
        _voltage(axes, (_SUPPLY + 0.62, converter + 0.04), rail.voltage, _LOW)
        _warning(axes, main, rail.voltage, 0.26 if robot.has_imu else 0.0)


def _board(axes: Axes, imu: bool, antennae: int) -> None:
    """The board of the antennae, and what hangs on it, right of the computer."""
    ink, above = style.INK, _TOP + 0.27
    _line(axes, [(_ADAPTER, _TOP), (_BOARD, _TOP), (_BOARD, _TOP - _STEP)], ink, 1.1)
    _line(axes, [(_BOARD, _TOP), (_BOARD, above), (_GROUND, above), (_GROUND, _TOP)], ink, 0.9)
    _joint(axes, (_GROUND, _TOP), ink)
    _box(
        axes,
        (_BOARD, _TOP),
        f"antenna board (ESP32)\n3V3, GPIO34{', 35' * (antennae > 1)}",
        ink,
        1.38,
    )
    dividers = "two dividers" if antennae > 1 else "divider"
    dividers += ":\nflex sensor above,\nresistor to ground"
    _box(axes, (_BOARD, _TOP - _STEP), dividers, ink, 1.2, 0.42)
    if imu:
        beside, sensor = _BOARD + 0.67, _TOP - 1.85 * _STEP
        _line(axes, [(beside, _TOP), (beside, sensor)], ink, 1.1)
        _box(axes, (_BOARD, sensor), "inertial sensor\n3V3, GPIO21, 22", ink, 1.38)


def _warning(axes: Axes, high: float, low: float, lower: float) -> None:
    """What must not be joined, in letters that nobody overlooks, below what hangs on the board."""
    axes.text(
        (_ADAPTER + style.WIDTH) / 2,
        (_TOP - _STEP + _ANTENNAE) / 2 - 0.05 - lower,
        f"{high:g} V destroys the\n{low:g} V servos (orange). No\nsupply wire between them!",
        ha="center",
        va="center",
        fontsize=_LETTERS + 1,
        weight="bold",
        color="white",
        bbox={"boxstyle": "round,pad=0.4", "facecolor": _MAIN, "edgecolor": "none"},
    )


def _told(power: Supply) -> str:
    """What the colours mean."""
    main, *others = power.rails
    return "\n".join(
        [
            f"red: {main.voltage:g} V, a feed for every {power.per_feed} servos of the chain",
            *(f"orange: {rail.voltage:g} V" for rail in others),
            "blue: data of the servo bus",
            "black: ground, common to all",
        ]
    )
