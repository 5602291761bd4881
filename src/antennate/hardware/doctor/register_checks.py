"""What the registers of servos mean: how they are set, and how they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from antennate.hardware.doctor.bus_survey import BusSurvey
from antennate.hardware.doctor.check import Check, Finding, Grade, grouped, ids_text, worst
from antennate.hardware.doctor.config import DoctorConfig
from antennate.hardware.dynamixel.tables import (
    RETURN_DELAY_UNIT,
    WATCHDOG_UNIT,
    XC430_W240,
    hardware_errors,
)
from antennate.hardware.settings import settings

FIX = "run doctor with --fix"
OFF_AND_ON = "switch the supply of the servos off and on"
_MODES = ((1, "reversed"), (4, "timed"), (8, "torque by goal"))
"""Bits of Drive Mode, from the manuals of both models."""
_ANSWERS_ALL = 2
"""Status return level at which a servo answers reads and writes."""
_VOLT = 0.1
_SHUTDOWNS = XC430_W240["shutdown"].default or 0

Judge = Callable[[BusSurvey, DoctorConfig, int, int], Grade]
"""The grade on a register of a servo: given survey, robot, id and value."""


def known(bus: BusSurvey, robot: DoctorConfig) -> dict[int, dict[str, int]]:
    """Registers of the expected servos that could be read."""
    return {i: values for i, values in bus.registers.items() if i in robot.robot.ids}


def _values(bus: BusSurvey, robot: DoctorConfig, register: str) -> dict[int, int]:
    """One of them, by id."""
    servos = known(bus, robot).items()
    return {servo: values[register] for servo, values in servos if register in values}


def _register(
    name: str,
    register: str,
    expected: Callable[[BusSurvey, DoctorConfig], str] | str,
    judge: Judge,
    cure: str,
    text: Callable[[int], str] = str,
) -> Check[BusSurvey]:
    """A check of one register of all servos; `{ids}` in the cure are those that are not ok."""

    def measure(bus: BusSurvey, robot: DoctorConfig) -> Finding:
        values = _values(bus, robot, register)
        grades: dict[int, Grade] = {
            servo: judge(bus, robot, servo, value) for servo, value in values.items()
        }
        return _of_servos(grades, grouped(values, text), cure)

    return Check(name, expected, measure)


def _of_servos(grades: Mapping[int, Grade], found: str, cure: str) -> Finding:
    ids = ids_text(servo for servo, grade in grades.items() if grade != "ok")
    return Finding(found, worst(grades.values()), cure.replace("{ids}", ids))


def _required(register: str) -> Judge:
    """What `drive` requires, as `hardware.settings` says."""
    return lambda bus, robot, servo, value: (
        "ok" if settings(robot.robot)[register][servo].allows(value) else "bad"
    )


def _unless(good: Callable[[int], bool], grade: Grade) -> Judge:
    """A grade on values that are not good."""
    return lambda bus, robot, servo, value: "ok" if good(value) else grade


def _position_limits(bus: BusSurvey, robot: DoctorConfig) -> Finding:
    rules = settings(robot.robot)
    low, high = (_values(bus, robot, f"{end}_position_limit") for end in ("min", "max"))
    both = {i: (low[i], high[i]) for i in rules["min_position_limit"] if i in low and i in high}
    grades: dict[int, Grade] = {
        servo: "ok" if room else "bad"
        for servo, (least, most) in both.items()
        for room in (
            rules["min_position_limit"][servo].allows(least)
            and rules["max_position_limit"][servo].allows(most),
        )
    }
    found = grouped(both, lambda ends: f"{ends[0]} to {ends[1]}")
    return _of_servos(grades, found, f"{FIX}: {{ids}} would refuse goals")


def _supply(bus: BusSurvey, robot: DoctorConfig, servo: int, value: int) -> Grade:
    registers, limits, volt = bus.registers[servo], robot.limits, _VOLT * value
    low, high = registers.get("min_voltage_limit", 0), registers.get("max_voltage_limit", 0xFFFF)
    body = bus.here[servo].model == XC430_W240.model
    if not low <= value <= high or (body and volt < limits.supply_hold):
        return "bad"
    return "warn" if body and volt < limits.supply_warn else "ok"


def _heat(bus: BusSurvey, robot: DoctorConfig, servo: int, heat: int) -> Grade:
    default = XC430_W240["temperature_limit"].default or 0
    most = bus.registers[servo].get("temperature_limit", default)
    return "bad" if heat >= most else "warn" if heat >= most - robot.doctor.heat_margin else "ok"


def _watchdog(counts: int) -> str:
    if counts < 0:
        return "tripped"
    return f"{1e3 * WATCHDOG_UNIT * counts:.0f} ms" if counts else "off"


REGISTER_CHECKS: tuple[Check[BusSurvey], ...] = (
    _register(
        "operating mode",
        "operating_mode",
        lambda bus, robot: grouped(robot.robot.modes),
        _required("operating_mode"),
        FIX,
    ),
    _register(
        "return delay",
        "return_delay_time",
        "0 us",
        _unless(lambda value: value == 0, "warn"),
        FIX,
        lambda value: f"{1e6 * RETURN_DELAY_UNIT * value:g} us",
    ),
    _register(
        "status return level",
        "status_return_level",
        str(_ANSWERS_ALL),
        _unless(lambda value: value == _ANSWERS_ALL, "warn"),
        OFF_AND_ON,
    ),
    _register(
        "homing offset",
        "homing_offset",
        "0",
        _required("homing_offset"),
        f"{FIX}, then correct robot.*.zeros of {{ids}}",
    ),
    _register(
        "drive mode",
        "drive_mode",
        "normal",
        _required("drive_mode"),
        f"{FIX}; robot.*.directions of {{ids}} tells signs",
        lambda value: " + ".join(word for bit, word in _MODES if value & bit) or "normal",
    ),
    _register(
        "velocity limit",
        "velocity_limit",
        "from robot.*.fastest on",
        _required("velocity_limit"),
        f"{FIX}: {{ids}} would refuse their profile velocity",
    ),
    Check("position limits", "at least robot.*.limit about each zero", _position_limits),
    _register(
        "shuts itself down at",
        "shutdown",
        ", ".join(hardware_errors(_SHUTDOWNS)),
        _unless(lambda bits: bits & _SHUTDOWNS == _SHUTDOWNS, "warn"),
        f"set register 63 of {{ids}} to {_SHUTDOWNS} with DYNAMIXEL Wizard",
        lambda bits: f"{'' if bits & _SHUTDOWNS == _SHUTDOWNS else 'not '}all of these",
    ),
    _register(
        "supply",
        "present_input_voltage",
        lambda bus, robot: (
            f"body from {robot.limits.supply_warn:g} V on, antennae within their limits"
        ),
        _supply,
        "{ids}: charge the battery, or check supply and cable to them",
        lambda value: f"{_VOLT * value:.1f} V",
    ),
    _register(
        "temperature",
        "present_temperature",
        lambda bus, robot: f"{robot.doctor.heat_margin:g} degC below the limit",
        _heat,
        "{ids}: let them cool down",
        lambda heat: f"{heat} degC",
    ),
    _register(
        "hardware errors",
        "hardware_error_status",
        "none",
        _unless(lambda bits: not bits, "bad"),
        "{ids}: remove the cause (load, heat, supply), then switch the supply off and on",
        lambda bits: ", ".join(hardware_errors(bits)) or "none",
    ),
    _register(
        "bus watchdog",
        "bus_watchdog",
        "off",
        _unless(lambda counts: not counts, "warn"),
        "{ids}: left by a program that died, or in use by one; drive clears it when it arms",
        _watchdog,
    ),
    _register(
        "torque",
        "torque_enable",
        "off",
        _unless(lambda value: not value, "bad"),
        "{ids}: no other program may drive them; hold the robot and switch the supply off",
        lambda value: "on" if value else "off",
    ),
)
