"""What a survey of a bus means: one row for each check."""

from __future__ import annotations

from collections.abc import Iterable

from antennate.hardware.doctor.pace import pace_rows
from antennate.hardware.doctor.registers import health_rows, settings_rows
from antennate.hardware.doctor.rows import Row, Verdict, grouped, ids_text, row
from antennate.hardware.doctor.survey import Seen, Survey
from antennate.hardware.dynamixel.tables import TABLES
from antennate.params import DoctorParams, SupervisorParams
from antennate.robots.spec import RobotSpec

_PART = "bus"
_FIX = "run doctor with --fix"
_WIRING = "check the supply of the servos, the cable of the bus and its first plug"


def bus_rows(
    survey: Survey, robot: RobotSpec, limits: SupervisorParams, params: DoctorParams
) -> list[Row]:
    """All rows of a bus; those about servos only if any answers."""
    rows = [_baud(survey, robot)]
    if not survey.here and not survey.elsewhere:
        return rows
    rows += [_ids(survey, robot), _whole(survey), _models(survey, robot), _firmware(survey)]
    known = {i: s.registers for i, s in survey.here.items() if s.registers and i in robot.ids}
    if known:
        rows += settings_rows(known, robot)
        rows += health_rows(known, survey, limits, params)
        rows += pace_rows(survey, params)
    return rows


def _baud(survey: Survey, robot: RobotSpec) -> Row:
    expected = f"all at {survey.baud}"
    if survey.here and not survey.elsewhere:
        return Row(_PART, "baud", expected, f"{len(survey.here)} at {survey.baud}", "ok")
    if survey.elsewhere:
        others = [f"{_at(survey, baud)} at {baud}" for baud in _bauds(survey.elsewhere)]
        here = [f"{len(survey.here)} at {survey.baud}"] if survey.here else []
        cure = f"{_FIX}, or set robot.baud to what the servos have"
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


def _ids(survey: Survey, robot: RobotSpec) -> Row:
    missing = set(robot.ids) - set(survey.here)
    extra = set(survey.here) - set(robot.ids)
    said = [f"missing {ids_text(missing)}"] if missing else []
    said += [f"not expected {ids_text(extra)}"] if extra else []
    cures: list[str] = []
    lone = len(missing) == 1 and len(extra) + len(survey.elsewhere) == 1
    if lone:
        cures.append(f"{_FIX} to give the lone one its id or speed")
    elif missing:
        doubled = [i for i, seen in survey.here.items() if seen.state in ("collides", "broken")]
        perhaps = f"perhaps a servo that answers as {ids_text(doubled)} is one; else "
        cures.append(
            f"{perhaps if doubled else ''}plug in the missing ones; if all behind one place are "
            "missing, check that cable"
        )
    if extra and not lone:
        cures.append("unplug those that are not expected, or name them under robot")
    found = ", ".join(said) or ids_text(survey.here)
    verdict: Verdict | None = "bad" if missing else "warn" if extra else None
    return row(_PART, "ids", ids_text(robot.ids), found, verdict, "; ".join(cures))


def _whole(survey: Survey) -> Row:
    said: list[str] = []
    cures: list[str] = []
    for state, text, cure in (
        (
            "collides",
            "doubled",
            "two servos have this id: give one its own, alone on the bus, with the manufacturer's "
            "program DYNAMIXEL Wizard 2.0",
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


def _models(survey: Survey, robot: RobotSpec) -> Row:
    wanted = robot.models
    found = {i: s.model for i, s in survey.here.items() if s.model is not None}
    wrong = [i for i, model in found.items() if i in wanted and model != wanted[i]]
    return row(
        _PART,
        "models",
        grouped(wanted, _name),
        grouped(found, _name),
        "bad" if wrong else None,
        f"{ids_text(wrong)}: put a servo of the expected model there, or correct robot.*.ids",
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
