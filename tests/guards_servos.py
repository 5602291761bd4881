"""Guards on servos: packets, the bus, bring-up and goals."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from functools import partial
from types import SimpleNamespace
from typing import Any

import serial
import test_dynamixel_bus as test_bus
import test_dynamixel_packets as test_packets
import test_following
import test_loose_leg
import test_release
import test_servo_hours
import test_session
import test_settings
import test_turns
import test_twin_robot
import test_virtual_servos
from guard_tools import Guard, after, around, constant, given, put

from antennate.hardware import joints
from antennate.hardware.driving import connect
from antennate.hardware.driving import drive as dry_run
from antennate.hardware.dynamixel import actuators, bringup
from antennate.hardware.dynamixel import leg_turns as turns
from antennate.hardware.dynamixel.actuators import ServoMonitor
from antennate.hardware.dynamixel.leg_turns import LegTurns
from antennate.hardware.safety import session, torque
from antennate.hardware.safety.following import Following
from antennate.params.safety import FollowingParams
from antennate.robots.spec import RobotSpec
from dynamixel_bus import bus, inquiry, packets, parser, ports
from dynamixel_bus.answers import PendingRequests, Timing, Value
from dynamixel_bus.model import FULL_DRIVE
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.simulated_wire import SimulatedWire

does_wrong = (
    test_following.test_B20_B21_B22_B23_what_a_joint_does_wrong_is_a_fault_in_time_that_names_it
)
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


class Agreeing(int):
    """A value that differs from none."""

    def __ne__(self, other: object) -> bool:
        return False

    __hash__ = int.__hash__


def any_refusal(old: Any, packet: Any, length: int, late: set[int]) -> Any:
    return old(packet, length, set())


def any_length(old: Any, packet: Any, length: int, late: set[int]) -> Any:
    status = packets.as_status(packet)
    return status and dataclasses.replace(status, data=status.data[-length:] if length else b"")


def from_its_neighbour(old: Any, packet: Any) -> Any:
    status = old(packet)
    return status and dataclasses.replace(status, id=3)


def as_wished(old: Any, *args: Any) -> dict[int, int]:
    return {servo: Agreeing(value) for servo, value in old(*args).items()}


def without_end(old: Any, self: Any, ids: Any, span: Any, budget: float = 0.0) -> Any:
    return old(self, ids, span, 1.0)


def of_any_model(old: Any, *args: Any) -> Any:
    present = old(*args)
    return present and dataclasses.replace(present, model=None)


def where_goals_were(old: Any, master: Any, ids: Any) -> Any:
    return bringup.read_register(master, ids, XC430_W240["present_position"])


GOAL, TORQUE, PLACE = (
    XC430_W240[name].address for name in ("goal_position", "torque_enable", "present_position")
)


class Echo:
    """Goals of single servos read as they were written, whether they were taken or not."""

    def __init__(self) -> None:
        self.written: dict[int, bytes] = {}

    def __call__(self, patch: Any) -> None:
        around(bus.Bus, "write_all", self.write)(patch)
        around(bus.Bus, "read_all", self.read)(patch)

    def write(self, old: Any, master: Any, address: int, data: Any, *more: Any) -> None:
        self.written |= data if address == GOAL and len(data) == 1 else {}
        old(master, address, data, *more)

    def read(self, old: Any, master: Any, ids: Any, span: Any, *more: Any) -> Any:
        answers = old(master, ids, span, *more)
        if span.address != GOAL:
            return answers
        return {i: Value(self.written[i], False) if i in self.written else answers[i] for i in ids}


class Stale:
    """A leg's place is not read anew after it was cleared: the third time as the second."""

    def __init__(self) -> None:
        self.places: list[Any] = []

    def __call__(self, old: Any, master: Any, ids: Any, span: Any, *more: Any) -> Any:
        answers = old(master, ids, span, *more)
        if span.address != PLACE or len(ids) > 1:
            return answers
        self.places.append(answers)
        return self.places[min(len(self.places) - 1, 1)]


def torque_reads(value: bytes) -> Any:
    def read(old: Any, master: Any, ids: Any, span: Any, *more: Any) -> Any:
        answers = old(master, ids, span, *more)
        return dict.fromkeys(ids, Value(value, False)) if span.address == TORQUE else answers

    return around(bus.Bus, "read_all", read)


