"""Which servos are on a bus, and what their registers hold; nothing moves, nothing is written."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, field
from statistics import median
from typing import Any

from antennate.hardware.doctor.check import Opener
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.esp32.wire import FrameDecoder
from antennate.params.hardware import DoctorParams
from antennate.robots.spec import RobotSpec
from dynamixel_bus import inquiry, packets
from dynamixel_bus.answers import MOTION, Timing, Value
from dynamixel_bus.bus import PING_DATA, Bus
from dynamixel_bus.inquiry import PINGS, Present
from dynamixel_bus.model import RETURN_DELAY_UNIT
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.packets import OVERHEAD

_BAUDS = (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
"""Bits per second at which servos are usually found."""
REGISTERS = (
    "return_delay_time",
    "drive_mode",
    "operating_mode",
    "homing_offset",
    "temperature_limit",
    "max_voltage_limit",
    "min_voltage_limit",
    "velocity_limit",
    "max_position_limit",
    "min_position_limit",
    "shutdown",
    "torque_enable",
    "status_return_level",
    "hardware_error_status",
    "bus_watchdog",
    "pwm_limit",
    "goal_pwm",
    "present_input_voltage",
    "present_temperature",
)
"""Read of every servo; at the same addresses in both models."""

_GAP = 0.05
"""Longest silence before an answer [s]: three times the 16 ms of a slow adapter."""
_BUDGET = 0.25
"""Time for one reading of all [s]: slow answers of 16 ms come in lumps."""
_SAMPLE_TIME = 0.3
"""Time in which an antenna board on the port of the bus is recognised [s]: thirty samples."""


@dataclass(slots=True)
class BusSurvey:
    """What was found on a bus that should run at a number of bits per second.

    Attributes:
        here: Servos that answer at that speed, by id.
        elsewhere: Servos that answer at another one, each with its bits per second.
        registers: Values by id and name, of those that could be read.
        ping_times: Shortest time to a ping's answer beyond wire and return delay, by id [s].
        board: The port carries the frames of an antenna board.
        read_time: Median time of one read of all servos [s], None if none answered.
        fast: They were read with fast sync reads.
        asked: Answers asked for while timing reads.
        missed: Those that did not come.
        echoes: Requests that came back from the adapter itself.
    """

    baud: int
    here: dict[int, Present] = field(default_factory=dict[int, Present])
    elsewhere: list[tuple[int, Present]] = field(default_factory=list[tuple[int, Present]])
    registers: dict[int, dict[str, int]] = field(default_factory=dict[int, dict[str, int]])
    ping_times: dict[int, float] = field(default_factory=dict[int, float])
    board: bool = False
    read_time: float | None = None
    fast: bool = True
    asked: int = 0
    missed: int = 0
    echoes: int = 0

    @property
    def whole(self) -> list[int]:
        """Ids of the servos whose answers are whole."""
        return [servo for servo, present in self.here.items() if present.state == "ok"]

    def result(self) -> dict[str, Any]:
        """Findings of the bus for result.json."""
        return {
            "baud": self.baud,
            "read_time_s": self.read_time,
            "answers_asked": self.asked,
            "answers_missed": self.missed,
            "echoes": self.echoes,
            "servos": [
                asdict(servo)
                | {"baud": self.baud, "registers": self.registers.get(i, {})}
                | {"ping_time": self.ping_times.get(i)}
                for i, servo in self.here.items()
            ]
            + [
                asdict(servo) | {"baud": baud, "registers": {}, "ping_time": None}
                for baud, servo in self.elsewhere
            ],
        }


def survey_bus(
    opener: Opener, robot: RobotSpec, params: DoctorParams, now: Callable[[], float]
) -> BusSurvey:
    """Look at the bus of an expected robot; a few seconds, ten if no servo answers."""
    survey = BusSurvey(robot.baud)
    with master(opener, robot.baud, now) as bus:
        survey.here = _present(bus, robot.ids)
        survey.registers = _registers(bus, survey.whole)
        _time_pings(bus, survey, now)
        _time_reads(bus, survey, params.reads, now)
        survey.echoes = bus.tally.echoes
    if not survey.here:
        survey.board = _antenna_board(opener, now)
    if set(robot.ids) - set(survey.here) and not survey.board:
        survey.elsewhere = _elsewhere(opener, robot, now)
    return survey


@contextlib.contextmanager
def master(opener: Opener, baud: int, now: Callable[[], float]) -> Iterator[Bus]:
    """A patient master of a bus, as long as the context lasts; PortError if it does not open."""
    with opener(baud) as port:
        yield Bus(port, Timing(baud, gap=_GAP), clock=now)


def _present(bus: Bus, expected: Iterable[int]) -> dict[int, Present]:
    """Ids that answer, in rising order."""
    answering = {status.id for status in bus.scan()}
    pings = PINGS if answering else 1
    looks = {i: inquiry.look(bus, i, pings) for i in sorted({*answering, *expected})}
    return {servo: present for servo, present in looks.items() if present is not None}


def _registers(bus: Bus, ids: Iterable[int]) -> dict[int, dict[str, int]]:
    """REGISTERS of servos, as far as they answer."""
    values: dict[int, dict[str, int]] = {servo: {} for servo in ids}
    for name in REGISTERS:
        for servo, value in inquiry.read_some(bus, values, XC430_W240[name]).items():
            values[servo][name] = value
    return {servo: named for servo, named in values.items() if named}


def _antenna_board(opener: Opener, now: Callable[[], float]) -> bool:
    """Whether a port carries the frames of an antenna board."""
    decoder = FrameDecoder()
    with opener(BOARD_BAUD) as port:
        end = now() + _SAMPLE_TIME
        while now() < end:
            decoder.feed(port.read(4096, _GAP))
    return decoder.counters.good + decoder.counters.refused > 0


def _elsewhere(
    opener: Opener, robot: RobotSpec, now: Callable[[], float]
) -> list[tuple[int, Present]]:
    others: list[tuple[int, Present]] = []
    for baud in _BAUDS:
        if baud != robot.baud:
            with master(opener, baud, now) as bus:
                others += [(baud, servo) for servo in _present(bus, ()).values()]
    return others


def _time_pings(bus: Bus, survey: BusSurvey, now: Callable[[], float]) -> None:
    wire = bus.timing.wire(len(packets.ping(1)) + OVERHEAD + PING_DATA)
    for servo in survey.here:
        times: list[float] = []
        for _ in range(PINGS):
            begin = now()
            if isinstance(bus.ping(servo), Value):
                times.append(now() - begin)
        if times:
            delay = survey.registers.get(servo, {}).get("return_delay_time", 0)
            survey.ping_times[servo] = max(min(times) - wire - RETURN_DELAY_UNIT * delay, 0.0)


def _time_reads(bus: Bus, survey: BusSurvey, reads: int, now: Callable[[], float]) -> None:
    ids, times = survey.whole, list[float]()
    for _ in range(reads if ids else 0):
        bus.settle()
        begin = now()
        answers = bus.read_all(ids, MOTION, _BUDGET)
        times.append(now() - begin)
        survey.asked += len(ids)
        survey.missed += sum(not isinstance(answer, Value) for answer in answers.values())
    survey.read_time = median(times) if times else None
    survey.fast = bus.fast
