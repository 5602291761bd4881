"""A whole trial by `drive`, through session, supervisor and bytes, and in pure simulation."""

from __future__ import annotations

import math

import pytest
from driven_rig import driven, simulated_alike

from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.types import Maneuver, State

CONFIG = TunnelConfig(seed=0)


def same(name: str, trial: int, ticks: float, phase: float = 0.0) -> tuple[set[int], int, str]:
    """Both ways agree in every tick; the maneuvers, the number of ticks and the end."""
    one = driven(CONFIG, name, trial, ticks, phase=phase)
    other = simulated_alike(CONFIG, name, trial, one.start, ticks)
    assert one.walk.maneuvers == other.maneuvers
    assert one.walk.commands == other.commands
    assert one.walk.readings == other.readings
    assert one.walk.goals == other.goals
    assert one.walk.status == other.status
    assert one.report.worst <= State.DEGRADED
    assert one.report.safe
    return set(other.maneuvers), len(other.maneuvers), other.status


SLOW = [pytest.param(phase, marks=pytest.mark.slow) for phase in (0.001, 0.0055)]


@pytest.mark.ci
@pytest.mark.parametrize("phase", [0.0, 0.003, 0.008, *SLOW])
def test_M7_drive_decides_as_the_pure_simulation_from_the_first_reading_on(phase: float) -> None:
    met, ticks, _ = same("paper", 0, 250, phase)
    assert Maneuver.FORWARD in met
    assert len(met) >= 3
    assert ticks == 250


@pytest.mark.slow
@pytest.mark.parametrize("phase", [0.0, 0.003])
@pytest.mark.parametrize(("name", "trial"), [("closed-1", 0), ("closed", 1), ("paper", 0)])
def test_M7_drive_decides_as_the_pure_simulation_for_a_whole_trial(
    name: str, trial: int, phase: float
) -> None:
    met, ticks, status = same(name, trial, math.inf, phase)
    assert {Maneuver.HOLD, Maneuver.FORWARD} <= met
    assert Maneuver.REVERSE in met or (name, trial) != ("closed-1", 0)
    assert ticks > 900
    assert status == "success"
