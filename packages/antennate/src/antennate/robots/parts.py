"""What a robot's servos may draw, and what to buy or make: plugs, fuse, battery and other parts.

Numbers of the datasheets: servos (stall and standby current, `robots.servos`), the plugs of their
cables (JST EH, 3 A a contact) and ROBOTIS' U2D2 Power Hub (10 A). Walking is what the simulated
default robot draws, by the torque-speed line of its servos.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec
from dynamixel_bus.model import Rating, ServoModel

PLUG = 3.0
"""Rated current of a contact of the servos' plugs, JST EH [A] (datasheet JST eEH)."""
CELLS_FROM = 9.0
"""Voltage of servos from which on three lithium cells feed them, empty or full [V]."""
REGULATOR_EFFICIENCY = 0.9
"""Efficiency of the step-down converter for the antennae (assumed: usual at half its load)."""
WALKING_SHARE = 0.1
"""Mean current of a walking servo over its stall current: 2.2 A of 17 in simulated tunnels."""
PEAK_SHARE = 0.33
"""Current of a walking servo over its stall current at the worst moment: 7.3 A."""
CELL_RATE = 20.0
"""Current over capacity that usual hobby cells give for long [1/h] (assumed)."""
MARGIN = 1.25
"""A fuse carries no more than 80 % of its rating for long (usual rule)."""
FUSES = (3, 5, 7.5, 10, 15, 20, 25, 30)
"""Blade fuses [A] (ISO 8820-3)."""


@dataclass(frozen=True)
class Rail:
    """The servos of one voltage.

    Attributes:
        voltage: Of the rail [V].
        ids: Servos on it, in the order of the joints.
        standby: Current without torque [A].
        walking: Mean current while walking [A].
        peak: Largest current while walking [A].
        stall: Current with every shaft held [A].
    """

    voltage: float
    ids: tuple[int, ...]
    standby: float
    walking: float
    peak: float
    stall: float


@dataclass(frozen=True)
class Supply:
    """What feeds a robot.

    Attributes:
        rails: Highest voltage first; that one is the battery's, others have a converter each.
        stall: Current from the battery with every shaft held [A].
        peak: Largest current from the battery while walking [A].
        walking: Mean of it [A].
        per_feed: Servos of the battery's rail that one plug may feed if all of them stall.
        feeds: Places at which the battery's rail has to be fed then.
        fuse: Rating of the fuse [A]: the smallest that carries the peak.
        least_capacity: Smallest battery that gives the stall current [Ah].
    """

    rails: tuple[Rail, ...]
    stall: float
    peak: float
    walking: float
    per_feed: int
    feeds: int
    fuse: float
    least_capacity: float

    @property
    def on_cells(self) -> bool:
        """Whether a battery of three lithium cells feeds it, not a power supply."""
        return self.rails[0].voltage > CELLS_FROM

    def hours(self, capacity: float) -> float:
        """How long a battery [Ah] lasts while walking, down to a fifth of its charge [h]."""
        return 0.8 * capacity / self.walking


def _models(robot: RobotSpec) -> list[ServoParams]:
    """Servo model of each joint; its gain is set later."""
    return [robot.servos.of(name) for name in robot.servo_names]


def supply(robot: RobotSpec) -> Supply:
    """The supply of a robot, from its description."""
    servos = _models(robot)
    rails = tuple(
        _rail(
            voltage,
            [(i, s) for i, s in zip(robot.ids, servos, strict=True) if s.voltage == voltage],
        )
        for voltage in sorted({servo.voltage for servo in servos}, reverse=True)
    )
    main, others = rails[0], rails[1:]

    def drawn(name: str) -> float:
        behind = sum(rail.voltage * getattr(rail, name) for rail in others)
        return getattr(main, name) + behind / main.voltage / REGULATOR_EFFICIENCY

    stalled = max(servo.stall_current for servo in servos if servo.voltage == main.voltage)
    per_feed = max(1, math.floor(PLUG / stalled))
    peak = drawn("peak")
    return Supply(
        rails=rails,
        stall=drawn("stall"),
        peak=peak,
        walking=drawn("walking"),
        per_feed=per_feed,
        feeds=math.ceil(len(main.ids) / per_feed),
        fuse=next((size for size in FUSES if size >= MARGIN * peak), math.ceil(MARGIN * peak)),
        least_capacity=drawn("stall") / CELL_RATE,
    )


