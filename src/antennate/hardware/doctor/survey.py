"""Who is on the bus, and what each servo says of itself; nobody moves, nothing is written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from statistics import median

from antennate.hardware.doctor.rows import Opener
from antennate.hardware.dynamixel import inquiry, packets
from antennate.hardware.dynamixel.answers import MOTION, Timing, Value
from antennate.hardware.dynamixel.bus import PING_DATA, Bus
from antennate.hardware.dynamixel.inquiry import PINGS, State
from antennate.hardware.dynamixel.packets import OVERHEAD
from antennate.hardware.dynamixel.tables import (
    RETURN_DELAY_UNIT,
    WATCHDOG_UNIT,
    XC430_W240,
    Register,
)
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.esp32.decoder import FrameDecoder
from antennate.hardware.ports.port import Port
from antennate.params import BoardParams, BusParams, DoctorParams
from antennate.robots.spec import RobotSpec

BAUDS = (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
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
    "present_input_voltage",
    "present_temperature",
)
"""Read of every servo; at the same addresses in both models."""

_PATIENCE = BusParams().patient_gap
_BUDGET = BusParams().patient_budget
_TRIES = BusParams().patient_tries
_SAMPLE_TIME = BoardParams().misplaced


@dataclass(slots=True)
class Seen:
    """One id that was heard.

    Attributes:
        servo: The id.
        baud: Bits per second at which it answers.
        model: Model number, None if no ping came back whole.
        firmware: Firmware version, None likewise.
        state: What its answers are like, as `inquiry.look` says.
        registers: Value by name, of those that could be read.
        ping_time: Shortest time to its answer beyond wire and return delay [s], None if not
            measured.
    """

    servo: int
    baud: int
    model: int | None
    firmware: int | None
    state: State
    registers: dict[str, int] = field(default_factory=dict[str, int])
    ping_time: float | None = None


@dataclass(slots=True)
class Survey:
    """What was found on a bus.

    Attributes:
        baud: Bits per second that are expected.
        here: Servos that answer at that speed, by id.
        elsewhere: Servos that answer at another one.
        board: The port speaks the frames of an antenna board.
        read_time: Median time of one read of all servos [s], None if none answered.
        fast: They were read with fast sync reads.
        asked: Answers asked for while timing reads.
        missed: Those that did not come.
    """

    baud: int
    here: dict[int, Seen] = field(default_factory=dict[int, Seen])
    elsewhere: list[Seen] = field(default_factory=list[Seen])
    board: bool = False
    read_time: float | None = None
    fast: bool = True
    asked: int = 0
    missed: int = 0


def survey(
    opener: Opener,
    robot: RobotSpec,
    params: DoctorParams,
    now: Callable[[], float],
) -> Survey:
    """Look at a bus; a few seconds, ten if nobody answers.

    Args:
        opener: Opens its port.
        robot: The robot expected.
        params: How often to read.
        now: Monotonic time [s].

    Raises:
        PortError: The port is gone or cannot be opened.
    """
    found = Survey(robot.baud)
    with opener(robot.baud) as port:
        bus = master(port, robot.baud, now)
        found.here = who(bus, robot.ids)
        fit = [servo for servo, seen in found.here.items() if seen.state == "ok"]
        for servo, values in read_registers(bus, fit).items():
            found.here[servo].registers = values
        _time_pings(bus, found.here, now)
        _time_reads(bus, fit, found, params.reads, now)
    if not found.here:
        found.board = antenna_board(opener, now)
    if set(robot.ids) - set(found.here) and not found.board:
        found.elsewhere = _elsewhere(opener, robot, now)
    return found


def master(port: Port, baud: int, now: Callable[[], float]) -> Bus:
    """A patient master of a bus."""
    return Bus(port, Timing(baud, gap=_PATIENCE), clock=now)


def who(bus: Bus, expected: Iterable[int]) -> dict[int, Seen]:
    """Ids heard, in rising order."""
    heard = {status.id for status in bus.scan()}
    pings = PINGS if heard else 1
    looked = {servo: look(bus, servo, pings) for servo in sorted({*heard, *expected})}
    return {servo: seen for servo, seen in looked.items() if seen is not None}


def look(bus: Bus, servo: int, pings: int = PINGS) -> Seen | None:
    """One id, None if it is silent."""
    found = inquiry.look(bus, servo, pings)
    if found is None:
        return None
    return Seen(servo, bus.timing.baud, found.model, found.firmware, found.state)


def read_registers(bus: Bus, ids: Iterable[int]) -> dict[int, dict[str, int]]:
    """REGISTERS of servos, as far as they answer."""
    found: dict[int, dict[str, int]] = {servo: {} for servo in ids}
    for name in REGISTERS:
        for servo, value in read_some(bus, found, XC430_W240[name]).items():
            found[servo][name] = value
    return found


def read_some(bus: Bus, ids: Iterable[int], register: Register) -> dict[int, int]:
    """One register of those servos that answer."""
    return inquiry.read_some(bus, ids, register, _TRIES, _BUDGET)


def antenna_board(opener: Opener, now: Callable[[], float]) -> bool:
    """Whether a port speaks the frames of an antenna board."""
    decoder = FrameDecoder()
    with opener(BOARD_BAUD) as port:
        end = now() + _SAMPLE_TIME
        while now() < end:
            decoder.feed(port.read(4096, _PATIENCE))
    return decoder.counters.good + decoder.counters.refused > 0


def _elsewhere(opener: Opener, robot: RobotSpec, now: Callable[[], float]) -> list[Seen]:
    found: list[Seen] = []
    for baud in BAUDS:
        if baud != robot.baud:
            with opener(baud) as port:
                bus = master(port, baud, now)
                heard = {status.id for status in bus.scan()}
                found += [seen for servo in sorted(heard) if (seen := look(bus, servo))]
    return found


def _time_pings(bus: Bus, here: Mapping[int, Seen], now: Callable[[], float]) -> None:
    wire = bus.timing.wire(len(packets.ping(1)) + OVERHEAD + PING_DATA)
    for servo, seen in here.items():
        times: list[float] = []
        for _ in range(PINGS):
            begin = now()
            if isinstance(bus.ping(servo), Value):
                times.append(now() - begin)
        if times:
            delay = RETURN_DELAY_UNIT * seen.registers.get("return_delay_time", 0)
            seen.ping_time = max(min(times) - wire - delay, 0.0)


def _time_reads(
    bus: Bus, ids: list[int], found: Survey, reads: int, now: Callable[[], float]
) -> None:
    times: list[float] = []
    for _ in range(reads if ids else 0):
        bus.settle()
        begin = now()
        said = bus.read_all(ids, MOTION, _BUDGET)
        times.append(now() - begin)
        found.asked += len(ids)
        found.missed += sum(not isinstance(answer, Value) for answer in said.values())
    found.read_time = median(times) if times else None
    found.fast = bus.fast


def watchdog_text(counts: int) -> str:
    """A bus watchdog in words."""
    if counts < 0:
        return "tripped"
    return "off" if counts == 0 else f"{1e3 * WATCHDOG_UNIT * counts:.0f} ms"
