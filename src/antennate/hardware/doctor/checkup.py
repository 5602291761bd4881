"""The whole examination: each port by itself, so that one that fails does not hide the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from antennate.hardware.doctor.antenna import board_rows, film_rows
from antennate.hardware.doctor.hearing import Heard, listen
from antennate.hardware.doctor.pace import latency_row, slow_adapter
from antennate.hardware.doctor.ports import port_row
from antennate.hardware.doctor.rows import Opener, Row, worst
from antennate.hardware.doctor.servos import bus_rows
from antennate.hardware.doctor.survey import Survey, survey
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.ports.port import PortError
from antennate.hardware.robot import RobotConfig
from antennate.params import DoctorParams


class DoctorConfig(RobotConfig):
    """The robot, and what is good."""

    doctor: DoctorParams = DoctorParams()


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
    robot: DoctorConfig,
    bus: tuple[str, Opener] | None,
    esp32: tuple[str, Opener] | None,
    now: Callable[[], float],
) -> Checkup:
    """Examine a robot at rest; nothing is written to it and nothing moves.

    Args:
        robot: What is expected, its calibration already in place.
        bus: Path and opener of the bus, None to leave it out.
        esp32: The same of the antenna board.
        now: Monotonic time [s].
    """
    found, params = Checkup(), robot.doctor
    if bus is not None:

        def look(opener: Opener) -> list[Row]:
            found.survey = seen = survey(opener, robot.robot, params, now)
            latency = latency_row(bus[0], slow_adapter(seen, params), params)
            return [latency, *bus_rows(seen, robot.robot, robot.limits, params)]

        found.rows += _examined("bus", *bus, robot.robot.baud, look)
    if esp32 is not None:

        def hear(opener: Opener) -> list[Row]:
            found.heard = listen(opener, robot.robot, params, now)
            rows = board_rows(found.heard, robot.control, robot.limits, params)
            return rows + film_rows(found.heard.hello, robot.sensor_id)

        found.rows += _examined("esp32", *esp32, BOARD_BAUD, hear)
    return found


def _examined(
    part: str, path: str, opener: Opener, baud: int, look: Callable[[Opener], list[Row]]
) -> list[Row]:
    """Rows of a port, and of what is behind it if it opens."""
    first = port_row(part, path, opener, baud)
    if first.verdict == "bad":
        return [first]
    try:
        return [first, *look(opener)]
    except PortError as error:
        return [first, _lost(part, path, error)]


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
