"""Touching walls: walls against geometry, presses against statics, the study whole."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import phone
import pytest

from antennate import figures as style
from antennate.antenna import statics as mechanics
from antennate.cli import main
from antennate.errors import SimulationError
from antennate.experiments import bench
from antennate.experiments.touch import experiment as touch
from antennate.experiments.touch import figure as figures
from antennate.experiments.touch import sensing
from antennate.experiments.touch.physics import TouchConfig, plan, site
from antennate.experiments.touch.result import TouchResult
from antennate.experiments.touch.sensing import runs
from antennate.params.bench import TouchWallsParams
from antennate.params.control import ConditioningParams, RuleParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim import touch_wall
from antennate.sim.bench import Ball, Bar, Bench, compile_bench
from antennate.studies.columns import content, typed
from antennate.studies.formats import to_csv, to_json, to_toml

SMALL = TouchConfig(
    trials=2,
    walls=("step",),
    speeds=(0.15, 0.3),
    profiles=("descending", "stiff"),
    averaging_times=(0.02, 0.3),
    wall_length=0.2,
    free_length=0.05,
)


@pytest.fixture(scope="module")
def outcome():
    return touch.run(SMALL)


def test_the_mind_answers_a_step_of_flex_when_the_mean_has_crossed():
    """Ten samples in the mean; b is one half at counts of 1543.3, between 1872 and 1399."""
    conditioning, sensor = ConditioningParams(), SensorParams(hysteresis=0.0, creep=(0.0, 0.0))
    flex = np.where(np.arange(100) >= 50, math.pi / 2, 0.0)[:, None]
    counts = bench.recorded(sensor, flex, np.zeros((100, 1)))
    _, alarm = sensing.sense(conditioning, RuleParams(), counts, 0.01)
    midpoint = 1399.0 + 0.305 * 473.0
    samples = math.ceil(10 * (1872.0 - midpoint) / (1872.0 - 1399.0))
    assert runs(alarm[:, 0]).tolist() == [[50 + samples - 1, 100]]


def test_truth_merges_short_gaps_of_strong_presses():
    config = TouchConfig(contact_force=0.1, merge_time=0.03)
    force = np.array([0.0, 0.2, 0.05, 0.1, 0.2, 0.0])
    np.testing.assert_array_equal(
        sensing.true_contact(config, force), [False, True, True, True, True, False]
    )


def sited(overlap=0.02, length=0.4):
    return site(AntennaSpec(), overlap, length, 0.25)


@pytest.mark.parametrize("kind", touch_wall.WALLS)
def test_walls_stand_where_they_should(kind):
    site, walls = sited(), TouchWallsParams()
    reach = 0.12 * math.sin(math.radians(47.0))
    assert site.near == pytest.approx(reach - 0.02)
    obstacles = touch_wall.build(walls, kind, site, x=1.0)
    lowest = min((o.y if isinstance(o, Ball) else min(o.y0, o.y1)) - o.radius for o in obstacles)
    nearer = {"sinusoidal": 0.005, "corner": 0.02}.get(kind, 0.0)
    assert lowest == pytest.approx(site.near - nearer, abs=2e-4)
    along = [o.x if isinstance(o, Ball) else o.x0 for o in obstacles]
    assert min(along) >= 1.0
    assert max(along) <= 1.4
    if kind == "boulders":
        assert {round(d, 9) for d in np.diff(along)} == {0.00635}
    if kind == "gap":
        free = [o for o in obstacles if isinstance(o, Bar) and 1.101 < (o.x0 + o.x1) / 2 < 1.299]
        assert free == []


def test_profiles_are_those_of_mechanics():
    everything = TouchConfig(profiles=tuple(mechanics.PROFILES))
    assert len(everything.profiles) == 5


def test_arms_meet_the_same_draws_and_springs_follow_them():
    config = TouchConfig()
    plans = [plan(config, "gap", s, p, 3) for s in (0.05, 0.15) for p in config.profiles]
    assert len({(p.site, p.wall_start) for p in plans}) == 1
    assert plan(config, "gap", 0.05, "stiff", 4).site != plans[0].site
    other = config.model_copy(update={"seed": 1})
    assert plan(other, "gap", 0.05, "stiff", 3).site != plans[0].site
    factors = plans[0].springs
    nominal = mechanics.with_profile(config.antenna, "descending")
    ratio = np.array(plans[1].antenna.spring_stiffness()) / nominal.spring_stiffness()
    np.testing.assert_allclose(ratio, factors)
    assert (abs(factors - 1) <= 0.1).all()
    overlaps = [plan(config, "gap", 0.05, "stiff", t).overlap for t in range(200)]
    assert 0.005 <= min(overlaps) < 0.007
    assert 0.033 < max(overlaps) <= 0.035


def test_a_steady_press_has_the_force_of_the_springs():
    """At rest against a smooth ball each spring's torque is the moment of the mean force."""
    antenna = AntennaSpec(friction=0.0)
    bench = Bench(compile_bench(BenchPhysicsParams(), antenna, [Ball(0.11, 0.02, 0.01)]), antenna)
    bench.place(0.0, 0.0, 0.0)
    for i in range(400):
        bench.command(0.0, 0.02 * min(1.0, i / 200), 0.0, 0.0, 0.0)
        bench.step(10)
    force = np.mean([bench.press(20) for _ in range(50)], axis=0)
    joints, angles = bench.joints(), bench.hinges().copy()
    k = antenna.hinge_stiffness()
    normal = force / np.linalg.norm(force)
    contact = np.array([0.11, 0.02]) + 0.01 * normal
    arm = contact - joints[:4]
    moment = arm[:, 0] * force[1] - arm[:, 1] * force[0]
    assert abs(angles[0]) > 0.02
    np.testing.assert_allclose(moment, np.array(k[:4]) * angles[:4], rtol=0.02, atol=2e-6)


