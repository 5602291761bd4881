"""Force and flex: closed forms, invariants, and the bench against the statics."""

import csv
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from beams import uniform_beam

from antennate.antenna import sensor
from antennate.antenna.statics import Chain, equilibrium, largest_force, shape, with_profile
from antennate.cli import main
from antennate.errors import SimulationError
from antennate.experiments import bench
from antennate.experiments.force import experiment as force
from antennate.experiments.force import physics as loads
from antennate.experiments.force import physics as post_traverse
from antennate.experiments.force.result import ForceResult
from antennate.params.control import ConditioningParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim.bench import Bench
from antennate.studies.columns import content, typed
from antennate.studies.formats import to_csv, to_json, to_toml

BARE = AntennaSpec(sensor_stiffness_n_mm_per_deg=0.0)
SENSOR = SensorParams()
SMALL = loads.ForceConfig(
    profiles=("stiff", "compliant"), loads=12, place_step=0.25, traverses=4, speeds=(0.15,)
)


DATA = Path(__file__).parents[2] / "shared" / "data" / "whisker_force_location_rod" / "derived"


def _loads(config: loads.ForceConfig, profile: str, friction: float) -> tuple[loads.Points, int]:
    """Static loads up to the largest force of a profile."""
    chain = Chain.of(with_profile(config.antenna, profile))
    largest = largest_force(chain, math.radians(config.hinge_limit_deg))
    return loads.static_loads(config, profile, friction, largest)


def test_largest_force_of_a_small_limit_is_that_of_the_base_hinge():
    """The tip load bends the base hinge most: k q = F L while angles are small."""
    chain = Chain.of(with_profile(BARE, "stiff"))
    wanted = chain.stiffness[0] * 1e-3 / chain.length
    assert largest_force(chain, 1e-3) == pytest.approx(wanted, rel=1e-3)


def test_largest_force_turns_the_most_bent_hinge_by_the_limit():
    chain, limit = Chain.of(AntennaSpec()), math.radians(30)
    largest = largest_force(chain, limit)
    rest = equilibrium(chain, np.array([chain.length]), np.array([[0.0, largest]]), follower=True)
    assert abs(rest.angles).max() == pytest.approx(limit, rel=1e-6)


def test_small_loads_bend_the_film_by_the_linear_sum():
    """Flex of a small load is F times the sum over covered hinges of (s - s_i) / k_i."""
    config = loads.ForceConfig(hinge_limit_deg=0.01, loads=3)
    points, left_out = _loads(config, "descending", 0.0)
    chain = Chain.of(with_profile(config.antenna, "descending"))
    arms = np.maximum(points.place[:, None] * chain.length - chain.starts, 0.0)
    covered = config.antenna.sensed_hinges
    wanted = points.force * (arms / chain.stiffness)[:, :covered].sum(axis=1)
    np.testing.assert_allclose(points.scalars["flex"], wanted, rtol=1e-5)
    assert left_out == 0


def test_uniform_chains_without_film_differ_by_the_scale_of_force_alone():
    config = loads.ForceConfig(antenna=BARE, loads=10)
    found = []
    for profile in ("stiff", "compliant"):
        points, _ = _loads(config, profile, 0.3)
        chain = Chain.of(with_profile(BARE, profile))
        largest = largest_force(chain, math.radians(30))
        found.append(force.score(points, "flex", 0.5, None, largest))
    assert found[0].r2 == pytest.approx(found[1].r2, abs=1e-6)
    assert found[0].rmse_percent == pytest.approx(found[1].rmse_percent, rel=1e-5)
    assert 0.3 < found[0].r2 < 0.95


def test_a_known_place_tells_the_force_and_friction_blurs_it():
    config = loads.ForceConfig(loads=60)
    plain, rubbed = (_loads(config, "descending", mu)[0] for mu in (0.0, 1.0))
    sure = force.score(plain, "flex", 0.5, config.place_step, 1.0).r2
    blurred = force.score(rubbed, "flex", 0.5, config.place_step, 1.0).r2
    blind = force.score(plain, "flex", 0.5, None, 1.0).r2
    assert sure > 0.999
    assert sure > blurred > blind


