"""What the registers of servos mean: how they are set, and how they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from antennate.dxl.model import RETURN_DELAY_UNIT, WATCHDOG_UNIT, hardware_errors
from antennate.dxl.models import XC430_W240
from antennate.hardware.doctor.bus_survey import BusSurvey
from antennate.hardware.doctor.check import Finding, Grade, grouped, ids_text, worst
from antennate.hardware.robot import DoctorConfig
from antennate.hardware.settings import settings

FIX = "run doctor with --fix"
OFF_AND_ON = "switch the supply of the servos off and on"
_MODES = ((1, "reversed"), (4, "timed"), (8, "torque by goal"))
"""Bits of Drive Mode, from the manuals of both models."""
_ANSWERS_ALL = 2
"""Status return level at which a servo answers reads and writes."""
_VOLT = 0.1
_FULL_PWM = XC430_W240["pwm_limit"].high or 1
_SHUTDOWNS = XC430_W240["shutdown"].default or 0

Grading = Callable[[BusSurvey, DoctorConfig, int, int], Grade]
"""The grade of a register of a servo: given survey, configuration, id and value."""


class _Check(NamedTuple):
    """A check of one register of all servos, by default one that `drive` requires.

    In `expected` {config} and {modes} are filled in, in `cure` the {ids} that are not ok; `text`
    says a value in words. `name` is that of the register if empty.
    """

    register: str
    expected: str
    cure: str
    text: Callable[[int], str] = str
    grading: Grading | None = None
    name: str = ""


def register_findings(bus: BusSurvey, config: DoctorConfig) -> Iterator[tuple[Finding, str, str]]:
    """Each with the name of its check and what would be good; of the servos that are expected."""
    modes = grouped(config.robot.modes)
    yield _position_limits(bus, config)
    for check in _CHECKS:
        values = _values(bus, config, check.register)
        grading = check.grading or _required(check.register)
        grades: dict[int, Grade] = {i: grading(bus, config, i, values[i]) for i in values}
        finding = _of_servos(grades, grouped(values, check.text), check.cure)
        name = check.name or check.register.replace("_", " ")
        yield finding, name, check.expected.format(config=config, modes=modes)


def _values(bus: BusSurvey, config: DoctorConfig, register: str) -> dict[int, int]:
    """A register of the servos that could be read, by id."""
    servos = bus.registers.items()
    return {i: v[register] for i, v in servos if i in config.robot.ids and register in v}


def _of_servos(grades: Mapping[int, Grade], found: str, cure: str) -> Finding:
    ids = ids_text(servo for servo, grade in grades.items() if grade != "ok")
    return Finding(found, worst(grades.values()), cure.replace("{ids}", ids))


def _required(register: str) -> Grading:
    """What `drive` requires, as `hardware.settings` says."""
    return lambda bus, config, servo, value: (
        "ok" if settings(config.robot)[register][servo].allows(value) else "bad"
    )


def _only(good: int, grade: Grade) -> Grading:
    """A grade of all values but one."""
    return lambda bus, config, servo, value: "ok" if value == good else grade


def _position_limits(bus: BusSurvey, config: DoctorConfig) -> tuple[Finding, str, str]:
    names = ("min_position_limit", "max_position_limit")
    rules = [settings(config.robot)[name] for name in names]
    least, most = (_values(bus, config, name) for name in names)
    limits = {i: (least[i], most[i]) for i in rules[0] if i in least and i in most}
    fits = {i: all(r[i].allows(v) for r, v in zip(rules, limits[i], strict=True)) for i in limits}
    grades: dict[int, Grade] = {i: "ok" if fit else "bad" for i, fit in fits.items()}
    shown = grouped(limits, lambda ends: f"{ends[0]} to {ends[1]}")
    finding = _of_servos(grades, shown, f"{FIX}: {{ids}} would refuse goals")
    return finding, "position limits", "at least robot.*.limit about each zero"


def _shutdown(bus: BusSurvey, config: DoctorConfig, servo: int, bits: int) -> Grade:
    return "ok" if bits & _SHUTDOWNS == _SHUTDOWNS else "warn"


def _supply(bus: BusSurvey, config: DoctorConfig, servo: int, value: int) -> Grade:
    registers, limits, volt = bus.registers[servo], config.limits, _VOLT * value
    low, high = registers.get("min_voltage_limit", 0), registers.get("max_voltage_limit", 0xFFFF)
    body = bus.here[servo].model == XC430_W240.number
    if not low <= value <= high or (body and volt < limits.supply_hold):
        return "bad"
    return "warn" if body and volt < limits.supply_warn else "ok"


def _heat(bus: BusSurvey, config: DoctorConfig, servo: int, heat: int) -> Grade:
    default = XC430_W240["temperature_limit"].default or 0
    most = bus.registers[servo].get("temperature_limit", default)
    return "bad" if heat >= most else "warn" if heat >= most - config.doctor.heat_margin else "ok"


def _full(bus: BusSurvey, config: DoctorConfig, servo: int, pwm: int) -> Grade:
    return "ok" if pwm >= bus.registers[servo].get("pwm_limit", pwm) else "warn"


def _watchdog(counts: int) -> str:
    if counts < 0:
        return "tripped"
    return f"{1e3 * WATCHDOG_UNIT * counts:.0f} ms" if counts else "off"


_CHECKS = (
    _Check("operating_mode", "{modes}", FIX),
    _Check(
        "return_delay_time",
        "0 us",
        FIX,
        lambda value: f"{1e6 * RETURN_DELAY_UNIT * value:g} us",
        _only(0, "warn"),
        "return delay",
    ),
    _Check(
        "status_return_level",
        str(_ANSWERS_ALL),
        OFF_AND_ON,
        grading=_only(_ANSWERS_ALL, "warn"),
    ),
    _Check("homing_offset", "0", f"{FIX}, then correct robot.*.zeros of {{ids}}"),
    _Check(
        "drive_mode",
        "normal",
        f"{FIX}; robot.*.directions of {{ids}} tells signs",
        lambda value: " + ".join(word for bit, word in _MODES if value & bit) or "normal",
    ),
    _Check(
        "velocity_limit",
        "from robot.*.fastest on",
        f"{FIX}: {{ids}} would refuse their profile velocity",
    ),
    _Check(
        "shutdown",
        ", ".join(hardware_errors(_SHUTDOWNS)),
        f"set register 63 of {{ids}} to {_SHUTDOWNS} with DYNAMIXEL Wizard",
        lambda bits: f"{'' if bits & _SHUTDOWNS == _SHUTDOWNS else 'not '}all of these",
        _shutdown,
        "shuts itself down at",
    ),
    _Check(
        "present_input_voltage",
        "body from {config.limits.supply_warn:g} V on, antennae within their limits",
        "{ids}: charge the battery, or check supply and cable to them",
        lambda value: f"{_VOLT * value:.1f} V",
        _supply,
        "supply",
    ),
    _Check(
        "present_temperature",
        "{config.doctor.heat_margin:g} degC below the limit",
        "{ids}: let them cool down",
        lambda heat: f"{heat} degC",
        _heat,
        "temperature",
    ),
    _Check(
        "hardware_error_status",
        "none",
        "{ids}: remove the cause (load, heat, supply), then switch the supply off and on",
        lambda bits: ", ".join(hardware_errors(bits)) or "none",
        _only(0, "bad"),
        "hardware errors",
    ),
    _Check(
        "bus_watchdog",
        "off",
        "{ids}: left by a program that died, or in use by one; drive clears it when it arms",
        _watchdog,
        _only(0, "warn"),
    ),
    _Check(
        "goal_pwm",
        "all that the PWM limit allows",
        "{ids}: little force, left by a program that died, such as jog; drive, teleop and jog set "
        "it when they arm",
        lambda pwm: f"{100 * pwm / _FULL_PWM:.0f} %",
        _full,
        "goal PWM",
    ),
    _Check(
        "torque_enable",
        "off",
        "{ids}: no other program may drive them; hold the robot and switch the supply off",
        lambda value: "on" if value else "off",
        _only(0, "bad"),
        "torque",
    ),
)
