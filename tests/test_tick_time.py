"""What a tick takes on the wire: by hand, by the bytes before a twin, and what doctor says."""

from __future__ import annotations

from itertools import pairwise

import pytest
from doctor_rig import Patient
from lockstep import BoardPort, LockstepClock
from twin_rig import rig

from antennate.control.loop import run_loop
from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor import bus_checks
from antennate.hardware.doctor.bus_survey import BusSurvey
from antennate.hardware.doctor.check import Finding
from antennate.hardware.dynamixel.tick_time import ADAPTER, tick_time
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from dynamixel_bus.port import Port

ROBOTS = {19: RobotSpec(), 26: RobotSpec.named("scuttle3d")}


@pytest.mark.parametrize("count", ROBOTS)
def test_the_bytes_of_a_tick_are_those_of_protocol_2(count: int) -> None:
    """Packets of 10 bytes and their contents, by the e-Manual: header 4, id, length 2, CRC 2.

    Sync write: instruction, address 2, length 2, then 5 a servo. Fast sync read: the same and one
    a servo, its answer 8 and 8 a servo; slow answers have 11 and the data each. A read of one
    servo: 14 bytes, its answer 11 and the data.
    """
    goals, request = 14 + 5 * count, 14 + count
    singles = 3 * 14 + (11 + 1) + (11 + 1) + (11 + 12)
    fast, slow = 8 + 8 * count, 15 * count
    ids = ROBOTS[count].ids
    for answer, kind in ((fast, True), (slow, False)):
        wanted = 10 * (goals + request + answer + singles) / 1e6
        assert tick_time(ids, 1_000_000, kind) == pytest.approx(wanted)
        assert tick_time(ids, 57_600, kind) == pytest.approx(wanted * 1e6 / 57_600)


class Counting:
    """A port that counts the bytes of both ways."""

    def __init__(self, port: Port) -> None:
        self._port, self.count = port, 0

    def write(self, data: bytes) -> None:
        self.count += len(data)
        self._port.write(data)

    def read(self, most: int, timeout: float) -> bytes:
        data = self._port.read(most, timeout)
        self.count += len(data)
        return data

    def drain(self) -> int:
        return self._port.drain()


@pytest.mark.ci
@pytest.mark.parametrize("count", ROBOTS)
def test_a_walk_before_the_twin_puts_no_more_on_the_wire(count: int) -> None:
    """But for two more questions of two bytes in single ticks, as for the voltage once a round."""
    robot = ROBOTS[count]
    made = rig(
        TwinConfig(robot=robot),
        "open",
        cable=lambda port: port if isinstance(port, BoardPort) else Counting(port),
    )
    wire = made.bus_port
    assert isinstance(wire, Counting)
    assert isinstance(made.clock, LockstepClock)
    counts: list[int] = []

    def go_on(*_: object) -> bool:
        counts.append(wire.count)
        made.session.orders.arm = len(counts) == 100
        return len(counts) < 300

    run_loop(made.session, made.session.control, made.session.period, go_on)
    assert made.session.actuators.enabled
    ticks = [after - before for before, after in pairwise(counts[150:])]
    made.session.release()
    most = tick_time(robot.ids, 10, fast=True)  # bytes
    more = 2 * (14 + 11 + 2)
    assert max(ticks) <= most + more
    assert sorted(ticks)[len(ticks) // 2] >= 0.8 * most


def found(robot: RobotSpec, baud: int, rate: float = 100.0, fast: bool = True) -> Finding:
    config = DoctorConfig.model_validate({"robot": robot.model_dump(), "control": {"rate": rate}})
    survey = BusSurvey(baud)
    survey.fast = fast
    return bus_checks.tick_finding(survey, config)


def test_26_servos_fit_10_ms_at_1_mbit_with_more_than_the_adapters_time_to_spare() -> None:
    for fast in (True, False):
        assert found(ROBOTS[26], 1_000_000, fast=fast).grade == "ok"
        assert tick_time(ROBOTS[26].ids, 1_000_000, fast) < 0.01 - ADAPTER


def test_doctor_names_the_slowest_speed_at_which_a_tick_fits() -> None:
    finding = found(ROBOTS[26], 57_600)
    assert finding.grade == "bad"
    assert "84.9 ms for 26 servos at 57600" in finding.found
    assert "set robot.baud to 1000000" in finding.cure
    assert "set robot.baud to 3000000" in found(ROBOTS[26], 57_600, 250.0).cure
    assert found(ROBOTS[26], 57_600, 1000.0).cure == "lower control.rate"


def test_doctor_shows_the_row_of_a_robot_before_it() -> None:
    checkup = Patient().examine(esp32=False)
    [row] = [row for row in checkup.rows if row.check == "tick on the wire"]
    assert row.grade == "ok"
    assert row.found.startswith("3.9 ms for 19 servos")
