"""What each register does, as its section in the manual says, through bytes in invented time."""

from __future__ import annotations

import inspect
import itertools
import math
import sys
from collections.abc import Callable

import pytest
from driven_bench import DRIVEN, DrivenBench
from manual_tables import BAUD_RATES, NO_LOAD_SPEED, PAGES, STALL_CURRENT, Page
from servo_bench import (
    ACCESS,
    INSTRUCTION,
    LIMIT,
    NONE,
    RANGE,
    RESULT_FAIL,
    Bench,
)

TURN = 4096
RPM = 0.229
VELOCITY, POSITION, EXTENDED, CURRENT, CURRENT_POSITION, PWM = 1, 3, 4, 0, 5, 16


def effect_model_number(bench: Bench) -> None:
    (said,) = bench.ask(1)
    assert int.from_bytes(said.data[:2], "little") == bench.page.model


def effect_model_information(bench: Bench) -> None:
    assert bench.put("model_information", 1) == ACCESS


def effect_firmware_version(bench: Bench) -> None:
    (said,) = bench.ask(1)
    assert said.data[2] == bench.get("firmware_version")


def effect_id(bench: Bench) -> None:
    assert bench.put("id", 252) == NONE
    assert bench.ask(1, to=1) == []
    assert bench.ask(1, to=252)[0].id == 252


def effect_baud_rate(bench: Bench) -> None:
    for code, baud in enumerate(BAUD_RATES[: 7 if bench.page.model == 1200 else 8]):
        assert bench.put("baud_rate", code) == NONE
        for speed in (*BAUD_RATES, 19_200, 500_000, 10_500_000):
            bench.bus.master_baud = speed
            assert len(bench.ask(1)) == (speed == baud), (baud, speed)
        bench.bus.master_baud = baud


def effect_return_delay_time(bench: Bench) -> None:
    """2 us a count, 500 us as delivered; the ping has 10 bytes, its answer 14."""
    ping = bytes.fromhex("FF FF FD 00 01 03 00 01 19 4E")
    for counts, delay in ((250, 500e-6), (0, 0.0), (100, 200e-6)):
        assert bench.put("return_delay_time", counts) == NONE
        begin = bench.t
        bench.bus.receive(begin, ping)
        assert bench.bus.next_time() == pytest.approx(begin + 24 * 10e-6 + delay, abs=1e-7)
        bench.ask(1)


def effect_drive_mode(bench: Bench) -> None:
    """Bit 0 turns goal and present position round: the shaft goes the other way."""
    here = bench.servo.motion.shaft.position
    assert bench.put("drive_mode", 1) == NONE
    assert bench.get("present_position") == TURN - 2048
    bench.mode(POSITION)
    assert bench.put("goal_position", 2048 + 500) == NONE
    bench.wait(1.0)
    assert bench.get("present_position") == 2548
    assert bench.servo.motion.shaft.position == pytest.approx(here - 500)


def effect_operating_mode(bench: Bench) -> None:
    """Gains, profile and goals are reset by a change."""
    for name, value in (("position_p_gain", 5), ("profile_velocity", 7), ("goal_pwm", 11)):
        assert bench.put(name, value) == NONE
    assert bench.put("operating_mode", EXTENDED) == NONE
    gain = bench.page.row("position_p_gain").initial
    assert bench.get("position_p_gain") == gain
    assert (bench.get("profile_velocity"), bench.get("goal_pwm")) == (0, 885)


def effect_secondary_id(bench: Bench) -> None:
    """The example of the section, with three servos."""
    for servo in (1, 2, 3):
        assert bench.put("secondary_id", 3, to=servo) == NONE
    assert bench.put("led", 1, to=3) == NONE  # only servo 3 answers
    assert [bench.get("led", to=servo) for servo in (1, 2, 3)] == [1, 1, 1]
    for servo in (1, 2, 3):
        assert bench.put("secondary_id", 100, to=servo) == NONE
    led = bench.page.row("led").address
    assert bench.ask(3, bytes([led, 0, 0]), to=100) == []
    assert [bench.get("led", to=servo) for servo in (1, 2, 3)] == [0, 0, 0]
    bench.ask(3, bytes([9, 0, 0]), to=100)  # not the EEPROM
    assert bench.get("return_delay_time") == 250


def effect_protocol_type(bench: Bench) -> None:
    if bench.page.model != 1200:
        assert bench.put("protocol_type", 1) in (NONE, None)
        assert bench.ask(1) == []


