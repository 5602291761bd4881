"""`antennate geometry` and `gait --optimise`: engine against model, symmetries, bad input."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from antennate.cli import main
from antennate.params.gaits import GAITS, GaitParams
from antennate.robots.mechanics import cycles, peaks, wave_of
from antennate.robots.spec import RobotSpec
from antennate_lab.gait.optimise import optimise
from antennate_lab.gait.physics import rolling_speed
from antennate_lab.geometry import experiment
from antennate_lab.geometry.figure import leads
from antennate_lab.geometry.physics import (
    LARGEST_OFFSET,
    LEAST_AMPLITUDE,
    GeometryConfig,
    random_waves,
    walk,
)
from antennate_lab.geometry.result import BestLead, Walked
from antennate_lab.geometry.torus import Torus
from geometric_locomotion.twist import Wave

LEADS = (-0.2, -0.1, 0.0, 0.1, 0.2, 0.3)
TINY = [
    *("--gaits", "4", "--wave-numbers", "1", "--leads", "5", "--front-waves", "1"),
    *("--turns", "2", "--cells", "8", "--repeats", "2", "--cycles", "2", "--settling-cycles", "1"),
]


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp("geometry") / "run"
    assert main(["geometry", *TINY, "--workers", "1", "--out", str(out)]) == 0
    names = {path.stem for path in (out / "figures").iterdir()}
    assert names == {"agreement", "leads", "front", "torus", "twists", "swimmer"}
    return json.loads((out / "result.json").read_text())


@pytest.mark.slow
def test_the_engine_agrees_with_the_model(result):
    """Speeds within the aim, twists of the map within 0.02 m/s and 0.3 1/m."""
    entry = result["agreement"]
    assert entry["speed_rmse_m_s"]["value"] < experiment.SPEED_RMSE
    assert entry["rival_speed_m_s"] == pytest.approx(rolling_speed(GaitParams(), RobotSpec()))
    assert result["turns"]["speed_rmse_m_s"] < 0.02
    assert result["turns"]["curvature_rmse_per_m"] < 0.3
    (lead,) = result["leads"]
    assert abs(lead["model_less_engine_deg"]) < experiment.LEAD_DEG


@pytest.mark.slow
def test_named_gaits_are_faster(result):
    rows = {row["name"]: row for row in result["named"]}
    assert rows["swift"]["speed_m_s"] > experiment.FASTER * rows["gait"]["speed_m_s"]
    assert rows["thrifty"]["speed_m_s"] > 1.05 * rows["gait"]["speed_m_s"]
    assert {"serpenoid", "b11bl0"}.isdisjoint(rows)


def test_random_gaits_are_uniform_and_those_of_their_seed():
    config = GeometryConfig(gaits=4000)
    waves = np.array(random_waves(config))
    np.testing.assert_array_equal(waves, random_waves(config))
    low = np.array([LEAST_AMPLITUDE, 0.5, 0.0, -LARGEST_OFFSET])
    high = np.array([RobotSpec().yaw_limit, 1.5, 2 * math.pi, LARGEST_OFFSET])
    assert (waves.min(1) >= low).all()
    assert (waves.max(1) <= high).all()
    np.testing.assert_allclose(waves.mean(1), (low + high) / 2, atol=0.12)


@pytest.mark.slow
def test_curvature_of_the_torus_is_what_the_lead_gains():
    """Stokes' theorem: loops of whole cycles, walked as paths, against the curvature inside."""
    robot, wave = RobotSpec(), Wave(0.2, 1.0, 0.0, 0.0)
    motion = Torus.of(robot, wave, 24)
    whole = cycles(robot, GaitParams(), Wave(0.2, 1.0, motion.phase, 0.0), stiff=True).step
    np.testing.assert_allclose(motion.steps, whole, rtol=0.05)
    gain = (np.roll(whole, -1) - np.roll(whole, 1)) / (math.pi / 6)
    assert np.corrcoef(motion.gains, gain)[0, 1] > 0.97
    assert abs(motion.curvature.mean()) < 1e-9  # the torus is closed


