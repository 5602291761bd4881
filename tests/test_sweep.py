"""Sweeps: shapes, geometry, and estimates of known truth."""

import csv
import dataclasses
import json
import math

import numpy as np
import pytest

from antennate.cli import main
from antennate.errors import SimulationError
from antennate.experiments.sweep import estimates
from antennate.experiments.sweep import estimates as reach
from antennate.experiments.sweep import experiment as sweep
from antennate.experiments.sweep import physics as sweeping
from antennate.experiments.sweep.physics import SweepConfig
from antennate.params.bench import EstimateParams, ShapeParams, SweepParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim.bench import Bench
from antennate.studies.columns import content
from antennate.studies.formats import to_csv, to_json, to_toml

ANTENNA, SENSOR, SHAPE = AntennaSpec(), SensorParams(), ShapeParams()
SWEEP = SweepParams()
SMALL = SweepConfig(
    profiles=("descending",),
    distances=(0.6,),
    centres=(math.radians(47),),
    amplitudes=(math.radians(30),),
    sweeps=1,
    estimate=EstimateParams(trials=6),
    sweep=SweepParams(frequency=2.0),
    physics=BenchPhysicsParams(timestep=0.001, contact_time=0.002),
)


def record(wall, params=SWEEP, antenna=ANTENNA, sweeps=1.0):
    return sweeping.record(BenchPhysicsParams(), antenna, params, wall, sweeps)


def test_shapes_by_flex_and_place_of_the_tip():
    deg = math.radians
    cases = [
        ((0, 0), "STRAIGHT"),
        ((4.9, -2.4), "STRAIGHT"),
        ((-20, -10), "FORWARD"),
        ((20, 10), "BACKWARD"),
        ((-20, 1), "TRANSITION"),
        ((20, -10), "TRANSITION"),
        ((1, 6), "TRANSITION"),
        ((-1, -6), "TRANSITION"),
    ]
    flex, offset = (np.array([deg(case[0][i]) for case in cases]) for i in (0, 1))
    found = sweeping.classify(SHAPE, flex, offset)
    assert [sweeping.Shape(k).name for k in found] == [name for _, name in cases]
    mirrored = sweeping.classify(SHAPE, -flex, -offset)
    swap = {0: 1, 1: 0, 2: 2, 3: 3}
    assert mirrored.tolist() == [swap[k] for k in found.tolist()]


def test_sweep_begins_at_its_near_end_and_swings_by_its_amplitude():
    params = SweepParams(centre=0.8, amplitude=0.5, frequency=0.5)
    t = np.linspace(0.5, 2.5, 401)
    angles = np.array([sweeping.commanded(params, float(time)) for time in t])
    assert (angles.min(), angles.max()) == pytest.approx((0.3, 1.3))
    assert sweeping.commanded(params, 0.0) == 0.0
    assert sweeping.commanded(params, 0.4999999) == pytest.approx(angles[0], abs=1e-6)
    assert angles[-1] == pytest.approx(angles[0])
    assert angles.mean() == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize("tilt", [0.0, 0.3, -0.3])
def test_the_wall_stands_at_its_distance(tilt):
    wall = sweeping.Wall(0.07, tilt)
    bar = wall.bar()
    along = np.array([bar.x1 - bar.x0, bar.y1 - bar.y0])
    along /= np.linalg.norm(along)
    off = abs(along[0] * bar.y0 - along[1] * bar.x0)
    assert off - bar.radius == pytest.approx(0.07)
    assert math.atan2(along[1], along[0]) == pytest.approx(tilt)


def test_out_of_reach_nothing_touches_and_the_base_swings_as_told():
    trace = record(sweeping.Wall(0.2))
    swing = trace.t > 0
    assert not trace.touching.any()
    assert abs(trace.flex[swing]).max() < SHAPE.flex
    assert math.degrees(trace.base[swing].max()) == pytest.approx(77, abs=1.0)
    assert abs(trace.reach / ANTENNA.length - 1).max() < 0.01
    assert sweeping.shares(SHAPE, trace, 0.0)["free"] == 1.0


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_the_first_touch_is_where_the_straight_tip_meets_the_wall(tilt):
    """L sin(psi - tilt) + radius = distance for a wall that leans away by tilt."""
    wall = sweeping.Wall(0.09, tilt)
    trace = record(wall, SweepParams(frequency=0.1), sweeps=0.5)
    first = int(np.flatnonzero(trace.touching)[0])
    met = ANTENNA.length * math.sin(trace.base[first] - tilt) + ANTENNA.radius
    assert met == pytest.approx(0.09, abs=0.001)
    bent = abs(trace.flex) > SHAPE.flex
    assert trace.touching[bent].all()
    assert (trace.flex[bent] < 0).all()  # on the way out the wall bends it towards the heading