def effect_homing_offset(bench: Bench) -> None:
    """Present Position = Actual Position + Homing Offset; in position mode up to 1024."""
    for mode, offset, acts in (
        (POSITION, 1024, True),
        (POSITION, -1024, True),
        (POSITION, 1025, False),
        (EXTENDED, 1025, True),
        (EXTENDED, -1_044_479, True),
    ):
        assert bench.put("operating_mode", mode) == NONE
        assert bench.put("homing_offset", offset) == NONE
        assert bench.get("present_position") == 2048 + (offset if acts else 0)
    assert bench.put("homing_offset", 1000) == NONE
    assert bench.put("torque_enable", 1) == NONE
    assert bench.put("goal_position", 3500) == NONE
    bench.wait(1.0)
    assert bench.get("present_position") == 3500
    assert bench.servo.motion.shaft.position == pytest.approx(2500)


def effect_moving_threshold(bench: Bench) -> None:
    bench.mode(VELOCITY)
    assert bench.put("goal_velocity", 50) == NONE
    bench.wait(2.0)
    assert bench.get("moving") == 1
    bench.put("torque_enable", 0)
    bench.wait(1.0)
    assert bench.put("moving_threshold", 60) == NONE
    bench.put("torque_enable", 1)
    bench.put("goal_velocity", 50)
    bench.wait(2.0)
    assert bench.get("present_velocity") == 50
    assert bench.get("moving") == 0


def effect_temperature_limit(bench: Bench) -> None:
    bench.put("torque_enable", 1)
    bench.servo.set("present_temperature", bench.get("temperature_limit"))
    assert bench.get("hardware_error_status") == 0
    bench.servo.set("present_temperature", bench.get("temperature_limit") + 1)
    bench.wait(0.01)
    assert bench.get("hardware_error_status") == 0x04
    assert bench.get("torque_enable") == 0


def effect_max_voltage_limit(bench: Bench) -> None:
    bench.servo.set("present_input_voltage", bench.get("max_voltage_limit") + 1)
    bench.wait(0.01)
    assert bench.get("hardware_error_status") == 0x01


def effect_min_voltage_limit(bench: Bench) -> None:
    bench.servo.set("present_input_voltage", bench.get("min_voltage_limit") - 1)
    bench.wait(0.01)
    assert bench.get("hardware_error_status") == 0x01


def effect_pwm_limit(bench: Bench) -> None:
    assert bench.put("pwm_limit", 300) == NONE
    assert bench.put("goal_pwm", 301) == LIMIT
    assert bench.put("operating_mode", PWM) == NONE
    assert bench.put("goal_pwm", 300) == NONE


def effect_current_limit(bench: Bench) -> None:
    assert bench.put("current_limit", 100) == NONE
    assert bench.put("goal_current", 101) == LIMIT
    assert bench.put("goal_current", -100) == NONE


def effect_velocity_limit(bench: Bench) -> None:
    assert bench.put("velocity_limit", 20) == NONE
    assert bench.put("goal_velocity", 21) == LIMIT
    assert bench.put("profile_velocity", 21) == LIMIT
    assert bench.put("profile_velocity", 20) == NONE


def effect_max_position_limit(bench: Bench) -> None:
    assert bench.put("max_position_limit", 3000) == NONE
    assert bench.put("goal_position", 3001) == LIMIT
    assert bench.put("goal_position", 3000) == NONE


def effect_min_position_limit(bench: Bench) -> None:
    assert bench.put("min_position_limit", 1000) == NONE
    assert bench.put("goal_position", 999) == LIMIT
    bench.put("operating_mode", EXTENDED)  # where they are not used
    assert bench.put("goal_position", 999) == NONE


def effect_startup_configuration(bench: Bench) -> None:
    """Bit 0 brings torque at power-on, bit 1 takes the RAM from the backup."""
    bench.put("position_p_gain", 123)
    assert bench.ask(0x20, b"\x01CTRL")[0].error == NONE
    assert bench.put("startup_configuration", 3) == NONE
    bench.ask(8)
    bench.wait(1.0)
    assert (bench.get("torque_enable"), bench.get("position_p_gain")) == (1, 123)


