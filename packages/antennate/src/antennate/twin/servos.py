"""The servos of a twin: those of its robot, fed by a battery, or any set of DYNAMIXEL servos alone.

A list without a robot is `1:xl330-m288 2:xl430-w250`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from antennate.errors import own_errors
from antennate.params.base import Params, from_values, number, read_file
from antennate.params.hardware import BatteryParams
from antennate.robots.servos import ServoParams
from antennate.robots.spec import RobotSpec
from antennate.twin.orders import Plugging, Pushes
from dynamixel_bus import servo_list
from dynamixel_bus.driven import DrivenServo
from dynamixel_bus.model import BAUD_RATES, POSITION_UNIT
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.servo_list import FACTORY_BAUD, MIDDLE, ListedServo, make_servo

_UNITS_A_VOLT = 10
QUIET = 0.5
"""Silence of the bus after which a packet is the first of another client, or of its next step [s]:
five times what the watchdogs of servos with torque allow, less than a program takes to start."""


def servos_of(robot: RobotSpec) -> list[DrivenServo]:
    """The servos as the robot needs them: of its models, in its operating modes."""
    return [
        _servo(servo, kind, robot.modes[servo], robot.baud)
        for servo, kind in zip(robot.ids, robot.joint_servos, strict=True)
    ]


def factory_new(robot: RobotSpec) -> list[DrivenServo]:
    """The servos of a robot as they come out of their boxes."""
    return [
        DrivenServo(kind.servo, kind.servo["id"].default or 1, drive=kind)
        for kind in robot.joint_servos
    ]


def _servo(servo: int, kind: ServoParams, mode: int, baud: int) -> DrivenServo:
    driven = DrivenServo(kind.servo, servo, drive=kind)
    driven.set("operating_mode", mode)
    driven.set("return_delay_time", 0)
    driven.set("baud_rate", BAUD_RATES.index(baud))
    driven.set("present_input_voltage", round(10 * kind.voltage))
    return driven


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


_EXPECTED = (
    f"--servos: expected {servo_list.FORM}, such as 1:xl330-m288, or a file alone that ends in "
    ".toml"
)
_FACTORY = "datasheet: as delivered"


class ServoEntry(Params):
    """One servo of a list: all else is as delivered."""

    model: str = number("xc430-w240", "1", "assumed: the robot's")
    """Model of the servo, or a file with one."""
    id: int = number(1, "1", _FACTORY, ge=0, le=252)
    """Id of the servo."""
    baud: int = number(FACTORY_BAUD, "bit/s", _FACTORY, gt=0)
    """Speed of the servo on the bus."""
    position: float = number(MIDDLE, "ticks", "assumed: the middle", ge=-1_048_575, le=1_048_575)
    """Where the shaft of the servo is."""
    name: str = number("", "1", "assumed: its place in the list")
    """Name of the servo in orders."""

    def make(self) -> Servo:
        """The servo."""
        with own_errors():
            return make_servo(
                ListedServo(self.id, self.model, self.baud), self.position, "--servos: "
            )


class ServoList(Params):
    """What the file of a list of servos holds: a table `[[servo]]` for each."""

    servo: tuple[ServoEntry, ...] = number((), "1", "assumed: none", min_length=1, max_length=253)
    """The servos."""


def read_list(words: Sequence[str]) -> tuple[ServoEntry, ...]:
    """Servos from `ID:MODEL[@BAUD][xCOUNT]` each, or from one TOML file."""
    if len(words) == 1 and words[0].endswith(".toml") and not servo_list.is_listed(words[0]):
        file = Path(words[0])
        return tuple(
            entry.model_copy(update={"model": str(file.parent / entry.model)})
            if entry.model.endswith(".toml")
            else entry
            for entry in read_file(file, ServoList).servo
        )
    with own_errors():
        listed = servo_list.read_list(words, _EXPECTED)
    return from_values(ServoList, {"servo": [servo._asdict() for servo in listed]}).servo


class ServoBox:
    """Servos on one wire.

    Args:
        entries: The servos.
        plugged: Names of those on the bus at first, all by default.
        pushes: Shafts that somebody turns, as `orders.Pushes` reads them.

    Attributes:
        servos: The servos.
        bus: Their wire.
        plugging: Plugs servos in and turns shafts, by orders.
        t: Time up to which everything has happened [s].
    """

    def __init__(
        self,
        entries: Sequence[ServoEntry],
        plugged: Sequence[str] = (),
        pushes: Sequence[str] = (),
    ) -> None:
        self.servos = [entry.make() for entry in entries]
        self.bus = ServoBus(self.servos)
        names = [entry.name or str(place) for place, entry in enumerate(entries, 1)]
        self._pushes = Pushes(pushes, names, lambda _, angle: MIDDLE + angle / POSITION_UNIT)
        self.plugging = Plugging(self.servos, self._pushes)
        self.plugging.begin(plugged)
        self.t = 0.0

    def advance(self, t: float) -> None:
        """Let everything happen until t [s]."""
        used = any(servo.last_fed > 0.0 for servo in self.servos)
        for place, ticks in self._pushes.apply(t, used, self.servos):
            self.servos[place].push(ticks)
        self.bus.advance(t)
        self.t = max(self.t, t)

    @property
    def on_order(self) -> Callable[[str], None]:
        """Carries out an order now."""
        return lambda text: self.plugging.order(text, self.t)
