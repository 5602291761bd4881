"""The shipped `drive` before the shipped `twin`, whatever happens: all of it in the slow tier."""

from __future__ import annotations

import os
import random
import sys
from pathlib import Path
from typing import Any

import pytest

from antennate.errors import BadInputError
from antennate.robots.spec import RobotSpec
from antennate.studies.run_directory import RunDirectory

FOLDER = Path(__file__).parents[1] / "benchmarks"
RUNS = 20
"""Runs of each case, each broken at another moment."""
LATE = 0.05
"""A tick that begins as late [s] costs answers enough for SILENT_SERVO: five at 100 Hz."""
ALL = ", ".join(str(servo) for servo in sorted(RobotSpec().ids))
"""No fault of one joint makes all servos silent: the process of the twin stood still."""
ATTEMPTS = 3


@pytest.fixture(scope="module")
def cases() -> Any:
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are not part of this copy")
    sys.path.insert(0, str(FOLDER))
    try:
        import drive_faults  # type: ignore[import-not-found]

        return drive_faults
    finally:
        sys.path.remove(str(FOLDER))


def as_documented(cases: Any, case: str) -> None:
    found = [cases.once(case, random.Random(f"slow {case} {n}")) for n in range(RUNS)]
    assert [one for one in found if not one["as_documented"]] == []


@pytest.mark.slow
@pytest.mark.parametrize("case", ["nothing", "board reset", "board replugged"])
def test_E1_L12_a_board_that_comes_back_ends_no_drive(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["bus replugged", "bus silent"])
def test_B6_a_lost_bus_is_a_fault_and_its_servos_are_named(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    ["servo silent", "servo reboots", "servo overloaded", "servo 50 ms late", "servo bad CRC"],
)
def test_B1_B3_B11_B12_one_bad_servo_is_a_fault_that_names_it(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        "leg cut",
        "yaw cut",
        "leg frozen",
        "yaw frozen",
        "yaw out of limits",
        "leg leaps",
        "mode changed",
    ],
)
def test_B20_B21_B22_B23_a_joint_that_does_wrong_is_a_fault_that_names_it(
    cases: Any, case: str
) -> None:
    for n in range(RUNS):
        for attempt in range(ATTEMPTS):
            found = cases.once(case, random.Random(f"slow {case} {n} {attempt}"))
            if found["as_documented"] or not was_late(found):
                break
        assert found["as_documented"], found


def was_late(found: dict[str, Any]) -> bool:
    """Whether result.json shows that the machine stood still."""
    pace = found.get("pace") or {"worst_lateness_s": 0.0}
    return pace["worst_lateness_s"] >= LATE or f"(servo {ALL})" in found.get("why", "")


@pytest.mark.parametrize(
    ("lateness", "why", "late"),
    [
        (0.02, "SILENT_SERVO: no answers (servo 2)", False),
        (0.06, "PAUSE: the loop stood still (0.13 s)", True),
        (0.02, f"SILENT_SERVO: no answers (servo {ALL})", True),
    ],
)
def test_only_a_machine_that_was_late_excuses_a_run(lateness: float, why: str, late: bool) -> None:
    assert was_late({"pace": {"worst_lateness_s": lateness}, "why": why}) is late
    assert not was_late({"pace": None})


@pytest.mark.slow
@pytest.mark.parametrize("case", ["BER 1e-5", "BER 1e-4", "BER 1e-3", "BER 1e-2"])
def test_L1_wrong_bits_on_both_wires(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["hum 400", "stuck +-1", "sticky codes"])
def test_S4_S14_noise_and_stuck_readings_hold_and_are_named(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
def test_B25_the_echo_of_an_adapter_is_dropped_and_named(cases: Any) -> None:
    as_documented(cases, "echo")


@pytest.mark.slow
def test_B13_a_supply_that_sags(cases: Any) -> None:
    as_documented(cases, "supply sags 1 V/s")


@pytest.mark.slow
@pytest.mark.parametrize("case", ["SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP"])
def test_B19_signals_end_it_in_order(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["SIGKILL", "SIGSTOP"])
def test_B7_T5_a_program_that_is_killed_or_stands_still(cases: Any, case: str) -> None:
    as_documented(cases, case)


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to mount a small disk")
def test_G4_a_full_disk_costs_the_log_and_not_the_result(cases: Any) -> None:
    as_documented(cases, "full disk")


def test_G4_room_for_the_result_is_kept_while_a_robot_is_driven(tmp_path: Path) -> None:
    with RunDirectory.create("drive", tmp_path / "run") as folder:
        folder.keep_room()
        kept = [path.stat().st_size for path in folder.path.iterdir()]
        folder.finish({"schema": 1})
        assert {path.name for path in folder.path.iterdir()} == {"files.txt", "result.json"}
    assert sum(kept) >= 2**16


WALKED = {"code": 0, "worst_state": "DEGRADED", "ended": "the end of its time"}
FAULT = {"code": 2, "worst_state": "FAULT", "ended": "FAULT"}
OFF: dict[str, Any] = {"torque_off": True, "servos_on": []}
NAMED: dict[str, Any] = {"torque_off": False, "servos_on": [7]}


@pytest.mark.parametrize(
    ("found", "documented"),
    [
        (WALKED | OFF, True),
        (FAULT | OFF, True),
        (FAULT | NAMED, True),
        (WALKED | NAMED, False),
        (WALKED | OFF | {"ended": "FAULT"}, False),
        (WALKED | OFF | {"code": 1}, False),
        (FAULT | OFF | {"code": 0}, False),
        (FAULT | OFF | {"worst_state": "HOLD"}, False),
        (FAULT | {"torque_off": None, "servos_on": []}, False),
    ],
)
def test_a_bad_wire_is_walked_on_or_is_a_fault_and_nothing_else(
    cases: Any, found: dict[str, Any], documented: bool
) -> None:
    assert cases.CASES["BER 1e-3"][1](found) is documented


def test_a_case_whose_fault_the_twin_does_not_know_is_refused(cases: Any) -> None:
    with pytest.raises(BadInputError):
        cases.fault("link=ber:1e-3")