def effect_pwm_slope(bench: Bench) -> None:
    """The example of the section: 140 counts are 276.84 mV/ms, 18.06 ms to full drive at 5 V."""
    for slope, time in ((140, 18.06e-3), (70, 36.1e-3)):
        bench.put("torque_enable", 0)
        assert bench.put("pwm_slope", slope) == NONE
        bench.mode(PWM)
        bench.put("goal_pwm", 0)
        bench.wait(1.0)
        bench.servo.write(100, (885).to_bytes(2, "little"))
        bench.wait(time - 2e-3)
        assert bench.servo.get("present_pwm") < 885
        bench.wait(3e-3)
        assert bench.servo.get("present_pwm") == 885


def effect_shutdown(bench: Bench) -> None:
    """An error takes the torque if its bit is set, and only then is torque refused."""
    bench.put("shutdown", 0x20)
    bench.put("torque_enable", 1)
    bench.servo.fail(0x10)
    assert bench.get("torque_enable") == 1
    bench.put("torque_enable", 0)
    assert bench.put("torque_enable", 1) == NONE
    bench.servo.fail(0x20)
    assert bench.get("torque_enable") == 0
    assert bench.put("torque_enable", 1) == RESULT_FAIL
    bench.ask(8)
    bench.wait(0.5)
    assert bench.put("torque_enable", 1) == NONE


def effect_torque_enable(bench: Bench) -> None:
    assert bench.put("goal_position", 3000) == NONE
    bench.wait(0.5)
    assert bench.get("present_position") == 2048
    assert bench.put("torque_enable", 1) == NONE
    bench.wait(1.0)
    assert bench.get("present_position") == 3000
    assert bench.put("return_delay_time", 0) == ACCESS


def effect_led(bench: Bench) -> None:
    assert bench.put("led", 1) == NONE
    assert bench.get("led") == 1
    bench.ask(8)
    bench.wait(0.5)
    assert bench.get("led") == 0


def effect_status_return_level(bench: Bench) -> None:
    for level, answers in ((2, [1, 1, 1]), (1, [1, 1, 0]), (0, [1, 0, 0])):
        bench.servo.set("status_return_level", level)
        asked = (1, b""), (2, b"\x84\0\x04\0"), (3, b"\x41\0\x01")
        assert [len(bench.ask(kind, params)) for kind, params in asked] == answers


def effect_registered_instruction(bench: Bench) -> None:
    """Reg Write waits for Action; an Action without one is an Instruction Error."""
    assert bench.ask(5)[0].error == INSTRUCTION
    assert bench.ask(4, b"\x41\0\x01")[0].error == NONE
    assert (bench.get("registered_instruction"), bench.get("led")) == (1, 0)
    assert bench.ask(5)[0].error == NONE
    assert (bench.get("registered_instruction"), bench.get("led")) == (0, 1)
    assert bench.ask(5)[0].error == INSTRUCTION
    assert bench.ask(4, b"\x41\0\x07")[0].error == RANGE
    assert bench.get("registered_instruction") == 0


def effect_hardware_error_status(bench: Bench) -> None:
    assert not bench.ask(1)[0].alert
    bench.servo.fail(0x20)
    assert bench.ask(1)[0].alert
    bench.ask(8)
    bench.wait(0.5)
    assert not bench.ask(1)[0].alert


def effect_velocity_p_gain(bench: Bench) -> None:
    """Without a gain there is no drive."""
    bench.mode(VELOCITY)
    bench.put("velocity_i_gain", 0)
    bench.put("velocity_p_gain", 0)
    bench.put("goal_velocity", 100)
    bench.wait(1.0)
    assert bench.get("present_velocity") == 0
    bench.put("velocity_p_gain", 100)
    bench.wait(1.0)
    assert 10 < bench.get("present_velocity") < 90


def effect_velocity_i_gain(bench: Bench) -> None:
    """It takes away what the proportional part leaves."""
    bench.mode(VELOCITY)
    bench.put("goal_velocity", 100)
    bench.wait(2.0)
    assert bench.get("present_velocity") == 100


def effect_position_p_gain(bench: Bench) -> None:
    """Drive for a distance: Kp = P / 128 in PWM a pulse; 256 as measured on an XL330."""
    bench.mode(POSITION)
    for name in ("position_p_gain", "position_d_gain"):
        bench.put(name, 0)
    bench.put("goal_position", 3000)
    bench.wait(0.5)
    assert bench.get("present_position") == 2048
    bench.servo.write(84, (13).to_bytes(2, "little"))
    bench.bus.advance(bench.t + 3e-3)
    pwm = 13 / bench.divisor * 952
    assert bench.servo.get("present_pwm") == pytest.approx(pwm, abs=3)