def test_pressing_steps_like_stepping():
    antenna = AntennaSpec()
    model = compile_bench(BenchPhysicsParams(), antenna, [Ball(0.1, 0.01, 0.01)])
    one, two = Bench(model, antenna), Bench(model, antenna)
    for either in (one, two):
        either.place(0.0, 0.0, 0.0)
        either.command(0.0, 0.002, 0.0, 0.0, 0.0)
    one.step(60)
    two.press(60)
    np.testing.assert_array_equal(one.hinges(), two.hinges())
    two.command(math.nan, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(SimulationError, match="not finite"):
        two.press(1)


def test_free_before_and_after_and_pressed_between(outcome):
    for one in outcome.traverses:
        force, x = one.force, one.x
        assert one.reason == ""
        assert x[0] == pytest.approx(0.0, abs=1e-3)
        assert x[-1] >= SMALL.travel - 1e-3
        assert (np.diff(x) > 0).all()
        lead = 0.12 * math.cos(math.radians(47.0))
        pressed = x[force > SMALL.contact_force]
        # no press before the tip can be there, none after the wall has passed the longest arm
        start = min(line[:, 0].min() for line in one.plan.outline())
        assert start - lead - 0.01 < pressed.min()
        assert pressed.max() < start + SMALL.wall_length + 0.12 + 0.01
    assert [len(one.joints) > 0 for one in outcome.traverses] == [True, False] * 4


def test_the_study_counts_what_it_ran(outcome):
    result, rows = outcome.result(), outcome.rows
    assert json.loads(to_json(content(result)))["command"] == "touch"
    assert len(rows) == len(outcome.traverses) == 8
    for name, measured in result.profiles.items():
        mine = [row for row in rows if row.profile == name]
        assert measured.traverses == len(mine)
        for key in ("contacts", "missed", "alarms", "false"):
            assert getattr(measured, key) == sum(getattr(row, key) for row in mine)
        assert measured.f1_95 is None  # two trials decide nothing
        assert measured.onset.n + measured.carried + measured.missed == measured.contacts
    assert typed(TouchResult, json.loads(to_json(content(result)))).cells == result.cells
    table = dict(touch.tables(result)[0].rows)
    assert table["contacts"] == [str(each.contacts) for each in result.profiles.values()]
    assert len({*table} & {"F1", "median onset latency [ms]", "missed contacts per metre"}) == 3
    # a blunt wall bends the antenna far back: felt, and half an averaging time late at its end
    whole = result.profiles["descending"]
    assert whole.f1 > 2 * whole.contact_share / (1 + whole.contact_share)
    short, long = result.averaging
    added = long.release.median_ms - short.release.median_ms
    assert 0.0 < added < 1000 * (0.3 - 0.02)
    assert result.truths[0].f1 == pytest.approx(
        sum(2 * (v.truth & v.alarm).sum() for v in outcome.comparisons)
        / sum(v.truth.sum() + v.alarm.sum() for v in outcome.comparisons)
    )


def test_the_force_that_is_needed_bends_the_film_that_far(outcome):
    needed = outcome.result().needed
    # b is one half where the divider reads the midpoint: solve the divider for the flex
    volts = 0.142 + 0.8056e-3 * (1399.0 + 0.305 * 473.0)
    flex = ((3.3 * 1e4 / volts - 1e4) / 1e4 - 1.0) * math.pi / 1.2
    assert needed.flex_rad == pytest.approx(flex, abs=0.01)  # one count is 4 mrad
    antenna = mechanics.with_profile(AntennaSpec(), "stiff")
    chain = mechanics.Chain.of(antenna)
    load = np.array([[0.0, needed.tip_force_n["stiff"]]])
    bent = mechanics.equilibrium(chain, np.array([0.12]), load, follower=True).angles[0, :5]
    assert bent.sum() == pytest.approx(needed.flex_rad, rel=1e-3)


def test_a_traverse_that_breaks_is_a_row_with_its_reason(monkeypatch):
    def broken(self, count):
        raise SimulationError(7, "engine warning")

    monkeypatch.setattr(Bench, "press", broken)
    config = SMALL.model_copy(update={"trials": 1, "speeds": (0.3,)})
    found = touch.run(config)
    assert found.result().invalid == 2
    assert found.result().profiles["stiff"].f1 is None
    assert found.example() is None
    assert [row.status for row in found.rows] == ["invalid"] * 2
    assert "engine warning" in found.rows[0].reason
    for figure in (figures.measures(found.result()), figures.curves(found.result())):
        figure.draw_without_rendering()


def test_figures_have_units_and_repeat(outcome):
    result = outcome.result()
    first, again = (figures.trace(*outcome.example()) for _ in range(2))
    assert style.render(first) == style.render(again)
    drawn = [first, figures.measures(result), figures.curves(result)]
    assert min(map(phone.smallest, drawn)) >= phone.LEAST
    labels = [axis.get_ylabel() for figure in drawn for axis in figure.axes]
    known = ("[ms]", "[%]", "[m]", "[rad]", "0 to 1")
    assert all(label.endswith(known) for label in labels if label), labels
    over = drawn[-1].axes[1]
    (default,) = over.texts
    assert default.get_window_extent().y0 > over.get_window_extent().y0  # clear of the axis


@pytest.mark.slow
def test_the_command_on_two_workers_writes_the_bytes_of_one(outcome, capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(to_toml(SMALL))
    assert main(["bench", "touch", "--config", "small.toml", "--workers", "2", "--out", "run"]) == 0
    out, err = capsys.readouterr()
    assert "onset latency [ms]" in out
    assert max(map(len, out.splitlines()[1:])) <= 100  # the first is a sentence
    assert "written to run" in err
    names = {path.name for path in (tmp_path / "run" / "figures").iterdir()}
    assert {"touch.svg", "touch_roc.png", "touch_trace.svg"} <= names
    assert json.loads(Path("run/result.json").read_text()) == json.loads(
        to_json(content(outcome.result()))
    )
    table = Path("run/trials.csv").read_text()
    assert table == to_csv([dataclasses.asdict(row) for row in outcome.rows])
