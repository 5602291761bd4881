"""Each guard between bytes and motion, switched off alone, makes a test fail that passes with it.

The list is in `guards_board.py`, `guards_ladder.py`, `guards_servos.py` and
`guards_session.py`.
"""

from __future__ import annotations

import pytest
from guard_tools import Guard
from guards_board import CLOCK, FILMS, STREAM
from guards_ladder import SUPERVISOR
from guards_servos import BUS, SERVOS
from guards_session import SESSION

GUARDS = [*STREAM, *CLOCK, *FILMS, *SUPERVISOR, *BUS, *SERVOS, *SESSION]


def test_every_guard_has_its_own_name() -> None:
    assert len({guard.name for guard in GUARDS}) == len(GUARDS)


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.name)
def test_a_guard_that_is_switched_off_is_noticed(guard: Guard) -> None:
    guard.notice()
    with pytest.MonkeyPatch.context() as patch:
        guard.off(patch)
        with pytest.raises(guard.by):
            guard.notice()
