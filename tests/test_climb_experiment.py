"""`antennate climb`: its criterion, its measures, bad input, and the same rows on any workers."""

import csv
import json
import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from antennate import experiments
from antennate.cli import main
from antennate.control.climbing.rule import Ground, Stage
from antennate.errors import BadInputError, ConfigError
from antennate.experiments.climb import measures
from antennate.experiments.climb.config import ClimbConfig, cells, config_of
from antennate.experiments.climb.criterion import is_over
from antennate.experiments.climb.experiment import EXPERIMENT, every
from antennate.experiments.climb.physics import carry_out
from antennate.experiments.climb.rows import ClimbRow
from antennate.experiments.climb.sensing import Verdict
from antennate.params.base import from_values, read_file
from antennate.robots.imu import ImuParams
from antennate.robots.spec import RobotSpec
from antennate.sim.trial import draw_trial, scene_of
from antennate.studies.pooling import frame

TINY = {
    "trials": 1,
    "heights": (0.05, 0.08),
    "conditions": ("locked", "edges"),
    "divisors": (128.0,),
    "grounds": ("step_tunnel:0.08",),
    "sensing": 0,
    "time_limit": 0.3,
}


def row(condition: str, outcome: str, trial: int = 0, **more) -> ClimbRow:
    """A climb of a step of 5 cm by hand."""
    place = {"part": "climbing", "ground": "5 cm", "height_m": 0.05, "divisor": 256.0}
    place |= {"seed": 0, "cell": condition, "trial": trial, "condition": condition}
    return ClimbRow(**{**place, "outcome": outcome, "time_s": 20.0, **more})


def test_it_is_registered_with_all_its_cells():
    assert experiments.load("climb") is EXPERIMENT
    config = ClimbConfig()
    table = cells(config)
    climbs = [cell for cell in table.values() if cell.part == "climbing"]
    assert len(climbs) == 6 * 5 * 2
    assert len([cell for cell in table.values() if cell.part == "ground"]) == 6 * 6 * 2
    assert len(every(config)) == len(table)
    robots = {cell.condition: config_of(config, cell).robot for cell in climbs}
    assert [n for n, robot in robots.items() if not robot.pitch_count] == ["locked"]
    divisors = {config_of(config, c).robot.servos.xc430_w240.gain_divisor for c in climbs}
    assert divisors == {256.0, 128.0}
    other = from_values(ClimbConfig, {"robot": {"pitch": {"servo": "xl430_w250"}}})
    servos = [config_of(other, cell).robot.servos for cell in cells(other).values()]
    assert {each.of("xl430_w250").gain_divisor for each in servos} == {256.0, 128.0}


def test_a_trial_starts_alike_for_all_conditions():
    """Scene, start, noise and slips depend on seed and number alone."""
    config = ClimbConfig(heights=(0.08,))
    starts = []
    for cell in cells(config).values():
        if cell.part == "climbing":
            one = config_of(config, cell)
            start = draw_trial(one, scene_of(one), 3, one.control.gait, one.control.period)
            scene: Any = start.scene
            friction = start.chance.leg_friction(0)
            assert friction is not None
            starts.append([scene.edges[0].x, start.phase, *start.world.head, *friction])
    assert len(starts) == 12
    assert np.ptp(np.array(starts), axis=0).max() == 0.0


@pytest.mark.parametrize(
    ("x", "y", "z", "over"),
    [
        (0.13, 0.0, 0.0, True),  # the tail, a little more than a link past the edge
        (0.11, 0.0, 0.0, False),
        (0.13, 2.6, 0.0, False),  # beside the ground
        (0.13, 0.0, -0.1, False),  # as far, on the floor
    ],
)
def test_a_robot_is_over_when_all_links_stand_behind_and_above(x, y, z, over):
    """The criterion, on a robot that is placed on a step of 10 cm."""
    config = ClimbConfig(heights=(0.10,), conditions=("edges",))
    one = config_of(config, next(iter(cells(config).values())))
    start = draw_trial(one, scene_of(one), 0, one.control.gait, one.control.period)
    scene: Any = start.scene
    world, robot, edge = start.world, one.robot, scene.edges[0].x
    head = edge + x + (robot.links - 1) * robot.link_pitch
    legs = np.zeros((robot.links, 2))
    world.place(head, y, 0.0, np.zeros(robot.yaw_count), legs, 0.10 + z)
    links = world.link_places()
    assert links[-1, 0] == pytest.approx(edge + x)
    assert is_over(links, edge, scene.top, robot.link_pitch) is over


