"""The whole examination: each port by itself, so that one that fails does not hide the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor import board as board_checks
from antennate.hardware.doctor import bus_checks, knowledge
from antennate.hardware.doctor.board import BoardSurvey, survey_board
from antennate.hardware.doctor.bus_survey import BusSurvey, survey_bus
from antennate.hardware.doctor.check import Grade, Opener, Row, latency_row, port_row, worst
from antennate.hardware.esp32.board import BOARD_BAUD
from dynamixel_bus.port import PortError


@dataclass(slots=True)
class Checkup:
    """A row for each check, and the surveys of the ports that were looked at.

    Attributes:
        walks: Whether it is of a robot with legs, not of a bench.
    """

    rows: list[Row] = field(default_factory=list[Row])
    bus: BusSurvey | None = None
    board: BoardSurvey | None = None
    walks: bool = True

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
            "walks": self.walks,
            "rows": [asdict(row) for row in self.rows],
            "bus": None if self.bus is None else self.bus.result(),
            "esp32": None if self.board is None else self.board.result(),
            "changes": list(changes),
        }


def examine(
    config: DoctorConfig,
    bus: tuple[str, Opener] | None,
    esp32: tuple[str, Opener] | None,
    now: Callable[[], float],
) -> Checkup:
    """Examine a robot at rest; nothing is written to it and nothing moves.

    Args:
        config: What is expected, its calibration already in place.
        bus: Path and opener of the bus, None to leave it out.
        esp32: The same of the antenna board.
        now: Monotonic time [s].
    """
    checkup = Checkup(walks=config.robot.leg_count > 0)

    def bus_rows(path: str, opener: Opener) -> Iterator[Row]:
        survey = checkup.bus = survey_bus(opener, config.robot, config.doctor, now)
        yield latency_row(path, bus_checks.slow(survey, config), config.doctor)
        for finding, check, expected in bus_checks.findings(survey, config):
            yield finding.row("bus", check, expected)

    def board_rows(path: str, opener: Opener) -> Iterator[Row]:
        survey = checkup.board = survey_board(opener, config.robot, config.doctor, now)
        survey.radio = path.startswith("udp:")
        for finding, check, expected in board_checks.findings(survey, config):
            yield finding.row("esp32", check, expected)

    checkup.rows += knowledge.rows(config, bus is not None, esp32 is not None)
    if bus is not None:
        checkup.rows += _rows("bus", *bus, config.robot.baud, bus_rows)
    if esp32 is not None:
        checkup.rows += _rows("esp32", *esp32, BOARD_BAUD, board_rows)
    return checkup


def _rows(
    part: str, path: str, opener: Opener, baud: int, behind: Callable[[str, Opener], Iterable[Row]]
) -> Iterator[Row]:
    """Rows of a port, and of what is behind it if it opens."""
    first = port_row(part, path, opener, baud)
    yield first
    if first.grade == "bad":
        return
    try:
        yield from behind(path, opener)
    except PortError as error:
        cure = "plug it in again, with a cable that holds; then run doctor again"
        yield Row(part, "wire", "stays open", f"{path}: {error}", "bad", cure)