def test_a_profile_comes_to_what_its_loads_and_traverses_tell():
    """Flex tells most where the place is known and nothing rubs; the closed form, fitted to
    nothing, tells more of what has settled."""
    config = SMALL.model_copy(update={"profiles": ("descending",), "loads": 60})
    found = force.run(config).result().profiles["descending"]
    plain, rubbed = found.statics.frictionless, found.statics.friction
    assert plain.known.flex.r2 > 0.95
    assert plain.known.flex.r2 > rubbed.known.flex.r2 > rubbed.unknown.flex.r2
    assert plain.known.flex.r2 > plain.known.reading.r2
    assert (plain.loads + plain.left_out, found.traverses.trials) == (4 * 2 * 60, 4)
    assert [each.from_place for each in found.by_range] == [0.25, 0.5, 0.75, 1.0]
    assert found.by_range[1].r2 == plain.unknown.flex.r2
    assert found.by_range[3].r2 > 0.95  # one place alone is a place that is known
    whole, settled = found.traverses.closed_form.all, found.traverses.closed_form.settled
    assert whole.n > settled.n > 0
    assert settled.r2 > whole.r2
    assert plain.known.flex.rmse_percent == 100 * plain.known.flex.rmse / found.force_max_n


def test_the_reading_falls_and_b_rises_with_the_force():
    points, _ = _loads(loads.ForceConfig(loads=20), "descending", 0.0)
    tip = points.place > 0.99
    order = np.argsort(points.force[tip])
    assert np.corrcoef(points.scalars["reading"][tip][order], np.arange(tip.sum()))[0, 1] < -0.9
    assert np.corrcoef(points.scalars["level"][tip][order], np.arange(tip.sum()))[0, 1] > 0.5


def test_flex_comes_back_from_counts_within_their_resolution():
    flex = np.linspace(0.0, 2.0, 50)
    back = bench.flex_of(SENSOR, sensor.counts(SENSOR, flex))
    flattest = SENSOR.supply * SENSOR.bend_gain / (2 + 2 * SENSOR.bend_gain) ** 2
    half_a_count = 0.5 * 3.3 / 4096
    np.testing.assert_allclose(back, flex, atol=half_a_count / flattest)


def test_running_mean_of_a_record_is_over_the_last_readings():
    conditioning = ConditioningParams(averaging_time=0.03)
    found = bench.averaged(conditioning, np.array([1.0, 2.0, 3.0, 4.0, 9.0]), 100.0)
    np.testing.assert_allclose(found, [1.0, 1.5, 2.0, 3.0, 16 / 3])


def test_slow_smooth_traverse_is_the_statics():
    """Without friction and slowly, place and force give the flex by the closed form alone.

    The hinges relax in 40 ms, so flex lags: a hinge's torque is k (q + 0.04 s dq/dt).
    """
    antenna = AntennaSpec(friction=0.0)
    one = post_traverse.drag(
        BenchPhysicsParams(), antenna, 0.8, 0.05, 0.003, math.radians(30), 100.0
    )
    settled = (one.age > 0.3) & (one.place < 0.99)
    chain = Chain.of(antenna)
    load = np.stack([np.zeros_like(one.force), one.force], axis=1)
    rest = equilibrium(chain, one.place * chain.length, load, follower=True)
    flex = rest.angles[:, : antenna.sensed_hinges].sum(axis=1)
    assert settled.sum() > 50
    ahead = one.flex + antenna.damping_time * np.gradient(one.flex, one.age)
    error = (ahead - flex)[settled] / flex[settled]
    assert abs(np.median(error)) < 0.01
    assert abs(error).max() < 0.04
    assert (np.diff(one.place[settled]) > -1e-3).all()  # it slides towards the tip


def test_a_traverse_that_blows_up_is_invalid_and_enters_nothing(monkeypatch):
    def burst(self, count, watch=None):
        raise SimulationError(7, "engine warning")

    monkeypatch.setattr(Bench, "press", burst)
    outcome = force.run(SMALL.model_copy(update={"profiles": ("stiff",), "loads": 4}))
    assert [row.status for row in outcome.rows] == ["invalid"] * 4
    assert "step 7: engine warning" in outcome.rows[0].reason
    found = outcome.result().profiles["stiff"].traverses
    assert found.invalid == 4
    assert found.unknown.flex.n == 0
    read = typed(ForceResult, json.loads(to_json(content(outcome.result()))))
    assert math.isnan(read.profiles["stiff"].traverses.known.flex.r2)
    shown = dict(force.tables(read)[0].rows)
    assert shown["R2 (place unknown) dragged"] == shown["R2 (place known) dragged"] == ["-"]
    assert shown["R2 (place known) at rest"] != ["-"]


