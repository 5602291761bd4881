"""The whole examination: each port by itself, so that one that fails does not hide the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from antennate.hardware.doctor import board_checks, bus_checks
from antennate.hardware.doctor.board_survey import BoardSurvey, survey_board
from antennate.hardware.doctor.bus_survey import BusSurvey, survey_bus
from antennate.hardware.doctor.check import Grade, Opener, Row, worst
from antennate.hardware.doctor.config import DoctorConfig
from antennate.hardware.doctor.ports import latency_row, port_row
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.ports.port import PortError


@dataclass(slots=True)
class Checkup:
    """What was found.

    Attributes:
        rows: One for each check.
        bus: Survey of the bus, None if there was no bus to look at.
        board: Survey of the board, None likewise.
    """

    rows: list[Row] = field(default_factory=list[Row])
    bus: BusSurvey | None = None
    board: BoardSurvey | None = None

    @property
    def grade(self) -> Grade:
        """The worst of all rows."""
        return worst(row.grade for row in self.rows)

    def result(self, changes: Sequence[str] = ()) -> dict[str, Any]:
        """The content of result.json, with the changes that were made before."""
        return {
            "schema": 1,
            "command": "doctor",
            "grade": self.grade,
            "rows": [asdict(row) for row in self.rows],
            "bus": None if self.bus is None else self.bus.result(),
            "esp32": None if self.board is None else self.board.result(),
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
    checkup = Checkup()
    if bus is not None:

        def look_at_bus(opener: Opener) -> list[Row]:
            survey = checkup.bus = survey_bus(opener, robot.robot, robot.doctor, now)
            latency = latency_row(bus[0], bus_checks.slow(survey, robot), robot.doctor)
            checks = bus_checks.checks(survey, robot)
            return [latency, *(check.row("bus", survey, robot) for check in checks)]

        checkup.rows += _port("bus", *bus, robot.robot.baud, look_at_bus)
    if esp32 is not None:

        def look_at_board(opener: Opener) -> list[Row]:
            survey = checkup.board = survey_board(opener, robot.robot, robot.doctor, now)
            checks = board_checks.checks(survey, robot)
            return [check.row("esp32", survey, robot) for check in checks]

        checkup.rows += _port("esp32", *esp32, BOARD_BAUD, look_at_board)
    return checkup


def _port(
    part: str, path: str, opener: Opener, baud: int, look: Callable[[Opener], list[Row]]
) -> list[Row]:
    """Rows of a port, and of what is behind it if it opens."""
    first = port_row(part, path, opener, baud)
    if first.grade == "bad":
        return [first]
    try:
        return [first, *look(opener)]
    except PortError as error:
        cure = "plug it in again, with a cable that holds; then run doctor again"
        return [first, Row(part, "wire", "stays open", f"{path}: {error}", "bad", cure)]
