"""How servos are set and how they are: one row for each register that matters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from antennate.hardware.doctor.rows import Row, Verdict, grouped, ids_text, row
from antennate.hardware.doctor.survey import Survey, watchdog_text
from antennate.hardware.dynamixel.tables import (
    RETURN_DELAY_UNIT,
    XC430_W240,
    hardware_errors,
)
from antennate.hardware.settings import Settings, settings
from antennate.params import DoctorParams, SupervisorParams
from antennate.robots.spec import RobotSpec

_PART = "bus"
_REVERSED, _TIMED, _TORQUE_BY_GOAL = 1, 4, 8
"""Bits of Drive Mode, from the manuals of both models."""
_ANSWERS_ALL = 2
"""Status return level at which a servo answers reads and writes."""
_VOLT = 0.1
_FIX = "run doctor with --fix"

Registers = Mapping[int, Mapping[str, int]]


def _of(known: Registers, name: str) -> dict[int, int]:
    return {servo: values[name] for servo, values in known.items() if name in values}


def _check(
    known: Registers,
    name: str,
    check: str,
    expected: str,
    judge: Callable[[int, int], Verdict | None],
    cure: str,
    text: Callable[[int], str] = str,
) -> Row:
    """One register of all servos; `judge` is told id and value."""
    values = _of(known, name)
    verdicts = {servo: judge(servo, value) for servo, value in values.items()}
    wrong = [servo for servo, verdict in verdicts.items() if verdict is not None]
    verdict: Verdict | None = "bad" if "bad" in verdicts.values() else "warn" if wrong else None
    said = cure if "{ids}" not in cure else cure.format(ids=ids_text(wrong))
    return row(_PART, check, expected, grouped(values, text), verdict, said)


def settings_rows(known: Registers, robot: RobotSpec) -> list[Row]:
    """What lasts over power-off, and the status return level."""
    rules = settings(robot)

    def judge(name: str) -> Callable[[int, int], Verdict | None]:
        return lambda servo, value: None if rules[name][servo].allows(value) else "bad"

    return [
        _check(
            known,
            "operating_mode",
            "operating mode",
            grouped(robot.modes),
            judge("operating_mode"),
            _FIX,
        ),
        _check(
            known,
            "return_delay_time",
            "return delay",
            "0 us",
            lambda _, value: "warn" if value else None,
            _FIX,
            lambda value: f"{1e6 * RETURN_DELAY_UNIT * value:g} us",
        ),
        _check(
            known,
            "status_return_level",
            "status return level",
            str(_ANSWERS_ALL),
            lambda _, value: "warn" if value != _ANSWERS_ALL else None,
            "switch the supply of the servos off and on",
        ),
        _check(
            known,
            "homing_offset",
            "homing offset",
            "0",
            judge("homing_offset"),
            f"{_FIX}, then correct robot.*.zeros of {{ids}}",
        ),
        _check(
            known,
            "drive_mode",
            "drive mode",
            "normal",
            judge("drive_mode"),
            f"{_FIX}; robot.*.directions of {{ids}} tells signs",
            _drive_mode,
        ),
        _check(
            known,
            "velocity_limit",
            "velocity limit",
            "from robot.*.fastest on",
            judge("velocity_limit"),
            f"{_FIX}: {{ids}} would refuse their profile velocity",
        ),
        _position_limits(known, rules),
        _shutdown(known),
    ]


def _drive_mode(value: int) -> str:
    words = ((_REVERSED, "reversed"), (_TIMED, "timed"), (_TORQUE_BY_GOAL, "torque by goal"))
    return " + ".join(word for bit, word in words if value & bit) or "normal"


def _position_limits(known: Registers, rules: Settings) -> Row:
    least, most = rules["min_position_limit"], rules["max_position_limit"]
    low, high = _of(known, "min_position_limit"), _of(known, "max_position_limit")
    both = {i: (low[i], high[i]) for i in least if i in low and i in high}
    wrong = [i for i, (a, b) in both.items() if not (least[i].allows(a) and most[i].allows(b))]
    return row(
        _PART,
        "position limits",
        "at least robot.*.limit about each zero",
        grouped(both, lambda ends: f"{ends[0]} to {ends[1]}"),
        "bad" if wrong else None,
        f"{_FIX}: {ids_text(wrong)} would refuse goals",
    )


def _shutdown(known: Registers) -> Row:
    wanted = XC430_W240["shutdown"].default or 0
    return _check(
        known,
        "shutdown",
        "shuts itself down at",
        ", ".join(hardware_errors(wanted)),
        lambda _, bits: "warn" if bits & wanted != wanted else None,
        f"set register 63 of {{ids}} to {wanted} with DYNAMIXEL Wizard",
        lambda bits: "all of these" if bits & wanted == wanted else "not all of these",
    )


def health_rows(
    known: Registers, survey: Survey, limits: SupervisorParams, params: DoctorParams
) -> list[Row]:
    """Supply, heat, errors, watchdog and torque."""
    return [
        _supply(known, survey, limits),
        _temperature(known, params),
        _check(
            known,
            "hardware_error_status",
            "hardware errors",
            "none",
            lambda _, bits: "bad" if bits else None,
            "{ids}: remove the cause (load, heat, supply), then switch the supply off and on",
            lambda bits: ", ".join(hardware_errors(bits)) or "none",
        ),
        _check(
            known,
            "bus_watchdog",
            "bus watchdog",
            "off",
            lambda _, value: "warn" if value else None,
            "{ids}: left by a program that died, or in use by one; drive clears it when it arms",
            watchdog_text,
        ),
        _check(
            known,
            "torque_enable",
            "torque",
            "off",
            lambda _, value: "bad" if value else None,
            "{ids}: no other program may drive them; hold the robot and switch the supply off",
            lambda value: "on" if value else "off",
        ),
    ]


def _supply(known: Registers, survey: Survey, limits: SupervisorParams) -> Row:
    volts = {i: _VOLT * v for i, v in _of(known, "present_input_voltage").items()}
    verdicts: dict[int, Verdict | None] = {}
    for servo, volt in volts.items():
        values = known[servo]
        low = _VOLT * values.get("min_voltage_limit", 0)
        high = _VOLT * values.get("max_voltage_limit", 0xFFFF)
        body = survey.here[servo].model == XC430_W240.model
        outside = not low <= volt <= high or (body and volt < limits.supply_hold)
        weak = body and volt < limits.supply_warn
        verdicts[servo] = "bad" if outside else "warn" if weak else None
    wrong = [servo for servo, verdict in verdicts.items() if verdict]
    bad = "bad" in verdicts.values()
    return row(
        _PART,
        "supply",
        f"body from {limits.supply_warn:g} V on, antennae within their limits",
        grouped(volts, lambda volt: f"{volt:.1f} V"),
        "bad" if bad else "warn" if wrong else None,
        f"{ids_text(wrong)}: charge the battery, or check supply and cable to them",
    )


def _temperature(known: Registers, params: DoctorParams) -> Row:
    limit = _of(known, "temperature_limit")
    margin = params.heat_margin

    def judge(servo: int, heat: int) -> Verdict | None:
        most = limit.get(servo, XC430_W240["temperature_limit"].default or 0)
        return "bad" if heat >= most else "warn" if heat >= most - margin else None

    return _check(
        known,
        "present_temperature",
        "temperature",
        f"{margin:g} degC below the limit",
        judge,
        "{ids}: let them cool down",
        lambda heat: f"{heat} degC",
    )
