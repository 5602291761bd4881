"""Guards on readings: frames, the clock of the board, films, contact."""

from __future__ import annotations

import dataclasses
import math
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import test_bad_readings
import test_board
import test_conditioning
import test_diagnosis
import test_esp32_clock as test_clock
import test_esp32_decoder as test_decoder
import test_esp32_frame as test_frame
import test_imu_diagnosis as test_imu
import test_maneuver
import test_noise
import test_signal_quality
from guard_tools import Guard, around, before, constant, put, together
from hardware_rig import BAND

from antennate.control import conditioning, controllers
from antennate.hardware.esp32 import board, clock, frame
from antennate.hardware.esp32 import wire as decoder
from antennate.hardware.esp32.clock import DeviceClock, SampleState
from antennate.hardware.esp32.wire import Reset
from antennate.hardware.safety import channel, imu
from antennate.hardware.safety import signal_quality as touch_check
from antennate.types import Maneuver


class AnyCrc(int):
    """A CRC that is right whatever it is compared with."""

    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = int.__hash__


def trusting(self: DeviceClock, sample: Any, now: float) -> None:
    greeting = {"boot_id": sample.boot_id, "reset": Reset.HARD, "tick_bits": 30, "rate": 100}
    self.greet(SimpleNamespace(**greeting))


def ticking(old: Any, self: DeviceClock, sample: Any, now: float) -> SampleState:
    seen = sum(self.states.values())
    return old(self, dataclasses.replace(sample, ticks=sample.ticks + seen), now)


def afresh(old: Any, self: Any, t: float, counts: float) -> Any:
    return old(self, t + 1e-6 * sum(self.counted.values()), counts)


def within(old: Any, self: DeviceClock, sample: Any, now: float) -> SampleState:
    return old(self, dataclasses.replace(sample, ticks=sample.ticks % (1 << 30)), now)


def any_version(old: Any, body: Any) -> Any:
    return old(bytes([frame.PROTOCOL]) + bytes(body[1:]))


def exchanged(old: Any, self: Any, left: float, right: float) -> Any:
    """Whichever antenna is bent counts as the one that was asked for."""
    asked_left = self.ask is not touch_check.Ask.RIGHT
    bent_left = left < right
    return old(self, *((left, right) if asked_left == bent_left else (right, left)))


def first(one: Any, other: Any) -> Any:
    return one


LIE = (lambda n: n * 10_000 + 3_600_000_000, SampleState.AHEAD)
STILL = (lambda n: 1_000_000, SampleState.FROZEN)
OLD_FIRMWARE = test_board.test_E8_no_sample_of_a_board_with_old_firmware_is_used