def test_a_verdict_is_that_of_the_first_probe():
    """Stages and grounds as the rule goes through them; a wall is told after the check."""
    verdict = Verdict()
    for stage, ground, t in [
        (Stage.WALK, Ground.FLOOR, 0.0),
        (Stage.PROBE_UP, Ground.FLOOR, 1.0),
        (Stage.LIFT, Ground.STEP_UP, 2.0),
        (Stage.CHECK, Ground.STEP_UP, 3.0),
    ]:
        verdict.look(stage, ground, 0.09, t)
    assert (verdict.felt_at, verdict.told) == (1.0, False)
    verdict.look(Stage.STEER, Ground.WALL, math.inf, 4.0)
    verdict.look(Stage.PROBE_DOWN, Ground.DROP, -0.1, 5.0)
    assert (verdict.ground, verdict.height, verdict.told) == (Ground.WALL, math.inf, True)


def test_measures_of_rows_by_hand():
    config = ClimbConfig(heights=(0.05,), conditions=("level", "climb"), divisors=(256.0,))
    rows = [
        row("level", "timeout", 0, time_s=60.0),
        row("level", "success", 1),
        row("level", "left", 2),
        row("level", "invalid", 3, reason="why"),
        row("climb", "success", 0, plan_error_m="0:-0.05 1:0.01", climbs=1, torque_rms_n_m=0.25),
        row("climb", "success", 1, plan_error_m="0:-0.07", climbs=3, torque_rms_n_m=0.75),
        row("climb", "success", 2),
        row("climb", "overturned", 3),
    ]
    (entry,) = measures.climbing(config, frame(rows))
    level, climb = entry.conditions["level"], entry.conditions["climb"]
    assert (level.trials, level.invalid, level.successes) == (4, 1, 1)
    assert level.success_share == pytest.approx(1 / 3)
    assert (level.success_time_s, level.first_reason) == (20.0, "why")
    assert (climb.successes, climb.overturned, climb.climbs) == (3, 1, 1.0)
    assert (climb.torque_rms_n_m, level.torque_rms_n_m) == (0.5, None)
    known = stats.binomtest(3, 4).proportion_ci(method="wilson")
    assert climb.wilson95 == pytest.approx((known.low, known.high))
    pair = entry.pairs["level"]
    assert (pair.trials, pair.only_climb, pair.only_other) == (3, 2, 0)
    assert pair.mcnemar_p == pytest.approx(0.5)  # two coins that fall alike
    assert entry.plan
    head, link1, together = entry.plan
    assert (head.crossings, link1.crossings, together.crossings) == (2, 1, 3)
    assert head.middle_cm == pytest.approx(-6.0)
    assert together.within == pytest.approx(2 / 3)


def test_what_is_felt_is_counted_by_hand():
    def felt(ground, verdict, outcome="felt", **more):
        values = {"part": "sensing", "ground": ground, "verdict": verdict, **more}
        return row("climb", outcome, **values)

    rows = [
        felt("step of 4 cm", "STEP_UP", height_m=0.04, felt_height_m=0.06),
        felt("step of 8 cm", "STEP_UP", height_m=0.08, felt_height_m=0.08),
        felt("step of 8 cm", "FLOOR", height_m=0.08),
        felt("step of 15 cm", "STEP_UP", height_m=0.15, felt_height_m=0.30),
        felt("drop of 35 cm", "DROP", "stopped", height_m=0.35),
        felt("drop of 35 cm", "FLOOR", "fell", height_m=0.35),
        felt("flat", "STEP_UP", height_m=None, climbs=2, time_s=500.0, walked_m=20.0),
    ]
    (entry,) = measures.sensing(ClimbConfig(divisors=(256.0,)), frame(rows))
    assert entry.confusion["step of 8 cm"] == {
        **dict.fromkeys(measures.VERDICTS, 0),
        "STEP_UP": 1,
        "FLOOR": 1,
    }
    assert entry.felt["step of 8 cm"].felt_height_m == 0.08
    heights = entry.heights
    assert (heights.steps, heights.told) == (3, 2)
    assert heights.rmse_m == pytest.approx(0.02 / math.sqrt(2))
    assert (entry.cliff.stopped, entry.cliff.trials) == (1, 2)
    flat = entry.false_climbs["flat"]
    assert (flat.per_1000_s, flat.per_m) == pytest.approx((4.0, 0.1))
    assert flat.per_1000_s_95
    low, high = flat.per_1000_s_95
    assert stats.poisson.sf(1, 0.5 * low) == pytest.approx(0.025)  # two or more, as seldom
    assert stats.poisson.cdf(2, 0.5 * high) == pytest.approx(0.025)


