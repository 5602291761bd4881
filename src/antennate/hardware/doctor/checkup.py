"""The whole examination: each port by itself, so that one that fails does not hide the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from antennate.hardware.doctor.antenna import Heard, board_rows, listen
from antennate.hardware.doctor.pace import latency_row, slow_adapter
from antennate.hardware.doctor.ports import port_row
from antennate.hardware.doctor.rows import Opener, Row, worst
from antennate.hardware.doctor.servos import bus_rows
from antennate.hardware.doctor.survey import Survey, survey
from antennate.hardware.ports.port import PortError
from antennate.params import ControllerParams, DoctorParams, Params, SupervisorParams
from antennate.params.layout import LayoutParams


class Robot(Params):
    """What doctor needs to know of a robot; a part of what robot.toml holds."""

    layout: LayoutParams = LayoutParams()
    mind: ControllerParams = ControllerParams()
    limits: SupervisorParams = SupervisorParams()


@dataclass(slots=True)
class Checkup:
    """What was found.

    Attributes:
        rows: One for each check.
        survey: Of the bus, None if there was no bus to look at.
        heard: From the board, None likewise.
    """

    rows: list[Row] = field(default_factory=list[Row])
    survey: Survey | None = None
    heard: Heard | None = None

    def result(self, changes: Sequence[str] = ()) -> dict[str, Any]:
        """The content of result.json, with the changes that were made before."""
        verdict = worst(self.rows)
        return {
            "schema": 1,
            "command": "doctor",
            "verdict": verdict,
            "rows": [asdict(row) for row in self.rows],
            "bus": None if self.survey is None else _bus_result(self.survey),
            "esp32": None if self.heard is None else _board_result(self.heard),
            "changes": list(changes),
        }


def examine(
    robot: Robot,
    bus: tuple[str, Opener] | None,
    esp32: tuple[str, Opener] | None,
    now: Callable[[], float],
    params: DoctorParams | None = None,
) -> Checkup:
    """Examine a robot at rest; nothing is written to it and nothing moves.

    Args:
        robot: What is expected.
        bus: Path and opener of the bus, None to leave it out.
        esp32: The same of the antenna board.
        now: Monotonic time [s].
        params: What is good.
    """
    found, params = Checkup(), params or DoctorParams()
    if bus is not None:
        _examine_bus(found, robot, *bus, params, now)
    if esp32 is not None:
        _examine_board(found, robot, *esp32, params, now)
    return found


def _examine_bus(
    found: Checkup,
    robot: Robot,
    path: str,
    opener: Opener,
    params: DoctorParams,
    now: Callable[[], float],
) -> None:
    found.rows.append(first := port_row("bus", path, opener, robot.layout.baud))
    if first.verdict == "bad":
        return
    try:
        found.survey = survey(opener, robot.layout, params, now)
    except PortError as error:
        found.rows.append(_lost("bus", path, error))
        return
    slow = slow_adapter(found.survey, params)
    found.rows.append(latency_row(path, slow, params))
    found.rows += bus_rows(found.survey, robot.layout, robot.limits, params)


def _examine_board(
    found: Checkup,
    robot: Robot,
    path: str,
    opener: Opener,
    params: DoctorParams,
    now: Callable[[], float],
) -> None:
    found.rows.append(first := port_row("esp32", path, opener))
    if first.verdict == "bad":
        return
    try:
        found.heard = listen(opener, robot.layout, params, now)
    except PortError as error:
        found.rows.append(_lost("esp32", path, error))
        return
    found.rows += board_rows(found.heard, robot.mind, robot.limits, params)


def _lost(part: str, path: str, error: PortError) -> Row:
    cure = "plug it in again, with a cable that holds; then run doctor again"
    return Row(part, "wire", "stays open", f"{path}: {error}", "bad", cure)


def _bus_result(survey: Survey) -> dict[str, Any]:
    return {
        "baud": survey.baud,
        "read_time_s": survey.read_time,
        "answers_asked": survey.asked,
        "answers_missed": survey.missed,
        "servos": [asdict(seen) for seen in (*survey.here.values(), *survey.elsewhere)],
    }


def _board_result(heard: Heard) -> dict[str, Any]:
    counts, hello = heard.counts, heard.hello
    known = len(counts) > 0
    return {
        "device_id": None if hello is None else hello.device_id,
        "firmware": None if hello is None else list(hello.firmware),
        "reset": None if hello is None else hello.reset.name,
        "rate_hz": heard.rate,
        "readings": len(counts),
        "lost": heard.lost,
        "broken": heard.broken,
        "median_counts": np.median(counts, axis=0).tolist() if known else None,
        "noise_counts": counts.std(axis=0).tolist() if known else None,
    }
