"""The bill of materials of a robot: what to buy or make, how many, and what it must stand."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from antennate.dxl.model import Rating, ServoModel
from antennate.robots.spec import RobotSpec
from antennate.robots.supply import PLUG, Supply, servos_of, supply

DIVIDER_CAPACITOR = "100 nF"
"""Beside each divider's lower resistor: keeps the converter's own noise small (ESP-IDF)."""


@dataclass(frozen=True)
class Part:
    """One row.

    Attributes:
        count: How many.
        item: What.
        use: Where it goes.
        rating: What it must stand, or how large it is.
    """

    count: int
    item: str
    use: str
    rating: str


def bill(robot: RobotSpec) -> list[Part]:
    """All parts, servos first."""
    power = supply(robot)
    return [*_servos(robot), *_electronics(robot), *_power(power), *_body(robot)]


def _servos(robot: RobotSpec) -> list[Part]:
    found: Counter[tuple[ServoModel, str]] = Counter()
    names = [name for name, _, count in robot.groups for _ in range(count)]
    for servo, name in zip(servos_of(robot), names, strict=True):
        found[servo.servo, name] += 1
    cables = len(robot.ids) + 1
    return [
        *(
            Part(count, f"DYNAMIXEL {model.name}", name, _rating(model.rating))
            for (model, name), count in found.items()
        ),
        Part(cables, "cable with three wires, JST EHR-03 at both ends", "servo bus", f"{PLUG:g} A"),
    ]


def _rating(rating: Rating) -> str:
    return f"{rating.voltage:g} V, {rating.stall_current:g} A stalled"


def _electronics(robot: RobotSpec) -> list[Part]:
    adapter = Part(
        1, "USB adapter for DYNAMIXEL, such as U2D2", "servo bus", f"{robot.baud} bit/s, TTL"
    )
    if not robot.antenna_count:
        return [adapter]
    sensor = robot.antenna.sensor
    length = 1000 * robot.antenna.sensed_hinges * robot.antenna.link_length
    kind = "flex sensor" if sensor.kind == "flex" else "pressure strip"
    ohms = f"{sensor.divider_resistance / 1000:g} kOhm, 1 %"
    return [
        adapter,
        Part(1, "ESP32 board (WROOM or WROVER)", "antennae", "ADC1 pins 34 and 35, USB"),
        Part(
            2,
            kind,
            "one along each antenna",
            f"{length:.0f} mm",
        ),
        Part(2, "resistor", "divider of each antenna", ohms),
        Part(2, "capacitor", "across that resistor", DIVIDER_CAPACITOR),
    ]


def _power(power: Supply) -> list[Part]:
    main, *others = power.rails
    amperes = f"{main.voltage:g} V, {power.stall:.1f} A"
    return [
        Part(
            1,
            "battery, three lithium cells",
            "all servos",
            f"{amperes}, {power.least_capacity:.1f} Ah or more",
        ),
        Part(1, "fuse and holder", "at the plus pole of the battery", f"{power.fuse:g} A"),
        Part(
            1,
            "emergency stop, opens when it is pressed",
            "behind the fuse",
            f"direct current, {amperes}",
        ),
        Part(
            power.feeds,
            "feed: two wires from the main line to a plug",
            "along the chain",
            f"{PLUG:g} A",
        ),
        *(
            Part(
                1,
                f"step-down converter, {rail.voltage:g} V",
                "antenna servos",
                f"{rail.stall:.1f} A or more",
            )
            for rail in others
        ),
    ]


def _body(robot: RobotSpec) -> list[Part]:
    legs = "O-leg" if robot.legs.kind == "rolling" else "leg"
    radius = 1000 * robot.leg_radius
    body = [
        Part(
            robot.links, "link frame", "body", f"{1000 * robot.link_pitch:g} mm from joint to joint"
        ),
        Part(robot.leg_count, legs, "one on each leg servo", f"outer radius {radius:g} mm"),
    ]
    return body + _antennae(robot) if robot.antenna_count else body


def _antennae(robot: RobotSpec) -> list[Part]:
    coils = Counter(robot.antenna.active_coils)
    return [
        Part(
            2 * robot.antenna.hinges,
            "link",
            "antennae",
            f"{1000 * robot.antenna.link_length:.1f} mm",
        ),
        *(
            Part(
                2 * count,
                f"torsion spring of {turns:g} coils",
                "antennae",
                "stiff ones at the base",
            )
            for turns, count in sorted(coils.items())
        ),
    ]
