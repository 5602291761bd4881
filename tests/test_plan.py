"""Plans of studies: which points they have, and what is told of a Morris plan."""

from __future__ import annotations

import numpy as np
import pytest

from antennate import experiments
from antennate.errors import ConfigError
from antennate.studies.plan import Range, elementary_effects, make_points, trajectories


def test_a_grid_is_every_combination_and_a_list_goes_in_step() -> None:
    axes = {"a": [1, 2], "b": ["x", "y", "z"]}
    assert len(make_points("grid", axes, 1, 0)) == 6
    assert make_points("grid", axes, 1, 0)[1] == {"a": 1, "b": "y"}
    assert make_points("list", {"a": [1, 2], "b": [3, 4]}, 1, 0) == [
        {"a": 1, "b": 3},
        {"a": 2, "b": 4},
    ]
    with pytest.raises(ConfigError, match="lists of one length, found lengths 2, 3"):
        make_points("list", axes, 1, 0)
    with pytest.raises(ConfigError, match="found a range"):
        make_points("grid", {"a": Range(low=0, high=1)}, 1, 0)
    for empty in ({}, {"a": []}):
        with pytest.raises(ConfigError, match="the grid is empty"):
            make_points("grid", empty, 1, 0)


def test_drawn_points_fill_their_ranges() -> None:
    axes = {
        "a": Range(low=2.0, high=4.0),
        "b": Range(low=1, high=100, log=True),
        "c": Range(low=1, high=3, whole=True),
        "d": Range(low=1, high=10000, whole=True, log=True),
    }
    for kind in ("random", "sobol"):
        points = make_points(kind, axes, 64, 3)
        assert points == make_points(kind, axes, 64, 3)
        a, b, c, d = (np.array([point[name] for point in points]) for name in "abcd")
        assert 2.0 <= a.min() < 2.2
        assert 3.8 < a.max() <= 4.0
        assert 0.35 < np.mean(b < 10) < 0.65  # half of the decades
        assert set(c.tolist()) == {1, 2, 3}
        assert all(isinstance(point["d"], int) for point in points)
        assert 0.35 < np.mean(d < 100) < 0.65
    halves = np.array([p["a"] for p in make_points("sobol", {"a": axes["a"]}, 64, 3)]) < 3.0
    assert halves.sum() == 32  # what Sobol's points are made for


def test_morris_finds_the_slopes_of_a_plane_and_moves_one_parameter_at_a_time() -> None:
    shares = trajectories(4, 5, np.random.default_rng(1)).reshape(5, 5, 4)
    moved = np.abs(np.diff(shares, axis=1)) > 1e-9
    assert (moved.sum(axis=2) == 1).all()
    assert (moved.sum(axis=1) == 1).all()
    assert set(np.round(shares.ravel() * 3).tolist()) == {0, 1, 2, 3}
    slopes = np.array([3.0, 0.0, -2.0, 0.5])
    response = (shares @ slopes).ravel().tolist()
    effects = elementary_effects(4, 5, 1, response)
    assert np.allclose(np.mean(effects, axis=1), slopes)


def test_every_assumed_number_of_the_tunnel_can_vary() -> None:
    from antennate.experiments.study.config import assumed_fields, assumed_ranges

    model = experiments.load("tunnel").config
    ranges = dict(assumed_ranges(model, 0.2))
    assert "control.rule.threshold" in ranges
    assert (mass := ranges["tunnel.cylinder.mass"]).low == pytest.approx(0.08)
    assert mass.high == pytest.approx(0.12)
    assert "tunnel.free_width" not in ranges  # it is the paper's
    assert "robot.baud" not in ranges  # it is not read
    told = {name for name, *_ in assumed_fields(model())}
    assert set(ranges) < told
