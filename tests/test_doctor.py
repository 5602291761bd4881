"""The doctor before a twin with one thing wrong: it names that and the cure, and moves nothing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from doctor_rig import ROBOT, Patient, wrong

from antennate.hardware.doctor import board as board_checks
from antennate.hardware.doctor.board import BoardSurvey
from antennate.hardware.doctor.check import grouped, ids_text, latency_row
from antennate.hardware.doctor.checkup import examine
from antennate.hardware.doctor.fix import Change, apply, plan
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.ports.errors import OpenError
from antennate.params.hardware import DoctorParams
from dynamixel_bus.packets import StatusError
from dynamixel_bus.servo import Servo


def memory(patient: Patient) -> list[dict[str, int]]:
    """Registers of all servos up to the goals, without those that time changes."""
    return [
        {r.name: servo.get(r.name) for r in servo.model.registers.values() if r.address < 120}
        for servo in patient.robot.servos
    ]


def test_a_healthy_robot_has_no_row_that_is_not_ok_and_nothing_is_written() -> None:
    patient = Patient()
    before = memory(patient)
    checkup = patient.examine()
    assert wrong(checkup) == {}
    assert len([row for row in checkup.rows if row.part != "robot"]) == 38
    assert memory(patient) == before
    assert sum(servo.eeprom_writes for servo in patient.robot.servos) == 0


def test_B17_an_adapter_that_is_16_ms_late_is_measured_and_its_cure_named() -> None:
    patient = Patient("bus=latency:0.016")
    checkup = patient.examine(esp32=False)
    rows = wrong(checkup)
    assert checkup.bus is not None
    assert list(checkup.bus.ping_times.values()) == pytest.approx([0.016] * 19, abs=2e-4)
    assert set(rows) == {"bus: latency timer", "bus: answer time", "bus: read of all"}
    assert "setserial /dev/bus low_latency" in rows["bus: latency timer"].cure
    assert "/sys/bus/usb-serial/devices/ttyUSB0/latency_timer" in rows["bus: latency timer"].cure
    assert checkup.grade == "bad"


@pytest.mark.parametrize(("timer", "grade"), [("16", "bad"), ("1", "ok")])
def test_B17_the_latency_timer_is_read_from_the_system(
    tmp_path: Path, timer: str, grade: str
) -> None:
    (tmp_path / "ttyUSB7").mkdir()
    file = tmp_path / "ttyUSB7" / "latency_timer"
    file.write_text(timer + "\n")
    row = latency_row("/dev/ttyUSB7", False, DoctorParams(), tmp_path)
    assert row.grade == grade
    assert (f"echo 1 | sudo tee {file}" in row.cure) is (grade == "bad")


def test_B17_late_answers_of_a_twin_are_no_fault_of_an_adapter() -> None:
    ends = os.openpty()
    try:
        row = latency_row(os.ttyname(ends[1]), True, DoctorParams())
    finally:
        for end in ends:
            os.close(end)
    assert row.grade == "bad"
    assert "end other programs" in row.cure
    assert "FTDI" not in row.cure


@pytest.mark.parametrize(
    ("fault", "check", "found", "cure"),
    [
        ("servo:7=silent", "ids", "missing 7", "plug in"),
        ("servo:7=id:99", "ids", "missing 7, not expected 99", "--fix"),
        ("servo:7=id:1", "answers", "doubled 1", "two servos"),
        ("servo:7=bad_crc", "answers", "never whole from 7", "cable"),
        ("servo:7=status_return_level:0", "answers", "pings only from 7", "off and on"),
        ("servo:2=model_number:1200", "models", "(2, 18, 19)", "2: put a servo"),
        ("servo:9=operating_mode:3", "operating mode", "3 (1-5, 9, 18, 19)", "--fix"),
    ],
)
def test_B15_servos_that_are_not_as_expected_are_named_with_the_cure(
    fault: str, check: str, found: str, cure: str
) -> None:
    patient = Patient(fault)
    before = memory(patient)
    row = wrong(patient.examine(esp32=False))[f"bus: {check}"]
    assert found in row.found
    assert cure in row.cure
    assert row.grade == "bad"
    assert memory(patient) == before


def test_B15_servos_of_another_speed_are_found_there() -> None:
    patient = Patient("servo:7=baud_rate:1", "servo:8=baud_rate:4")
    row = wrong(patient.examine(esp32=False))["bus: baud"]
    assert row.found == "17 at 1000000, id 7 at 57600, id 8 at 2000000"


def test_a_bus_where_nobody_answers_says_power_and_wiring() -> None:
    row = wrong(Patient("bus=silent").examine(esp32=False))["bus: baud"]
    assert row.found == "no servo answers at any usual speed"
    assert "supply" in row.cure
    assert "swapped" in row.cure


@pytest.mark.parametrize(
    ("fault", "check", "found", "grade"),
    [
        ("servo:3=return_delay_time:250", "return delay", "500 us (3)", "warn"),
        ("servo:3=homing_offset:7", "homing offset", "7 (3)", "bad"),
        ("servo:12=homing_offset:7", "homing offset", "7 (12)", "bad"),
        ("servo:3=drive_mode:1", "drive mode", "reversed (3)", "bad"),
        ("servo:3=drive_mode:8", "drive mode", "torque by goal (3)", "bad"),
        ("servo:3=max_position_limit:2300", "position limits", "0 to 2300 (3)", "bad"),
        ("servo:3=velocity_limit:200", "velocity limit", "200 (3)", "bad"),
        ("servo:3=shutdown:0", "shuts itself down at", "not all of these (3)", "warn"),
        ("servo:3=present_input_voltage:105", "supply", "10.5 V (3)", "warn"),
        ("servo:3=present_input_voltage:100", "supply", "10.0 V (3)", "bad"),
        ("servo:18=present_input_voltage:75", "supply", "7.5 V (18)", "bad"),
        ("servo:3=present_temperature:71", "temperature", "71 degC (3)", "warn"),
        ("servo:18=present_temperature:71", "temperature", "71 degC (18)", "bad"),
        ("servo:3=overload", "hardware errors", "overload (3)", "bad"),
        ("servo:3=bus_watchdog:-1", "bus watchdog", "tripped (3)", "warn"),
        ("servo:3=goal_pwm:265", "goal PWM", "30 % (3)", "warn"),
        ("servo:3=torque_enable:1", "torque", "on (3)", "bad"),
        ("servo:3=firmware_version:44", "firmware", "44 (3)", "warn"),
    ],
)
def test_what_a_servo_says_of_itself_is_judged(
    fault: str, check: str, found: str, grade: str
) -> None:
    """Limits of both models are their manuals'; 2300 ticks are less than 2048 + 332.

    5.26 rad/s are 219 counts of 0.229 rev/min, and 275 with a quarter more.
    """
    rows = wrong(Patient(fault).examine(esp32=False))
    latched = ["bus: hardware errors"] if fault.startswith("servo:18=present") else []
    slow = ["bus: read of all"] if check == "firmware" else []
    assert list(rows) == [f"bus: {check}", *slow, *latched]  # beyond its limit it latches an error
    row = rows[f"bus: {check}"]
    assert found in row.found
    assert row.grade == grade
    assert row.cure


def test_lost_answers_are_counted() -> None:
    row = wrong(Patient("bus=loss:0.2").examine(esp32=False))["bus: lost answers"]
    assert row.grade == "warn"
    assert " of 380 " in row.found


def test_L14_swapped_ports_are_known_from_both_sides() -> None:
    patient = Patient()
    before = memory(patient)
    rows = wrong(patient.examine(swapped=True))
    assert rows["bus: baud"].found == "the antenna board is on this port"
    assert rows["esp32: greeting"].found == "servos are on this port"
    assert all("swap the ports" in row.cure for row in rows.values())
    assert memory(patient) == before


@pytest.mark.parametrize(
    ("fault", "check", "found", "grade"),
    [
        ("esp32=silent", "greeting", "nothing", "bad"),
        ("esp32=open_left", "left antenna", "wire open", "bad"),
        ("esp32=short_left", "left antenna", "torn off", "bad"),
        ("esp32=right:4200", "right antenna", "short to supply", "bad"),
        ("esp32=left:1450", "left at rest", "b = 0.9", "bad"),
    ],
)
def test_what_the_board_says_is_judged(fault: str, check: str, found: str, grade: str) -> None:
    patient = Patient(fault)
    patient.clock.sleep(0.5)
    row = wrong(patient.examine(bus=False))[f"esp32: {check}"]
    assert found in row.found
    assert row.grade == grade
    assert row.cure


def test_a_board_that_speaks_another_language_is_quoted() -> None:
    text = BoardSurvey(text="MicroPython v1.24 on ESP32\r\n>>> ", received=40)
    other = BoardSurvey(refusals=["the board speaks protocol version 9"], received=40)
    for survey, said in ((text, "'MicroPython v1.24 on ESP32 >>>'"), (other, "version 9")):
        rows = [finding for finding, *_ in board_checks.findings(survey, ROBOT)]
        assert len(rows) == 1
        assert said in rows[0].found
        assert "firmware/" in rows[0].cure


def test_a_port_that_does_not_open_hides_nothing_of_the_other() -> None:
    patient = Patient()

    def refused(baud: int):
        raise OpenError("--bus", "/dev/nowhere", "no permission", "join the group")

    checkup = examine(
        ROBOT, ("/dev/nowhere", refused), ("/dev/esp32", patient.esp32), patient.clock.now
    )
    rows = wrong(checkup)
    assert list(rows) == ["bus: port"]
    assert rows["bus: port"].cure == "join the group"
    assert len(checkup.rows) > 10


# putting right


def test_fix_gives_ids_speeds_modes_and_delays_and_writes_each_once() -> None:
    """A new servo of the factory: id 1, 57600 bit/s, position mode, 500 us; the manual's values."""
    patient = Patient(
        "servo:7=baud_rate:1",
        "servo:7=id:1",
        "servo:7=operating_mode:3",
        "servo:7=return_delay_time:250",
    )
    assert patient.fix() == [
        "servo 1 (at 57600): id 1 -> 7",
        "servo 7 (at 57600): baud rate 57600 -> 1000000",
        "servo 7 (at 1000000): operating mode 3 -> 4",
        "servo 7 (at 1000000): return delay time 250 -> 0",
    ]
    assert wrong(patient.examine()) == {}
    assert [servo.eeprom_writes for servo in patient.robot.servos] == [0] * 6 + [4] + [0] * 12
    assert not any(servo.torque for servo in patient.robot.servos)


