"""Findings on a bus: which servos are there, how quickly they answer, how they are set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from statistics import median
from typing import NamedTuple, get_args

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.bus_survey import BusSurvey
from antennate.hardware.doctor.check import Finding, Grade, grouped, ids_text, worst
from antennate.hardware.dynamixel.bringup import CURE
from antennate.hardware.dynamixel.tick_time import ADAPTER, tick_time
from antennate.hardware.joints import settings
from antennate.robots.parts import supply
from antennate.robots.spec import RobotSpec
from dynamixel_bus.inquiry import FOUND, State
from dynamixel_bus.model import RETURN_DELAY_UNIT, WATCHDOG_UNIT, hardware_errors
from dynamixel_bus.models import MODELS_BY_NUMBER, XC430_W240, model_name

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

    In `expected` {config}, {modes} and {body} are filled in, in `cure` the {ids} that are not ok;
    `text` says a value in words. `name` is that of the register if empty.
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
    warn = config.limits.supply_warn
    body = f"body from {warn:g} V on, antennae " if supply(config.robot).on_cells else ""
    yield _position_limits(bus, config)
    for check in _CHECKS:
        values = _values(bus, config, check.register)
        grading = check.grading or _required(check.register)
        grades: dict[int, Grade] = {i: grading(bus, config, i, values[i]) for i in values}
        finding = _of_servos(grades, grouped(values, check.text), check.cure)
        name = check.name or check.register.replace("_", " ")
        yield finding, name, check.expected.format(config=config, modes=modes, body=body)


def _values(bus: BusSurvey, config: DoctorConfig, register: str) -> dict[int, int]:
    """A register of the servos that could be read, by id."""
    servos = bus.registers.items()
    return {i: v[register] for i, v in servos if i in config.robot.ids and register in v}


def _of_servos(grades: Mapping[int, Grade], text: str, cure: str) -> Finding:
    ids = ids_text(servo for servo, grade in grades.items() if grade != "ok")
    return Finding(text, worst(grades.values()), cure.replace("{ids}", ids))


def _required(register: str) -> Grading:
    """What `drive` requires, as `hardware.joints` says."""
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
        "{body}within their limits",
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


_FOUND: Mapping[State, str] = {
    "collides": "doubled",
    "broken": "never whole from",
    "mute": "pings only from",
}


def findings(bus: BusSurvey, config: DoctorConfig) -> Iterator[tuple[Finding, str, str]]:
    """Each with the name of its check and what would be good, in the order to be shown."""
    robot, good = config.robot, config.doctor
    yield _baud(bus), "baud", f"all at {bus.baud}"
    if bus.echoes:
        cure = "nothing, as echoes are dropped; other programs may need an adapter without"
        echo = Finding(f"{bus.echoes} requests came back", "warn", cure)
        yield echo, "echo of the adapter", "none"
    if not (bus.here or bus.elsewhere):
        return
    yield _ids(bus, robot), "ids", ids_text(robot.ids)
    yield _answers(bus), "answers", "one whole answer of each"
    yield _models(bus, robot), "models", grouped(robot.models, model_name)
    newest = ", ".join(f"{t.name} {t.fast_read_firmware}" for t in MODELS_BY_NUMBER.values())
    yield _firmware(bus), "firmware", f"from {newest} on"
    if not bus.registers.keys() & set(robot.ids):
        return
    yield from register_findings(bus, config)
    period = config.control.period
    within = f"at most {1e3 * (period - ADAPTER):g} of {1e3 * period:g} ms"
    yield tick_finding(bus, config), "tick on the wire", within
    if bus.ping_times:
        yield _answer_time(bus, config), "answer time", f"at most {1e3 * good.answer_time:g} ms"
    if bus.read_time is not None:
        finding = _read_time(bus, bus.read_time, good.read_time)
        yield finding, "read of all", f"at most {1e3 * good.read_time:g} ms"
        yield _lost_answers(bus), "lost answers", "none"


def slow(bus: BusSurvey, config: DoctorConfig) -> bool:
    """All answers come late, as through an adapter that keeps bytes back."""
    times = bus.ping_times.values()
    return bool(times) and median(times) > config.doctor.answer_time


def _baud(bus: BusSurvey) -> Finding:
    here = [f"{len(bus.here)} at {bus.baud}"] if bus.here else []
    if bus.elsewhere:
        ids: dict[int, set[int]] = {}
        for baud, servo in bus.elsewhere:
            ids.setdefault(baud, set()).add(servo.servo)
        others = [f"id {ids_text(ids[baud])} at {baud}" for baud in sorted(ids)]
        cure = f"{FIX}, or set robot.baud to what the servos have"
        return Finding(", ".join(here + others), "bad", cure)
    if here:
        return Finding(here[0])
    if bus.board:
        cure = "swap the ports of --esp32 and --bus"
        return Finding("the antenna board is on this port", "bad", cure)
    return Finding(
        "no servo answers at any usual speed",
        "bad",
        "check the supply of the servos, the cable of the bus and its first plug; see whether "
        "--esp32 and --bus are swapped",
    )


def _ids(bus: BusSurvey, robot: RobotSpec) -> Finding:
    missing = set(robot.ids) - set(bus.here)
    extra = set(bus.here) - set(robot.ids)
    parts = [f"missing {ids_text(missing)}"] if missing else []
    parts += [f"not expected {ids_text(extra)}"] if extra else []
    cures: list[str] = []
    lone = len(missing) == 1 and len(extra) + len(bus.elsewhere) == 1
    if lone:
        cures.append(f"{FIX} to give the lone one its id or speed")
    elif missing:
        doubled = [i for i, seen in bus.here.items() if seen.state in ("collides", "broken")]
        perhaps = f"perhaps a servo that answers as {ids_text(doubled)} is one; else "
        cures.append(
            f"{perhaps if doubled else ''}plug in the missing ones; if all behind one place are "
            "missing, check that cable"
        )
    if extra and not lone:
        cures.append("unplug those that are not expected, or name them under robot")
    grade: Grade = "bad" if missing else "warn" if extra else "ok"
    return Finding(", ".join(parts) or ids_text(bus.here), grade, "; ".join(cures))


def _answers(bus: BusSurvey) -> Finding:
    parts: list[str] = []
    cures: list[str] = []
    for state, words in _FOUND.items():
        if ids := ids_text(i for i, seen in bus.here.items() if seen.state == state):
            parts.append(f"{words} {ids}")
            cures.append(f"{ids}: {FOUND[state]}; {CURE[state]}")
    grade: Grade = "bad" if parts else "ok"
    return Finding(", ".join(parts) or "all whole", grade, "; ".join(cures))


def _models(bus: BusSurvey, robot: RobotSpec) -> Finding:
    models = {i: seen.model for i, seen in bus.here.items() if seen.model is not None}
    wrong = [i for i, model in models.items() if model != robot.models.get(i, model)]
    cure = f"{ids_text(wrong)}: put a servo of the expected model there, or correct robot.*.ids"
    return Finding(grouped(models, model_name), "bad" if wrong else "ok", cure)


def _firmware(bus: BusSurvey) -> Finding:
    here = bus.here.values()
    versions = {s.servo: s.firmware for s in here if s.firmware is not None}
    least = {
        s.servo: MODELS_BY_NUMBER[s.model].fast_read_firmware
        for s in here
        if s.model in MODELS_BY_NUMBER
    }
    old = [servo for servo, version in versions.items() if version < least.get(servo, 0)]
    cure = f"{ids_text(old)}: update with DYNAMIXEL Wizard; older ones take no fast reads"
    return Finding(grouped(versions), "warn" if old else "ok", cure)


def _answer_time(bus: BusSurvey, config: DoctorConfig) -> Finding:
    times = bus.ping_times
    usual = f"{1e3 * median(times.values()):.1f} ms"
    late = ids_text(servo for servo, time in times.items() if time > config.doctor.answer_time)
    if not late:
        return Finding(usual)
    if slow(bus, config):
        return Finding(usual, "bad", "the adapter is slow: see latency timer")
    longest = f"{usual}, up to {1e3 * max(times.values()):.1f} ms ({late})"
    busy = (
        "before a twin, or on a busy computer, the computer may be too busy: close other programs"
    )
    return Finding(longest, "bad", f"{late}: check its return delay, then its cable; {busy}")


_BAUDS: tuple[int, ...] = get_args(RobotSpec.model_fields["baud"].annotation)


def tick_finding(bus: BusSurvey, config: DoctorConfig) -> Finding:
    """Whether goals and answers of a tick fit it, all servos there; the speed at which they do."""
    ids, longest = config.robot.ids, config.control.period - ADAPTER
    time = tick_time(ids, bus.baud, bus.fast)
    text = f"{1e3 * time:.1f} ms for {len(ids)} servos at {bus.baud}"
    if time <= longest:
        return Finding(text)
    faster = [baud for baud in _BAUDS if tick_time(ids, baud, bus.fast) <= longest]
    cure = f"set robot.baud to {min(faster)} and {FIX}" if faster else "lower control.rate"
    return Finding(text, "bad", cure)


def _read_time(bus: BusSurvey, time: float, longest: float) -> Finding:
    rate = f", {1.0 / time:.0f} a second" if time else ""
    return Finding(
        f"{1e3 * time:.1f} ms{rate}, {'fast' if bus.fast else 'slow'} reads of {len(bus.whole)}",
        "bad" if time > longest else "ok" if bus.fast else "warn",
        "cure answer time, answers and lost answers first, then return delay and firmware; then "
        "end other programs, or raise robot.baud",
    )


def _lost_answers(bus: BusSurvey) -> Finding:
    return Finding(
        f"{bus.missed} of {bus.asked} ({100 * bus.missed / max(bus.asked, 1):.1f} %)",
        "warn" if bus.missed else "ok",
        "check plugs, cables and the ground between adapter, supply and servos",
    )
