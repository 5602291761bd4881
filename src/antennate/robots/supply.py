"""What a robot's servos may draw, and what follows for plugs, fuse and battery.

Numbers of the datasheets: servos (stall and standby current, `robots.servos`), the plugs of their
cables (JST EH, 3 A a contact) and ROBOTIS' U2D2 Power Hub (10 A). Walking is what the simulated
default robot draws, by the torque-speed line of its servos.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec

PLUG = 3.0
"""Rated current of a contact of the servos' plugs, JST EH [A] (datasheet JST eEH)."""
REGULATOR_EFFICIENCY = 0.9
"""Of the step-down converter for the antennae (assumed: usual at half its load)."""
WALKING_SHARE = 0.1
"""Mean current of a walking servo over its stall current: 2.2 A of 17 in simulated tunnels."""
PEAK_SHARE = 0.33
"""The same at the worst moment: 7.3 A."""
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

    def hours(self, capacity: float) -> float:
        """How long a battery [Ah] lasts while walking, down to a fifth of its charge [h]."""
        return 0.8 * capacity / self.walking


def servos_of(robot: RobotSpec) -> list[ServoParams]:
    """The servo model of every joint."""
    return [robot.servos.of(g.servo) for _, g, count in robot.groups for _ in range(count)]


def supply(robot: RobotSpec) -> Supply:
    """The supply of a robot, from its description."""
    servos = servos_of(robot)
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
