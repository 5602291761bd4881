"""What a trial of the tunnel measures of the way of the head and of the antennae's springs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from antennate.experiments.tunnel.physics import TrialMonitor
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import LOOK_EVERY, Episode
from antennate.sim.scenes import geometry
from antennate.sim.scenes.scene import Route


def walked(heads: list[tuple[float, float]], bends: np.ndarray) -> Any:
    """The row of a robot whose head was seen at these places of a bent corridor of 1 + 1 m."""
    scene = Route(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]))
    monitor = TrialMonitor(Episode(scene, 100.0), "open")
    world: Any = SimpleNamespace(
        t=1.0, robot=RobotSpec(), obstacle_force=lambda: 0.0, overturned=False
    )
    still = np.tile(bends[-1], (len(heads) * LOOK_EVERY - len(bends), 1))
    for tick, angles in enumerate([*bends, *still]):
        world.bends = lambda angles=angles: angles
        world.head = np.array([*heads[tick // LOOK_EVERY], 0.03])
        assert monitor.tick(world, 0) is None
    world.t = 100.0
    assert monitor.tick(world, 0) == "timeout"
    return monitor.result(world)


def test_who_stands_still_off_the_middle_is_not_farther_off() -> None:
    """Two stretches, 0.02 and 0.06 m off: the mean over the length is 0.04 m, over time 0.058."""
    heads = [(0.51, 0.02), *[(0.61, -0.06)] * 19]
    assert walked(heads, np.zeros((3, 12))).offset_m == pytest.approx(0.04)


def test_distances_are_those_from_the_nearest_piece() -> None:
    line = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    for where, distance in (((0.5, -0.2), 0.2), ((1.3, 0.5), 0.3), ((1.3, -0.4), 0.5)):
        assert geometry.distance(line, np.array(where)) == pytest.approx(distance)


def test_a_hinge_at_its_stop_bends_its_spring_no_further() -> None:
    """1.4 rad by default, 21.98 N·mm at the base spring."""
    bends = np.zeros((3, 12))
    bends[1, 0] = 2.0
    row = walked([(0.1, 0.0)], bends)
    assert row.spring_high_n_m == pytest.approx(0.274e-3 * np.degrees(1.4), rel=1e-6)


def test_the_springs_of_both_antennae_are_looked_at() -> None:
    """A base spring of 0.274 N·mm/deg that is bent by 20° twice bears 5.48 N·mm."""
    bends = np.zeros((9, 12))
    bends[:, 6] = -np.radians([0, 10, 20, 10, 0, 10, 20, 10, 0])
    row = walked([(0.1, 0.0)], bends)
    assert row.spring_high_n_m == pytest.approx(5.48e-3, rel=1e-6)
    assert (row.spring_low_n_m, row.spring_cycles) == (0.0, 1)
