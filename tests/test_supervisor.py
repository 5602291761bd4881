"""Who may walk, and when not: silence, reboots, exceptions, servos, and all of them at once."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from esp32_streams import made
from hardware_rig import BENT, FREE, LIMIT, PERIOD, Rig, Ticker, armed, healthy, pose_change
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from pydantic import ValidationError

from antennate.controller import Controller
from antennate.hardware.causes import DATA, Cause, Inputs, Outputs, State
from antennate.hardware.diagnosis import Finding
from antennate.hardware.esp32.clock import DeviceClock, Verdict
from antennate.hardware.esp32.wire import Hello, Reset
from antennate.hardware.supervisor import Supervisor
from antennate.params import ControllerParams, SupervisorParams
from antennate.records import Contact, Maneuver

BAD: dict[Cause, dict[str, Any]] = {
    Cause.SPIKY: {"findings": (Finding.SPIKY, Finding.OK)},
    Cause.OUT_OF_CAL: {"findings": (Finding.OUT_OF_CAL, Finding.OK)},
    Cause.SATURATED: {"findings": (Finding.OK, Finding.SATURATED)},
    Cause.LATE_ANSWERS: {"missed": {3: 2}},
    Cause.SUPPLY_UNKNOWN: {"supply": math.nan},
    Cause.SUPPLY_WARN: {"supply": 10.7},
    Cause.STALE: {"age": 0.06, "valid": 0},
    Cause.REBOOT: {"resets": 1, "reset_reason": "WATCHDOG"},
    Cause.LOST: {"findings": (Finding.LOST, Finding.OK)},
    Cause.STUCK: {"findings": (Finding.STUCK, Finding.OK)},
    Cause.OPEN: {"findings": (Finding.OPEN, Finding.OK)},
    Cause.SHORT_LO: {"findings": (Finding.SHORT_LO, Finding.OK)},
    Cause.SHORT_HI: {"findings": (Finding.OK, Finding.SHORT_HI)},
    Cause.FAILED: {"failure": "ValueError: 3"},
    Cause.UNDECIDED: {"decided_at": 0.0},
    Cause.BAD_ACTION: {"maneuver": 5},
    Cause.UNKNOWN_CONTACT: {"contact": (Contact.FREE, Contact.UNKNOWN)},
    Cause.SUPPLY_HOLD: {"supply": 10.1},
    Cause.SILENT_SERVO: {"missed": {3: 5, 11: 9}},
    Cause.SERVO_ERROR: {"servo_errors": {7: "overload"}},
    Cause.BUS_ERROR: {"bus_error": "port gone"},
    Cause.WATCHDOG: {"watchdogs": (4, 5)},
    Cause.SUPPLY_OFF: {"supply": 9.5},
    Cause.NOT_READY: {"objections": ("the firmware is old",)},
    Cause.STOPPED: {"stop": True},
}
"""A change of healthy inputs that brings about each cause."""
SUPPLY = (Cause.SUPPLY_WARN, Cause.SUPPLY_HOLD, Cause.SUPPLY_OFF)


def causes(outputs: Outputs) -> set[Cause]:
    return {active.cause for active in outputs.causes}


def together(*bad: Cause) -> dict[str, Any]:
    """Changes for several causes at once; sides and ids are joined, the lowest supply counts."""
    merged: dict[str, Any] = {}
    for cause in bad:
        for key, value in BAD[cause].items():
            if key == "findings" and key in merged:
                theirs = [f for f in (*merged[key], *value) if f is not Finding.OK]
                merged[key] = (theirs[0], theirs[-1])
            elif key == "missed" and key in merged:
                merged[key] = merged[key] | value
            elif key == "supply" and key in merged:
                merged[key] = min(merged[key], value)
            else:
                merged[key] = value
    return merged


@pytest.mark.parametrize("cause", list(BAD))
def test_every_cause_is_named_dated_and_as_severe_as_it_says(cause: Cause) -> None:
    ticker = armed()
    outputs = ticker.step(**BAD[cause])
    assert outputs.state is cause.severity
    (active,) = [a for a in outputs.causes if a.cause is cause]
    assert active.since == ticker.now
    assert active.present
    assert active.text.startswith(f"{cause.severity.name} {cause.name}: {cause.text}")
    assert outputs.causes[0].cause.severity is cause.severity
    assert outputs.move == (cause.severity <= State.DEGRADED)
    assert outputs.torque == (cause.severity < State.OFF)
    later = ticker.step(**BAD[cause])
    assert all(a.since < ticker.now for a in later.causes if a.cause is cause)


def test_details_name_sides_servos_and_reasons() -> None:
    ticker = armed()
    changes = together(Cause.SILENT_SERVO, Cause.SERVO_ERROR, Cause.WATCHDOG, Cause.SUPPLY_HOLD)
    outputs = ticker.step(**changes, findings=(Finding.STUCK, Finding.STUCK))
    details = {a.cause: a.detail for a in outputs.causes}
    assert details[Cause.SILENT_SERVO] == "servo 3, 11"
    assert details[Cause.SERVO_ERROR] == "servo 7: overload"
    assert details[Cause.WATCHDOG] == "servo 4, 5"
    assert details[Cause.SUPPLY_HOLD] == "10.1 V"
    assert details[Cause.STUCK] == "left, right"


def test_L8_silence_at_a_thousand_random_phases() -> None:
    """HOLD is decided within 70 ms after the last valid sample, whatever the phases."""
    rng = np.random.default_rng(8)
    after = []
    for _ in range(1000):
        ticker = armed()
        phase, delay = rng.uniform(0, PERIOD), rng.uniform(0, 0.005)
        last = ticker.now + phase - delay
        outputs = ticker.step(age=ticker.now + PERIOD - last)
        while outputs.move:
            outputs = ticker.step(age=ticker.now + PERIOD - last, valid=0)
        assert outputs.state is State.HOLD
        assert causes(outputs) == {Cause.STALE}
        after.append(ticker.now - last)
    assert min(after) > LIMIT
    assert max(after) <= 0.070


def test_L8_a_maneuver_that_is_held_does_not_delay_hold() -> None:
    """The turn has 2 s to go when the samples end: the pose stands still within 70 ms."""
    rig = Rig("paper")
    rig.start()
    rig.go(40, (BENT, FREE))
    assert rig.mind.maneuver[0] == Maneuver.TURN_R
    last = rig.now
    moved = last
    for _ in range(100):
        rig.step([])
        if rig.pose_step() > 0:
            moved = rig.now
    assert moved - last <= 0.06
    assert rig.outputs[-1].state is State.HOLD
    assert rig.outputs[-1].torque


@pytest.mark.parametrize("silence", [0.2, 0.5, 1.0, 5.0, 60.0])
def test_L9_silence_then_return(silence: float) -> None:
    """Walks again within 1 s and after ten good samples; the first step is a normal one."""
    rig = Rig("open")
    rig.start()
    normal = 0.0
    for _ in range(100):
        rig.go(1)
        normal = max(normal, rig.pose_step())
    assert normal > 0
    for _ in range(round(silence / PERIOD)):
        rig.step([])
    assert rig.outputs[-1].state is State.HOLD
    held = rig.sent[-1]
    first = rig.now + PERIOD
    good = 0
    while rig.sent[-1] is held or rig.pose_step() == 0:
        rig.go(1)
        good += 1
        assert rig.now - first < 1.0
    assert good >= 10
    assert rig.pose_step() <= 1.01 * normal
    assert causes(rig.outputs[-1]) <= {Cause.RATE}
    rig.go(100)
    assert rig.outputs[-1].state is State.OK
    assert max(itertools.starmap(pose_change, itertools.pairwise(rig.sent))) <= 1.01 * normal


def boot(number: int = 1) -> Hello:
    return Hello(number, (1, 0, 0), Reset.POWER_ON, 0, "00", 30, 100)


@pytest.mark.parametrize("stall", [0.1, 0.6, 2.0, 5.0])
@pytest.mark.parametrize("behind", [0, 20])
def test_L10_a_burst_of_old_frames_is_not_acted_upon(stall: float, behind: int) -> None:
    """No pose rests on a sample older than 50 ms; it holds in time and walks again after."""
    rig, clock = Rig("paper"), DeviceClock()
    clock.greet(boot(made(0).boot_id))
    rig.sent.append(rig.mind.gait.step(np.array([int(Maneuver.HOLD)])))
    rng = np.random.default_rng(10)
    stop, end = 200, 200 + round(stall * 100)
    holds = moves = 0
    for n in range(end + 300):
        now = (rig.n + 1) * PERIOD
        if n < stop:
            arrived = [n]
        elif n < end:
            arrived = []
        elif n == end:
            arrived = list(range(stop, max(stop, end - behind)))
        else:
            arrived = [n] if n > end + 1 else list(range(max(stop, end - behind), n + 1))
        samples = []
        for number in arrived:
            if clock.take(made(number), now) is Verdict.USED and clock.newest is not None:
                counts = (FREE + np.rint(rng.normal(0, 2.5, 2))).tolist()
                samples.append((number * PERIOD, *counts))
        outputs = rig.step(samples, age=clock.age(now), arm=n == 100)
        holds += outputs.state is State.HOLD and n >= stop
        moves += outputs.move and n >= stop
        if stop + 7 <= n < end + 10:
            assert not outputs.move
    assert max(rig.used_ages) <= LIMIT + 1e-9
    assert holds >= round(stall * 100) - 7
    assert rig.outputs[-1].state is State.OK
    assert moves > 200


def reboots(reason: str, gap: float, every: float, count: int) -> list[Outputs]:
    """What follows when the board restarts again and again, silent for a time [s] after each."""
    ticker = armed()
    found = []
    for number in range(1, count + 1):
        for n in range(round(every / PERIOD)):
            silent = n < round(gap / PERIOD)
            changes = {"age": math.inf, "valid": 0} if silent else {}
            found.append(ticker.step(resets=number, reset_reason=reason, **changes))
    return found


@pytest.mark.parametrize("gap", [0.05, 0.3, 0.95, 1.0])
@pytest.mark.parametrize("reason", ["brown-out", "HARD"])
def test_E2_a_reboot_loop_is_a_fault_after_three(gap: float, reason: str) -> None:
    """One a second, 30 times: FAULT at the third, with the reason; never walks again by itself."""
    found = reboots(reason, gap, 1.0, 30)
    first = next(n for n, outputs in enumerate(found) if outputs.state is State.FAULT)
    assert first <= 2.0 / PERIOD
    assert all(o.state is State.FAULT and not o.move for o in found[first:])
    details = {a.cause: a.detail for a in found[-1].causes}
    assert details[Cause.REBOOT_LOOP] == reason
    assert ("brown-out" in details[Cause.REBOOT_LOOP]) == (reason == "brown-out")


def test_E2_reboots_far_apart_are_holds() -> None:
    found = reboots("HARD", 0.3, 6.0, 5)
    assert {o.state for o in found} == {State.OK, State.HOLD}


@pytest.mark.parametrize(
    ("rate", "wrong"),
    [(50, True), (78, True), (82, False), (100, False), (118, False), (200, True)],
)
def test_L16_a_wrong_rate_is_shown_and_degrades(rate: int, wrong: bool) -> None:
    """After 2 s it is known, and measured to 2 %."""
    ticker = armed()
    taken = 0
    outputs = None
    for n in range(400):
        come = (n + 1) * rate // 100 - taken
        taken += come
        outputs = ticker.step(valid=come)
    assert outputs is not None
    assert ticker.supervisor.meter.rate == pytest.approx(rate, rel=0.02)
    assert (Cause.RATE in causes(outputs)) == wrong
    assert outputs.state is (State.DEGRADED if wrong else State.OK)


@pytest.mark.parametrize("rate", [25, 50, 100, 200, 1000])
def test_L16_the_mean_covers_the_same_time_at_any_rate(rate: int) -> None:
    """Readings step from straight to half bent: b settles after 0.1 s, and one sample or tick."""
    rig = Rig("paper")
    rig.start()
    begin = rig.n + 1
    taken = 0
    settled = []
    for n in range(begin, begin + 40):
        come = (n - begin + 1) * rate // 100 - taken
        taken += come
        rig.step(
            [(n * PERIOD - k / rate, 1600.0 + k % 2, FREE + k % 2) for k in reversed(range(come))]
        )
        settled.append(rig.mind.b[0, 0])
    reached = next(n for n, b in enumerate(settled) if abs(b - settled[-1]) < 0.01)
    averaging = ControllerParams().conditioning.averaging_time
    patience = max(1 / rate, 2 * PERIOD) * 3
    assert averaging - 2 * PERIOD <= (reached + 1) * PERIOD <= averaging + patience


def test_T5_after_a_pause_it_does_not_resume() -> None:
    """The loop stood still for 5 s, then a person pressed arm: not in the tick of the wake-up."""
    ticker = armed()
    ticker.n += 500
    outputs = ticker.step(arm=True)
    assert outputs.state is State.FAULT
    assert not outputs.arming
    assert Cause.PAUSE in causes(outputs)
    assert all(o.state is State.FAULT for o in ticker.run(100))
    assert ticker.step(arm=True).arming


@pytest.mark.parametrize("now", [math.nan, -1.0, math.inf, 0.0])
def test_a_clock_that_lies_is_a_fault(now: float) -> None:
    ticker = armed()
    outputs = ticker.supervisor.step(now, healthy(now))
    assert outputs.state is State.FAULT
    assert not outputs.move
    assert Cause.PAUSE in causes(outputs)


class Moody:
    """A controller that raises in some ticks."""

    def __init__(self, bad: set[int]) -> None:
        self._inner = Controller(ControllerParams(), "open")
        self._bad = bad
        self._n = 0

    def step(self, frame):
        self._n += 1
        if self._n in self._bad:
            raise RuntimeError(f"tick {self._n}")
        return self._inner.step(frame)

    def __getattr__(self, name: str):
        return getattr(self._inner, name)


@pytest.mark.parametrize("seed", range(5))
def test_T6_an_exception_holds_in_the_same_tick_and_three_are_a_fault(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bad = sorted((100 + rng.choice(500, 3, replace=False)).tolist())
    rig = Rig(mind=Moody(set(bad)))
    rig.start()
    while rig.n < 700:
        tick = rig.n + 2
        rig.go(1)
        outputs = rig.outputs[-1]
        if tick in bad:
            assert outputs.state is (State.FAULT if tick == bad[-1] else State.HOLD)
            assert not outputs.move
            assert not outputs.feed_watchdog
            assert Cause.FAILED in causes(outputs)
            assert rig.pose_step() == 0
        elif tick < bad[-1]:
            assert outputs.state is State.OK
        else:
            assert outputs.state is State.FAULT
            assert Cause.REPEATED_FAILURES in causes(outputs)


def test_B8_watchdogs_are_fed_only_upon_a_decision_of_this_tick() -> None:
    """A controller that stands still with the bus alive, one of the future, and one that raises."""
    ticker = armed()
    assert ticker.step().feed_watchdog
    frozen = ticker.now
    for _ in range(20):
        outputs = ticker.step(decided_at=frozen)
        assert not outputs.feed_watchdog
        assert not outputs.move
    assert ticker.step().feed_watchdog
    for lie in (math.nan, math.inf, ticker.now + 1, -math.inf):
        assert not ticker.step(decided_at=lie).feed_watchdog
    assert not ticker.step(failure="x").feed_watchdog
    assert not ticker.step(stop=True).feed_watchdog


def test_B8_a_hold_for_lost_data_still_feeds_the_watchdogs() -> None:
    ticker = armed()
    assert all(o.feed_watchdog for o in ticker.run(100, age=1.0, valid=0))


@pytest.mark.parametrize("age", [math.nan, math.inf, -math.inf, -0.001, 0.0501])
def test_S5_an_age_that_is_no_age_is_stale(age: float) -> None:
    outputs = armed().step(age=age)
    assert outputs.state is State.HOLD
    assert Cause.STALE in causes(outputs)


@pytest.mark.parametrize("changes", [{"finite": False}, {"maneuver": -1}, {"maneuver": 7}])
def test_S5_a_pose_or_maneuver_that_is_none_is_not_sent(changes: dict[str, Any]) -> None:
    outputs = armed().step(**changes)
    assert outputs.state is State.HOLD
    assert Cause.BAD_ACTION in causes(outputs)


@pytest.mark.parametrize("contact", list(itertools.product(Contact, Contact)))
@pytest.mark.parametrize("maneuver", list(Maneuver))
def test_S5_unknown_contact_never_walks(contact: tuple, maneuver: Maneuver) -> None:
    outputs = armed().step(contact=contact, maneuver=maneuver)
    assert outputs.move == (Contact.UNKNOWN not in contact)


def test_data_must_be_well_ten_times_in_a_row() -> None:
    ticker = armed()
    ticker.step(**BAD[Cause.OPEN])
    assert [o.state for o in ticker.run(9)] == [State.HOLD] * 9
    ticker.step(age=0.06)
    assert [o.state for o in ticker.run(9)] == [State.HOLD] * 9
    ticker.step(refused=1)
    assert [o.state for o in ticker.run(9)] == [State.HOLD] * 9
    ticker.run(3, valid=0)
    assert ticker.step().state is State.OK


def test_three_holds_in_ten_seconds_are_a_fault() -> None:
    ticker = armed()
    for n in range(3):
        outputs = ticker.step(**BAD[Cause.STALE])
        assert outputs.state is (State.FAULT if n == 2 else State.HOLD)
        outputs = ticker.run(300)[-1]
    assert outputs.state is State.FAULT
    assert causes(outputs) == {Cause.REPEATED_HOLDS}
    assert ticker.step(arm=True).arming
    assert ticker.step().move


def test_three_holds_in_eleven_seconds_are_none() -> None:
    ticker = armed()
    for _ in range(6):
        assert ticker.step(**BAD[Cause.STALE]).state is State.HOLD
        assert ticker.run(549)[-1].state is State.OK


def test_it_begins_off_and_arms_on_good_data_only() -> None:
    ticker = Ticker()
    first = ticker.step(arm=True)
    assert first.state is State.OFF
    assert not first.torque
    assert first.refusal == (Cause.STALE,)
    assert not any(o.torque for o in ticker.run(50, arm=True))
    ticker.step()
    outputs = ticker.step(arm=True)
    assert outputs.arming
    assert outputs.torque
    assert not outputs.move
    held = ticker.run(10, arm=True)
    assert not any(o.arming for o in held)
    assert held[-1].move


def test_arming_clears_latched_watchdogs_and_nothing_else() -> None:
    ticker = armed()
    assert ticker.step(**BAD[Cause.WATCHDOG]).state is State.FAULT
    outputs = ticker.step(**together(Cause.WATCHDOG, Cause.SERVO_ERROR), arm=True)
    assert outputs.refusal == (Cause.SERVO_ERROR,)
    ticker.step(**BAD[Cause.WATCHDOG])
    assert ticker.step(**BAD[Cause.WATCHDOG], arm=True).arming
    assert ticker.step().move
    assert ticker.step(**BAD[Cause.WATCHDOG]).state is State.FAULT


def test_an_arm_event_while_walking_is_ignored() -> None:
    outputs = armed().step(arm=True)
    assert not outputs.arming
    assert outputs.move


def test_the_supply_sags_down_the_ladder_and_does_not_flutter() -> None:
    ticker = armed()
    levels = np.linspace(12.0, 9.0, 600)
    states = [ticker.step(supply=float(v)).state for v in levels]
    kept = [s for s, _ in itertools.groupby(states)]
    assert kept == [State.OK, State.DEGRADED, State.HOLD, State.OFF]
    ticker = armed()
    before = ticker.supervisor.transitions
    for n in range(200):
        ticker.step(supply=10.15 + 0.2 * (n % 2))
    assert ticker.supervisor.transitions - before <= 2


def possible(group: tuple[Cause, ...]) -> bool:
    """Whether one set of inputs can say it all: a supply that is unknown is not also low."""
    return Cause.SUPPLY_UNKNOWN not in group or not set(SUPPLY) & set(group)


def pairs() -> list[tuple[Cause, ...]]:
    return [group for group in itertools.combinations(BAD, 2) if possible(group)]


def triples() -> list[tuple[Cause, ...]]:
    rng = np.random.default_rng(8)
    every = [group for group in itertools.combinations(BAD, 3) if possible(group)]
    return [every[k] for k in rng.choice(len(every), 500, replace=False).tolist()]


@pytest.mark.parametrize("groups", [pairs(), triples()], ids=["pairs", "triples"])
def test_T8_the_most_severe_wins_and_nothing_flutters(groups: list[tuple[Cause, ...]]) -> None:
    for group in groups:
        ticker = armed()
        before = ticker.supervisor.transitions
        outputs = ticker.run(40, **together(*group))
        worst = max(cause.severity for cause in group)
        assert outputs[0].state is worst, group
        falls = sum(b.state < a.state for a, b in itertools.pairwise(outputs))
        assert falls <= (Cause.REBOOT in group), group  # which is an event and passes
        assert ticker.supervisor.transitions - before <= 2, group
        severities = [a.cause.severity for a in outputs[-1].causes]
        assert severities == sorted(severities, reverse=True)


def test_T8_clearing_one_cause_keeps_the_other() -> None:
    """What is latched stays, what is gone goes, and the one still there decides."""
    for one, other in itertools.permutations(BAD, 2):
        if other is Cause.REBOOT or not possible((one, other)) or {one, other} <= set(SUPPLY):
            continue
        ticker = armed()
        ticker.run(2, **together(one, other))
        outputs = ticker.run(30, **BAD[other])[-1]
        assert other in causes(outputs), (one, other)
        stays = one.severity >= State.FAULT or (one in DATA and other in DATA)
        assert (one in causes(outputs)) == stays, (one, other)
        assert outputs.state is max(a.cause.severity for a in outputs.causes)


class Ladder(RuleBasedStateMachine):
    """T7: any events in any order; what must hold after each is in the invariants."""

    def __init__(self) -> None:
        super().__init__()
        self.supervisor = Supervisor(SupervisorParams())
        self.now = 0.0
        self.inputs: Inputs | None = None
        self.outputs: Outputs | None = None
        self.before: Outputs | None = None
        self.asked = self.was_asked = False
        self.armed_once = False
        self.good = 0

    def tick(self, **changes: Any) -> None:
        self.now += PERIOD
        self.before = self.outputs
        self.was_asked = self.asked
        self.inputs = healthy(self.now, **changes)
        self.asked = self.inputs.arm
        self.outputs = self.supervisor.step(self.now, self.inputs)
        self.armed_once |= self.outputs.arming
        lost = DATA & {a.cause for a in self.outputs.causes if a.present}
        self.good = 0 if lost else self.good + self.inputs.valid

    @rule(count=st.integers(1, 15))
    def well(self, count: int) -> None:
        for _ in range(count):
            self.tick()

    @rule(bad=st.lists(st.sampled_from(list(BAD)), min_size=1, max_size=3), arm=st.booleans())
    def ill(self, bad: list[Cause], arm: bool) -> None:
        self.tick(**together(*bad), arm=arm)

    @rule()
    def arm(self) -> None:
        self.tick(arm=True)

    @rule()
    def settle_and_arm(self) -> None:
        self.well(15)
        self.tick(arm=True)

    @rule(maneuver=st.integers(-2, 8))
    def act(self, maneuver: int) -> None:
        self.tick(maneuver=maneuver)

    @rule(pause=st.floats(0.02, 5.0))
    def pause(self, pause: float) -> None:
        self.now += pause
        self.tick(age=pause)

    @invariant()
    def no_motion_without_an_arm_event(self) -> None:
        if self.outputs is None or self.inputs is None:
            return
        if self.outputs.torque or self.outputs.move:
            assert self.armed_once
        if self.outputs.arming:
            assert self.inputs.arm
            assert not self.was_asked
            assert not self.outputs.move
        off = self.before is None or not self.before.torque
        if off and self.outputs.torque:
            assert self.outputs.arming

    @invariant()
    def the_most_severe_cause_wins(self) -> None:
        if self.outputs is None:
            return
        worst = max((a.cause.severity for a in self.outputs.causes), default=State.OK)
        assert self.outputs.state is worst
        assert self.outputs.causes == tuple(
            sorted(self.outputs.causes, key=lambda a: (-a.cause.severity, a.since))
        )

    @invariant()
    def fault_and_off_are_left_by_arming_only(self) -> None:
        if self.before is None or self.outputs is None:
            return
        if self.before.state >= State.FAULT and self.outputs.state < self.before.state:
            assert self.outputs.arming

    @invariant()
    def it_moves_on_good_data_and_a_fresh_decision_only(self) -> None:
        if self.outputs is None or self.inputs is None or not self.outputs.move:
            return
        assert self.outputs.state <= State.DEGRADED
        assert self.inputs.age <= LIMIT
        assert self.inputs.decided_at == self.now
        assert self.inputs.maneuver in set(Maneuver)
        assert Contact.UNKNOWN not in self.inputs.contact
        assert self.outputs.feed_watchdog
        assert self.good >= 10

    @invariant()
    def watchdogs_are_fed_upon_a_decision_only(self) -> None:
        if self.outputs is None or self.inputs is None or not self.outputs.feed_watchdog:
            return
        assert self.inputs.decided_at == self.now
        assert not self.inputs.failure
        assert self.outputs.torque


Ladder.TestCase.settings = settings(max_examples=100, stateful_step_count=50, deadline=None)
test_T7_any_events_in_any_order = Ladder.TestCase


def test_supply_levels_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ValidationError, match="must fall from warn over hold to off"):
        SupervisorParams(supply_hold=11.0)