def effect_position_i_gain(bench: Bench) -> None:
    bench.mode(POSITION)
    for name in ("position_p_gain", "position_d_gain"):
        bench.put(name, 0)
    bench.put("position_i_gain", 100)
    bench.put("goal_position", 2148)
    bench.wait(0.2)
    assert bench.get("present_position") > 2049


def effect_position_d_gain(bench: Bench) -> None:
    """More of it makes the way slower."""
    way: list[int] = []
    for gain in (0, 16_383):
        bench.mode(POSITION)
        bench.put("goal_position", 2048)
        bench.wait(1.0)
        bench.put("position_d_gain", gain)
        bench.put("goal_position", 2548)
        bench.wait(0.05)
        way.append(bench.get("present_position"))
    assert way[1] < way[0] - 50


def fed_forward(bench: Bench, gain: str, value: int, after: float) -> int:
    """PWM in the profile of a long way, that gain alone: 100 x 214.577 rev/min², 100 x 0.229."""
    bench.mode(EXTENDED)
    for name in ("position_p_gain", "position_i_gain", "position_d_gain"):
        bench.put(name, 0)
    bench.put("profile_acceleration", 100)
    bench.put("profile_velocity", 100)
    assert bench.put(gain, value) == NONE
    begin = bench.t
    bench.put("goal_position", bench.get("present_position") + 3 * TURN)
    bench.bus.advance(begin + after)
    bench.t = max(bench.t, begin + after)
    return bench.servo.get("present_pwm")


def effect_feedforward_2nd_gain(bench: Bench) -> None:
    """K = gain / 4, on the acceleration: 24 414 pulses/s², for 64 ms; none in the cruise."""
    pwm = 16_383 / 4 * 24_414 * 1e-6
    assert fed_forward(bench, "feedforward_2nd_gain", 16_383, 0.5) == 0
    bench = Bench(bench.page)
    bench.wait(1.0)
    assert fed_forward(bench, "feedforward_2nd_gain", 0, 0.0) == 0
    bench.put("feedforward_2nd_gain", 16_383)
    bench.put("goal_position", bench.get("goal_position") - 3 * TURN)
    assert bench.servo.get("present_pwm") == pytest.approx(-pwm, rel=0.05)


def effect_feedforward_1st_gain(bench: Bench) -> None:
    """K = gain / 4, on the speed: 1563 pulses/s, after the acceleration."""
    pwm = 400 / 4 * 1563e-3
    assert fed_forward(bench, "feedforward_1st_gain", 400, 0.5) == pytest.approx(pwm, rel=0.02)


def effect_bus_watchdog(bench: Bench) -> None:
    """The eight steps of the example of the section."""
    bench.mode(VELOCITY)
    bench.put("goal_velocity", 50)
    bench.put("bus_watchdog", 100)
    bench.wait(1.9)
    assert bench.servo.get("bus_watchdog") == 100
    assert bench.servo.get("moving") == 1
    bench.wait(0.3)
    assert bench.get("bus_watchdog") == -1
    assert bench.get("moving") == 0
    assert bench.put("goal_velocity", 150) == RANGE
    assert bench.put("bus_watchdog", 5) == RANGE
    assert bench.put("bus_watchdog", 0) == NONE
    assert bench.put("goal_velocity", 150) == NONE
    bench.wait(1.0)
    assert bench.get("present_velocity") > 100


def effect_goal_pwm(bench: Bench) -> None:
    """In its mode the drive itself: a half gives half the unloaded speed of the datasheet."""
    bench.mode(PWM)
    for duty in (885, 442, -885):
        bench.put("goal_pwm", duty)
        bench.wait(1.0)
        expected = duty / 885 * NO_LOAD_SPEED[bench.page.model] / RPM
        assert bench.get("present_velocity") == pytest.approx(expected, abs=1)
        assert bench.get("present_pwm") == duty
    bench.mode(POSITION)  # elsewhere a limit
    bench.put("goal_pwm", 100)
    bench.put("goal_position", 2048 if bench.get("present_position") > 3000 else 4000)
    bench.wait(0.1)
    assert abs(bench.get("present_pwm")) == 100