def test_shares_of_time_add_up_and_shapes_point_ahead_near_a_wall():
    trace = record(sweeping.Wall(0.06), sweeps=2.0)
    found = sweeping.shares(SHAPE, trace, 2.0)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["forward"] > 0.5
    assert found["backward"] == 0.0


def test_statics_of_no_flex_are_those_of_a_straight_rod():
    base = np.radians([20.0, 47.0, 80.0])
    found = reach.wall_distance(ANTENNA, base, np.zeros(3))
    wanted = ANTENNA.length * np.sin(base) + ANTENNA.radius
    np.testing.assert_allclose(found, wanted, rtol=1e-3)  # base angles come in steps of 2.5 deg
    assert np.isnan(reach.wall_distance(ANTENNA, base, np.full(3, 9.0))).all()


@pytest.mark.parametrize("share", [0.5, 0.7, 0.85])
def test_statics_find_the_wall_that_a_slow_smooth_sweep_touches(share):
    smooth = ANTENNA.model_copy(update={"friction": 0.0})
    wall = sweeping.Wall(share * ANTENNA.length)
    trace = record(wall, SweepParams(frequency=0.1), smooth, 0.5)
    told = reach.wall_distance(smooth, trace.base, -trace.flex)
    bent = (-trace.flex > SHAPE.flex) & np.isfinite(told)
    assert bent.sum() > 50
    np.testing.assert_allclose(told[bent], wall.distance, rtol=0.015)


def felt(first, peak, base):
    return reach.Felt(first, peak, base, peak / 3.0, 0.05, 0.1)


def test_a_cue_recovers_a_law_of_second_degree_exactly():
    rng = np.random.default_rng(0)
    seen = [felt(*row) for row in rng.uniform(0.2, 1.0, (40, 3))]
    truth = np.array([0.1 + 0.3 * f.first - f.peak * f.peak_base + f.first**2 for f in seen])
    guess = reach.calibrate_and_guess("flex_and_base", seen[:20], truth[:20], seen[20:])
    np.testing.assert_allclose(guess, truth[20:], rtol=1e-8)
    alone = reach.calibrate_and_guess("first_contact", seen[:20], truth[:20], seen[20:])
    assert abs(alone / truth[20:] - 1).max() > 0.1  # the rest of the law is hidden from it
    blind = reach.calibrate_and_guess("blind", seen[:20], truth[:20], seen[20:])
    np.testing.assert_allclose(blind, truth[:20].mean())
    assert reach.coefficients("flex_and_base") == 10


def test_errors_are_in_percent_and_count_what_cannot_be_told():
    found = estimates.errors(np.array([1.1, 1.8, np.nan]), np.array([1.0, 2.0, 3.0]))
    assert (found.n, found.untold) == (2, 1)
    assert found.mape_percent == pytest.approx(10.0)
    assert found.rmse_percent == pytest.approx(10.0)
    assert found.bias_percent == pytest.approx(0.0, abs=1e-9)
    none = estimates.errors(np.array([np.nan]), np.array([1.0]))
    assert (none.n, none.untold, none.mape_percent, none.bias_percent) == (0, 1, None, None)


def test_a_gap_is_both_distances_and_the_space_between_the_bases():
    def trial(number, side, distance):
        sweep_params = SweepParams()
        return estimates.Trial("same", "test", number, side, distance, sweep_params, None, None)

    test = [trial(0, "l", 0.05), trial(0, "r", 0.07), trial(1, "l", 0.06), trial(2, "r", 0.06)]
    guess, truth = estimates.gaps(test, np.array([0.06, 0.07, 0.0, 0.0]), 0.04)
    np.testing.assert_allclose(truth, [0.16])  # of the others one antenna felt nothing
    np.testing.assert_allclose(guess, [0.17])


FORGETFUL = SENSOR.model_copy(update={"hysteresis": 0.0, "creep": (0.0, 0.0)})
"""The closed form knows no memory of the film."""


def setting(frequency=2.0, sensor=SENSOR):
    antenna = ANTENNA.model_copy(update={"sensor": sensor})
    return SweepConfig(sweep=SweepParams(frequency=frequency), shape=SHAPE, antenna=antenna)


@pytest.mark.slow
def test_flex_and_base_angle_tell_a_distance_and_flex_alone_needs_a_known_sweep():
    trials = [
        estimates.run_trial(setting(0.5, FORGETFUL), condition, split, number, side)
        for condition in ("same", "varied")
        for split in estimates.SPLITS
        for number in range(10)
        for side in estimates.SIDES
    ]
    summary = estimates.errors_by_condition(trials, 0.04)
    found = {name: summary[name].noisy.distance for name in ("same", "varied")}
    blind = found["same"]["blind"].mape_percent
    for cues in found.values():
        assert cues["flex_and_base"].mape_percent < 0.3 * blind
        assert cues["first_contact"].mape_percent < 0.3 * blind
        assert cues["closed_form"].mape_percent < 0.3 * blind
    alone = {name: cues["flex"].mape_percent for name, cues in found.items()}
    assert alone["same"] < 0.3 * alone["varied"]


