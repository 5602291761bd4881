"""Many causes at once, and any events in any order."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hardware_faults import BAD, SUPPLY, causes, possible, together
from hardware_rig import LIMIT, PERIOD, armed, healthy
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from antennate.hardware.safety.causes import DATA, OF_CONTROLLER, Active, Cause
from antennate.hardware.safety.supervisor import Inputs, Outputs, Supervisor
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, Maneuver, State


def first_told(active: Active) -> tuple[int, int, bool, float]:
    """Lost data explain what the controller makes of them; those that are over explain least."""
    cause = active.cause
    over = cause in DATA and not active.present
    return -cause.severity, 0 if cause in DATA else 1 + (cause in OF_CONTROLLER), over, active.since


def pairs() -> list[tuple[Cause, ...]]:
    return [group for group in itertools.combinations(BAD, 2) if possible(group)]


def triples() -> list[tuple[Cause, ...]]:
    rng = np.random.default_rng(8)
    every = [group for group in itertools.combinations(BAD, 3) if possible(group)]
    return [every[k] for k in rng.choice(len(every), 500, replace=False).tolist()]


@pytest.mark.ci
@pytest.mark.parametrize("groups", [pairs(), triples()], ids=["pairs", "triples"])
def test_T8_the_most_severe_wins_and_nothing_flutters(groups: list[tuple[Cause, ...]]) -> None:
    for group in groups:
        ticker = armed()
        outputs = ticker.run(40, **together(*group))
        worst = max(cause.severity for cause in group)
        assert outputs[0].state is worst, group
        falls = sum(b.state < a.state for a, b in itertools.pairwise(outputs))
        assert falls <= (Cause.REBOOT in group), group  # which is an event and passes
        kept = itertools.groupby([State.OK, *(o.state for o in outputs)])
        assert len(list(kept)) <= 3, group
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

    @rule(bad=st.lists(st.sampled_from(list(BAD)), min_size=1, max_size=2))
    def fall_ill_while_walking(self, bad: list[Cause]) -> None:
        self.settle_and_arm()
        self.well(2)
        self.tick(**together(*bad))

    @rule(age=st.floats(0.0, 0.12), valid=st.integers(0, 3), refused=st.integers(0, 1))
    def come_late_while_walking(self, age: float, valid: int, refused: int) -> None:
        self.settle_and_arm()
        self.well(2)
        self.tick(age=age, valid=valid, refused=refused)

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
        assert self.outputs.causes == tuple(sorted(self.outputs.causes, key=first_told))

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


class LongLadder(Ladder):
    """The same, more often."""


Ladder.TestCase.settings = settings(max_examples=50, stateful_step_count=50)
LongLadder.TestCase.settings = settings(max_examples=200, stateful_step_count=50)
test_T7_any_events_in_any_order = Ladder.TestCase
test_T7_any_events_in_any_order_200_times = pytest.mark.slow(LongLadder.TestCase)