@pytest.mark.parametrize(
    "speeds",
    [
        (0.5,),
        *(
            pytest.param(s, marks=pytest.mark.slow)
            for s in ((0.4, 0.8), (0.3, 0.6, 0.9), (0.2, 0.4, 0.6, 0.8))
        ),
    ],
)
def test_traverses_that_fit_and_that_test_meet_every_speed_in_any_order(
    speeds: tuple[float, ...],
) -> None:
    small = {"profiles": ("descending",), "loads": 2, "place_step": 0.5, "traverses": 8}
    orders = (speeds, speeds[::-1])
    one, other = (force.run(loads.ForceConfig(speeds=s, **small)) for s in orders)
    assert to_json(content(one.result())) == to_json(content(other.result()))
    points, met = one.profiles[0].traverses, np.array([row.speed_m_s for row in one.rows])
    for half in (points.fit, ~points.fit):
        assert set(met[np.unique(points.trial[half])]) == set(speeds)


@pytest.mark.slow
def test_command_on_two_workers_writes_the_run_of_one(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = SMALL.model_copy(update={"loads": 4, "speeds": (0.5,)})
    Path("small.toml").write_text(to_toml(small))
    words = ["bench", "force", "--config", "small.toml"]
    assert main([*words, "--workers", "2", "--out", "run"]) == 0
    assert "Share of the force" in capsys.readouterr().out
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["schema"], result["command"], result["seed"]) == (1, "force", 0)
    alone = force.run(small, workers=1)
    assert result == json.loads(to_json(content(alone.result())))
    table = Path("run/trials.csv").read_text()
    assert table == to_csv([dataclasses.asdict(row) for row in alone.rows])
    assert [row.trial for row in alone.rows] == [0, 1, 2, 3] * 2
    overlaps = [row.overlap for row in alone.rows]
    assert overlaps[:4] == overlaps[4:]  # every profile meets the same posts
    assert min(overlaps) >= 0.5
    assert (tmp_path / "run" / "figures" / "force.png").stat().st_size > 10_000
    assert main([*words, "--nearest", "0.9", "--out", "bad"]) == 2
    assert "nearest must not exceed" in capsys.readouterr().err
    assert not (tmp_path / "bad").exists()


def test_moment_of_a_real_rod_is_that_of_a_load_normal_to_it():
    """Moments at the base of a tapered rod pressed by 0.1 to 0.25 N, up to 56 deg of tilt.

    The tilt follows from the two measured forces; so the ratio of moment to force times distance
    has no free number in the closed form but the taper, between none and one that ends at the load.
    Moments are rounded to 1 N·mm.
    """
    path = DATA / "full_validation.csv"
    if not path.exists():
        pytest.skip("the recording is not here")
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    load, place, axial, moment = np.array(
        [
            [float(row[key]) for key in ("F_applied_N", "s_applied_m", "Fx_exp_N", "MB_exp_Nm")]
            for row in rows
        ]
    ).T
    tilt, ratio, rounding = np.arcsin(-axial / load), moment / (load * place), 5e-4 / load / place
    high, high_by_arc = _moment_ratio(uniform_beam(1.0, 1.0, 50), tilt)
    low, low_by_arc = _moment_ratio(_tapered(50), tilt)
    assert len(rows) == 19
    assert (ratio > low - rounding - 0.02).all()
    assert (ratio < high + rounding + 0.02).all()
    bent = tilt > 0.6
    assert (ratio[bent] > np.maximum(high_by_arc, low_by_arc)[bent]).all()


def _tapered(count: int) -> Chain:
    """A rod whose radius falls to an eighth from its base to the load at its end."""
    piece = 1.0 / count
    radius = 1.0 - 0.875 * (np.arange(count) + 0.5) * piece
    lengths = np.full(count, piece)
    lengths[-1] = piece / 2
    return Chain(lengths, radius**4 / piece)


def _moment_ratio(chain: Chain, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Base moment over force times distance, along the base's axis and along the rod."""
    size = np.linspace(0.02, 3.0, 60) * np.mean(chain.stiffness) / len(chain.lengths)
    load = np.stack([np.zeros_like(size), size], axis=1)
    rest = equilibrium(chain, np.full(len(size), chain.length), load, follower=True)
    good = rest.solved
    turned = rest.angles[good].sum(axis=1)
    moment = chain.stiffness[0] * rest.angles[good, 0] / size[good]
    across = shape(chain, rest.angles[good])[:, -1, 0]
    assert turned[-1] > tilt.max()
    return np.interp(tilt, turned, moment / across), np.interp(tilt, turned, moment / chain.length)
