"""Guards of the supervisor."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import hardware_rig
import test_signal_quality
import test_supervisor
import test_supervisor_outages as test_outages
from guard_tools import Guard, Off, after, around, blind, given, put
from hardware_rig import PERIOD

from antennate.hardware.safety import channel, supervisor
from antennate.hardware.safety import supervisor as rate
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.supervisor import Outputs, Supervisor
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, Maneuver, State


class Pulse:
    """An order to arm that is new whenever it is given."""

    def __init__(self) -> None:
        self.asked = False

    def __bool__(self) -> bool:
        first, self.asked = not self.asked, True
        return first


def always_new(old: Any, self: Any, now: float, inputs: Any) -> Outputs:
    return old(self, now, dataclasses.replace(inputs, arm=Pulse()) if inputs.arm else inputs)


def fed(old: Any, self: Any, *args: Any) -> Outputs:
    out = old(self, *args)
    return dataclasses.replace(out, feed_watchdog=out.torque)


def no_fault(cause: Cause) -> State:
    return min(cause.value[0], State.HOLD)


class Steady:
    """Lets the time of each supervisor pass evenly, whatever its clock says."""

    def __init__(self) -> None:
        self.times: dict[int, float] = {}

    def __call__(self, old: Any, supervisor: Any, now: float, inputs: Any) -> Outputs:
        t = self.times[id(supervisor)] = self.times.get(id(supervisor), 0.0) + PERIOD
        return old(supervisor, t, dataclasses.replace(inputs, decided_at=t))


def limits(**values: Any) -> Off:
    return given(hardware_rig, SupervisorParams, **values)


def told(cause: Cause) -> Callable[[], Any]:
    return partial(test_supervisor.test_every_cause_is_named_dated_and_as_severe_as_it_says, cause)


SUPERVISOR = [
    Guard(
        "age limit of the supervisor",
        blind(age=0.0),
        partial(test_supervisor.test_S5_an_age_that_is_no_age_is_stale, 0.0501),
    ),
    Guard(
        "age that is NaN",
        blind(age=0.0),
        partial(test_supervisor.test_S5_an_age_that_is_no_age_is_stale, math.nan),
    ),
    Guard(
        "findings hold the robot",
        blind(findings=(channel.Finding.OK, channel.Finding.OK)),
        told(Cause.OPEN),
    ),
    Guard("restart of the board", blind(resets=0), told(Cause.REBOOT)),
    Guard("silent servo", blind(missed={}), told(Cause.SILENT_SERVO)),
    Guard("hardware error of a servo", blind(servo_errors={}), told(Cause.SERVO_ERROR)),
    Guard("dead bus", blind(bus_error=""), told(Cause.BUS_ERROR)),
    Guard("tripped watchdog", blind(watchdogs=()), told(Cause.WATCHDOG)),
    Guard("servo without torque or watchdog", blind(disarmed=()), told(Cause.DISARMED)),
    Guard("joint that does not follow", blind(behind={}), told(Cause.NOT_FOLLOWING)),
    Guard("joint beyond its limit", blind(outside={}), told(Cause.OUT_OF_LIMITS)),
    Guard("joint that leaps", blind(leaps={}), told(Cause.IMPOSSIBLE_SPEED)),
    Guard("servo in another mode", blind(modes={}), told(Cause.WRONG_MODE)),
    Guard("record that is required", blind(unrecorded=False), told(Cause.NO_RECORD)),
    Guard("supply", blind(supply=12.0), told(Cause.SUPPLY_OFF)),
    Guard("stop by the operator", blind(stop=False), told(Cause.STOPPED)),
    Guard("exception of the controller", blind(failure=""), told(Cause.FAILED)),
    Guard("action that does not exist", blind(maneuver=Maneuver.HOLD), told(Cause.BAD_ACTION)),
    Guard(
        "command that was refused",
        blind(bad_command=""),
        partial(
            test_supervisor.test_S5_a_pose_or_maneuver_that_is_none_is_not_sent,
            {"bad_command": "nan"},
        ),
    ),
    Guard(
        "UNKNOWN never walks",
        blind(contact=(Contact.FREE, Contact.FREE)),
        partial(
            test_supervisor.test_S5_unknown_contact_never_walks,
            (Contact.FREE, Contact.UNKNOWN),
            Maneuver.FORWARD,
        ),
    ),
    Guard(
        "fresh decision before motion",
        blind(decided_at="now"),
        test_supervisor.test_B8_watchdogs_are_fed_only_upon_a_decision_of_this_tick,
    ),
    Guard(
        "watchdogs fed only upon a fresh decision",
        around(Supervisor, "step", fed),
        test_supervisor.test_B8_watchdogs_are_fed_only_upon_a_decision_of_this_tick,
    ),
    Guard(
        "touch check and other objections",
        blind(objections=()),
        test_signal_quality.test_S8_an_objection_keeps_the_robot_from_being_armed,
    ),
    Guard(
        "arm gate",
        put(supervisor, "CURED_BY_ARMING", set(Cause)),
        test_supervisor.test_it_begins_off_and_arms_on_good_data_only,
    ),
    Guard(
        "arming is an event",
        around(Supervisor, "step", always_new),
        test_supervisor.test_it_begins_off_and_arms_on_good_data_only,
    ),
    Guard(
        "faults stay until an arm event",
        put(Cause, "severity", property(no_fault)),
        test_outages.test_T5_after_a_pause_it_does_not_resume,
    ),
    Guard(
        "clock that lies",
        around(Supervisor, "step", Steady()),
        partial(test_supervisor.test_a_clock_that_lies_is_a_fault, -1.0),
    ),
    Guard(
        "pause of the loop",
        limits(longest_pause=math.inf),
        test_outages.test_T5_after_a_pause_it_does_not_resume,
    ),
    Guard(
        "ten good samples after a loss",
        limits(recovery=0),
        test_supervisor.test_data_must_be_well_ten_times_in_a_row,
    ),
    Guard(
        "refused samples break the row",
        blind(refused=0),
        test_supervisor.test_data_must_be_well_ten_times_in_a_row,
    ),
    Guard(
        "three holds are a fault",
        limits(repeats=10**6),
        test_supervisor.test_three_holds_in_ten_seconds_are_a_fault,
    ),
    Guard(
        "three failures are a fault",
        limits(repeats=10**6),
        partial(test_outages.test_T6_an_exception_holds_in_the_same_tick_and_three_are_a_fault, 0),
    ),
    Guard(
        "reboot loop",
        limits(repeats=10**6),
        partial(test_outages.test_E2_a_reboot_loop_is_a_fault_after_three, 0.3, "HARD"),
        by=(StopIteration,),
    ),
    Guard(
        "wrong rate",
        after(rate.RateMeter, "step", lambda self, *args: setattr(self, "wrong", False)),
        partial(test_outages.test_L16_a_wrong_rate_is_shown_and_degrades, 50, True),
    ),
    Guard(
        "supply does not flutter",
        limits(supply_rise=0.0),
        test_supervisor.test_the_supply_sags_down_the_ladder_and_does_not_flutter,
    ),
]
