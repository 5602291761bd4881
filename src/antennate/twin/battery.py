"""A supply that discharges, and whose voltage drops under load."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.params.twin import BatteryParams
from antennate.twin.motor import RATINGS
from antennate.twin.registers import Servo

_UNITS_A_VOLT = 10


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
        return RATINGS[servo.table.model].voltage > self._params.antenna_voltage
