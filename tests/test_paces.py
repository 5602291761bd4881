"""The pace of a rule is that of the least time among those that cross as many but for noise."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

SCIENCE = Path(__file__).parents[1] / "docs" / "science"
N = 20


@pytest.fixture
def paces(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(SCIENCE))
    sys.modules.pop("paces", None)
    return importlib.import_module("paces")


def draws(crossed: int, share: float) -> tuple[np.ndarray, np.ndarray]:
    """So many of 160 draws crossed, one of each number before the second of any."""
    ok = (np.arange(8 * N) < crossed).reshape(8, N).T.astype(float)
    return ok, np.where(ok > 0, share, 1.0)


@pytest.mark.parametrize(
    ("slower", "wanted"),
    [
        ((100, 0.1), "x+gait.frequency=0.8"),  # one fewer in each number: no noise at all
        ((113, 0.1), "x+gait.frequency=0.8"),  # 7 fewer: one in each of 7 numbers, SE 2.2
        ((119, 0.1), "x+gait.frequency=0.5"),  # one loses one: SE 1, and it takes less time
        ((119, 0.9), "x+gait.frequency=0.8"),
        ((120, 0.5), "x+gait.frequency=0.5"),  # equal in all: the slower one
    ],
)
def test_the_pace_of_a_rule(paces: Any, slower: tuple[int, float], wanted: str) -> None:
    found = {"x+gait.frequency=0.5": draws(*slower), "x+gait.frequency=0.8": draws(120, 0.5)}
    assert paces.chosen(found) == {"x": wanted}


def test_times_of_a_rule_keep_their_gait_cycles(paces: Any) -> None:
    """2.2 s at 0.6 Hz are 1.32 cycles, and so are 1.65 s at 0.8 Hz."""
    assert paces.at("geometric", 0.8) == "geometric+gait.frequency=0.8"
    assert "escape.reverse_time=1.65+" in paces.at("timed", 0.8)
    assert paces.at("timed", 0.6) == "timed+gait.frequency=0.6"
    assert "schedule.turn_rate=0.5585" in paces.at("schedule", 0.8)  # 24 deg/s times 8/6
