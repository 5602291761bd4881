"""Flex to counts: facts section 2 gives the counts, the formula the resistances."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from antennate import simulate
from antennate.antenna import sensor
from antennate.cli import main
from antennate.errors import ConfigError
from antennate.experiments.antenna.config import AntennaConfig
from antennate.experiments.antenna.experiment import run, tables
from antennate.experiments.antenna.physics import sensor_of
from antennate.experiments.bench import flex_of
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import RobotFile
from antennate.params.base import read_file
from antennate.params.control import ControlParams, CurveParams
from antennate.robots.antenna import AntennaSpec, SensorParams

FLAT, GAIN = 10e3, 1.2 / math.pi


@pytest.mark.parametrize(
    ("resistance", "expected"), [(10e3, 1872), (15e3, 1462), (22e3, 1104), (40e3, 643)]
)
def test_film_resistances_give_the_counts_of_the_divider(resistance: float, expected: int) -> None:
    flex = (resistance / FLAT - 1) / GAIN
    assert sensor.counts(SensorParams(), np.array([flex])) == pytest.approx([expected], abs=1)


@pytest.mark.parametrize(("resistance", "expected"), [(10e3, 1872), (15e3, 2281), (22e3, 2640)])
def test_below_the_fixed_resistor_counts_rise(resistance: float, expected: int) -> None:
    """By hand: 3.3 V R / (R + 10 kOhm), less 0.142 V, by 0.80566 mV a count."""
    params = SensorParams(fixed_resistor="supply")
    read = sensor.counts(params, np.array([(resistance / FLAT - 1) / GAIN]))
    assert read == pytest.approx([expected], abs=1)
    assert flex_of(params, read) == pytest.approx([(resistance / FLAT - 1) / GAIN], abs=0.01)
    assert params.polarity == 1


def test_counts_fall_strictly_over_bends_a_degree_apart() -> None:
    flex = np.radians(np.arange(0.0, 181.0))
    assert (np.diff(sensor.counts(SensorParams(), flex)) < 0).all()


def test_counts_stay_within_twelve_bits() -> None:
    noise = np.array([-1e6, 1e6])
    assert sensor.counts(SensorParams(), np.zeros(2), noise).tolist() == [0.0, 4095.0]


def test_an_endless_bend_reads_zero() -> None:
    assert sensor.counts(SensorParams(), np.array([1e9])).tolist() == [0.0]


def test_counts_are_whole_numbers() -> None:
    read = sensor.counts(SensorParams(), np.linspace(-2, 2, 50), 0.3)
    assert (read == np.round(read)).all()


def test_a_film_of_one_direction_ignores_bends_towards_the_head() -> None:
    params = SensorParams(directions="one")
    straight, tail, head = sensor.counts(params, np.array([0.0, 1.0, -1.0]))
    assert head == straight
    assert tail < straight


def test_a_film_of_both_directions_sees_both_alike() -> None:
    tail, head = sensor.counts(SensorParams(directions="both"), np.array([1.0, -1.0]))
    assert head == tail


def test_the_transfer_curve_passes_the_makers_table() -> None:
    """Readings above 2880 at a reference of 1.1 V (ESP-IDF), and one measured chip within 2.5 %."""
    volts, readings = sensor.transfer_curve(SensorParams())
    at = np.interp([3264, 3648, 4032], readings, volts)
    assert at == pytest.approx([2.718, 2.932, 3.107], abs=1e-3)
    chip = np.interp([2.462, 1.641, 0.819], volts, readings)
    assert chip == pytest.approx([2811, 1814, 823], rel=0.03)
    assert (np.diff(volts) > 0).all()


def test_there_is_a_dead_zone_below_and_an_end_above() -> None:
    low = SensorParams(divider_resistance=400.0)  # 0.127 V
    assert sensor.counts(low, np.array([0.0])).tolist() == [0.0]
    high = SensorParams(divider_resistance=1e6)  # 3.27 V
    assert sensor.counts(high, np.array([0.0])).tolist() == [4095.0]


@pytest.mark.parametrize("reference", [1.0, 1.2])
def test_a_higher_reference_reads_less(reference: float) -> None:
    here = sensor.counts(SensorParams(reference=reference), np.zeros(1))
    usual = sensor.counts(SensorParams(), np.zeros(1))
    assert np.sign(usual - here) == np.sign(reference - 1.1)


def test_a_pressure_film_reads_more_when_bent() -> None:
    params = SensorParams(kind="fsr")
    read = sensor.counts(params, np.radians([0.0, 30.0, 60.0, 90.0]))
    assert (np.diff(read) > 0).all()
    assert sensor.resistance(params, np.array([0.0, math.pi / 2])) == pytest.approx([10e6, 5e3])


FSR = {"sensor": {"kind": "fsr"}}


@pytest.mark.parametrize(("name", "value"), [("kind", "fsr"), ("fixed_resistor", "supply")])
def test_the_curve_that_calibrate_finds_for_it_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, value: str
) -> None:
    """As the refusal says; `drive` takes the same file for a real robot."""
    other = [f"--antenna.sensor.{name.replace('_', '-')}", value]
    words = ["--rig.pushes", "2", "--rig.speeds", "0.3", "--no-figures"]
    rig = ["calibrate", *other, *words, "--out", str(tmp_path / "rig")]
    assert main(rig) == 0
    file = tmp_path / "rig" / "conditioning.toml"
    words = ["--trials", "1", "--time-limit", "0.1", "--no-figures", "--out", str(tmp_path / "run")]
    assert main(["tunnel", "--config", str(file), *words]) == 0, capsys.readouterr().err
    told = (tmp_path / "run" / "config.toml").read_text()
    assert f'{name} = "{value}"' in told
    assert "polarity = 1  #" in told
    assert read_file(file, RobotFile).control.conditioning.polarity == 1


def test_each_antenna_needs_a_curve_of_its_own_kind() -> None:
    rising = ControlParams.model_validate({"conditioning": {"polarity": 1}})
    one = {"control": rising, "robot": {"antenna": FSR}}
    assert TunnelConfig.model_validate(one).control == rising
    with pytest.raises(ConfigError, match=r"control\.conditioning\.polarity must be -1 for a flex"):
        simulate("open", control=rising, time_limit=0.1)
    two = rising.model_copy(update={"conditioning_right": CurveParams()})
    with pytest.raises(ValidationError, match=r"control\.conditioning_right\.polarity must be 1"):
        TunnelConfig.model_validate({**one, "control": two})


def test_the_bench_tells_what_the_datasheet_says() -> None:
    """Flat 10 kOhm on 10 kOhm at 3.3 V: half of it. E24 nearest to the geometric mean of ends."""
    plain = SensorParams(hysteresis=0, creep=(0, 0))
    config = AntennaConfig(antenna=AntennaSpec(sensor=plain), largest_flex=math.pi)
    result = sensor_of(config)[0]
    first, last = result.curve[0], result.curve[-1]
    assert (first.flex_deg, last.flex_deg) == pytest.approx((0.0, 180.0))
    assert (first.resistance_ohm, last.resistance_ohm) == pytest.approx((10e3, 22e3))
    assert first.voltage_v == pytest.approx(1.65)
    assert result.counts_span == first.counts - last.counts > 0
    assert result.polarity == -1
    assert not result.clipped
    assert result.loop_width_share == pytest.approx(0.0, abs=0.01)
    assert result.creep_counts == 0
    assert result.noise_sd_counts == pytest.approx(2.5, rel=0.1)
    assert result.best_divider_ohm == pytest.approx(math.sqrt(10e3 * 22e3), rel=0.1)
    table = next(t for t in tables(run(config).result()) if "Sensor" in t.title)
    assert table.columns == ["R [kOhm]", "V", "counts"]
    assert table.rows[0][0] == "0 deg"
    assert table.rows[0][1][:2] == ["10.00", "1.650"]


def test_a_bend_that_creeps_and_a_wide_loop_are_told() -> None:
    """As declared: a loop of a tenth of the flex, over readings that are nearly straight in it.

    By hand: of 90 deg a tenth creeps, from 3.3 V / 2.54 to 3.3 V / 2.6, 37 counts.
    """
    params = SensorParams(hysteresis=0.1, creep=(0, 0))
    result, _ = sensor_of(AntennaConfig(antenna=AntennaSpec(sensor=params)))
    assert result.loop_width_share == pytest.approx(0.1, rel=0.2)
    creeping = SensorParams(hysteresis=0, creep=(0.05, 0.05))
    result, _ = sensor_of(AntennaConfig(antenna=AntennaSpec(sensor=creeping)))
    assert result.creep_counts == pytest.approx(37, rel=0.1)


def test_without_memory_the_chain_is_the_static_curve() -> None:
    params = SensorParams(hysteresis=0, creep=(0, 0))
    flex = np.random.default_rng(0).uniform(-2, 2, (50, 3, 2))
    chain = sensor.SensorChain(params, (3, 2), 0.01)
    for row in flex:
        assert (chain.step(row) == sensor.counts(params, row)).all()


def test_the_loop_is_as_wide_as_declared() -> None:
    params = SensorParams(hysteresis=0.1, creep=(0, 0))
    chain = sensor.SensorChain(params, (), 0.01)
    up = np.linspace(0, math.pi / 2, 1001)
    there = np.array([float(chain.with_memory(x)) for x in up])
    back = np.array([float(chain.with_memory(x)) for x in up[::-1]])[::-1]
    assert back[500] - there[500] == pytest.approx(0.1 * math.pi / 2, rel=1e-6)
    assert (back >= there - 1e-12).all()


def test_hysteresis_does_not_depend_on_pace() -> None:
    params = SensorParams(creep=(0, 0))
    ends = []
    for count in (11, 1001):
        chain = sensor.SensorChain(params, (), 0.01)
        path = np.concatenate([np.linspace(0, 1, count), np.linspace(1, 0.3, count)])
        ends.append([float(chain.with_memory(x)) for x in path][-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)


def test_a_held_bend_creeps_by_the_declared_share() -> None:
    params = SensorParams(hysteresis=0, creep=(0.03, 0.02), creep_time=(0.3, 10.0))
    chain = sensor.SensorChain(params, (), 0.01)
    felt = np.array([float(chain.with_memory(np.array(1.0))) for _ in range(10_000)])
    assert felt[0] == pytest.approx(0.95, abs=2e-3)
    assert felt[30] == pytest.approx(0.95 + 0.03 * (1 - math.exp(-1)), abs=2e-3)
    assert felt[-1] == pytest.approx(1.0, abs=1e-4)


def test_a_row_that_forgets_starts_anew_and_leaves_the_others_alone() -> None:
    params = SensorParams()
    chain, fresh = (sensor.SensorChain(params, (2, 2), 0.01) for _ in range(2))
    for _ in range(100):
        chain.step(np.full((2, 2), 1.5))
    chain.reset(0)
    straight, expected = chain.step(np.zeros((2, 2))), fresh.step(np.zeros((2, 2)))
    assert (straight[0] == expected[0]).all()
    assert (straight[1] < expected[1]).all()


def test_averaging_leaves_the_common_noise() -> None:
    rng = np.random.default_rng(0)
    params = SensorParams(outlier_share=0)
    assert sensor.reading_noise(params, rng, (200_000,)).std() == pytest.approx(2.5, rel=0.01)
    single = SensorParams(oversampling=1, common_noise_counts=0, outlier_share=0.01)
    noise = sensor.reading_noise(single, rng, (200_000,))
    assert noise.std() == pytest.approx(math.sqrt(64 + 0.01 * 1600), rel=0.01)


def test_the_best_divider_is_near_the_geometric_mean() -> None:
    """Closed form: sqrt(R_straight R_bent) spreads the voltage farthest."""
    candidates = np.geomspace(1e3, 1e5, 401)
    best, spread = sensor.best_divider(SensorParams(), math.pi, candidates)
    assert best == pytest.approx(math.sqrt(10e3 * 22e3), rel=0.1)  # whole counts: flat top
    assert spread.max() == spread[np.argmin(abs(candidates - best))]


def test_creep_beyond_all_measure_is_refused() -> None:
    with pytest.raises(ValueError, match="creep must be"):
        SensorParams(creep=(0.6, 0.5))