STREAM = [
    Guard(
        "CRC of frames",
        put(decoder, "crc32", constant(AnyCrc())),
        partial(test_decoder.test_L1_random_bit_errors, 1e-2),
    ),
    Guard(
        "longest piece between delimiters",
        put(decoder, "LONGEST", 1 << 30),
        test_decoder.test_L4_endless_garbage_without_a_delimiter,
    ),
    Guard(
        "room for text",
        put(decoder, "TEXT_KEPT", 1 << 30),
        test_decoder.test_L5_a_flood_of_text_is_bounded,
    ),
    Guard(
        "protocol version",
        around(decoder, "parse", any_version),
        test_frame.test_E8_another_protocol_version_is_refused_and_both_are_named,
    ),
    Guard(
        "range of readings",
        put(frame, "FULL_SCALE", 65_535),
        partial(
            test_frame.test_E8_what_cannot_be_used_says_why,
            b"\x01\x02" + bytes(12) + b"\x00\x10\x03" + bytes(4),
            "at most 4095",
        ),
    ),
    Guard(
        "repeated readings of an inertial sensor",
        put(imu, "STUCK", 1 << 30),
        partial(test_imu.test_one_that_repeats_itself_is_withheld_after_100_ms, 100),
    ),
    Guard(
        "end of the range of an inertial sensor",
        put(imu, "RAILED", 1 << 30),
        partial(
            test_imu.test_an_axis_at_its_end_is_withheld_at_once_and_the_others_after_100_ms,
            100,
            1.0,
        ),
    ),
    Guard(
        "answer of an inertial sensor",
        put(imu, "SILENT", 1 << 30),
        partial(test_imu.test_what_is_missing_is_withheld_at_once_and_named_after_100_ms, 100),
    ),
    Guard("firmware", put(board, "objections", constant(())), OLD_FIRMWARE),
    Guard(
        "age limit of readings",
        put(board.Board, "newest", lambda self, now: self.clock.newest),
        test_board.test_a_reading_older_than_the_limit_is_none,
    ),
]
CLOCK = [
    Guard(
        "greeting before samples, and their boot",
        before(DeviceClock, "take", trusting),
        test_clock.test_E8_before_a_greeting_no_sample_is_used,
    ),
    Guard(
        "earlier boots",
        put(clock, "RETIRED_BOOTS", 0),
        test_clock.test_E1_a_greeting_that_comes_late_does_not_bring_the_old_boot_back,
    ),
    Guard(
        "ticks beyond the modulus",
        around(DeviceClock, "take", within),
        test_clock.test_E7_ticks_beyond_the_declared_modulus_are_refused,
    ),
    Guard(
        "doubled and late samples",
        put(clock.Sequence, "place", constant(SampleState.USED)),
        test_clock.test_L7_the_window_tells_late_from_doubled,
    ),
    Guard(
        "board's time jumps",
        put(clock, "EARLY", math.inf),
        partial(test_clock.test_E7_lies_of_the_boards_clock, *LIE),
    ),
    Guard(
        "board's time stands still",
        around(DeviceClock, "take", ticking),
        partial(test_clock.test_E7_lies_of_the_boards_clock, *STILL),
    ),
    Guard(
        "ten samples before a new time is believed",
        put(clock, "SETTLE_SAMPLES", 1),
        test_clock.test_E7_single_lies_do_no_harm,
    ),
    Guard(
        "ages settle before they are believed",
        together(put(clock, "SETTLE_SAMPLES", 0), put(clock, "SETTLE_TIME", 0.0)),
        partial(test_clock.test_L10_a_burst_at_the_start_is_not_believed_to_be_fresh, 100, 0.0),
    ),
    Guard(
        "wraps hidden by an outage",
        put(clock, "HIDDEN_WRAP", math.inf),
        partial(test_clock.test_E5_a_wrap_hidden_by_an_outage, 18.0),
    ),
]
FILMS = [
    Guard(
        "open wire",
        together(put(channel, "OPEN_BAD", 10**6), put(channel, "HIGH_RAIL", 1e6)),
        partial(
            test_diagnosis.test_S1_a_floating_wire_is_open_within_ten_readings,
            test_diagnosis.rail_to_rail,
            BAND,
        ),
    ),
    Guard(
        "short circuit",
        put(channel, "LOW_RAIL", -1.0),
        partial(
            test_diagnosis.test_S2_shorts_are_named_at_the_tenth_reading,
            [0.0] * 10,
            channel.Finding.SHORT_LO,
            BAND,
            test_diagnosis.FREE,
        ),
    ),
    Guard(
        "stuck reading",
        together(put(channel, "STUCK", 10**6), put(channel, "NEARLY_STUCK", 10**6)),
        test_diagnosis.test_S4_a_repeated_reading_is_stuck_after_100,
        by=(ValueError,),
    ),
    Guard(
        "reading stuck but for its last bit",
        put(channel, "NEARLY_STUCK", 10**6),
        test_noise.test_S4_a_converter_whose_last_bit_toggles_is_stuck_after_150,
        by=(ValueError,),
    ),
    Guard(
        "hum",
        put(channel, "HIDDEN", 10.0),
        partial(test_noise.test_S14_a_hum_is_named_with_size_and_frequency, 120.0, 50.0, "50 Hz"),
    ),
    Guard(
        "hum that its beat hides",
        put(channel.ChannelDiagnosis.__init__, "__defaults__", (0.1,)),
        partial(test_noise.test_S14_a_hum_stays_in_force_while_its_beat_hides_it, 400.0, 50.02),
    ),
    Guard(
        "isolated spikes",
        put(channel, "AGREE", 1),
        test_diagnosis.test_S6_a_real_jump_is_believed_after_three_readings,
    ),
    Guard(
        "share of bad readings",
        put(channel, "SHARE", 1.0),
        partial(test_diagnosis.test_S6_more_than_a_fifth_bad_is_degraded_or_worse, 0.3),
    ),
    Guard(
        "a sensor at its rail is flagged",
        put(channel, "SATURATED", 10**6),
        test_diagnosis.test_S3_a_saturated_film_is_flagged_and_still_contact,
    ),
    Guard(
        "readings far beyond the range",
        put(channel, "BEYOND", 1e6),
        test_diagnosis.test_S11_far_beyond_is_not_believed,
    ),
    Guard(
        "findings that say nothing of contact",
        put(channel.Finding, "usable", True),
        test_diagnosis.test_S4_a_repeated_reading_is_stuck_after_100,
    ),
    Guard(
        "a sample is counted once",
        around(channel.ChannelDiagnosis, "step", afresh),
        test_diagnosis.test_S4_the_same_sample_seen_twice_is_not_counted_twice,
    ),
    Guard(
        "gap in time",
        put(channel, "GAP", 1e6),
        test_diagnosis.test_a_gap_in_time_forgets_what_was_before,
    ),
    Guard(
        "swapped antennae",
        around(touch_check.TouchCheck, "step", exchanged),
        test_signal_quality.test_S8_swapped_channels_are_refused,
    ),
    Guard(
        "a missing sample taints its mean",
        around(
            conditioning.RunningMean,
            "step",
            lambda old, self, c: old(self, np.nan_to_num(c, nan=2e3)),
        ),
        test_conditioning.test_a_missing_sample_taints_its_side_until_the_window_has_passed,
    ),
    Guard(
        "overflow of the sigmoid",
        put(conditioning, "np", SimpleNamespace(exp=np.exp, minimum=first, maximum=first)),
        test_bad_readings.test_S10_the_sigmoid_never_overflows,
        by=(RuntimeWarning,),
    ),
    Guard(
        "NaN is UNKNOWN",
        around(conditioning, "contact_of", lambda old, p, b, was: old(p, np.nan_to_num(b), was)),
        test_conditioning.test_nan_is_unknown_and_is_not_remembered_as_contact,
    ),
    Guard(
        "UNKNOWN ends a held maneuver",
        put(controllers, "Maneuver", SimpleNamespace(HOLD=99, FORWARD=Maneuver.FORWARD)),
        test_maneuver.test_unknown_stops_a_held_maneuver_at_once_and_ends_with_its_cause,
    ),
]
