"""The time series of a trial, and what is measured of its way and springs."""

from __future__ import annotations

import base64
import dataclasses
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import antennate
from antennate import TimeSeries
from antennate.experiments.tunnel.physics import TrialMonitor
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import LOOK_EVERY, Episode
from antennate.sim.scenes import geometry
from antennate.sim.scenes.scene import Route

SIDES = ("left", "right")
ODD = [np.nan, np.inf, -np.inf, -0.0, 5e-324, 0.1, 1 / 3, 1.7976931348623157e308]
"""Floats that a careless writer changes."""


def made(ticks: int = 8, links: int = 6, pitch: int = 0, elevation: int = 0) -> TimeSeries:
    rng = np.random.default_rng(1)
    counts = rng.normal(size=(ticks, 2))
    counts[:, 0] = np.resize(ODD, ticks)
    return TimeSeries(
        t=0.01 * np.arange(ticks),
        counts=counts,
        level=rng.random((ticks, 2)),
        contact=rng.integers(0, 3, (ticks, 2)),
        maneuver=rng.integers(0, 5, ticks),
        yaw=rng.normal(size=(ticks, links - 1)),
        leg=rng.normal(size=(ticks, links, 2)),
        antenna=rng.normal(size=(ticks, 2)),
        pitch=rng.normal(size=(ticks, pitch)),
        elevation=rng.normal(size=(ticks, elevation)),
        head=rng.normal(size=(ticks, 2)),
        meta={"controller": "closed", "seed": 3, "length_m": 0.1, "scene": None, "note": "ä\n,"},
    )


def test_a_robot_without_antennae_is_taken() -> None:
    bare = dataclasses.replace(made(), antenna=np.zeros((8, 0)))
    assert not [name for name in bare.columns() if name.startswith("antenna")]


def test_a_data_frame_holds_every_column() -> None:
    series = made()
    frame = series.to_dataframe()
    assert len(frame) == 8
    assert (frame["leg_5_right"] == series.leg[:, 5, 1]).all()
    assert (frame["head_y"] == series.head[:, 1]).all()


def test_columns_are_named_by_side_and_axis_and_joints_are_numbered() -> None:
    pairs = [f"{name}_{side}" for name in ("counts", "level", "contact") for side in SIDES]
    legs = [f"leg_{link}_{side}" for link in range(4) for side in SIDES]
    yaw, pitch = [f"yaw_{k}" for k in range(3)], [f"pitch_{k}" for k in range(3)]
    ends, lifts = ([f"{name}_{side}" for side in SIDES] for name in ("antenna", "elevation"))
    assert list(made(links=4, pitch=3).columns()) == [
        *("t", *pairs, "maneuver", *yaw, *legs, *ends, *pitch, "head_x", "head_y")
    ]
    assert list(made(links=4, pitch=3, elevation=2).columns()) == [
        *("t", *pairs, "maneuver", *yaw, *legs, *ends, *pitch, *lifts, "head_x", "head_y")
    ]


def test_a_series_is_one_line_and_shows_itself_in_a_notebook() -> None:
    series = made(60)
    assert len(repr(series)) < 200
    assert "\n" not in repr(series)
    assert "60 ticks, 0.59 s: controller closed, seed 3" in repr(series)
    page = series._repr_html_()
    forward = 100 * float((series.maneuver == antennate.Maneuver.FORWARD).mean())
    assert f"<td>FORWARD</td><td>{forward:.1f}</td>" in re.sub(' style="[^"]*"', "", page)
    png = base64.b64decode(page.split("data:image/png;base64,")[1].split('"')[0])
    assert png.startswith(b"\x89PNG")
    assert len(page) < 200_000


def test_a_series_without_ticks_or_contact_shows_itself_too() -> None:
    empty = made(0)
    assert "0 ticks" in repr(empty)
    assert "<img" not in empty._repr_html_()
    blind = dataclasses.replace(made(), level=np.full((8, 2), np.nan))
    assert "<td>all</td>" in re.sub(' style="[^"]*"', "", blind._repr_html_())


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
