"""Faults on demand: `servo:7=silent@3s`, `esp32=reset@5s`, `wire=ber:1e-4`.

A register of a servo takes a value by its name: `servo:7=return_delay_time:250`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from antennate.errors import BadInputError, own_errors
from antennate.hardware.esp32.frame import FULL_SCALE
from antennate.twin.board import SIDES
from antennate.twin.robot import TwinRobot
from antennate.twin.servos import ServoBox
from dynamixel_bus import demands
from dynamixel_bus.demands import NONE, SIZES, TARGETS, Demand, break_bus, break_servo

_MOST_COUNTS = 65535
"""Largest reading that a frame can hold; those above 4095 are none of its converter."""
_BOARD = ("silent", "reset", NONE)
_IMU = ("silent", "stuck", "railed", NONE)
"""What can be wrong with the inertial sensor of the board."""
_READINGS = (
    *(f"{kind}_{side}" for kind in ("open", "short", "stuck") for side in SIDES),
    *SIDES,
    "hum",
    "drift",
    "plateau",
    "sticky",
    "radio_noise",
)
_TARGETS = {
    **TARGETS,
    "esp32": (*_BOARD, *_READINGS, "ber"),
    "imu": _IMU,
    "bus": (*TARGETS["bus"], "discharge"),
    "wire": ("loss", "ber"),
}
_SIZES = {
    **SIZES,
    **dict.fromkeys(SIDES, (0.0, _MOST_COUNTS, f"a reading of 0 to {_MOST_COUNTS}")),
    **dict.fromkeys(("hum", "radio_noise"), (0.0, _MOST_COUNTS, f"0 to {_MOST_COUNTS} counts")),
    "drift": (-_MOST_COUNTS, _MOST_COUNTS, f"at most {_MOST_COUNTS} counts a second"),
    "plateau": (0.0, FULL_SCALE, f"a code of 0 to {FULL_SCALE}"),
    "discharge": (-math.inf, math.inf, "volts a second"),
}


def read(text: str) -> Demand:
    """One demand from its text.

    Targets are "servo", "esp32", "imu" for the inertial sensor on that board, "bus", and "wire" for
    the wires of both. Sizes are those of `dynamixel_bus.demands`, share of bytes lost, fall of the
    supply [V/s], reading of a bent antenna, hum, noise or plateau [counts], and drift [counts/s].
    """
    with own_errors():
        return demands.read(text, _TARGETS, _SIZES)


class Faults:
    """Demands that wait for their time.

    Args:
        demands: The faults.
        ids: Ids of the servos, in their order.
        alone: There are servos and their bus, but no robot.
        has_imu: The board has an inertial sensor.

    Attributes:
        on_begin: Told each of them as it happens, and the time [s].
    """

    def __init__(
        self,
        demands: Sequence[Demand],
        ids: Sequence[int],
        alone: bool = False,
        has_imu: bool = False,
    ) -> None:
        self._waiting = sorted(demands, key=lambda demand: demand.t)
        self._ids = tuple(ids)
        self.on_begin: Callable[[Demand, float], None] = lambda demand, t: None
        self._alone, self._has_imu = alone, has_imu
        for demand in demands:
            self._require(demand)

    def order(self, text: str) -> None:
        """Let a fault begin with the next tick."""
        demand = read(text)
        self._require(demand)
        self._waiting.insert(0, demand)

    def _require(self, demand: Demand) -> None:
        if demand.target == "servo" and demand.servo not in self._ids:
            known = ", ".join(map(str, self._ids))
            raise BadInputError(f"--fault: expected a servo of {known}, found {demand.servo}")
        if self._alone and (
            demand.target in ("esp32", "imu", "wire") or demand.what == "discharge"
        ):
            raise BadInputError(
                "--fault: expected one of a servo or the bus where there is no robot, found "
                f"{demand.target}={demand.what}"
            )
        if demand.target == "imu" and not self._has_imu:
            raise BadInputError(
                "--fault: expected a robot with an inertial sensor (robot.imu.kind), found one "
                f"without for {demand}"
            )

    def apply(self, twin: TwinRobot | ServoBox, t: float) -> None:
        """Let happen what is due at time t [s]."""
        while self._waiting and self._waiting[0].t <= t:
            demand = self._waiting.pop(0)
            self.on_begin(demand, t)
            if demand.target == "servo":
                break_servo(twin.servos[self._ids.index(demand.servo)], demand, twin.t)
            elif isinstance(twin, TwinRobot) and demand.target != "bus":
                _break_robot(twin, demand)
            elif isinstance(twin, TwinRobot) and demand.what == "discharge":
                twin.battery.discharge(twin.t, demand.size)
            else:
                break_bus(twin.bus, demand)


def _break_robot(robot: TwinRobot, demand: Demand) -> None:
    if demand.target == "wire":
        for noise in (robot.noise, robot.bus.noise):
            setattr(noise, demand.what, demand.size)
    elif demand.target == "imu" and robot.imu is not None:
        robot.imu.trouble = "" if demand.what == NONE else demand.what
    elif demand.what in _READINGS:
        robot.converter.set(demand.what, demand.size)
    elif demand.what == "ber":
        robot.noise.ber = demand.size
    else:
        robot.break_board(demand.what)