def test_fix_sets_what_drive_requires_and_says_what_has_to_follow() -> None:
    patient = Patient(
        "servo:3=min_position_limit:1900",
        "servo:3=max_position_limit:2200",
        "servo:7=max_position_limit:2200",
        "servo:8=drive_mode:9",
        "servo:9=homing_offset:500",
        "servo:19=velocity_limit:100",
    )
    assert patient.fix() == [
        "servo 3 (at 1000000): max position limit 2200 -> 4095",
        "servo 3 (at 1000000): min position limit 1900 -> 0",
        "servo 8 (at 1000000): drive mode 9 -> 0",
        "servo 9 (at 1000000): homing offset 500 -> 0",
        "servo 19 (at 1000000): velocity limit 100 -> 445",
    ]
    assert wrong(patient.examine()) == {}
    assert sum(servo.eeprom_writes for servo in patient.robot.servos) == 5


def test_B18_fix_writes_nothing_where_nothing_differs() -> None:
    patient = Patient()
    apply(patient.bus, Change(3, 1_000_000, "return_delay_time", 250, 0), patient.clock.now)
    assert patient.robot.servos[2].eeprom_writes == 0
    assert patient.fix() == []


@pytest.mark.parametrize(
    "faults",
    [
        ("servo:7=silent", "servo:8=silent", "servo:9=id:99"),
        ("servo:7=id:99", "servo:7=model_number:1200"),
        ("servo:7=id:1",),
    ],
)
def test_fix_gives_no_id_where_it_is_not_plain_whose_it_is(faults: tuple[str, ...]) -> None:
    survey = Patient(*faults).examine(esp32=False).bus
    assert survey is not None
    assert [change for change in plan(survey, ROBOT.robot) if change.register == "id"] == []