def _rail(voltage: float, servos: list[tuple[int, ServoParams]]) -> Rail:
    stall = sum(servo.stall_current for _, servo in servos)
    standby = sum(servo.standby_current for _, servo in servos)
    ids = tuple(i for i, _ in servos)
    walking, peak = (standby + share * stall for share in (WALKING_SHARE, PEAK_SHARE))
    return Rail(voltage, ids, standby, walking, peak, stall)


DIVIDER_CAPACITOR = "100 nF"
"""Beside each divider's lower resistor: keeps the converter's own noise small (ESP-IDF)."""


INERTIAL = ("breakout of an LSM6DSOX", "inertial sensor of the ESP32 board", "3.3 V, I2C")


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
    return [*bought(robot), *_body(robot), *(_antennae(robot) if robot.antenna_count else [])]


def bought(robot: RobotSpec) -> list[Part]:
    """Parts of the bill that are bought as they are: servos, electronics, supply."""
    return [*_servos(robot), *_electronics(robot), *_power(supply(robot))]


def servo_item(model: ServoModel) -> str:
    """Item of the bill that a servo is."""
    return f"DYNAMIXEL {model.name}"


def source_item(power: Supply) -> str:
    """Item of the bill that feeds a robot."""
    return "battery, three lithium cells" if power.on_cells else "power supply"


def _servos(robot: RobotSpec) -> list[Part]:
    counts: Counter[tuple[ServoModel, str]] = Counter()
    names = [name for name, _, count in robot.groups for _ in range(count)]
    for servo, name in zip(_models(robot), names, strict=True):
        counts[servo.servo, name] += 1
    cables = len(robot.ids) + 1
    return [
        *(
            Part(count, servo_item(model), name, _rating(model.rating))
            for (model, name), count in counts.items()
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
    pins = "pins 34 and 35" if robot.antenna_count > 1 else "pin 34"
    ohms = f"{sensor.divider_resistance / 1000:g} kOhm, 1 %"
    return [
        adapter,
        Part(1, "ESP32 board (WROOM or WROVER)", "antennae", f"ADC1 {pins}, USB"),
        Part(robot.antenna_count, kind, "one along each antenna", f"{length:.0f} mm"),
        Part(robot.antenna_count, "resistor", "divider of each antenna", ohms),
        Part(robot.antenna_count, "capacitor", "across that resistor", DIVIDER_CAPACITOR),
        *([Part(1, *INERTIAL)] if robot.has_imu else []),
    ]


def _power(power: Supply) -> list[Part]:
    main, *others = power.rails
    amperes = f"{main.voltage:g} V, {power.stall:.1f} A"
    capacity = f", {power.least_capacity:.1f} Ah or more" if power.on_cells else ""
    return [
        Part(1, source_item(power), "all servos", amperes + capacity),
        Part(1, "fuse and holder", "at the plus pole of the supply", f"{power.fuse:g} A"),
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
    if not robot.leg_count:
        return [Part(1, "clamp with a bracket", "antenna's servo", "holds on a table")]
    legs = "O-leg" if robot.legs.kind == "rolling" else "leg"
    radius = 1000 * robot.leg_radius
    return [
        Part(
            robot.links, "link frame", "body", f"{1000 * robot.link_pitch:g} mm from joint to joint"
        ),
        Part(robot.leg_count, legs, "one on each leg servo", f"outer radius {radius:g} mm"),
    ]


def _antennae(robot: RobotSpec) -> list[Part]:
    coils = Counter(robot.antenna.active_coils)
    return [
        Part(
            robot.antenna_count * robot.antenna.hinges,
            "link",
            "antennae",
            f"{1000 * robot.antenna.link_length:.1f} mm",
        ),
        *(
            Part(
                robot.antenna_count * count,
                f"torsion spring of {turns:g} coils",
                "antennae",
                "stiff ones at the base; `antennate build` gives wire and mandrel",
            )
            for turns, count in sorted(coils.items())
        ),
    ]
