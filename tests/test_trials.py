"""A trial is written once: pool, lockstep, view and studies carry out the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from antennate.params.base import Params, number
from antennate.studies.trials import OneByOne, Trials, no_row, no_step
from antennate.telemetry.view import Restart


class Config(Params):
    """Throws of two dice."""

    trials: int = number(3, "1", "assumed: few", ge=1)
    """Throws."""
    seed: int = number(7, "1", "assumed: any", ge=0)
    """Seed of all chance."""


@dataclass(frozen=True)
class Row:
    seed: int
    trial: int
    die: str
    eyes: int


def throw(config: Config, die: str, number: int, watch: Any = None) -> tuple[Row, str | None]:
    if watch is not None:
        watch(number)
    eyes = (config.seed + 5 * number + (die == "red")) % 6 + 1
    return Row(config.seed, number, die, eyes), "drawn" if number == 0 else None


def dice(**more: Any) -> Trials[Config]:
    return Trials[Config](
        "die",
        every=lambda config: [(d, k) for k in range(config.trials) for d in ("red", "blue")],
        carry_out=OneByOne(throw),
        row=Row,
        invalid=lambda config, die, number, reason: Row(config.seed, number, die, 0),
        **more,
    )


def test_trials_come_by_condition_and_number_whatever_their_order() -> None:
    """The order of conditions is that in which they come first."""
    rows: list[Row] = []
    ended, interrupted = dice().gather(Config(), 1, no_step, rows.append)
    assert not interrupted
    assert [(row.die, row.trial) for row, _ in ended] == [
        (die, k) for die in ("red", "blue") for k in range(3)
    ]
    assert [(row.die, row.trial) for row in rows] == [
        (die, k) for k in range(3) for die in ("red", "blue")
    ]
    assert [extra for _, extra in ended] == ["drawn", None, None] * 2


def test_a_study_gets_the_row_of_each_trial_by_its_place() -> None:
    config, places = Config(), dict[int, Row]()
    dice().run(config, [("blue", 2), ("red", 0), ("blue", 1)], places.__setitem__)
    assert [(places[i].die, places[i].trial) for i in range(3)] == [
        ("blue", 2),
        ("red", 0),
        ("blue", 1),
    ]
    assert places[0] == throw(config, "blue", 2)[0]


class View:
    """A person who wants the second trial anew, with another seed."""

    def __init__(self) -> None:
        self.begun: list[tuple[str, int]] = []

    def begin(self, title: str, seed: int) -> None:
        self.begun.append((title, seed))

    def watch(self, number: int) -> None:
        if len(self.begun) == 2:
            raise Restart(99)


def test_a_trial_that_is_begun_anew_has_the_seed_that_a_person_wants_and_no_other_has() -> None:
    view: Any = View()
    trials = dice(watched=lambda view: {"watch": view.watch})
    ended, _ = trials.gather(Config(trials=2), 1, no_step, no_row, view=view)
    assert [seed for _, seed in view.begun] == [7, 7, 99, 7, 7]
    assert view.begun[1][0] == view.begun[2][0] == "blue, trial 0"
    assert {(row.die, row.trial): row.seed for row, _ in ended} == {
        ("red", 0): 7,
        ("red", 1): 7,
        ("blue", 0): 99,
        ("blue", 1): 7,
    }


@pytest.mark.parametrize("interruptible", [True, False])
def test_what_had_ended_before_ctrl_c_is_a_result_only_where_it_may_be(interruptible: bool) -> None:
    def on_step(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    trials = dice(interruptible=interruptible)
    if not interruptible:
        with pytest.raises(KeyboardInterrupt):
            trials.gather(Config(), 1, on_step, no_row)
        return
    ended, interrupted = trials.gather(Config(), 1, on_step, no_row)
    assert interrupted
    assert len(ended) == 2
