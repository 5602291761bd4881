"""Puts right what doctor found: ids, speed, settings, each change on its own and verified.

Torque goes off first. EEPROM is written only where it differs, and read back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from antennate.hardware.doctor.bus_survey import BusSurvey, master
from antennate.hardware.doctor.check import Opener
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.joints import all_settings, settings_of
from antennate.hardware.safety import torque
from antennate.robots.spec import RobotSpec
from dynamixel_bus.bus import Bus
from dynamixel_bus.inquiry import look, read_some
from dynamixel_bus.model import BAUD_RATES
from dynamixel_bus.models import XC430_W240

_ID, _BAUD = "id", "baud_rate"
_MOVED = (_ID, _BAUD)
"""Registers after whose change a servo is found elsewhere."""
_UNMEASURED = (*_MOVED, "drive_mode", "homing_offset")
"""Registers after whose change a zero and a direction measured before need not hold."""


@dataclass(frozen=True, slots=True)
class Change:
    """One register, by name, of one servo, which answers at so many bits per second."""

    servo: int
    baud: int
    register: str
    before: int
    after: int

    def __str__(self) -> str:
        name = self.register.replace("_", " ")
        values: tuple[object, object] = self.before, self.after
        if self.register == _BAUD:
            values = BAUD_RATES[self.before], BAUD_RATES[self.after]
        return f"servo {self.servo} (at {self.baud}): {name} {values[0]} -> {values[1]}"

    @property
    def unmeasured(self) -> int | None:
        """Id of the servo whose zero and direction are not known after it, None if they are."""
        servo = self.after if self.register == _ID else self.servo
        return servo if self.register in _UNMEASURED else None


def plan(survey: BusSurvey, robot: RobotSpec) -> list[Change]:
    """Changes that would put right what can be; those that move a servo come alone, first."""
    return _moves(survey, robot) or _settings(survey, robot)


def _moves(survey: BusSurvey, robot: RobotSpec) -> list[Change]:
    missing = [servo for servo in robot.ids if servo not in survey.here]
    extra = [(survey.baud, seen) for i, seen in survey.here.items() if i not in robot.ids]
    extra += [(baud, seen) for baud, seen in survey.elsewhere if seen.servo not in missing]
    if len(missing) == 1 and len(extra) == 1:
        baud, lone = extra[0]
        if lone.state == "ok" and lone.model == robot.models[missing[0]]:
            return [Change(lone.servo, baud, _ID, lone.servo, missing[0])]
    ids = [seen.servo for _, seen in survey.elsewhere]
    return [
        Change(seen.servo, baud, _BAUD, BAUD_RATES.index(baud), BAUD_RATES.index(robot.baud))
        for baud, seen in survey.elsewhere
        if seen.servo in missing and seen.state == "ok" and ids.count(seen.servo) == 1
    ]


def _settings(survey: BusSurvey, robot: RobotSpec) -> list[Change]:
    rules = all_settings(robot)
    return [
        Change(servo, survey.baud, name, values[name], setting.cure)
        for servo, values in survey.registers.items()
        if servo in robot.ids
        for name, setting in settings_of(rules, servo).items()
        if name in values and not setting.allows(values[name])
    ]


def apply(opener: Opener, change: Change, now: Callable[[], float]) -> None:
    """Make one change: torque off, write if it differs, read back."""
    register = XC430_W240[change.register]
    with master(opener, change.baud, now) as bus:
        _require_alone(bus, change)
        if left := torque.disable(bus, [change.servo]):
            raise BringUpError(f"expected torque off, servo {left[0]} did not confirm it; {_POWER}")
        if read_some(bus, [change.servo], register).get(change.servo) == change.after:
            return
        bus.write(change.servo, register.address, register.encode(change.after))
        bus.settle()
        if change.register not in _MOVED:
            _require_value(bus, change.servo, change)
    if change.register in _MOVED:
        _require_moved(opener, change, now)


_POWER = "switch its supply off and on"


def _require_alone(bus: Bus, change: Change) -> None:
    present = look(bus, change.servo)
    if (state := "silent" if present is None else present.state) != "ok":
        raise BringUpError(
            f"expected servo {change.servo} alone at {change.baud}, found it {state}; "
            "leave it alone on the bus"
        )
    if change.register == _ID and look(bus, change.after, 1) is not None:
        raise BringUpError(f"expected id {change.after} to be free, found a servo of this id")


def _require_moved(opener: Opener, change: Change, now: Callable[[], float]) -> None:
    """The servo is where the change has put it, and not where it was."""
    to_id = change.register == _ID
    servo = change.after if to_id else change.servo
    baud = change.baud if to_id else BAUD_RATES[change.after]
    with master(opener, baud, now) as bus:
        _require_value(bus, servo, change)
        if to_id and look(bus, change.servo, 1) is not None:
            raise BringUpError(f"expected id {change.servo} to be left by all, found one there")


def _require_value(bus: Bus, servo: int, change: Change) -> None:
    value = read_some(bus, [servo], XC430_W240[change.register]).get(servo, "no answer")
    if value != change.after:
        raise BringUpError(
            f"expected {change.register} {change.after} in servo {servo}, found {value}; {_POWER}"
        )
