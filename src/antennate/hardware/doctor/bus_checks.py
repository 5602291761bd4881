"""What a survey of a bus means: which servos are there, and how quickly they answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from statistics import median

from antennate.dxl.inquiry import FOUND, State
from antennate.dxl.models import MODELS_BY_NUMBER, model_name
from antennate.hardware.doctor.bus_survey import BusSurvey
from antennate.hardware.doctor.check import Finding, Grade, grouped, ids_text
from antennate.hardware.doctor.register_checks import FIX, register_findings
from antennate.hardware.dynamixel.bringup import CURE
from antennate.hardware.robot import DoctorConfig
from antennate.robots.spec import RobotSpec

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
    for state, found in _FOUND.items():
        if ids := ids_text(i for i, seen in bus.here.items() if seen.state == state):
            parts.append(f"{found} {ids}")
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
