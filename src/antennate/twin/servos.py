"""The servos of the twin's robot: made for it, fed by a battery, used by clients in turn."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.dxl.driven import DrivenServo
from antennate.dxl.model import BAUD_RATES
from antennate.dxl.servo import Servo
from antennate.params.hardware import BatteryParams
from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec

_UNITS_A_VOLT = 10
QUIET = 0.5
"""Silence of the bus after which a packet is the first of another client, or of its next step [s]:
five times what the watchdogs of servos with torque allow, less than a program takes to start."""


def servos_of(robot: RobotSpec) -> list[DrivenServo]:
    """The servos as the robot needs them: of its models, in its operating modes."""
    kinds = [robot.servos.of(name) for name in robot.servo_names]
    return [
        _servo(servo, kind, robot.modes[servo], robot.baud)
        for servo, kind in zip(robot.ids, kinds, strict=True)
    ]


def factory_new(robot: RobotSpec) -> list[DrivenServo]:
    """The same servos as they come out of their boxes."""
    kinds = (robot.servos.of(name) for name in robot.servo_names)
    return [DrivenServo(kind.servo, kind.servo["id"].default or 1, drive=kind) for kind in kinds]


def _servo(servo: int, kind: ServoParams, mode: int, baud: int) -> DrivenServo:
    made = DrivenServo(kind.servo, servo, drive=kind)
    made.set("operating_mode", mode)
    made.set("return_delay_time", 0)
    made.set("baud_rate", BAUD_RATES.index(baud))
    made.set("present_input_voltage", round(10 * kind.voltage))
    return made


class Battery:
    """Feeds all servos; its voltage is constant until `discharge` is called.

    Models made for no more than the voltage at the antennae are behind the regulator.
    """

    def __init__(self, params: BatteryParams) -> None:
        self._params = params
        self._begin = math.inf
        self._rate = 0.0

    def discharge(self, t: float, rate: float) -> None:
        """From t [s] on the voltage falls by `rate` [V/s], and drops under load."""
        self._begin, self._rate = t, rate

    def feed(self, servos: Sequence[Servo], t: float) -> None:
        """Let servos see their voltage at time t [s]."""
        if t < self._begin:
            return
        volts = self._volts(servos, t)
        for servo in servos:
            seen = volts if self._direct(servo) else min(volts, self._params.antenna_voltage)
            servo.set("present_input_voltage", round(_UNITS_A_VOLT * seen))

    def _volts(self, servos: Sequence[Servo], t: float) -> float:
        load = sum(abs(servo.motion.shaft.load) for servo in servos if self._direct(servo))
        empty = self._rate * (t - self._begin)
        drop = self._params.resistance * self._params.stall_current * load
        return max(self._params.voltage - empty - drop, 0.0)

    def _direct(self, servo: Servo) -> bool:
        """Whether it is wired to the supply itself."""
        return servo.model.rating.voltage > self._params.antenna_voltage


class Visit:
    """The present client.

    Attributes:
        begun: When it began [s], inf before the first.
    """

    def __init__(self) -> None:
        self.begun = math.inf
        self._last = -math.inf

    def step(self, t: float, servos: Sequence[Servo]) -> bool:
        """Look at the bus at the time t [s], at least ten times a second; True if one has begun."""
        newest = max(servo.last_fed for servo in servos)
        if newest <= max(self._last, 0.0):  # 0 where no packet has come
            return False
        begins = newest - self._last > QUIET
        self._last = newest
        if begins:
            self.begun = t
        return begins
