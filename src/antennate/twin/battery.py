"""A supply that discharges, and whose voltage drops under load."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.hardware.dynamixel.tables import XC430_W240
from antennate.params.twin import BatteryParams
from antennate.twin.registers import Servo

_UNITS_A_VOLT = 10


class Battery:
    """Feeds all servos; its voltage is constant until `discharge` is called.

    Args:
        params: Its numbers.
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
        if t >= self._begin:
            self._show(servos, self._volts(servos, t))

    def _show(self, servos: Sequence[Servo], volts: float) -> None:
        for servo in servos:
            large = servo.table is XC430_W240
            seen = volts if large else min(volts, self._params.antenna_voltage)
            servo.set("present_input_voltage", round(_UNITS_A_VOLT * seen))

    def _volts(self, servos: Sequence[Servo], t: float) -> float:
        load = sum(abs(s.motion.shaft.load) for s in servos if s.table is XC430_W240)
        empty = self._rate * (t - self._begin)
        drop = self._params.resistance * self._params.stall_current * load
        return max(self._params.voltage - empty - drop, 0.0)
