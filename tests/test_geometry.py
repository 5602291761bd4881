"""`antennate geometry` and `gait --optimise`: engine against model, symmetries, bad input."""

import json
import math

import numpy as np
import pytest

from antennate.cli import main
from antennate.experiments.gait.optimise import optimise
from antennate.experiments.gait.physics import rolling_speed
from antennate.experiments.geometry import experiment
from antennate.experiments.geometry.figure import leads
from antennate.experiments.geometry.physics import (
    LARGEST_OFFSET,
    LEAST_AMPLITUDE,
    GeometryConfig,
    random_waves,
    walk,
)
from antennate.experiments.geometry.torus import Torus
from antennate.mechanics.twist import Wave
from antennate.params.gaits import GAITS, GaitParams
from antennate.robots.mechanics import cycles, peaks, wave_of
from antennate.robots.spec import RobotSpec

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
    assert (result["torus"], result["turns"]) == (None, None)
    assert "law_deg" not in result["leads"][0]
    assert result["agreement"]["speed_rmse_m_s"]["value"] < 0.03
    assert {"gait", "gait at 1.15 f"} == {row["name"] for row in result["named"]}


def test_a_row_keeps_what_was_planned():
    few = {"gaits": 3, "wave_numbers": (1.0,), "leads": 5, "front_waves": 1, "repeats": 1}
    config = GeometryConfig(cycles=2, settling_cycles=0, turns=0, **few)
    row = experiment.plan(config).rows[0]
    walked = walk(config, row)
    assert (walked.lead_rad, walked.model_speed_m_s) == (row.lead_rad, row.model_speed_m_s)
    assert math.isfinite(walked.speed_m_s)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["geometry", "--gait.amplitude", "0.6"], "gait.amplitude: expected at most 0.5087 rad"),
        (["gait", "--optimise", "speed", "--gait.amplitude", "0.6"], "the limit of the yaw joints"),
        (["gait", "--optimise", "fast"], "speed"),
        (["geometry", "--robot.links", "1"], "links: expected a number of at least 2, found 1"),
        (["geometry", "--largest-amplitude", "0.55"], "expected at most 0.5087 rad"),
    ],
)
def test_bad_input_is_one_line(words, text, capsys):
    assert main(words) == 2
    err = capsys.readouterr().err
    assert text in err
    assert err.count("\n") == 1


def test_gaits_by_name_stay_within_the_joints():
    limit = RobotSpec().yaw_limit
    for name in ("serpenoid", "swift", "thrifty"):
        assert GaitParams.model_validate(GAITS[name]).amplitude <= limit


@pytest.mark.parametrize("numbers", [(1.0,), (1.0, 1.5)])
def test_each_name_in_the_legend_of_the_leads_has_something_drawn(numbers):
    lead = {"law_deg": 80.0, "model_deg": 82.0, "engine_deg": 85.0}
    drawn = leads([{"wave_number": number, **lead} for number in numbers])
    (panel,) = drawn.axes
    assert [text.get_text() for text in panel.get_legend().get_texts()] == [
        "law of stiff servos",
        "model",
        "engine",
    ]
    for line in panel.lines:
        is_line = len(numbers) > 1 and line.get_linestyle() not in ("None", "")
        assert is_line or line.get_marker() not in ("", "None", None), line.get_label()