def test_peaks_are_those_of_a_parabola():
    at = np.linspace(-1.0, 1.0, 9)
    place, height = peaks(np.stack([at, at]), np.stack([3 - (at - 0.3) ** 2, 1 - (at + 2) ** 2]))
    np.testing.assert_allclose(place, [0.3, -1.0], atol=1e-9)
    np.testing.assert_allclose(height, [3.0, 0.0], atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("goal", ["speed", "cost"])
def test_an_optimum_is_better_than_what_was_given(goal):
    robot, gait = RobotSpec(), GaitParams()
    best = optimise(robot, gait, goal)
    assert best.amplitude <= robot.yaw_limit
    before, after = (cycles(robot, gait, wave_of(g), phases=24) for g in (gait, best))
    assert after.step[0] >= before.step[0]
    if goal == "speed":
        assert after.step[0] > 1.15 * before.step[0]
    else:
        assert after.cost[0] < before.cost[0]


@pytest.mark.slow
def test_lifting_legs_have_no_map():
    config = GeometryConfig(
        robot=RobotSpec.named("hexapod"),
        gait=GaitParams.named("b11bl0"),
        gaits=3,
        wave_numbers=(1.0,),
        leads=5,
        front_waves=1,
        cycles=2,
    )
    outcome = experiment.run(config)
    result = outcome.result()
    assert (result.torus, result.turns, result.leads[0].law_deg) == (None, None, None)
    assert result.agreement.speed_rmse_m_s.value < 0.03
    assert {"gait", "gait at 1.15 f"} == {gait.name for gait in result.named}


def walked(part, trial, speed, cost, name="", lead=0.0):
    return Walked(
        part=part,
        trial=trial,
        name=name,
        amplitude_rad=0.3,
        wave_number=1.0,
        lead_rad=lead,
        offset_rad=0.0,
        frequency_hz=0.5,
        speed_m_s=speed,
        model_speed_m_s=speed + 0.01,
        yaw_deg_per_cycle=10.0 * trial,
        model_yaw_deg_per_cycle=10.0 * trial + 2.0,
        cost_of_transport=cost,
        model_cost=0.1 * trial,
        model_torque_n_m=0.2,
    )


def test_rows_become_the_result_that_the_tables_show():
    """Speeds are drawn: the model is 0.01 m/s too fast, and the best lead is 0.1 rad."""
    config = GeometryConfig(wave_numbers=(1.0,), body_length=0.8, gait=GaitParams(frequency=0.5))
    speeds = (0.18, 0.19, 0.20, 0.21, 0.22)
    rows = [
        *(walked("random", i, 0.1 * i, None if i == 2 else 0.5 - 0.1 * i) for i in range(3)),
        *(walked("lead", i, 0.2 - (x - 0.1) ** 2, 0.4, lead=x) for i, x in enumerate(LEADS)),
        *(walked("front", 2, speed, cost) for speed, cost in ((0.3, 0.39), (0.4, 0.41))),
        *(walked("named", i, speed, 0.4, "gait") for i, speed in enumerate(speeds)),
        *(walked("named", 5 + i, 0.25, 0.3, "swift") for i in range(5)),
        *(walked("named", 10 + i, 0.5, 0.3, "gait at 1.15 f") for i in range(5)),
    ]
    result = experiment.summarise(config, rows, None)
    found = result.agreement
    assert (found.speed_rmse_m_s.value, found.yaw_rmse_deg.value) == pytest.approx((0.01, 2.0))
    assert found.rival_less_model_m_s.value == pytest.approx(
        math.sqrt(np.mean([(s - math.pi * 0.033) ** 2 for s in (0.0, 0.1, 0.2)])) - 0.01
    )
    assert found.cost_rank_r.value == pytest.approx(0.5)  # ranks 0, 1, 2 against 1, 0, 2
    (lead,) = result.leads
    assert lead.engine_deg == pytest.approx(math.degrees(0.1))
    assert lead.model_less_engine_deg == pytest.approx(0.0)
    assert lead.law_less_engine_deg == pytest.approx(lead.law_deg - lead.engine_deg - 360.0)
    gait = result.named[0]
    assert (gait.speed_m_s, gait.body_lengths_per_cycle, gait.trial) == pytest.approx((0.2, 0.5, 2))
    # Student's t, 4 degrees of freedom: 2.776 x 0.01581 / sqrt(5)
    assert gait.speed_m_s_95 == pytest.approx((0.2 - 0.01963, 0.2 + 0.01963), abs=1e-5)
    best = result.fastest_at_no_more_cost
    assert (best.gait, best.speed_over_default) == (result.front[0], pytest.approx(1.5))
    assert (result.torus, result.turns) == (None, None)
    _, _, gaits = experiment.tables(result)
    assert gaits.columns == ["gait", "swift", "gait at 1.15 f", "of the front"]
    cells = dict(gaits.rows)
    assert cells["speed [m/s]"] == ["0.200", "0.250", "0.500", "0.300"]
    assert cells["  95 % [m/s]"][::3] == ["0.180 to 0.220", "-"]
    assert cells["body lengths a cycle"] == ["0.50", "0.62", "1.25", "0.75"]


@pytest.mark.ci
def test_a_row_keeps_what_was_planned():
    few = {"gaits": 3, "wave_numbers": (1.0,), "leads": 5, "front_waves": 1, "repeats": 1}
    config = GeometryConfig(cycles=2, settling_cycles=0, turns=0, **few)
    row = experiment.plan(config).rows[0]
    walked = walk(config, row)
    assert (walked.lead_rad, walked.model_speed_m_s) == (row.lead_rad, row.model_speed_m_s)
    assert math.isfinite(walked.speed_m_s)


def test_gaits_by_name_stay_within_the_joints():
    limit = RobotSpec().yaw_limit
    for name in ("serpenoid", "swift", "thrifty"):
        assert GaitParams.model_validate(GAITS[name]).amplitude <= limit


@pytest.mark.parametrize("numbers", [(1.0,), (1.0, 1.5)])
def test_each_name_in_the_legend_of_the_leads_has_something_drawn(numbers):
    angles = {"law_deg": 80.0, "model_deg": 82.0, "engine_deg": 85.0, "model_less_engine_deg": -3.0}
    lead = BestLead(**angles, wave_number=1.0, engine_speed_m_s=0.2, reached=True)
    drawn = leads([replace(lead, wave_number=number) for number in numbers])
    (panel,) = drawn.axes
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [
        "law of stiff servos",
        "model",
        "engine",
    ]
    for line in panel.lines:
        is_line = len(numbers) > 1 and line.get_linestyle() not in ("None", "")
        assert is_line or line.get_marker() not in ("", "None", None), line.get_label()