def effect_goal_current(bench: Bench) -> None:
    """The torque, in its mode; a limit of it in mode 5. An unloaded shaft runs away."""
    bench.mode(CURRENT)
    bench.put("goal_current", 50)  # less than friction
    bench.wait(0.5)
    assert bench.get("present_velocity") == 0
    bench.put("goal_current", 400)
    bench.wait(0.02)
    assert bench.get("present_velocity") > 50
    bench.put("goal_current", -400)
    bench.wait(1.0)
    assert bench.get("present_velocity") < -50
    bench.put("goal_current", 0)
    bench.wait(2.0)
    assert bench.get("present_velocity") == 0
    bench.mode(CURRENT_POSITION)
    start = bench.get("present_position")
    bench.put("goal_current", 200)
    bench.put("goal_position", start + 2000)
    bench.wait(0.05)
    assert bench.servo.get("present_current") == pytest.approx(200, abs=3)
    bench.wait(4.0)
    assert bench.get("present_position") == start + 2000


def effect_goal_velocity(bench: Bench) -> None:
    bench.mode(VELOCITY)
    for speed in (100, -100):
        bench.put("goal_velocity", speed)
        bench.wait(3.0)
        before, begin = bench.servo.position, bench.t
        bench.wait(1.0)
        turned = (bench.servo.position - before) / (bench.t - begin) / TURN * 60
        assert turned == pytest.approx(speed * RPM, rel=0.002)


def effect_profile_velocity(bench: Bench) -> None:
    """A rectangle without an acceleration: its speed, and the time for a way."""
    bench.mode(EXTENDED)
    bench.put("profile_velocity", 50)
    bench.put("goal_position", 2048 + TURN)
    begin = bench.t
    bench.wait(1.0)
    assert bench.get("velocity_trajectory") == 50
    assert bench.get("present_velocity") == pytest.approx(50, abs=1)
    while bench.servo.get("moving_status") & 0x02:
        bench.wait(0.01)
    assert bench.t - begin == pytest.approx(60 / (50 * RPM), abs=0.08)


def effect_profile_acceleration(bench: Bench) -> None:
    """A trapezoid: t1 = 64 ms * V / A; in velocity mode a ramp."""
    bench.mode(VELOCITY)
    bench.put("profile_acceleration", 10)
    bench.put("goal_velocity", 100)
    bench.wait(0.32 - 0.05)
    assert bench.get("velocity_trajectory") == pytest.approx(50, abs=9)
    bench.wait(0.4)
    assert bench.get("velocity_trajectory") == 100
    bench.mode(EXTENDED)
    bench.put("profile_acceleration", 10)
    bench.put("profile_velocity", 100)
    bench.put("goal_position", bench.get("present_position") + 3 * TURN)
    seen: list[tuple[float, int]] = []
    for _ in range(130):
        bench.wait(0.01)
        seen.append((bench.t, bench.servo.get("velocity_trajectory")))
    rising = [t for t, speed in seen if 10 <= speed <= 90]
    assert rising[-1] - rising[0] == pytest.approx(0.8 * 0.64, abs=0.03)


def effect_goal_position(bench: Bench) -> None:
    bench.mode(POSITION)
    for goal in (0, 4095, 1234):
        assert bench.put("goal_position", goal) == NONE
        bench.wait(2.0)
        assert bench.get("present_position") == goal
    assert bench.put("goal_position", 4096) == LIMIT
    assert bench.put("goal_position", -1) == LIMIT
    bench.mode(EXTENDED)
    assert bench.put("goal_position", 1_048_576) in (RANGE, LIMIT)
    assert bench.put("goal_position", -1_048_575) == NONE
    bench.put("goal_position", 3 * TURN)
    bench.wait(6.0)
    assert bench.get("present_position") == 3 * TURN
    if CURRENT_POSITION in bench.page.modes:
        bench.mode(CURRENT_POSITION)
        assert bench.put("goal_position", 1_048_575) == NONE


def effect_realtime_tick(bench: Bench) -> None:
    """Milliseconds that begin anew after 32 767."""
    first = bench.get("realtime_tick")
    bench.wait(1.0 - 0.05)
    assert (bench.get("realtime_tick") - first) % 32_768 == pytest.approx(1000, abs=2)
    bench.bus.advance(bench.t + 32.768)
    bench.t += 32.768
    assert bench.get("realtime_tick") < 32_768


def effect_moving(bench: Bench) -> None:
    """Set while a profile goes on, however slow."""
    bench.mode(POSITION)
    assert bench.get("moving") == 0
    bench.put("profile_velocity", 1)
    bench.put("goal_position", 2148)
    bench.wait(1.0)
    assert abs(bench.get("present_velocity")) <= 2
    assert bench.get("moving") == 1
    bench.wait(8.0)
    assert bench.get("moving") == 0


