"""How quickly a bus answers, and the latency timer of its adapter."""

from __future__ import annotations

import os
from pathlib import Path
from statistics import median

from antennate.hardware.doctor.rows import Row, ids_text, row
from antennate.hardware.doctor.survey import Survey
from antennate.params import DoctorParams

_PART = "bus"
_TIMERS = Path("/sys/bus/usb-serial/devices")
_USUAL_NAME = "ttyUSB0"
_MS = 1e-3


def pace_rows(survey: Survey, params: DoctorParams) -> list[Row]:
    """Time to an answer, time of a read of all, answers lost meanwhile."""
    times = {i: s.ping_time for i, s in survey.here.items() if s.ping_time is not None}
    rows: list[Row] = []
    if times:
        usual = median(times.values())
        slow = [i for i, time in times.items() if time > params.answer_time]
        all_slow = usual > params.answer_time
        found = f"{1e3 * usual:.1f} ms"
        if slow and not all_slow:
            found += f", up to {1e3 * max(times.values()):.1f} ms ({ids_text(slow)})"
        cure = "" if all_slow else f"{ids_text(slow)}: check its return delay, then its cable"
        rows.append(
            row(
                _PART,
                "answer time",
                f"at most {1e3 * params.answer_time:g} ms",
                found,
                "bad" if slow else None,
                cure or "the adapter is slow: see latency timer",
            )
        )
    if survey.read_time is not None:
        rows.append(_read_row(survey, params))
        rows.append(_loss_row(survey))
    return rows


def _read_row(survey: Survey, params: DoctorParams) -> Row:
    count = sum(seen.state == "ok" for seen in survey.here.values())
    time = survey.read_time or 0.0
    kind = "fast" if survey.fast else "slow"
    return row(
        _PART,
        f"one {kind} read of {count}",
        f"at most {1e3 * params.read_time:g} ms",
        f"{1e3 * time:.1f} ms, {1.0 / time:.0f} a second" if time else "0 ms",
        "bad" if time > params.read_time else None if survey.fast else "warn",
        "cure answer time, answers and lost answers first, then return delay and firmware; then "
        "end other programs, or raise robot.baud",
    )


def _loss_row(survey: Survey) -> Row:
    share = survey.missed / survey.asked if survey.asked else 0.0
    return row(
        _PART,
        "lost answers",
        "none",
        f"{survey.missed} of {survey.asked} ({100 * share:.1f} %)",
        "warn" if survey.missed else None,
        "check plugs, cables and the ground between adapter, supply and servos",
    )


def slow_adapter(survey: Survey, params: DoctorParams) -> bool:
    """Whether all answers come late, as through an adapter that keeps bytes back."""
    times = [s.ping_time for s in survey.here.values() if s.ping_time is not None]
    return bool(times) and median(times) > params.answer_time


def latency_row(path: str, slow: bool, params: DoctorParams, timers: Path = _TIMERS) -> Row:
    """The latency timer of an adapter.

    Args:
        path: Device file of the port.
        slow: All answers were measured to come late.
        params: The highest timer that is good.
        timers: Where Linux shows them.
    """
    name = Path(os.path.realpath(path)).name
    file = timers / name / "latency_timer"
    try:
        value = int(file.read_text())
    except (OSError, ValueError):
        value = None
    most = params.latency_timer
    found = "none is shown" if value is None else f"{value} ms"
    if slow:
        found += ", and answers come late"
    high = value is not None and value > most
    shown = file if value is not None else timers / _usual(name) / "latency_timer"
    cure = (
        f"run `echo {most} | sudo tee {shown}`, or `setserial {path} low_latency`; again after "
        "every plug-in"
    )
    if value is not None and not high:
        cure = "not the timer: plug the adapter into the computer itself, end busy programs"
    if value is None:
        cure = f"if it is an FTDI adapter (U2D2), {cure}; else use one"
    verdict = "bad" if high or slow else None
    return row(_PART, "latency timer", f"at most {most} ms", found, verdict, cure)


def _usual(name: str) -> str:
    return name if name.startswith("tty") else _USUAL_NAME
