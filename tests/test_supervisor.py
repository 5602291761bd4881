"""Who may walk, and when not: each cause, arming, holds, and numbers that are none."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hardware_faults import BAD, causes, together
from hardware_rig import Ticker, armed, healthy

from antennate.errors import ConfigError
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.channel import Finding
from antennate.hardware.safety.supervisor import Inputs
from antennate.params.safety import SupervisorParams
from antennate.types import Contact, Maneuver, State


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


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(Inputs)])
def test_an_input_that_is_forgotten_is_an_error_and_not_health(name: str) -> None:
    given = dataclasses.asdict(healthy(0.01))
    del given[name]
    with pytest.raises(TypeError, match=name):
        Inputs(**given)


def test_causes_that_are_alike_are_listed_by_name() -> None:
    ticker = Ticker()
    outputs = ticker.step(**together(Cause.STALE, Cause.UNKNOWN_CONTACT, Cause.STUCK, Cause.LOST))
    held = [a.cause.name for a in outputs.causes if a.cause.severity is State.HOLD]
    assert held == sorted(held)
    assert len(held) > 2


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


@pytest.mark.parametrize("now", [math.nan, -1.0, math.inf, 0.0])
def test_a_clock_that_lies_is_a_fault(now: float) -> None:
    ticker = armed()
    outputs = ticker.supervisor.step(now, healthy(now))
    assert outputs.state is State.FAULT
    assert not outputs.move
    assert Cause.PAUSE in causes(outputs)


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


@pytest.mark.parametrize("changes", [{"bad_command": "nan"}, {"maneuver": -1}, {"maneuver": 7}])
def test_S5_a_pose_or_maneuver_that_is_none_is_not_sent(changes: dict[str, Any]) -> None:
    outputs = armed().step(**changes)
    assert outputs.state is State.HOLD
    assert {Cause.BAD_ACTION, Cause.BAD_COMMAND} & causes(outputs)


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
    states = [ticker.step(supply=10.15 + 0.2 * (n % 2)).state for n in range(200)]
    assert len(list(itertools.groupby([State.OK, *states]))) <= 3


def test_supply_levels_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ConfigError, match="must fall from warn over hold to off"):
        SupervisorParams(supply_hold=11.0)


@pytest.mark.parametrize("cause", Cause)
def test_the_page_of_causes_says_what_to_do_about_each(cause: Cause) -> None:
    page = (Path(__file__).parents[1] / "docs" / "causes.md").read_text(encoding="utf-8")
    (line,) = [line for line in page.splitlines() if line.startswith(f"| `{cause.name}` |")]
    _, _, state, means, cure, _ = (cell.strip() for cell in line.split("|"))
    assert (state, means) == (cause.severity.name, cause.text)
    assert len(cure) > len("hold")