def effect_moving_status(bench: Bench) -> None:
    """Bits 4 and 5 the profile, 3 not following, 1 going on, 0 arrived."""
    bench.mode(EXTENDED)
    cases = [(0, 0, 0x00, 2.0), (100, 0, 0x10, 2.0), (100, 1000, 0x30, 2.0), (200, 1, 0x20, 6.0)]
    for velocity, acceleration, kind, time in cases:
        bench.put("profile_acceleration", acceleration)
        bench.put("profile_velocity", velocity)
        bench.put("goal_position", bench.get("goal_position") + 1000)
        assert bench.get("moving_status") & 0x30 == kind
        assert bench.get("moving_status") & 0x03 == (0x02 if kind else 0x00)
        bench.wait(time)
        assert bench.get("moving_status") & 0x0B == 0x01
    bench.put("profile_velocity", 0)
    bench.put("goal_pwm", 1)
    bench.put("goal_position", bench.get("goal_position") + 1000)
    bench.wait(0.1)
    assert bench.get("moving_status") & 0x09 == 0x08


def effect_present_pwm(bench: Bench) -> None:
    bench.mode(PWM)
    bench.put("goal_pwm", -200)
    bench.wait(0.5)
    assert bench.get("present_pwm") == -200


def effect_present_load(bench: Bench) -> None:
    """The share of the stall torque: all of it at the first moment, none at the unloaded speed."""
    bench.mode(PWM)
    bench.servo.write(100, (885).to_bytes(2, "little"))
    bench.bus.advance(bench.t + 1e-4)
    assert bench.servo.get("present_load") == pytest.approx(1000, abs=15)
    bench.wait(1.0)
    assert abs(bench.get("present_load")) <= 1


def effect_present_current(bench: Bench) -> None:
    """In mA: the stall current of the datasheet at the first moment, with the whole drive."""
    bench.put("pwm_slope", 255)
    bench.mode(PWM)
    bench.servo.write(100, (885).to_bytes(2, "little"))
    most = 0
    for _ in range(40):
        bench.wait(0.001)
        most = max(most, bench.servo.get("present_current"))
    assert 800 < most <= 1000 * STALL_CURRENT[bench.page.model]
    bench.wait(1.0)
    assert abs(bench.get("present_current")) <= 2


def effect_present_velocity(bench: Bench) -> None:
    bench.mode(VELOCITY)
    bench.put("goal_velocity", -80)
    bench.wait(3.0)
    before, begin = bench.servo.position, bench.t
    bench.wait(0.5)
    turned = (bench.servo.position - before) / (bench.t - begin) / TURN * 60 / RPM
    assert bench.get("present_velocity") == pytest.approx(turned, abs=1)


def effect_present_position(bench: Bench) -> None:
    """Within one turn after torque in position mode, a mode change to it, and a restart."""
    bench.put("operating_mode", EXTENDED)
    bench.servo.place(5 * TURN + 100.0)
    assert bench.get("present_position") == 5 * TURN + 100
    bench.put("operating_mode", POSITION)
    assert bench.get("present_position") == 100
    bench.servo.place(-200.0)
    assert bench.get("present_position") == -200
    bench.put("goal_position", TURN - 200)
    bench.put("torque_enable", 1)
    assert bench.get("present_position") == TURN - 200
    bench.put("torque_enable", 0)
    bench.servo.place(2 * TURN + 7.0)
    bench.ask(8)
    bench.wait(0.5)
    assert bench.get("present_position") == 7


def effect_velocity_trajectory(bench: Bench) -> None:
    bench.mode(POSITION)
    bench.put("profile_velocity", 20)
    bench.put("goal_position", 2548)
    assert bench.get("velocity_trajectory") == 20
    bench.wait(4.0)
    assert bench.get("velocity_trajectory") == 0


def effect_position_trajectory(bench: Bench) -> None:
    bench.mode(POSITION)
    bench.put("profile_velocity", 20)
    bench.put("goal_position", 2548)
    bench.wait(0.45)  # and 0.05 s for the write
    way = 20 * RPM / 60 * TURN * 0.5
    assert bench.servo.get("position_trajectory") == pytest.approx(2048 + way, abs=3)
    bench.wait(4.0)
    assert bench.get("position_trajectory") == 2548


def effect_present_input_voltage(bench: Bench) -> None:
    """A motor turns the slower the lower its supply is."""
    recommended = 50 if bench.page.model == 1200 else 111
    assert bench.get("present_input_voltage") == recommended
    bench.servo.set("present_input_voltage", round(0.8 * recommended))
    bench.mode(PWM)
    bench.put("goal_pwm", 885)
    bench.wait(1.0)
    expected = round(0.8 * recommended) / recommended * NO_LOAD_SPEED[bench.page.model] / RPM
    assert bench.get("present_velocity") == pytest.approx(expected, abs=1)


