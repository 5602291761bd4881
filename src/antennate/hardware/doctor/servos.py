"""What a survey of a bus means: one row for each check."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from antennate.hardware import roster
from antennate.hardware.doctor.pace import pace_rows
from antennate.hardware.doctor.rows import Row, Verdict, grouped, ids_text, row
from antennate.hardware.doctor.survey import Seen, Survey, watchdog_text
from antennate.hardware.dynamixel.tables import (
    EXTENDED_MODE,
    RETURN_DELAY_UNIT,
    TABLES,
    XC430_W240,
    hardware_errors,
)
from antennate.params import DoctorParams, SupervisorParams
from antennate.params.layout import TICKS_A_TURN, LayoutParams

_PART = "bus"
_REVERSED, _TIMED, _TORQUE_BY_GOAL = 1, 4, 8
"""Bits of Drive Mode, from the manuals of both models."""
_ANSWERS_ALL = 2
"""Status return level at which a servo answers reads and writes."""
_VOLT = 0.1
_FIX = "run doctor with --fix"
_WIRING = "check the supply of the servos, the cable of the bus and its first plug"


def bus_rows(
    survey: Survey, layout: LayoutParams, limits: SupervisorParams, params: DoctorParams
) -> list[Row]:
    """All rows of a bus; those about servos only if any answers."""
    rows = [_baud(survey, layout)]
    if not survey.here and not survey.elsewhere:
        return rows
    rows += [_ids(survey, layout), _whole(survey), _models(survey, layout), _firmware(survey)]
    known = {i: s.registers for i, s in survey.here.items() if s.registers and i in layout.ids}
    if known:
        rows += _settings(known, layout)
        rows += _health(known, survey, limits, params)
        rows += pace_rows(survey, params)
    return rows


# who is there


def _baud(survey: Survey, layout: LayoutParams) -> Row:
    expected = f"all at {survey.baud}"
    if survey.here and not survey.elsewhere:
        return Row(_PART, "baud", expected, f"{len(survey.here)} at {survey.baud}", "ok")
    if survey.elsewhere:
        others = [f"{_at(survey, baud)} at {baud}" for baud in _bauds(survey.elsewhere)]
        here = [f"{len(survey.here)} at {survey.baud}"] if survey.here else []
        cure = f"{_FIX}, or set layout.baud to what the servos have"
        return Row(_PART, "baud", expected, ", ".join(here + others), "bad", cure)
    if survey.board:
        cure = "swap the ports of --esp32 and --bus"
        return Row(_PART, "baud", expected, "the antenna board is on this port", "bad", cure)
    cure = f"{_WIRING}; see whether --esp32 and --bus are swapped"
    return Row(_PART, "baud", expected, "nobody answers at any usual speed", "bad", cure)


def _bauds(seen: Iterable[Seen]) -> list[int]:
    return sorted({one.baud for one in seen})


def _at(survey: Survey, baud: int) -> str:
    return "id " + ids_text({one.servo for one in survey.elsewhere if one.baud == baud})


def _ids(survey: Survey, layout: LayoutParams) -> Row:
    missing = set(layout.ids) - set(survey.here)
    extra = set(survey.here) - set(layout.ids)
    said = [f"missing {ids_text(missing)}"] if missing else []
    said += [f"not expected {ids_text(extra)}"] if extra else []
    cures: list[str] = []
    lone = len(missing) == 1 and len(extra) + len(survey.elsewhere) == 1
    if lone:
        cures.append(f"{_FIX} to give the lone one its id or speed")
    elif missing:
        cures.append(
            "plug in the missing ones; if all behind one place are missing, check that cable"
        )
    if extra and not lone:
        cures.append("unplug those that are not expected, or name them in layout")
    found = ", ".join(said) or ids_text(survey.here)
    verdict: Verdict | None = "bad" if missing else "warn" if extra else None
    return row(_PART, "ids", ids_text(layout.ids), found, verdict, "; ".join(cures))


def _whole(survey: Survey) -> Row:
    said: list[str] = []
    cures: list[str] = []
    for state, text, cure in (
        (
            "collides",
            "doubled",
            "two servos have this id: give one its own with DYNAMIXEL Wizard, alone on the bus",
        ),
        ("broken", "never whole from", "two servos of one id, or a bad cable or plug there"),
        ("mute", "pings only from", "status return level 0: switch the supply off and on"),
    ):
        if ids := [i for i, seen in survey.here.items() if seen.state == state]:
            said.append(f"{text} {ids_text(ids)}")
            cures.append(cure)
    bad: Verdict | None = "bad" if said else None
    found = ", ".join(said) or "all whole"
    return row(_PART, "answers", "one whole answer of each", found, bad, "; ".join(cures))


def _name(model: int | None) -> str:
    return TABLES[model].name if model in TABLES else f"model {model}"


def _models(survey: Survey, layout: LayoutParams) -> Row:
    wanted = roster.models(layout)
    found = {i: s.model for i, s in survey.here.items() if s.model is not None}
    wrong = [i for i, model in found.items() if i in wanted and model != wanted[i]]
    return row(
        _PART,
        "models",
        grouped(wanted, _name),
        grouped(found, _name),
        "bad" if wrong else None,
        f"{ids_text(wrong)}: put a servo of the expected model there, or correct layout",
    )


def _firmware(survey: Survey) -> Row:
    found = {i: s.firmware for i, s in survey.here.items() if s.firmware is not None}
    least = {
        i: TABLES[s.model].fast_read_firmware for i, s in survey.here.items() if s.model in TABLES
    }
    old = [i for i, version in found.items() if version < least.get(i, 0)]
    needs = ", ".join(f"{t.name} {t.fast_read_firmware}" for t in TABLES.values())
    return row(
        _PART,
        "firmware",
        f"from {needs} on",
        grouped(found),
        "warn" if old else None,
        f"{ids_text(old)}: update with DYNAMIXEL Wizard; older ones take no fast reads",
    )


# how they are set

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


def _settings(known: Registers, layout: LayoutParams) -> list[Row]:
    modes, legs = roster.modes(layout), set(roster.legs(layout))
    return [
        _check(
            known,
            "operating_mode",
            "operating mode",
            grouped(modes),
            lambda servo, mode: "bad" if mode != modes[servo] else None,
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
            lambda servo, value: ("bad" if servo in legs else "warn") if value else None,
            "set register 20 of {ids} to 0 with DYNAMIXEL Wizard, then correct layout.*.zeros: "
            f"in mode {EXTENDED_MODE} a watchdog would make the servo move",
        ),
        _check(
            known,
            "drive_mode",
            "drive mode",
            "normal",
            lambda _, value: ("bad" if value & _TORQUE_BY_GOAL else "warn") if value else None,
            "set register 10 of {ids} to 0 with DYNAMIXEL Wizard; layout.*.directions tells signs",
            _drive_mode,
        ),
        _position_limits(known, layout),
        _shutdown(known),
    ]


def _drive_mode(value: int) -> str:
    words = ((_REVERSED, "reversed"), (_TIMED, "timed"), (_TORQUE_BY_GOAL, "torque by goal"))
    return " + ".join(word for bit, word in words if value & bit) or "normal"


def _position_limits(known: Registers, layout: LayoutParams) -> Row:
    quarter = TICKS_A_TURN // 4
    zeros = dict(zip(layout.ids, layout.zeros, strict=True))
    turning = set(roster.legs(layout))
    low, high = _of(known, "min_position_limit"), _of(known, "max_position_limit")
    both = {i: (low[i], high[i]) for i in low if i in high and i not in turning}
    wrong = [
        i for i, (a, b) in both.items() if not a <= zeros[i] - quarter < zeros[i] + quarter <= b
    ]
    return row(
        _PART,
        "position limits",
        "a quarter turn about each zero",
        grouped(both, lambda ends: f"{ends[0]} to {ends[1]}"),
        "warn" if wrong else None,
        f"{ids_text(wrong)}: set registers 48 and 52 to 4095 and 0; goals beyond are refused",
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


# how they are


def _health(
    known: Registers, survey: Survey, limits: SupervisorParams, params: DoctorParams
) -> list[Row]:
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
            lambda _, value: "warn" if value else None,
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
