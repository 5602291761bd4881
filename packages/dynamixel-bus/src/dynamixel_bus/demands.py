"""Faults on demand, as texts: `servo:7=silent@3s`, `bus=ber:1e-4`.

A register of a servo takes a value by its name: `servo:7=return_delay_time:250`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from dynamixel_bus.errors import BadInputError
from dynamixel_bus.faults import Fault, Trouble
from dynamixel_bus.model import MOST_TICKS
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

Sizes = Mapping[str, tuple[float, float, str]]
"""Faults that mean nothing without a size: the least, the largest and how they are called."""

_FORM = re.compile(
    r"(?P<target>servo:(?P<id>\d{1,3})|[a-z][a-z0-9]*)=(?P<what>[a-z_]+)(:(?P<size>[0-9.e-]+))?"
    r"(@(?P<t>[0-9.]+)s)?"
)
_SERVO = {fault.name.lower(): fault for fault in Fault}
_HARDWARE = {"voltage": 1, "overheat": 4, "encoder": 8, "shock": 16, "overload": 32}
"""Bits of the register Hardware Error Status, from the manuals of both models."""
NONE = "none"
"""Takes back what was wrong; a latched hardware error stays until a reboot."""
_FROZEN, _JUMP = "frozen", "jump"
"""Present Position keeps its value, or is wrong by some ticks; the servo moves as before."""
TARGETS: Mapping[str, Collection[str]] = {
    "servo": (*_SERVO, *_HARDWARE, "reboot", _FROZEN, _JUMP, NONE),
    "bus": ("loss", "silent", "latency", "ber", "echo"),
}
"""What can be wrong with what."""
SIZES: Sizes = {
    **dict.fromkeys(("loss", "ber"), (0.0, 1.0, "a share of 0 to 1")),
    **dict.fromkeys(("late", "latency"), (0.0, math.inf, "seconds from 0 on")),
    _JUMP: (-MOST_TICKS, MOST_TICKS, f"a jump of 1 to {MOST_TICKS} ticks"),
}
"""Sizes of faults of servos and their bus."""


@dataclass(frozen=True, slots=True)
class Demand:
    """One fault, and when.

    Attributes:
        target: "servo", "bus", or what else a caller of `read` knows.
        servo: Id, for a servo.
        what: Its name.
        size: Delay of a late answer or of all [s], share of answers lost or of bits that are
            wrong, jump of a position [ticks], value of a register, or what else a caller knows.
        t: When it begins [s].
        sized: It is told with its size, even if that is 0.
    """

    target: str
    servo: int
    what: str
    size: float
    t: float
    sized: bool = False

    def __str__(self) -> str:
        servo = f":{self.servo}" if self.servo else ""
        size = f":{self.size:g}" if self.size or self.sized else ""
        return f"{self.target}{servo}={self.what}{size}"


def read(
    text: str, targets: Mapping[str, Collection[str]] = TARGETS, sizes: Sizes = SIZES
) -> Demand:
    """One demand from its text.

    Args:
        text: `TARGET=WHAT[:SIZE][@Ts]`.
        targets: What can be wrong with what.
        sizes: Faults that need a size.
    """
    match = _FORM.fullmatch(text)
    target = match["target"].split(":")[0] if match is not None else ""
    if match is None or target not in targets or (target == "servo") == (match["id"] is None):
        raise BadInputError(
            f"--fault: expected TARGET=WHAT[:SIZE][@Ts], such as servo:7=silent@3s, found {text!r}"
        )
    register = target == "servo" and match["what"] in XC430_W240.registers
    if match["what"] not in targets[target] and not register:
        known = ", ".join(targets[target])
        raise BadInputError(f"--fault: expected one of {known} for {target}, found {match['what']}")
    try:
        size, t = float(match["size"] or 0.0), float(match["t"] or 0.0)
    except ValueError:
        raise BadInputError(
            f"--fault: expected numbers for size and time, found {text!r}"
        ) from None
    if not (math.isfinite(size) and math.isfinite(t)):
        raise BadInputError(f"--fault: expected finite numbers, found {text!r}")
    if match["what"] in sizes:
        least, largest, called = sizes[match["what"]]
        small = match["what"] == _JUMP and abs(size) < 1
        if not match["size"] or small or not least <= size <= largest:
            raise BadInputError(
                f"--fault: expected {called}, as {match['what']}:SIZE, found {text!r}"
            )
    if register:
        _require_value(match["what"], size)
    sized = register or match["what"] in sizes
    return Demand(target, int(match["id"] or 0), match["what"], size, t, sized)


def _require_value(name: str, value: float) -> None:
    try:
        XC430_W240[name].encode(int(value))
    except OverflowError:
        size = XC430_W240[name].size
        raise BadInputError(
            f"--fault: expected a value of {size} bytes for {name}, found {value:g}"
        ) from None


def break_servo(servo: Servo, demand: Demand, t: float) -> None:
    """Let a fault of a servo happen at time t [s]."""
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


def break_bus(bus: ServoBus, demand: Demand) -> None:
    """Let a fault of the bus happen."""
    if demand.what == "latency":
        bus.latency = demand.size
    elif demand.what == "ber":
        bus.noise.ber = demand.size
    elif demand.what == "echo":
        bus.echo = True
    else:
        bus.loss = 1.0 if demand.what == "silent" else demand.size