@pytest.mark.ci
def test_a_run_leaves_its_tables_and_figures(tmp_path):
    out = tmp_path / "run"
    words = ["climb", "--trials", "1", "--heights", "0.05", "--conditions", "climb", "level"]
    words += ["--divisors", "256", "--time-limit", "0.3", "--sensing", "1", "--workers", "1"]
    words += ["--grounds", "flat", "gap:0.1"]
    assert main([*words, "--out", str(out)]) == 0
    with (out / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 + 2 * 2 + 14
    result = json.loads((out / "result.json").read_text())
    assert result["climbing"][0]["conditions"]["climb"]["timeouts"] == 1
    assert result["grounds"][0]["grounds"]["climb"][0]["ground"] == "gap:0.1"
    names = {path.stem for path in (out / "figures").iterdir()}
    assert names == {"success", "side", "felt"}  # no link came to the edge: no error of the plan


def test_a_robot_of_its_own_begins_with_the_one_that_climbs():
    assert ClimbConfig.model_validate({"robot": {"mass": 2.5}}).robot.pitch_count == 5
    with pytest.raises(BadInputError, match="expected a robot with pitch joints"):
        ClimbConfig(robot={"pitch": {"kind": "locked"}})  # pyright: ignore[reportArgumentType]


def test_steps_and_gaps_stand_as_far_as_is_asked():
    config = ClimbConfig(
        heights=(0.05,), conditions=("climb",), grounds=("gap:0.1",), start=(2.0, 2.1), sensing=0
    )
    for cell in cells(config).values():
        one = config_of(config, cell)
        drawn: Any = scene_of(one).draw(one.robot, np.random.default_rng(1))
        assert 2.0 <= drawn.edges[0].x - drawn.start[0] <= 2.1


def test_what_is_felt_and_tunnels_stay_where_they_are():
    grounds = ("step_tunnel:0.08",)
    far, near = (
        ClimbConfig(heights=(0.05,), conditions=("climb",), grounds=grounds, start=start)
        for start in ((2.0, 2.1), (0.35, 0.95))
    )
    for name, cell in cells(far).items():
        same = config_of(far, cell) == config_of(near, cells(near)[name])
        assert same == (cell.part != "climbing")


def test_a_robot_that_lacks_one_table_has_that_of_the_one_that_climbs():
    table = RobotSpec.named("scuttle").model_dump(mode="json")
    del table["pitch"]
    with pytest.raises(ValidationError, match="antennae that rise"):
        ClimbConfig.model_validate({"robot": table})
    del table["elevation"]
    assert ClimbConfig.model_validate({"robot": table}).robot.pitch_count == 5


def test_a_list_that_is_too_short_says_how_much():
    with pytest.raises(ConfigError, match=r"start: expected 2 values, found 0"):
        from_values(ClimbConfig, {"start": []})


def test_a_whole_robot_takes_nothing_from_the_one_that_climbs():
    own = RobotSpec.named("scuttle3d").model_copy(update={"imu": ImuParams()})
    table = {"robot": own.model_dump(mode="json")}
    assert ClimbConfig.model_validate(table).robot == own


SHORT = (
    *("climb", "--heights", "0.05", "--grounds", "flat", "--conditions", "level", "--sensing", "0"),
    *("--divisors", "256", "--time-limit", "0.1", "--no-figures", "--workers", "1"),
)


@pytest.mark.parametrize(
    ("file", "mass", "sensor"),
    [
        ('robot = "scuttle3d"', 2.4, True),
        ('[robot]\nbase = "scuttle3d"\nmass = 2.5', 2.5, True),
        ("[robot]\nmass = 2.5", 2.5, True),
        ('[robot.imu]\nkind = "none"', 2.4, False),
    ],
)
def test_a_configuration_names_its_robot_as_anywhere(file, mass, sensor, tmp_path):
    """And what a run wrote is read as it was."""
    given, out, again = (tmp_path / name for name in ("given.toml", "out", "again"))
    given.write_text(f"{file}\n")
    assert main([*SHORT, "--config", str(given), "--out", str(out)]) == 0
    robot = read_file(out / "config.toml", ClimbConfig).robot
    assert (robot.mass, robot.has_imu, robot.pitch_count) == (mass, sensor, 5)
    kept = ["--no-figures", "--workers", "1", "--out", str(again)]
    assert main(["climb", "--config", str(out / "config.toml"), *kept]) == 0
    assert (again / "trials.csv").read_bytes() == (out / "trials.csv").read_bytes()


def test_a_run_that_was_stopped_tells_of_the_divisors_that_it_came_to():
    config = ClimbConfig(heights=(0.05,), conditions=("climb",))
    one = measures.summarise(config, frame([row("climb", "success")]))
    told = EXPERIMENT.sentence(one)
    assert told.endswith("with gain divisor 256 climb 1 of 1 (0.21 to 1.00).")
    none = measures.summarise(config, frame([], ClimbRow))
    assert EXPERIMENT.sentence(none).endswith(": none.")


@pytest.mark.slow
def test_a_step_of_5_cm_is_climbed_by_who_knows_where_it_is():
    config = ClimbConfig(heights=(0.05,), conditions=("edges",), trials=2, grounds=(), sensing=0)
    for name in cells(config):
        ended = []
        carry_out(config, name, [0, 1], ended.append)
        assert [r.outcome for r, _ in ended] == ["success", "success"]
        assert all(r.torque_peak_n_m > r.torque_rms_n_m > 0.0 for r, _ in ended)
