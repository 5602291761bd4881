"""Each guard between bytes and motion, switched off alone, makes a test fail that passes with it.

The list is in `guards_board.py`, `guards_ladder.py`, `guards_servos.py` and
`guards_session.py`.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
import test_session
from guard_tools import Guard, runs_by_itself
from guards_board import CLOCK, FILMS, STREAM
from guards_ladder import SUPERVISOR
from guards_servos import BUS, SERVOS
from guards_session import SESSION

GUARDS = [*STREAM, *CLOCK, *FILMS, *SUPERVISOR, *BUS, *SERVOS, *SESSION]

disarmed = test_session.test_B11_B9_a_servo_without_torque_or_watchdog_is_a_fault_within_a_second


def test_every_guard_has_its_own_name() -> None:
    assert len({guard.name for guard in GUARDS}) == len(GUARDS)


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.name)
@pytest.mark.ci
def test_a_guard_that_is_switched_off_is_noticed(guard: Guard) -> None:
    """That it passes with the guard is seen where it runs by itself, and here if it does not."""
    if not runs_by_itself(guard.notice):
        guard.notice()
    with pytest.MonkeyPatch.context() as patch:
        guard.off(patch)
        with pytest.raises(guard.by):
            guard.notice()


@pytest.mark.parametrize(
    ("notice", "runs"),
    [
        (test_session.test_L15_B16_a_second_program_on_a_port_is_refused, True),
        (
            partial(
                test_session.test_B17_an_adapter_that_keeps_bytes_back_is_refused_with_its_cure, 0.0
            ),
            True,
        ),
        (
            partial(
                test_session.test_B17_an_adapter_that_keeps_bytes_back_is_refused_with_its_cure, 0.1
            ),
            False,
        ),
        (partial(disarmed, 7, ("torque_enable",)), True),
        (partial(disarmed, 1, ("bus_watchdog",)), False),  # slow
        (test_session.walked, False),
    ],
)
def test_what_runs_by_itself_is_a_case_of_a_test_of_every_run(notice: Any, runs: bool) -> None:
    assert runs_by_itself(notice) == runs