def test_fix_takes_torque_off_before_it_writes_eeprom() -> None:
    patient = Patient("servo:3=return_delay_time:250", "servo:3=torque_enable:1")
    assert patient.fix() == ["servo 3 (at 1000000): return delay time 250 -> 0"]
    assert not patient.robot.servos[2].torque


def test_fix_says_so_if_a_servo_does_not_take_it(monkeypatch: pytest.MonkeyPatch) -> None:
    patient = Patient("servo:3=return_delay_time:250")
    monkeypatch.setattr(Servo, "write", lambda *_: StatusError.NONE)
    with pytest.raises(BringUpError, match="return_delay_time 0 in servo 3, found 250"):
        patient.fix()


def test_fix_refuses_a_servo_that_is_not_alone() -> None:
    patient = Patient("servo:7=id:1")
    with pytest.raises(BringUpError, match="servo 1 alone at 1000000, found it collides"):
        apply(patient.bus, Change(1, 1_000_000, "id", 1, 7), patient.clock.now)


def test_ids_and_values_are_said_in_few_words() -> None:
    assert ids_text([9, 1, 2, 3, 5, 6]) == "1-3, 5, 6, 9"
    assert grouped({1: 0, 2: 0, 3: 250}) == "0 (1, 2), 250 (3)"
    assert grouped({1: 0, 2: 0}) == "0"