def well(old: Any, master: Any, ids: Any, register: Any) -> Any:
    return {} if register.name == "hardware_error_status" else old(master, ids, register)


def told_once(old: Any, master: Any, ids: Any, *words: Any) -> list[int]:
    return old(master, ids, 1)


def only_when_quiet(old: Any, self: Any, address: int, data: Any, anyway: bool = False) -> None:
    old(self, address, data)


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
        put(packets, "require_ids", constant(None)),
        partial(test_packets.test_ids_that_cannot_be_are_refused, [1, 1]),
    ),
    Guard(
        "stale bytes drained before a request",
        put(SimulatedWire, "drain", constant(0)),
        partial(test_bus.test_B4_no_late_answer_is_taken_for_a_new_one, 0.003, True),
    ),
    Guard(
        "bus quiet before a request",
        put(bus, "Timing", partial(Timing, quiet=0.0)),
        partial(test_bus.test_B4_no_late_answer_is_taken_for_a_new_one, 0.060, True),
    ),
    Guard(
        "other lengths while an answer may come late",
        put(PendingRequests, "free", lambda self, ids, span: span.length),
        test_bus.test_B4_single_reads_after_a_late_answer,
    ),
    Guard(
        "wait before a write that cannot be told apart",
        put(PendingRequests, "holds", constant(False)),
        test_bus.test_B4_a_late_confirmation_does_not_confirm_the_next_write,
    ),
    Guard(
        "late refusals",
        around(bus, "fitting", any_refusal),
        test_bus.test_B4_a_late_refusal_does_not_refuse_the_next_read,
    ),
    Guard(
        "length of an answer",
        around(bus, "fitting", any_length),
        test_bus.test_B4_single_reads_after_a_late_answer,
    ),
    Guard(
        "id of an answer",
        around(packets, "as_status", from_its_neighbour),
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
        around(bus.Bus, "read_all", without_end),
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
        around(serial, "Serial", shared),
        test_session.test_L15_B16_a_second_program_on_a_port_is_refused,
    ),
    Guard(
        "line that goes away",
        put(ports, "port_errors", constant(contextlib.nullcontext())),
        test_virtual_servos.test_L12_a_line_that_goes_away_is_a_port_error,
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
        around(inquiry, "look", of_any_model),
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
        put(connect, "wrong_settings", constant([])),
        test_settings.test_all_that_is_wrong_is_said_at_once,
    ),
    Guard(
        "speed limit on the servos",
        put(torque, "limit_speed", constant(None)),
        test_settings.test_B10_profiles_that_another_program_left_are_set_before_torque,
    ),
    Guard(
        "present goals on torque-on",
        around(torque, "hold_here", where_goals_were),
        test_bus.test_B10_torque_goes_on_without_a_jump,
    ),
    Guard(
        "present goals before watchdogs are on",
        put(torque, "hold_here", constant({})),
        test_bus.test_B9_watchdogs_are_rearmed_in_order_with_goals_where_servos_stand,
    ),
    Guard(
        "writes are read back",
        around(torque, "read_register", as_wished),
        test_bus.test_B9_latched_watchdogs_are_seen_and_rearmed_in_place,
    ),
    Guard(
        "homing offset in extended mode",
        put(torque, "EXTENDED_MODE", -1),
        test_bus.test_B9_extended_mode_with_an_offset_is_refused,
    ),
    Guard(
        "torque off is confirmed",
        put(torque, "disable", constant([])),
        test_bus.test_B19_torque_off_is_confirmed_and_what_did_not_is_named,
    ),
    Guard(
        "torque off is told again",
        around(torque, "disable", told_once),
        partial(test_release.test_B19_a_servo_is_told_five_times_to_let_go, 4, []),
    ),
    Guard(
        "torque off through noise",
        around(bus.Bus, "write_all", only_when_quiet),
        partial(
            test_release.test_B19_noise_at_the_release_leaves_no_servo_with_torque_within_2_s, 60.0
        ),
    ),
    Guard(
        "watchdogs armed",
        around(torque, "arm_watchdogs", lambda old, master, ids: old(master, ids, 0)),
        partial(controller_fails, 11.1),
    ),
    Guard(
        "torque lost while armed",
        torque_reads(b"\1"),
        partial(
            test_session.test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second,
            7,
            ("torque_enable",),
        ),
        by=(AssertionError,),
    ),
    Guard(
        "watchdog lost while armed",
        put(actuators, "WATCHDOG_COUNTS", AnyNumber()),
        partial(
            test_session.test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second,
            7,
            ("bus_watchdog",),
        ),
        by=(AssertionError,),
    ),
    Guard(
        "drive of a joint that is behind",
        put(Following, "drive", constant(None)),
        partial(does_wrong, *test_following.CASES[0]),
    ),
    Guard(
        "joint that is stuck",
        given(test_following, FollowingParams, stuck_time=math.inf),
        test_following.test_B20_a_joint_far_behind_at_full_drive_is_not_named_as_long_as_it_moves,
    ),
    Guard(
        "limit of a joint",
        put(Following, "leave", constant(None)),
        partial(
            test_following.test_B21_a_joint_is_pushed_beyond_its_limit_for_a_moment_and_at_full_drive,
            1.03,
            205,
            FULL_DRIVE,
            True,
            1,
        ),
    ),
    Guard(
        "speed of a joint",
        given(test_following, FollowingParams, overspeed=math.inf),
        partial(
            test_following.test_B22_a_leap_is_named_at_once_and_the_speed_without_load_is_not,
            4096.0,
        ),
    ),
    Guard(
        "operating mode while armed",
        put(actuators, "ServoMonitor", lambda *words, modes: ServoMonitor(*words)),
        partial(does_wrong, *test_following.CASES[1]),
    ),
    Guard(
        "operating mode before torque",
        put(bringup, "require_modes", constant(None)),
        test_following.test_B23_a_mode_that_was_changed_in_the_dry_run_gets_no_torque,
    ),
    Guard(
        "hardware error before a drive",
        around(bringup, "read_register", well),
        partial(test_following.test_B24_a_hardware_error_is_refused_at_once, 0.0, "overload"),
    ),
    Guard(
        "hardware error in the dry run",
        put(dry_run, "latched_causes", constant("")),
        partial(test_following.test_B24_a_hardware_error_is_refused_at_once, 0.2, "overheat"),
    ),
    Guard(
        "torque taken off on purpose",
        put(LegTurns, "loose", None),
        test_turns.test_a_leg_without_torque_to_forget_its_turns_is_not_reported,
    ),
    Guard(
        "goal of a loose leg is read back",
        Echo(),
        test_loose_leg.test_B10_a_leg_that_does_not_take_its_goal_gets_no_torque,
    ),
    Guard(
        "goal of a loose leg is where it stands",
        around(bus.Bus, "read_all", Stale()),
        partial(
            test_loose_leg.test_B10_a_leg_that_was_turned_while_loose_gets_torque_where_it_stands,
            600,
        ),
    ),
    Guard(
        "a loose leg after a fault",
        put(session, "State", SimpleNamespace(FAULT=math.inf)),
        test_loose_leg.test_B10_after_a_pause_a_loose_leg_waits_for_an_arm_event,
    ),
    Guard(
        "torque is off before turns are forgotten",
        torque_reads(b"\0"),
        test_loose_leg.test_a_leg_whose_torque_came_back_is_not_cleared,
    ),
    Guard(
        "turns are forgotten",
        put(turns, "SLACK", 300.0),
        test_loose_leg.test_a_leg_that_did_not_forget_gets_no_torque,
    ),
    Guard(
        "turns that cannot be told",
        put(turns, "SLACK", 300.0),
        partial(
            test_loose_leg.test_a_leg_turned_so_far_that_its_turns_cannot_be_told_gets_no_torque,
            1300,
        ),
    ),
    Guard(
        "legs stand still before one is let go",
        put(turns, "CALM", 0),
        test_loose_leg.test_no_leg_loses_its_torque_before_all_have_stood_still_for_five_ticks,
    ),
    Guard(
        "supply read long ago",
        put(actuators, "SUPPLY_AGE", math.inf),
        test_session.test_B13_a_supply_that_cannot_be_read_any_more_is_not_known_after_4_s,
    ),
    Guard(
        "no torque after half an arming",
        put(actuators, "FAILURES", ()),
        partial(
            test_session.test_B10_arming_that_fails_half_way_leaves_no_servo_with_torque, "servo"
        ),
    ),
    Guard(
        "limits of yaw joints and antennae",
        put(RobotSpec, "limits", (math.inf,) * 19),
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
