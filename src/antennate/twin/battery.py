"""A supply that discharges, and whose voltage drops under load."""

from __future__ import annotations

import math
from collections.abc import Sequence

from antennate.params.twin import BatteryParams
from antennate.robots.servos import TICKS_A_TURN, ServoParams, ServosParams
from antennate.twin.registers import Servo

_VOLTAGE_ERROR = 1
"""Bit of the register Hardware Error Status, from the manuals of both models."""
_UNITS_A_VOLT = 10
_TICK = 2.0 * math.pi / TICKS_A_TURN
_MODELS: dict[int, ServoParams] = {m.model_number: m for m in dict(ServosParams()).values()}


class Battery:
    """Feeds all servos; its voltage is constant until `discharge` is called.

    Models made for no more than the voltage at the antennae are behind the regulator.
    """

    def __init__(self, params: BatteryParams) -> None:
        self._params = params
        self._before: dict[int, float] = {}
        self._t = 0.0
        self._begin = math.inf
        self._rate = 0.0

    def discharge(self, t: float, rate: float) -> None:
        """From t [s] on the voltage falls by `rate` [V/s], and drops under load."""
        self._begin, self._rate = t, rate

    def feed(self, servos: Sequence[Servo], t: float) -> None:
        """Let servos see their voltage; one below its limit latches a voltage error."""
        if t >= self._begin:
            self._show(servos, self._volts(servos, t))
        self._before, self._t = {servo.get("id"): servo.position for servo in servos}, t

    def _show(self, servos: Sequence[Servo], volts: float) -> None:
        for servo in servos:
            seen = volts if self._direct(servo) else min(volts, self._params.antenna_voltage)
            servo.set("present_input_voltage", round(_UNITS_A_VOLT * seen))
            if servo.get("present_input_voltage") < servo.get("min_voltage_limit"):
                servo.fail(_VOLTAGE_ERROR)

    def _volts(self, servos: Sequence[Servo], t: float) -> float:
        load = sum(self._load(servo, t) for servo in servos if self._direct(servo))
        empty = self._rate * (t - self._begin)
        drop = self._params.resistance * self._params.stall_current * load
        return max(self._params.voltage - empty - drop, 0.0)

    def _direct(self, servo: Servo) -> bool:
        """Whether it hangs on the supply itself."""
        return _MODELS[servo.table.model].voltage > self._params.antenna_voltage

    def _load(self, servo: Servo, t: float) -> float:
        """Share of its stall current: its drive, less what its own turning takes from that."""
        if not servo.torque or t <= self._t:
            return 0.0
        ahead = _TICK * (servo.get("goal_position") - servo.position)
        turned = _TICK * (servo.position - self._before.get(servo.get("id"), servo.position))
        model = _MODELS[servo.table.model]
        drive = max(-1.0, min(model.position_gain * ahead, 1.0))
        return min(abs(drive - turned / (t - self._t) / model.no_load_speed), 1.0)