def test_conditions_share_their_chance_and_splits_do_not():
    one, two = (estimates.run_trial(setting(), c, "test", 3, "l") for c in ("same", "varied"))
    other = estimates.run_trial(setting(), "same", "calibration", 3, "l")
    right = estimates.run_trial(setting(), "varied", "test", 3, "r")
    assert one.distance == two.distance
    assert one.distance not in (other.distance, right.distance)
    assert one.sweep == SweepParams(frequency=2.0) != two.sweep
    assert two.sweep == right.sweep
    assert one.exact != one.noisy


@pytest.fixture
def burst(monkeypatch):
    """Let every sweep end at once: what was drawn for it is known all the same."""

    def step(self, count=1, watch=None):
        raise SimulationError(7, "engine warning")

    monkeypatch.setattr(Bench, "step", step)


@pytest.mark.parametrize("seed", [0, pytest.param(7, marks=pytest.mark.slow)])
@pytest.mark.parametrize("side", estimates.SIDES)
def test_the_sweep_and_the_distance_of_a_wall_are_drawn_apart(burst, seed, side):
    config = SMALL.model_copy(update={"seed": seed})
    trials = [estimates.run_trial(config, "varied", "test", n, side) for n in range(200)]
    drawn = [(t.distance, t.sweep.centre, t.sweep.amplitude) for t in trials]
    apart = np.corrcoef(np.array(drawn).T)
    assert abs(apart[np.triu_indices(3, 1)]).max() < 3 / math.sqrt(200)  # of chance, 99.7 %


def test_a_trial_that_blows_up_is_invalid_and_enters_no_estimate(burst):
    outcome = sweep.run(SMALL)
    assert {row.status for row in outcome.rows} == {"invalid"}
    result = outcome.result()
    cells = result.shapes["descending"]["fixed"]
    assert (cells.cells, cells.invalid, cells.map) == (1, 1, [])
    assert set(cells.share.values()) == {(None, None, None)}
    same = result.estimates["same"].noisy
    assert (same.sweeps, same.missed, same.invalid, same.distance) == (12, 0, 24, {})


def test_cells_of_the_map_become_shares_of_time_and_invalid_ones_none():
    cell = {"seed": 0, "kind": "map", "profile": "descending", "condition": "moving", "side": "l"}
    cell |= {"distance_m": 0.06, "centre_rad": 1.2, "amplitude_rad": 0.5, "status": "valid"}
    rest = {"backward": 0.0, "straight": 0.1, "transition": 0.0}
    rows = [
        sweep.SweepRow(trial=0, **cell, **rest, forward=0.2, free=0.7),
        sweep.SweepRow(trial=1, **cell, **rest, forward=0.4, free=0.5),
        sweep.SweepRow(trial=2, **{**cell, "status": "invalid"}),
    ]
    result = sweep.summarise(SMALL, rows, [])
    found = result.shapes["descending"]["moving"]
    assert (found.cells, found.invalid, len(found.map)) == (3, 1, 2)
    assert found.share["forward"] == (pytest.approx(0.3), None, None)  # too few for a spread
    first = found.map[0]
    assert (first.distance, first.centre_rad, first.free) == (0.5, 1.2, 0.7)  # of 0.12 m
    shapes, *_ = sweep.tables(result)
    assert dict(shapes.rows)["free"] == ["-", "0.60"]
    assert [name for name, _ in shapes.rows] == [shape.name.lower() for shape in sweeping.Shape] + [
        "free"
    ]


@pytest.mark.slow
def test_command_writes_its_run_and_the_same_on_two_workers(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(to_toml(SMALL))
    assert main(["bench", "sweep", "--config", "small.toml", "--workers", "2", "--out", "run"]) == 0
    out = capsys.readouterr().out
    assert "sweep varied, with sensor noise" in " ".join(out.split())  # a title may wrap
    assert "published for CITRAS: 7.75 % and 6.73 %" in out
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["schema"], result["command"], result["seed"]) == (1, "sweep", 0)
    alone = sweep.run(SMALL, workers=1)
    assert json.loads(to_json(content(alone.result()))) == result
    assert (tmp_path / "run" / "trials.csv").read_text() == to_csv(
        [dataclasses.asdict(row) for row in alone.rows]
    )
    with (tmp_path / "run" / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["kind"] for row in rows] == ["map"] * 2 + ["estimate"] * 96
    assert (tmp_path / "run" / "figures" / "sweep.png").stat().st_size > 10_000
    assert main(["bench", "sweep", "--distances", "0.01", "--out", "bad"]) == 2
    assert "distances must exceed" in capsys.readouterr().err
    assert not (tmp_path / "bad").exists()
