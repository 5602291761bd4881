"""The taper: proxies of the animal, harmonic stretches, and ladders."""

from __future__ import annotations

import numpy as np
import pytest

from antennate.antenna import springs
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.physics import taper_of
from antennate.params.spring import TaperParams
from antennate.robots.antenna import AntennaSpec

LINEAR = (
    *(1, 0.759, 0.564, 0.410, 0.289, 0.198, 0.130, 0.0809, 0.0474, 0.0256, 0.0123, 0.00506),
    *(0.00160, 0.000316),
)
GEOMETRIC = (
    *(1, 0.538, 0.289, 0.156, 0.084, 0.045, 0.024, 0.013, 0.0070, 0.0038, 0.0020, 0.0011),
    *(0.00059, 0.00032),
)


@pytest.mark.parametrize(("law", "expected"), [("linear", LINEAR), ("geometric", GEOMETRIC)])
def test_proxies_of_fourteen_segments(law: str, expected: tuple[float, ...]) -> None:
    config = TaperParams.model_validate({"law": law})
    assert springs.proxy(springs.diameters(config)) == pytest.approx(expected, rel=0.05)


def test_the_animal_falls_a_thousandfold_and_the_robot_threefold() -> None:
    result = taper_of(AntennaConfig())
    assert result.base_over_tip == pytest.approx(3164, abs=1)
    assert result.ladder.base_over_tip == pytest.approx(3)


def test_springs_in_a_row_give_as_much_as_the_segments_they_stand_for() -> None:
    values = np.random.default_rng(0).uniform(0.1, 1.0, 14)
    for bins in (1, 2, 6, 7, 14):
        give = (1 / springs.binned(values, bins)).sum() * 14 / bins
        assert give == pytest.approx((1 / values).sum())
    assert springs.binned(values, 14) == pytest.approx(values)


def test_a_uniform_antenna_gets_a_uniform_ladder() -> None:
    assert springs.follow(np.ones(6), 3, 9).tolist() == [3] * 6


def test_a_taper_within_the_limits_is_followed_exactly() -> None:
    assert springs.follow(np.array([1, 1 / 2, 1 / 3, 1 / 10]), 2, 40).tolist() == [2, 4, 6, 20]


def test_a_steeper_taper_ends_at_the_limits() -> None:
    coils = springs.follow(np.array([1.0, 1e-3]), 3, 30)
    assert coils.tolist() == [3, 30]


def test_the_suggested_ladder_is_nearer_than_the_papers() -> None:
    result = taper_of(AntennaConfig())
    assert result.suggested.distance_decades < result.ladder.distance_decades


def test_measured_diameters_replace_the_law() -> None:
    """(1/2)^4 and (1/4)^4."""
    taper = taper_of(AntennaConfig(diameters_mm=(2.0, 1.0, 0.5)))
    assert taper.proxy == [1, 1 / 16, 1 / 256]
    assert taper.diameters_mm == [2.0, 1.0, 0.5]


def test_the_springs_are_those_of_the_antenna() -> None:
    taper = taper_of(AntennaConfig(antenna=AntennaSpec(active_coils=(2.0, 8.0))))
    assert taper.ladder.name == "2-8"
    assert taper.ladder.base_over_tip == 4.0
    assert len(taper.stretches) == 2
