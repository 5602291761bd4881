"""The law of torsion springs and the taper: the paper's table, other figures of both, ladders."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from antennate.antenna import springs
from antennate.antenna.load import SpringLoad, largest_load
from antennate.errors import ConfigError
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.experiment import run, sentence, tables
from antennate.experiments.antenna.physics import springs_of, taper_of
from antennate.experiments.antenna.result import AntennaResult
from antennate.params.spring import SpringParams, TaperParams
from antennate.robots.antenna import N_MM_PER_DEG, AntennaSpec
from antennate.studies.columns import content, typed
from antennate.studies.formats import to_json

E = 193e9


@pytest.mark.parametrize(("coils", "printed"), [(3, 0.274), (6, 0.137), (9, 0.091)])
def test_the_papers_table_within_its_rounding(coils: int, printed: float) -> None:
    found = springs_of(AntennaConfig()).springs
    spring = next(spring for spring in found if spring.active_coils == coils)
    assert spring.stiffness_n_mm_per_deg == pytest.approx(printed, abs=6e-4)
    assert spring.stiffness_n_m_per_rad == pytest.approx(printed * 0.0573, rel=5e-3)
    assert spring.paper_n_mm_per_deg == printed


@pytest.mark.parametrize(
    ("modulus", "wire", "coil"),
    [
        (E, 0.40, 1.55),
        (E, 0.45, 2.48),
        (E, 0.50, 3.77),
        (E, 0.55, 5.53),
        (E, 0.60, 7.83),
        (206e9, 0.50, 4.03),
    ],
)
def test_other_wires_that_give_the_same_stiffness(modulus: float, wire: float, coil: float) -> None:
    k = springs.spring_stiffness(modulus, 1e-3 * wire, 1e-3 * coil, 3)
    assert k / N_MM_PER_DEG == pytest.approx(0.274, rel=5e-3)


def test_beam_theory_is_six_percent_stiffer() -> None:
    """E I / L of the uncoiled wire: 64 instead of 10.8 x 2 pi."""
    d, coil, coils = 0.5e-3, 4e-3, 5
    beam = E * math.pi * d**4 / 64 / (math.pi * coil * coils)
    assert beam / springs.spring_stiffness(E, d, coil, coils) == pytest.approx(
        10.8 / 10.186, rel=1e-4
    )


def test_many_springs_at_once_are_those_one_by_one() -> None:
    """The taper of the paper, in an array, a list, and a grid of wires and coils."""
    coils = [3, 6, 6, 9, 9, 9]
    one = [springs.spring_stiffness(E, 0.5e-3, 3.77e-3, n) for n in coils]
    assert springs.spring_stiffness(E, 0.5e-3, 3.77e-3, np.array(coils)) == pytest.approx(one)
    assert springs.spring_stiffness(E, 0.5e-3, 3.77e-3, coils) == pytest.approx(one)
    wires = np.array([[0.4e-3], [0.8e-3]])
    grid = np.asarray(springs.spring_stiffness(E, wires, 4e-3, coils))
    assert grid.shape == (2, 6)
    assert grid[1] / grid[0] == pytest.approx([16.0] * 6)  # the fourth power of the wire
    assert type(springs.spring_stiffness(E, 0.5e-3, 3.77e-3, 3)) is float


def test_a_straight_wire_yields_at_its_surface() -> None:
    """Stress E d theta / (2 L), up to curvature, which vanishes for large coils."""
    config = SpringParams(wire="music_wire")
    d, coil, coils = 1e-3, 0.2, 4
    angle = springs.yield_angle(config, d, coil, coils)
    length = math.pi * coil * coils
    strain_stress = 203e9 * d * angle / (2 * length) * 10.186 / 10.8
    assert strain_stress == pytest.approx(0.78 * 2211e6, rel=5e-3)


def test_wound_sets_keep_all_limits_and_their_own_law() -> None:
    found = springs_of(AntennaConfig()).windings
    assert found
    for wound in found:
        assert 4 - 1e-9 <= wound.spring_index <= 12 + 1e-9
        assert wound.yield_angle_deg >= 30
        assert all(2 <= n <= 12 and n * 4 == int(n * 4) for n in wound.active_coils)
        for n, k in zip(wound.active_coils, wound.stiffness_n_mm_per_deg, strict=True):
            d, coil = wound.wire_mm, wound.coil_mm
            assert k == pytest.approx(193e3 * d**4 / (3888 * coil * n), rel=1e-3)
    errors = [wound.largest_error for wound in found]
    assert errors == sorted(errors)


def test_a_mandrel_is_smaller_than_its_coil_by_the_wire() -> None:
    wound = springs_of(AntennaConfig()).windings[0]
    assert wound.coil_mm - wound.mandrel_mm == pytest.approx(wound.wire_mm)


def test_the_sentence_names_the_wire_of_which_its_sizes_keep_to_the_law() -> None:
    """E d^4 / (3888 D N) in N·mm/deg, N in quarter turns; E of stainless and music wire."""
    result = run(AntennaConfig()).result()
    for wire, modulus in (("stainless_302", 193e3), ("music_wire", 203e3)):
        told = sentence(replace(result, springs=springs_of(AntennaConfig(wire=wire))))
        sizes = r"Of ([\w ]+), stock wire of ([\d.]+) mm .* of ([\d.]+) mm .* within ([\d.]+) %"
        found = re.match(sizes, told)
        assert found is not None, told
        assert found[1] == wire.replace("_", " ")
        d, mandrel, percent = (float(found[n]) for n in (2, 3, 4))
        one = modulus * d**4 / (3888 * (mandrel + d))
        worst = max(abs(one / (round(4 * one / k) / 4) / k - 1) for k in (0.274, 0.137, 0.091))
        assert 100 * worst == pytest.approx(percent, abs=0.06)
    none = springs_of(AntennaConfig(wanted_n_mm_per_deg=(90.0,)))
    assert sentence(replace(result, springs=none)).startswith("No stock wire of stainless 302 ")


def test_the_tables_of_a_result_that_was_read_are_those_of_the_run() -> None:
    """Also of a count that the paper lacks, and of wire that no stock comes near."""
    two = AntennaConfig(antenna=AntennaSpec(active_coils=(3, 5, 5)))
    for config in (two, AntennaConfig(wanted_n_mm_per_deg=(90.0,))):
        result = run(config).result()
        assert typed(AntennaResult, json.loads(to_json(content(result)))) == result
        asked, wound, *_ = (dict(table.rows) for table in tables(result))
        assert len(asked["stiffness [N·mm/deg]"]) == len({*config.antenna.active_coils})
        assert bool(wound) == bool(result.springs.windings)
    asked, wound, *_ = tables(run(two).result())
    assert dict(asked.rows)["  the paper prints"] == ["0.274", "-"]
    assert dict(wound.rows)["active coils"][0] == "4 8 12"


def test_the_fatigue_of_shigleys_stock_spring() -> None:
    """Example 10-8: music wire of 0.072 in, coil of 0.521 in, 1 to 5 lbf·in; n_f is 1.13."""
    inch, lbf_in = 25.4, 0.1129848
    spring = SpringParams(wire="music_wire", wire_mm=0.072 * inch, coil_mm=0.521 * inch)
    found = springs.endurance(spring, 1.0 * lbf_in, 5.0 * lbf_in)
    assert found.stress == pytest.approx(152.1e3 * 6894.76, rel=5e-3)
    assert found.fatigue_factor == pytest.approx(1.13, abs=0.01)
    assert found.yield_factor == pytest.approx(229.6 / 152.1, rel=5e-3)


def test_a_load_at_the_published_limit_bears_a_million_cycles_and_no_more() -> None:
    """Half of the tensile strength, from 0 (table 10-10)."""
    spring = SpringParams()
    most = springs.endurance(spring, 0.0, 1e-3).stress
    limit = 0.5 * 1867e6 / 0.5**0.146 / most * 1e-3
    assert springs.endurance(spring, 0.0, limit).fatigue_factor == pytest.approx(1.0, rel=1e-12)
    assert springs.endurance(spring, -limit, limit).fatigue_factor < 1.0
    assert math.isnan(springs.endurance(SpringParams(wire="hard_drawn"), 0.0, 1.0).fatigue_factor)
    with pytest.raises(ConfigError, match="low: expected at most"):
        springs.endurance(spring, -2.0, 1.0)


def test_the_load_is_that_of_the_spring_with_the_largest_torque() -> None:
    """Ten cycles of the stiff spring, bent to its negative side; the soft one goes further."""
    t = np.linspace(0.0, 10.0, 2001)
    stiff, soft = -0.1 * (1.0 - np.cos(2 * np.pi * t)), 0.3 * np.sin(2 * np.pi * 7 * t)
    ripple = 0.002 * np.sin(2 * np.pi * 31 * t)
    found = largest_load(np.column_stack([stiff + ripple, soft]), (3.0, 1.0))
    assert found.high == pytest.approx(0.6, rel=0.03)
    assert found.low == pytest.approx(0.0, abs=0.01)
    assert found.cycles == pytest.approx(10, abs=1)
    assert largest_load(np.zeros((5, 0)), (3.0,)) == SpringLoad()


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
