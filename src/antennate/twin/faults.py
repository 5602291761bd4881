"""Faults on demand: `servo:7=silent@3s`, `esp32=reset@5s`, `wire=ber:1e-4`.

A register of a servo takes a value by its name: `servo:7=return_delay_time:250`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from antennate.dxl.faults import Fault, Trouble
from antennate.dxl.model import MOST_TICKS
from antennate.dxl.models import XC430_W240
from antennate.dxl.servo import Servo
from antennate.dxl.servo_bus import ServoBus
from antennate.errors import BadInputError
from antennate.hardware.esp32.frame import FULL_SCALE
from antennate.twin.board import SIDES
from antennate.twin.robot import TwinRobot
from antennate.twin.servos import ServoBox

_FORM = re.compile(
    r"(?P<target>servo:(?P<id>\d{1,3})|esp32|imu|bus|wire)=(?P<what>[a-z_]+)(:(?P<size>[0-9.e-]+))?"
    r"(@(?P<t>[0-9.]+)s)?"
)
_SERVO = {fault.name.lower(): fault for fault in Fault}
_HARDWARE = {"voltage": 1, "overheat": 4, "encoder": 8, "shock": 16, "overload": 32}
"""Bits of the register Hardware Error Status, from the manuals of both models."""
NONE = "none"
"""Takes back what was wrong; a latched hardware error stays until a reboot."""
_FROZEN, _JUMP = "frozen", "jump"
"""Present Position keeps its value, or is wrong by some ticks; the servo moves as before."""
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
_KNOWN = {
    "servo": (*_SERVO, *_HARDWARE, "reboot", _FROZEN, _JUMP, NONE),
    "esp32": (*_BOARD, *_READINGS, "ber"),
    "imu": _IMU,
    "bus": ("loss", "silent", "latency", "discharge", "ber", "echo"),
    "wire": ("loss", "ber"),
}
_SIZES = {
    **dict.fromkeys(SIDES, (0.0, _MOST_COUNTS, f"a reading of 0 to {_MOST_COUNTS}")),
    **dict.fromkeys(("hum", "radio_noise"), (0.0, _MOST_COUNTS, f"0 to {_MOST_COUNTS} counts")),
    "drift": (-_MOST_COUNTS, _MOST_COUNTS, f"at most {_MOST_COUNTS} counts a second"),
    "plateau": (0.0, FULL_SCALE, f"a code of 0 to {FULL_SCALE}"),
    **dict.fromkeys(("loss", "ber"), (0.0, 1.0, "a share of 0 to 1")),
    **dict.fromkeys(("late", "latency"), (0.0, math.inf, "seconds from 0 on")),
    "discharge": (-math.inf, math.inf, "volts a second"),
    _JUMP: (-MOST_TICKS, MOST_TICKS, f"a jump of 1 to {MOST_TICKS} ticks"),
}
"""Faults that mean nothing without a size: the least, the largest and how they are called."""


@dataclass(frozen=True, slots=True)
class Demand:
    """One fault, and when.

    Attributes:
        target: "servo", "esp32", "imu" for the inertial sensor on that board, "bus", or "wire" for
            the wires of both.
        servo: Id, for a servo.
        what: Its name.
        size: Delay of a late answer or of all [s], share of answers or bytes lost or of bits
            that are wrong, fall of the supply [V/s], reading of a bent antenna, hum, noise or
            plateau [counts], drift [counts/s], jump of a position [ticks], or value of a register.
        t: When it begins [s].
    """

    target: str
    servo: int
    what: str
    size: float
    t: float

    def __str__(self) -> str:
        servo = f":{self.servo}" if self.servo else ""
        sized = self.what in XC430_W240.registers or self.what in _SIZES
        size = f":{self.size:g}" if self.size or sized else ""
        return f"{self.target}{servo}={self.what}{size}"


def read(text: str) -> Demand:
    """One demand from its text."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise BadInputError(
            f"--fault: expected TARGET=WHAT[:SIZE][@Ts], such as servo:7=silent@3s, found {text!r}"
        )
    target = match["target"].split(":")[0]
    register = target == "servo" and match["what"] in XC430_W240.registers
    if match["what"] not in _KNOWN[target] and not register:
        known = ", ".join(_KNOWN[target])
        raise BadInputError(f"--fault: expected one of {known} for {target}, found {match['what']}")
    try:
        size, t = float(match["size"] or 0.0), float(match["t"] or 0.0)
    except ValueError:
        raise BadInputError(
            f"--fault: expected numbers for size and time, found {text!r}"
        ) from None
    if not (math.isfinite(size) and math.isfinite(t)):
        raise BadInputError(f"--fault: expected finite numbers, found {text!r}")
    _check_size(match["what"], size, given=bool(match["size"]), text=text)
    if register:
        _check_register(match["what"], size)
    return Demand(target, int(match["id"] or 0), match["what"], size, t)


def _check_size(what: str, size: float, given: bool, text: str) -> None:
    least, largest, called = _SIZES.get(what, (-math.inf, math.inf, ""))
    if called and not (given and least <= size <= largest and (what != _JUMP or abs(size) >= 1)):
        raise BadInputError(f"--fault: expected {called}, as {what}:SIZE, found {text!r}")


def _check_register(name: str, value: float) -> None:
    try:
        XC430_W240[name].encode(int(value))
    except OverflowError:
        size = XC430_W240[name].size
        raise BadInputError(
            f"--fault: expected a value of {size} bytes for {name}, found {value:g}"
        ) from None


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
                _break_servo(twin.servos[self._ids.index(demand.servo)], demand, twin.t)
            elif isinstance(twin, TwinRobot) and demand.target != "bus":
                _break_robot(twin, demand)
            elif isinstance(twin, TwinRobot) and demand.what == "discharge":
                twin.battery.discharge(twin.t, demand.size)
            else:
                _break_bus(twin.bus, demand)


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


def _break_bus(bus: ServoBus, demand: Demand) -> None:
    if demand.what == "latency":
        bus.latency = demand.size
    elif demand.what == "ber":
        bus.noise.ber = demand.size
    elif demand.what == "echo":
        bus.echo = True
    else:
        bus.loss = 1.0 if demand.what == "silent" else demand.size


def _break_servo(servo: Servo, demand: Demand, t: float) -> None:
    if demand.what == NONE:
        servo.trouble = None
        servo.freeze(False)
        servo.misread(0)
    elif demand.what in _SERVO:
        servo.trouble = Trouble(_SERVO[demand.what], delay=demand.size)
    elif demand.what == "reboot":
        servo.restart(t)
    elif demand.what == _FROZEN:
        servo.freeze()
    elif demand.what == _JUMP:
        servo.misread(int(demand.size))
    elif demand.what in _HARDWARE:
        servo.fail(_HARDWARE[demand.what])
    elif demand.what in servo.model.registers:
        servo.set(demand.what, int(demand.size))