def effect_present_temperature(bench: Bench) -> None:
    assert 15 <= bench.get("present_temperature") <= 30


def effect_backup_ready(bench: Bench) -> None:
    """Stored and restored: EEPROM, gains and profile; not under torque, not without a backup."""
    assert bench.get("backup_ready") == 0
    assert bench.ask(0x20, b"\x02CTRL")[0].error == RESULT_FAIL
    bench.put("return_delay_time", 7)
    bench.put("position_p_gain", 321)
    assert bench.ask(0x20, b"\x01CTRL")[0].error == NONE
    assert bench.get("backup_ready") == 1
    bench.put("return_delay_time", 9)
    bench.put("position_p_gain", 1)
    bench.put("torque_enable", 1)
    assert bench.ask(0x20, b"\x02CTRL")[0].error == RESULT_FAIL
    bench.put("torque_enable", 0)
    assert bench.ask(0x20, b"\x02CTRL")[0].error == NONE
    assert (bench.get("return_delay_time"), bench.get("position_p_gain")) == (7, 321)


def effect_indirect_address_1(bench: Bench) -> None:
    """The two examples of the section: the LED, and a goal position in four bytes."""
    assert bench.put("indirect_address_1", 65) == NONE
    for value in (1, 0):
        assert bench.put("indirect_data_1", value) == NONE
        assert bench.get("led") == value
    for n in range(4):
        assert bench.put(f"indirect_address_{2 + n}", 116 + n) == NONE
    data = bench.page.row("indirect_data_2").address
    bench.put("torque_enable", 1)
    written = data.to_bytes(2, "little") + (1024).to_bytes(4, "little")
    assert bench.ask(3, written)[0].error == NONE
    bench.wait(2.0)
    assert (bench.get("goal_position"), bench.get("present_position")) == (1024, 1024)
    assert bench.ask(3, written[:4])[0].error != NONE  # not a half of it


def effect_indirect_data_1(bench: Bench) -> None:
    """It inherits the access of what it stands for."""
    assert bench.put("indirect_data_1", 200) == NONE
    assert bench.get("indirect_data_1") == 200
    bench.put("indirect_address_1", 146)
    assert bench.get("indirect_data_1") == bench.get("present_temperature")
    assert bench.put("indirect_data_1", 1) == ACCESS
    bench.put("indirect_address_1", 64)
    assert bench.put("indirect_data_1", 2) == RANGE


EFFECTS: dict[str, Callable[[Bench], None]] = {
    name.removeprefix("effect_"): function
    for name, function in inspect.getmembers(sys.modules[__name__], inspect.isfunction)
    if name.startswith("effect_")
}


def effects_of(page: Page) -> list[str]:
    """Registers of a page; of the indirect ones the first stands for all."""
    names = [row.name for row in page.rows.values()]
    return [n for n in names if not n.startswith("indirect") or n.endswith(("address_1", "data_1"))]


CASES = [(page, name) for page in PAGES for name in effects_of(page)]


@pytest.mark.parametrize(("page", "name"), CASES, ids=[f"{p.name}-{n}" for p, n in CASES])
def test_a_register_does_what_its_section_says(page: Page, name: str) -> None:
    EFFECTS[name](Bench(page, others=2))


UNSHOWN = {
    "present_load": "is told at the end of a period of the physics, not within it",
    "present_input_voltage": "the physics has the recommended supply, whatever the battery gives",
}
"""Effects that a servo of the walking twin does not have, and why."""
USUAL = next(page for page in PAGES if page.model == 1080)
"""Most servos of a robot; of another model the registers that this one lacks are quick to see."""
DRIVEN_CASES = [
    pytest.param(
        page,
        name,
        id=f"{page.name}-{name}",
        marks=pytest.mark.slow if page is not USUAL and name in effects_of(USUAL) else (),
    )
    for page, name in CASES
    if page.model in DRIVEN and name not in UNSHOWN
]


