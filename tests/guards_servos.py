"""Guards on servos: packets, the bus, bring-up and goals."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from functools import partial
from typing import Any

import test_dynamixel_bus as test_bus
import test_dynamixel_packets as test_packets
import test_loose_leg
import test_release
import test_servo_hours
import test_session
import test_settings
import test_turns
import test_twin_bus
import test_twin_robot
from guard_tools import Guard, after, around, constant, put

from antennate.hardware import joints, settings
from antennate.hardware.driving import session, turns
from antennate.hardware.driving.turns import Turns
from antennate.hardware.dynamixel import bringup, bus, packets, parser
from antennate.hardware.dynamixel.answers import Value
from antennate.hardware.dynamixel.doubts import Doubts
from antennate.hardware.dynamixel.tables import XC430_W240
from antennate.hardware.ports import serial_port
from antennate.hardware.safety import watch
from antennate.hardware.safety.causes import Outputs, State
from antennate.params import TurnsParams
from antennate.robots.layout import LayoutParams
from antennate.twin.wire import SimulatedWire

controller_fails = test_session.test_B8_servos_stop_within_120_ms_when_only_the_controller_fails


class AnyNumber(int):
    """A CRC that is right whatever it is compared with."""

    def __ne__(self, other: object) -> bool:
        return False

    __hash__ = int.__hash__

    def to_bytes(self, *args: Any) -> Any:
        return AnyBytes()


class AnyBytes(bytes):
    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = bytes.__hash__


class Everyone(list[int]):
    """Ids among which every id is."""

    def __contains__(self, key: object) -> bool:
        return True


def any_refusal(old: Any, packet: Any, length: int, doubtful: set[int]) -> Any:
    return old(packet, length, set())


def any_length(old: Any, packet: Any, length: int, doubtful: set[int]) -> Any:
    status = packets.as_status(packet)
    return status and dataclasses.replace(status, data=status.data[-length:] if length else b"")


def from_anybody(old: Any, self: Any, request: bytes, ids: Any, length: int, end: float) -> Any:
    return old(self, request, Everyone(ids), length, end)


def unread(old: Any, master: Any, register: Any, values: Any) -> None:
    master.write_all(register.address, {i: register.encode(v) for i, v in values.items()})


def where_goals_were(old: Any, master: Any, ids: Any) -> Any:
    return bringup.read_register(master, ids, bringup._COMMON["present_position"])


def goal_taken(old: Any, self: Any, servo: int, register: Any, value: int) -> bool:
    return old(self, servo, register, value) or register is turns._GOAL


def torque_off(old: Any, self: Any, servo: int, register: Any) -> Any:
    return 0 if register is turns._TORQUE and self._stage == 1 else old(self, servo, register)


def old_goal(old: Any, self: Any, at: int, goals: Any) -> bool:
    return self._write(self._joints.ids[at], turns._TORQUE, 1)


def no_fault(old: Any, self: Any, out: Outputs) -> None:
    old(self, dataclasses.replace(out, state=State.HOLD))


def no_line_of_errors(self: Any, what: str) -> Any:
    return contextlib.nullcontext()


def told_once(old: Any, master: Any, ids: Any, *words: Any) -> list[int]:
    return old(master, ids, 1)


def only_when_quiet(old: Any, self: Any, request: bytes, end: float, anyway: bool = False) -> bool:
    return old(self, request, end)


def shared(old: Any, *args: Any, exclusive: bool = True, **kwargs: Any) -> Any:
    return old(*args, exclusive=False, **kwargs)


def first_of_each(old: Any, self: Any, data: bytes) -> Any:
    found = {packet.id: packet for packet in reversed(old(self, data))}
    return list(reversed(found.values()))


BUS = [
    Guard(
        "CRC of servo packets",
        put(parser, "crc16", constant(AnyNumber())),
        test_packets.test_B3_no_flipped_bit_makes_a_wrong_packet_and_the_next_one_is_found,
    ),
    Guard(
        "CRC of each part of a fast reply",
        put(packets, "crc16", constant(AnyNumber())),
        test_packets.test_B3_a_flipped_bit_in_a_fast_reply_spoils_two_values_at_most_and_makes_none,
    ),
    Guard(
        "byte stuffing",
        put(packets, "stuff", lambda body: body),
        test_packets.test_B3_every_pattern_near_a_header_survives_stuffing,
    ),
    Guard(
        "length of a packet",
        put(parser, "LONGEST", 1 << 20),
        test_packets.test_lengths_that_cannot_be_are_refused_at_once,
    ),
    Guard(
        "ids in requests",
        put(packets, "_check_ids", constant(None)),
        partial(test_packets.test_ids_that_cannot_be_are_refused, [1, 1]),
    ),
    Guard(
        "stale bytes drained before a request",
        put(SimulatedWire, "drain", constant(0)),
        partial(test_bus.test_B4_no_late_answer_is_taken_for_a_new_one, 0.003, True),
    ),
    Guard(
        "bus quiet before a request",
        put(bus.Bus, "_quiet", constant(True)),
        partial(test_bus.test_B4_no_late_answer_is_taken_for_a_new_one, 0.060, True),
    ),
    Guard(
        "other lengths while an answer may come late",
        put(Doubts, "free", lambda self, ids, span: span.length),
        test_bus.test_B4_single_reads_after_a_late_answer,
    ),
    Guard(
        "wait before a write that cannot be told apart",
        put(Doubts, "holds", constant(False)),
        test_bus.test_B4_a_late_confirmation_does_not_confirm_the_next_write,
    ),
    Guard(
        "late refusals",
        around(bus, "_fitting", any_refusal),
        test_bus.test_B4_a_late_refusal_does_not_refuse_the_next_read,
    ),
    Guard(
        "length of an answer",
        around(bus, "_fitting", any_length),
        test_bus.test_B4_single_reads_after_a_late_answer,
    ),
    Guard(
        "id of an answer",
        around(bus.Bus, "_exchange", from_anybody),
        test_bus.test_an_answer_with_another_id_is_no_answer,
    ),
    Guard(
        "two answers of one id",
        around(parser.Parser, "feed", first_of_each),
        test_bus.test_two_answers_of_one_servo_that_differ_are_none,
    ),
    Guard(
        "one caller at a time",
        after(
            bus.Bus,
            "__init__",
            lambda self, *args, **kwargs: setattr(self, "turn", contextlib.nullcontext()),
        ),
        partial(test_servo_hours.hammer, 800),
    ),
    Guard(
        "budget of time",
        put(bus.Bus, "_time_for", constant(True)),
        test_bus.test_B1_two_silent_servos_leave_seventeen,
    ),
    Guard(
        "goals wait for a quiet bus, not for ever",
        put(bus, "BUSY", 1.0),
        test_bus.test_a_babbling_bus_is_given_up_in_time,
    ),
    Guard(
        "servos without fast reads",
        put(bus, "FAST_TRIES", 1 << 30),
        test_bus.test_servos_that_do_not_know_fast_reads_are_asked_slowly,
    ),
    Guard(
        "second program on a port",
        around(serial_port.serial, "Serial", shared),
        test_session.test_L15_B16_a_second_program_on_a_port_is_refused,
    ),
    Guard(
        "line that goes away",
        put(serial_port.SerialPort, "_mapped", no_line_of_errors),
        test_twin_bus.test_L12_a_line_that_goes_away_is_a_port_error,
        by=(OSError,),
    ),
]
SERVOS = [
    Guard(
        "duplicate id",
        put(bus.Bus, "read", constant(Value(b"x", alert=False))),
        test_bus.test_B15_missing_wrong_double_and_strange_servos_are_named_within_3_s,
    ),
    Guard(
        "servos nobody expects",
        put(bus.Bus, "scan", constant([])),
        test_bus.test_B15_missing_wrong_double_and_strange_servos_are_named_within_3_s,
    ),
    Guard(
        "model of a servo",
        around(bringup, "_verdict", lambda old, found, model: old(found, found.model or model)),
        test_bus.test_B15_missing_wrong_double_and_strange_servos_are_named_within_3_s,
    ),
    Guard(
        "operating mode of a servo",
        put(bringup, "read_register", constant(dict.fromkeys(range(1, 20), AnyNumber()))),
        partial(
            test_session.test_B15_servos_that_are_not_as_expected_are_refused,
            lambda robot: robot.servos[8].set("operating_mode", 3),
            r"mode .* \[9\]",
        ),
    ),
    Guard(
        "settings of servos",
        put(settings, "wrong", constant([])),
        test_settings.test_all_that_is_wrong_is_said_at_once,
    ),
    Guard(
        "speed limit on the servos",
        put(bringup, "limit_speed", constant(None)),
        test_settings.test_B10_profiles_that_another_program_left_are_set_before_torque,
    ),
    Guard(
        "present goals on torque-on",
        around(bringup, "hold_here", where_goals_were),
        test_bus.test_B10_torque_goes_on_without_a_jump,
    ),
    Guard(
        "present goals before watchdogs are on",
        put(bringup, "hold_here", constant({})),
        test_bus.test_B9_watchdogs_are_rearmed_in_order_with_goals_where_servos_stand,
    ),
    Guard(
        "writes are read back",
        around(bringup, "_write_checked", unread),
        test_bus.test_B9_latched_watchdogs_are_seen_and_rearmed_in_place,
    ),
    Guard(
        "homing offset in extended mode",
        put(bringup, "EXTENDED_MODE", -1),
        test_bus.test_B9_extended_mode_with_an_offset_is_refused,
    ),
    Guard(
        "torque off is confirmed",
        put(bringup, "disable", constant([])),
        test_bus.test_B19_torque_off_is_confirmed_and_what_did_not_is_named,
    ),
    Guard(
        "torque off is told again",
        around(bringup, "disable", told_once),
        partial(test_release.test_B19_a_servo_is_told_five_times_to_let_go, 4, []),
    ),
    Guard(
        "torque off through noise",
        around(bus.Bus, "_send", only_when_quiet),
        partial(
            test_release.test_B19_noise_at_the_release_leaves_no_servo_with_torque_within_2_s, 60.0
        ),
    ),
    Guard(
        "watchdogs armed",
        around(bringup, "arm_watchdogs", lambda old, master, ids: old(master, ids, 0)),
        partial(controller_fails, 11.1),
    ),
    Guard(
        "torque lost while armed",
        put(watch, "_TORQUE", XC430_W240["status_return_level"]),
        partial(
            test_session.test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second,
            7,
            ("torque_enable",),
        ),
        by=(StopIteration,),
    ),
    Guard(
        "watchdog lost while armed",
        put(watch, "WATCHDOG_COUNTS", AnyNumber()),
        partial(
            test_session.test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second,
            7,
            ("bus_watchdog",),
        ),
        by=(StopIteration,),
    ),
    Guard(
        "torque taken off on purpose",
        put(Turns, "loose", None),
        test_turns.test_a_leg_without_torque_to_forget_its_turns_is_not_reported,
    ),
    Guard(
        "goal of a loose leg is read back",
        around(Turns, "_write", goal_taken),
        test_loose_leg.test_B10_a_leg_that_does_not_take_its_goal_gets_no_torque,
    ),
    Guard(
        "goal of a loose leg is where it stands",
        around(Turns, "_hold", old_goal),
        partial(
            test_loose_leg.test_B10_a_leg_that_was_turned_while_loose_gets_torque_where_it_stands,
            600,
        ),
    ),
    Guard(
        "a loose leg after a fault",
        around(session.Session, "_forget_turns", no_fault),
        test_loose_leg.test_B10_after_a_pause_a_loose_leg_waits_for_an_arm_event,
    ),
    Guard(
        "torque is off before turns are forgotten",
        around(Turns, "_read", torque_off),
        test_loose_leg.test_a_leg_whose_torque_came_back_is_not_cleared,
    ),
    Guard(
        "turns are forgotten",
        put(turns, "TurnsParams", partial(TurnsParams.model_construct, slack=300.0)),
        test_loose_leg.test_a_leg_that_did_not_forget_gets_no_torque,
    ),
    Guard(
        "turns that cannot be told",
        put(turns, "TurnsParams", partial(TurnsParams.model_construct, slack=300.0)),
        partial(
            test_loose_leg.test_a_leg_turned_so_far_that_its_turns_cannot_be_told_gets_no_torque,
            1300,
        ),
    ),
    Guard(
        "legs stand still before one is let go",
        put(Turns, "_calm", constant(True)),
        test_loose_leg.test_no_leg_loses_its_torque_before_all_have_stood_still_for_five_ticks,
    ),
    Guard(
        "supply read long ago",
        put(watch, "_OLD", math.inf),
        test_session.test_B13_a_supply_that_cannot_be_read_any_more_is_not_known_after_4_s,
    ),
    Guard(
        "no torque after half an arming",
        put(session, "AntennateError", ()),
        partial(
            test_session.test_B10_arming_that_fails_half_way_leaves_no_servo_with_torque, "servo"
        ),
    ),
    Guard(
        "limits of yaw joints and antennae",
        put(LayoutParams, "limits", (math.inf,) * 19),
        test_twin_robot.test_B14_a_yaw_or_an_antenna_beyond_its_limit_is_refused_as_a_whole,
    ),
    Guard(
        "goals beyond 256 turns",
        put(joints, "MOST_TICKS", math.inf),
        partial(
            test_twin_robot.test_B14_a_goal_that_is_not_finite_or_too_far_is_refused_as_a_whole, 1e4
        ),
    ),
]