@pytest.mark.parametrize(("page", "name"), DRIVEN_CASES)
def test_a_register_does_the_same_where_the_physics_turns_the_shaft(page: Page, name: str) -> None:
    EFFECTS[name](DrivenBench(page, others=2))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_indirect_byte_stands_for_the_byte_that_it_names(page: Page) -> None:
    bench = Bench(page)
    count = 20 if page.model == 1200 else 56
    for n in range(1, count + 1):
        assert bench.put(f"indirect_address_{n}", 65) == NONE
        assert bench.put(f"indirect_data_{n}", n % 2) == NONE
        assert bench.get("led") == n % 2


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
@pytest.mark.parametrize(("whole", "ramp"), [(1000, 250), (1000, 0), (1000, 900)])
def test_a_time_based_profile_takes_its_time(page: Page, whole: int, ramp: int) -> None:
    """t3 is Profile Velocity, t1 Profile Acceleration, at most a half of t3, both in ms."""
    bench = Bench(page)
    assert bench.put("drive_mode", 4) == NONE
    bench.mode(POSITION)
    bench.put("profile_acceleration", ramp)
    bench.put("profile_velocity", whole)
    bench.put("goal_position", 3048)
    begin, fastest = bench.t - 0.05, 0
    while bench.servo.get("moving_status") & 0x02:
        bench.wait(0.005)
        fastest = max(fastest, bench.servo.get("velocity_trajectory"))
    assert bench.t - begin == pytest.approx(1.0, abs=0.01)
    cruise = 1000 / (1.0 - min(ramp, 500) / 1000) / TURN * 60 / RPM
    assert fastest == pytest.approx(cruise, abs=2)


def test_a_new_goal_on_the_way_changes_the_speed_without_a_jump() -> None:
    bench = Bench(PAGES[0])
    bench.mode(EXTENDED)
    bench.put("profile_acceleration", 20)
    bench.put("profile_velocity", 150)
    bench.put("goal_position", 2048 + 2 * TURN)
    bench.wait(1.0)
    bench.servo.write(116, (0).to_bytes(4, "little"))
    speeds: list[int] = []
    for _ in range(600):
        bench.wait(0.005)
        speeds.append(bench.servo.get("velocity_trajectory"))
    steepest = 20 * 214.577 / 60 / RPM * 0.005
    assert max(abs(b - a) for a, b in itertools.pairwise(speeds)) <= steepest + 1
    assert speeds[0] > 140
    assert min(speeds) == -150
    bench.wait(3.0)
    assert bench.get("present_position") == 0


@pytest.mark.parametrize(("option", "kept"), [(0xFF, ()), (1, ("id",)), (2, ("id", "baud_rate"))])
def test_a_factory_reset_keeps_what_its_option_says(option: int, kept: tuple[str, ...]) -> None:
    page = PAGES[0]
    bench = Bench(page)
    changed = {"id": 9, "baud_rate": 3, "return_delay_time": 0, "operating_mode": 4, "shutdown": 0}
    to = 1
    for name, value in reversed(changed.items()):
        assert bench.put(name, value, to=to) == NONE
    assert bench.ask(6, bytes([option]), to=9)[0].error == NONE
    bench.wait(0.5)
    to = 9 if "id" in kept else 1
    for name, value in changed.items():
        assert bench.get(name, to) == (value if name in kept else page.row(name).initial)


def test_a_factory_reset_of_everything_by_broadcast_does_nothing() -> None:
    bench = Bench(PAGES[0])
    bench.put("return_delay_time", 7)
    assert bench.ask(6, b"\xff", to=254) == []
    bench.wait(0.5)
    assert bench.get("return_delay_time") == 7


def test_clear_fails_while_it_moves() -> None:
    bench = Bench(PAGES[0])
    bench.mode(EXTENDED)
    bench.put("goal_position", 20 * TURN)
    assert bench.ask(0x10, b"\x01DXL\x22")[0].error == RESULT_FAIL
    bench.put("goal_position", 2 * TURN + 5)
    bench.wait(5.0)
    bench.put("torque_enable", 0)
    assert bench.ask(0x10, b"\x01DXL\x22")[0].error == NONE
    assert bench.get("present_position") == 5


def test_a_motor_needs_the_time_of_its_inertia() -> None:
    """J w0 / stall torque = 0.003 * 6.81 / 1.7 s: 63 % of the unloaded speed after it."""
    bench = Bench(PAGES[0])
    bench.mode(PWM)
    bench.servo.write(100, (885).to_bytes(2, "little"))
    bench.bus.advance(bench.t + 0.003 * (65 * 2 * math.pi / 60) / 1.7)
    assert bench.servo.get("present_velocity") == pytest.approx(0.632 * 65 / RPM, rel=0.01)
